#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "clients/vehicle/print.h"

namespace grouser::cli {

using Json = nlohmann::ordered_json;

namespace {

/// As a cell of RFC 4180: quoted where it has a comma, a quote or an end of a line.
std::string CellOf(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? "\"\"" : std::string(1, c);
  return cell + "\"";
}

}  // namespace

std::string CsvOf(std::span<const std::string> drives, std::span<const TrajectoryCost> costs) {
  std::string out =
      "joules,joules_low,joules_high,seconds,metres,rows_left_out,seconds_left_out,reasons,"
      "first_row,first_reasons,least_margin,least_margin_of,least_margin_row,drive\n";
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const TrajectoryCost& c = costs[i];
    const vehicle::DriveEnergy& e = c.energy;
    out += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{:.6g},{},{},{},{:.6g},{},{},{}\n",
                       e.joules, e.low, e.high, e.seconds, e.metres, e.left_out, e.left_out_s,
                       vehicle::NamesOf(c.reasons), c.first_step, vehicle::NamesOf(c.first_reasons),
                       c.least_margin, vehicle::NamesOf(c.least_margin_of), c.least_margin_step,
                       CellOf(drives[i]));
  }
  return out;
}

std::string JsonOf(std::span<const std::string> drives, std::span<const TrajectoryCost> costs) {
  Json out = Json::array();
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const TrajectoryCost& c = costs[i];
    const vehicle::DriveEnergy& e = c.energy;
    const auto row = [](int step) { return step < 0 ? Json() : Json(step); };
    out.push_back({{"drive", drives[i]},
                   {"joules", e.joules},
                   {"joules_low", e.low},
                   {"joules_high", e.high},
                   {"seconds", e.seconds},
                   {"metres", e.metres},
                   {"rows_left_out", e.left_out},
                   {"seconds_left_out", e.left_out_s},
                   {"reasons", vehicle::NamesOf(c.reasons)},
                   {"first_row", row(c.first_step)},
                   {"first_reasons", vehicle::NamesOf(c.first_reasons)},
                   {"least_margin", c.least_margin},
                   {"least_margin_of", vehicle::NamesOf(c.least_margin_of)},
                   {"least_margin_row", row(c.least_margin_step)}});
  }
  // A file's name need not be UTF-8.
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace grouser::cli

#include "surrogate/soils/cone_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/soils/csv_cells.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {
namespace {

constexpr double kConeDegree = std::numbers::pi / 180;
constexpr std::array kConeColumns = {"soil",
                                     "soil_sha256",
                                     "cone_index_kPa",
                                     "cone_index_se_kPa",
                                     "gradient_kPa_per_m",
                                     "gradient_se_kPa_per_m",
                                     "beds",
                                     "to_depth_mm",
                                     "cone_diameter_mm",
                                     "cone_angle_deg",
                                     "speed_mm_per_s",
                                     "grain_mm",
                                     "bevameter_sha256",
                                     "source"};

struct ConeCells {
  const std::string& place;
  const std::vector<std::string>& cells;

  [[noreturn]] void Fail(std::size_t column, const std::string& expected) const {
    throw std::invalid_argument(fmt::format("{}: {}: {}, expected {}", place, kConeColumns[column],
                                            cells[column].empty() ? "empty" : cells[column],
                                            expected));
  }
  /// In table units, within [low, high]; none: an empty cell.
  std::optional<double> Maybe(std::size_t column, double low, double high) const {
    const std::string& text = cells[column];
    if (text.empty()) return std::nullopt;
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    if (!whole || !(value >= low && value <= high)) {
      Fail(column, fmt::format("a number from {:g} to {:g}", low, high));
    }
    return value;
  }
  double Number(std::size_t column, double low, double high) const {
    const std::optional<double> value = Maybe(column, low, high);
    if (!value) Fail(column, fmt::format("a number from {:g} to {:g}", low, high));
    return *value;
  }
  std::string Hash(std::size_t column) const {
    const std::string& text = cells[column];
    const auto hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
    if (text.size() != 64 || !std::ranges::all_of(text, hex)) Fail(column, "64 hex digits");
    return text;
  }
};

ConeIndex ReadCone(const ConeCells& row) {
  if (row.cells[0].empty()) row.Fail(0, "a name");
  ConeIndex cone;
  cone.soil = row.cells[0];
  cone.soil_sha256 = row.Hash(1);
  cone.index_pa = 1e3 * row.Number(2, 1e-3, 1e5);
  if (const auto se = row.Maybe(3, 0, 1e5)) cone.index_se_pa = 1e3 * *se;
  cone.gradient_pa_per_m = 1e3 * row.Number(4, -1e6, 1e6);
  if (const auto se = row.Maybe(5, 0, 1e6)) cone.gradient_se_pa_per_m = 1e3 * *se;
  const double beds = row.Number(6, 1, 1000);
  if (beds != std::floor(beds)) row.Fail(6, "a whole number");
  cone.beds = static_cast<int>(beds);
  for (const std::size_t column : {3, 5}) {
    if (row.cells[column].empty() == (cone.beds == 1)) continue;
    row.Fail(column, cone.beds == 1 ? "none of one bed" : "a standard error over the beds");
  }
  cone.to_depth_m = 1e-3 * row.Number(7, 1, 1000);
  cone.diameter_m = 1e-3 * row.Number(8, 1, 1000);
  cone.angle_rad = kConeDegree * row.Number(9, 5, 180);
  cone.speed_m_per_s = 1e-3 * row.Number(10, 0.01, 1e4);
  cone.grain_m = 1e-3 * row.Number(11, 0.01, 1000);
  cone.bevameter_sha256 = row.Hash(12);
  cone.source = row.cells[13];
  return cone;
}

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "18.0 kPa (0.4)", "18.0 kPa".
std::string WithError(double value, std::optional<double> error, double unit, const char* name) {
  const std::string text = fmt::format("{:.3g} {}", value / unit, name);
  return error ? text + fmt::format(" ({:.2g})", *error / unit) : text;
}

}  // namespace

std::vector<ConeIndex> ReadConeIndices(std::istream& table, const std::string& name) {
  std::vector<ConeIndex> cones;
  std::string line;
  bool header = true;
  for (int number = 1; std::getline(table, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    const std::string place = fmt::format("{}:{}", name, number);
    const std::vector<std::string> cells = CsvCells(line);
    if (cells.size() != kConeColumns.size()) {
      throw std::invalid_argument(
          fmt::format("{}: {} columns, expected {}", place, cells.size(), kConeColumns.size()));
    }
    for (std::size_t i = 0; header && i < kConeColumns.size(); ++i) {
      if (cells[i] == kConeColumns[i]) continue;
      throw std::invalid_argument(
          fmt::format("{}: column {}, expected {}", place, cells[i], kConeColumns[i]));
    }
    if (!header) {
      const ConeCells row{place, cells};
      cones.push_back(ReadCone(row));
      if (std::ranges::count(cones, cells[1], &ConeIndex::soil_sha256) > 1) {
        row.Fail(1, "each soil once");
      }
    }
    header = false;
  }
  if (header) throw std::invalid_argument(name + ": no header, expected a table of cone indices");
  return cones;
}

std::vector<ConeIndex> ConeIndices(const std::vector<std::string>& more_files) {
  std::vector<std::string> files = more_files;
  const std::string shipped = SurrogateFile("soils/cone_indices.csv");
  if (std::filesystem::exists(shipped)) files.insert(files.begin(), shipped);
  std::vector<ConeIndex> all;
  for (const std::string& file : files) {
    std::istringstream table(records::ReadInputFile(file, "a table of cone indices"));
    for (ConeIndex& cone : ReadConeIndices(table, file)) {
      std::erase_if(all, [&](const ConeIndex& c) { return c.soil_sha256 == cone.soil_sha256; });
      all.push_back(std::move(cone));
    }
  }
  return all;
}

const ConeIndex* FindConeIndex(const std::vector<ConeIndex>& cones, const std::string& soil) {
  const auto found = std::find_if(cones.rbegin(), cones.rend(), [&](const ConeIndex& cone) {
    return LowerCase(cone.soil) == LowerCase(soil) ||
           LowerCase(cone.soil) + ", dem" == LowerCase(soil);
  });
  return found == cones.rend() ? nullptr : &*found;
}

std::string ConeText(const ConeIndex& c) {
  if (c.beds == 0) {
    return fmt::format("cone index {:.3g} kPa, gradient {:.3g} kPa/m, as given\n", c.index_pa / 1e3,
                       c.gradient_pa_per_m / 1e3);
  }
  return fmt::format(
      "cone index {}, mean over 0 to {:.0f} mm; gradient {}{}\n"
      "  cone of {:.3g} mm and {:.0f} degrees at {:.3g} mm/s, grains of {:.3g} mm; {}; "
      "bevameter.json {}\n",
      WithError(c.index_pa, c.index_se_pa, 1e3, "kPa"), 1e3 * c.to_depth_m,
      WithError(c.gradient_pa_per_m, c.gradient_se_pa_per_m, 1e3, "kPa/m"),
      c.index_se_pa ? fmt::format("; standard errors of {} beds in brackets", c.beds) : ", one bed",
      1e3 * c.diameter_m, c.angle_rad / kConeDegree, 1e3 * c.speed_m_per_s, 1e3 * c.grain_m,
      c.source, c.bevameter_sha256.substr(0, 12));
}

std::string ConeListText(const std::vector<ConeIndex>& cones) {
  std::string text =
      fmt::format("{:<40} {:>16} {:>16} {:>6} {:>6} {:>8} {:>6}\n", "soil", "cone index kPa",
                  "gradient kPa/m", "beds", "to mm", "cone mm", "grains");
  const auto cell = [](double value, std::optional<double> error) {
    return error ? fmt::format("{:.3g} ({:.2g})", value / 1e3, *error / 1e3)
                 : fmt::format("{:.3g}", value / 1e3);
  };
  for (const ConeIndex& c : cones) {
    text += fmt::format("{:<40} {:>16} {:>16} {:>6} {:>6.0f} {:>8.3g} {:>6.3g}\n", c.soil,
                        cell(c.index_pa, c.index_se_pa),
                        cell(c.gradient_pa_per_m, c.gradient_se_pa_per_m), c.beds,
                        1e3 * c.to_depth_m, 1e3 * c.diameter_m, 1e3 * c.grain_m);
  }
  return text + "(standard errors over beds in brackets; grains in mm)\n";
}

std::string ConeListJson(const std::vector<ConeIndex>& cones) {
  const auto maybe = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  nlohmann::json list = nlohmann::json::array();
  for (const ConeIndex& c : cones) {
    list.push_back({{"soil", c.soil},
                    {"soil_sha256", c.soil_sha256},
                    {"index_pa", c.index_pa},
                    {"index_se_pa", maybe(c.index_se_pa)},
                    {"gradient_pa_per_m", c.gradient_pa_per_m},
                    {"gradient_se_pa_per_m", maybe(c.gradient_se_pa_per_m)},
                    {"beds", c.beds},
                    {"to_depth_m", c.to_depth_m},
                    {"diameter_m", c.diameter_m},
                    {"angle_rad", c.angle_rad},
                    {"speed_m_per_s", c.speed_m_per_s},
                    {"grain_m", c.grain_m},
                    {"bevameter_sha256", c.bevameter_sha256},
                    {"source", c.source}});
  }
  return list.dump(1) + "\n";
}

}  // namespace grouser::surrogate

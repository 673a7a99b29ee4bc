// Measured wheel tests from their files.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/measured.h"
#include "surrogate/soils/csv_cells.h"

namespace grouser::surrogate {
namespace {

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadPerDegree = std::numbers::pi / 180;

// Column names by output: value, sd; null where nobody measures it.
struct Columns {
  const char *value, *sd;
};
constexpr std::array<Columns, kOutputs> kColumns = {
    Columns{"f_x_n", "f_x_sd"}, Columns{"f_y_n", "f_y_sd"},
    Columns{nullptr, nullptr},  Columns{"torque_n_m", "torque_sd"},
    Columns{nullptr, nullptr},  Columns{"sinkage_m", "sinkage_sd"}};

/// Columns that are no output: the state, and what is told but not used.
constexpr std::string_view kOtherColumns[] = {"slip",    "attack_angle_deg",  "load_n",
                                              "load_sd", "rim_speed_m_per_s", "speed_m_per_s",
                                              "repeats"};

struct Reader {
  std::string path;  // with what stands before a line's number
  WheelLimits limits;
  std::vector<std::string> header;
  int line = 0;

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::invalid_argument(path + std::to_string(line) + ": " + what);
  }

  std::vector<std::string> Cells(const std::string& text) const {
    try {
      return CsvCells(text);
    } catch (const std::invalid_argument& error) {
      Fail(error.what());
    }
  }

  void TakeHeader(const std::vector<std::string>& cells) {
    header = cells;
    for (auto name = header.begin(); name != header.end(); ++name) {
      if (std::find(header.begin(), name, *name) != name) {
        Fail(*name + ": the column stands here twice, expected each once");
      }
    }
    for (const char* name : {"slip", "attack_angle_deg", "load_n"}) {
      if (std::find(header.begin(), header.end(), name) == header.end()) {
        Fail(std::string("no column ") + name + ", expected slip,attack_angle_deg,load_n,...");
      }
    }
    for (const std::string& name : header) {
      bool known = std::find(std::begin(kOtherColumns), std::end(kOtherColumns), name) !=
                   std::end(kOtherColumns);
      for (const Columns& c : kColumns) {
        known |= c.value != nullptr && (name == c.value || name == c.sd);
      }
      if (!known) Fail(name + ": unknown column");
    }
  }

  v1alpha1::MeasuredPoint Point(const std::vector<std::string>& cells) const {
    if (cells.size() != header.size()) {
      Fail(std::to_string(cells.size()) + " fields, expected " + std::to_string(header.size()));
    }
    std::map<std::string, double> values;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (cells[i].empty()) continue;
      char* end = nullptr;
      const double value = std::strtod(cells[i].c_str(), &end);
      if (*end != '\0' || !std::isfinite(value)) {
        Fail(header[i] + ": \"" + cells[i] + "\", expected a number");
      }
      values[header[i]] = value;
    }
    const auto get = [&](const char* name) {
      const auto found = name == nullptr ? values.end() : values.find(name);
      return found == values.end() ? kNotMeasured : found->second;
    };
    v1alpha1::MeasuredPoint p;
    p.set_slip(get("slip"));
    p.set_attack_angle_rad(get("attack_angle_deg") * kRadPerDegree);
    p.set_load_n(get("load_n"));
    for (const Columns& c : kColumns) {
      p.add_value(get(c.value));
      p.add_sd(get(c.sd));
    }
    if (!(p.load_n() > 0)) Fail("load_n: expected a positive load");
    if (!std::isfinite(FromSlip(p.slip(), p.attack_angle_rad(), 1).v_x)) {
      Fail("slip: no motion has this slip at this attack angle");
    }
    for (int o = 0; o < kOutputs; ++o) CheckOutput(o, p);
    return p;
  }

  void CheckOutput(int o, const v1alpha1::MeasuredPoint& p) const {
    if (p.sd(o) < 0) Fail(std::string(kColumns[o].sd) + ": expected a number not below 0");
    if (std::isnan(p.value(o))) return;
    const std::string why = ImpossibleOutput(o, p.value(o), p.load_n(), limits);
    if (!why.empty()) Fail(std::string(kColumns[o].value) + ": " + why);
  }

  /// What a single row cannot tell: all of it in another unit.
  void CheckTable(const std::vector<v1alpha1::MeasuredPoint>& points, const std::vector<int>& lines,
                  bool accept_unusual) {
    constexpr double kLeastShare = 1e-3;
    std::size_t widest = 0, strongest = 0;
    double force = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto angle = [&](std::size_t k) { return std::fabs(points[k].attack_angle_rad()); };
      if (angle(i) > angle(widest)) widest = i;
      for (const Output o : {kFx, kFy}) {
        const double share = std::fabs(points[i].value(o)) / points[i].load_n();
        if (share > force) force = share, strongest = i;  // NaN is not
      }
    }
    const double degrees = std::fabs(points[widest].attack_angle_rad()) / kRadPerDegree;
    line = lines[widest];
    if (degrees > 0 && degrees <= std::numbers::pi / 2 && !accept_unusual) {
      Fail(
          fmt::format("attack_angle_deg: {:g} is the largest, expected degrees: radians? "
                      "--accept-unusual takes it",
                      degrees));
    }
    line = lines[strongest];
    if (force >= 0 && force < kLeastShare) {
      Fail(fmt::format("f_x_n, f_y_n: at most {:.2g} of the load in every row, expected N: kN?",
                       force));
    }
  }
};

// What `grouser validate` wrote, as the CSV that it stands for; the sd is the standard error there.
std::string CsvOfRows(const std::string& path, const std::string& text) {
  std::string csv = "slip,attack_angle_deg,load_n";
  for (const Columns& c : kColumns) {
    if (c.value != nullptr) csv += fmt::format(",{},{}", c.value, c.sd);
  }
  try {
    const Json file = Json::parse(text);
    for (const Json& row : file.at("rows")) {
      csv += fmt::format("\n{},{},{}", row.at("slip").get<double>(),
                         row.at("attack_angle_deg").get<double>(), row.at("load_n").get<double>());
      const Json& measured = row.at("measured");
      for (int o = 0; o < kOutputs; ++o) {
        if (kColumns[o].value == nullptr) continue;
        const auto found = measured.find(kOutputFields[o].name);
        const Json error = found == measured.end() ? Json() : found->at("standard_error");
        csv += found == measured.end() ? "," : fmt::format(",{}", found->at("value").get<double>());
        csv += error.is_null() ? "," : fmt::format(",{}", error.get<double>());
      }
    }
  } catch (const Json::exception& problem) {
    throw std::invalid_argument(path + ": " + problem.what() +
                                ", expected rows.json of grouser validate");
  }
  return csv + "\n";
}

}  // namespace

std::vector<v1alpha1::MeasuredPoint> ReadMeasured(const std::string& path,
                                                  const WheelLimits& limits, bool accept_unusual) {
  const bool json = path.ends_with(".json");
  const std::string text = records::ReadInputFile(
      path, json ? "rows.json of grouser validate" : "a CSV of measured tests");
  std::istringstream file(json ? CsvOfRows(path, text) : text);
  Reader reader{path + (json ? ": row " : ":"), limits, {}};
  if (json) reader.line = -1;  // its head is none of the file's
  const std::string source = path.substr(path.find_last_of('/') + 1);
  std::vector<v1alpha1::MeasuredPoint> points;
  std::vector<int> lines;
  std::string line;
  while (std::getline(file, line)) {
    ++reader.line;
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    if (reader.header.empty()) {
      reader.TakeHeader(reader.Cells(line));
      continue;
    }
    points.push_back(reader.Point(reader.Cells(line)));
    points.back().set_source(source);
    lines.push_back(reader.line);
  }
  if (points.empty()) reader.Fail("no measured row, expected a header line and rows");
  reader.CheckTable(points, lines, accept_unusual);
  return points;
}

}  // namespace grouser::surrogate

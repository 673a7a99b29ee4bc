#include "surrogate/vehicle/path_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "surrogate/vehicle/yaml.h"

namespace grouser::vehicle {
namespace {

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t\r"), last = cell.find_last_not_of(" \t\r");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

}  // namespace

std::vector<PathPoint> ReadPath(const std::string& file, const Grounds& grounds) {
  std::istringstream in(yaml::ReadYamlText(file));
  const std::vector<std::string> known = {"s_m", "curvature_per_m", "grade_deg", "bank_deg",
                                          "soil"};
  std::vector<std::string> columns;
  std::vector<PathPoint> path;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const std::string at = file + ":" + std::to_string(number) + ": ";
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const std::vector<std::string> cells = Cells(line);
    if (columns.empty()) {
      columns = cells;
      for (const std::string& c : columns) {
        if (std::find(known.begin(), known.end(), c) == known.end() ||
            std::count(columns.begin(), columns.end(), c) > 1) {
          throw yaml::InputError(at + "column " + c +
                                 ": expected each of s_m, curvature_per_m, "
                                 "grade_deg, bank_deg, soil once at most");
        }
      }
      for (const char* must : {"s_m", "curvature_per_m"}) {
        if (std::find(columns.begin(), columns.end(), must) == columns.end()) {
          throw yaml::InputError(at + "no column " + must);
        }
      }
      continue;
    }
    if (cells.size() != columns.size()) {
      throw yaml::InputError(at + "got " + std::to_string(cells.size()) + " cells, expected " +
                             std::to_string(columns.size()));
    }
    PathPoint p;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto which = std::find(known.begin(), known.end(), columns[c]) - known.begin();
      if (which == 4) {
        const auto soil = std::find(grounds.soils.begin(), grounds.soils.end(), cells[c]);
        if (soil == grounds.soils.end()) {
          throw yaml::InputError(at + "soil: got " + cells[c] +
                                 ", expected one of the vehicle, such as " +
                                 yaml::NearestOf(cells[c], grounds.soils));
        }
        p.soil = static_cast<std::uint8_t>(soil - grounds.soils.begin());
        continue;
      }
      double value = 0;
      const char* end = cells[c].data() + cells[c].size();
      const auto [rest, error] = std::from_chars(cells[c].data(), end, value);
      if (error != std::errc() || rest != end || !std::isfinite(value)) {
        throw yaml::InputError(at + columns[c] + ": got '" + cells[c] +
                               "', expected a finite number");
      }
      if (which >= 2) value *= std::numbers::pi / 180;
      double* const to[] = {&p.s_m, &p.curvature_per_m, &p.grade_rad, &p.bank_rad};
      *to[which] = value;
    }
    if (!path.empty() && !(p.s_m > path.back().s_m)) {
      throw yaml::InputError(at + "s_m: expected more than in the line before");
    }
    path.push_back(p);
  }
  if (path.size() < 2)
    throw yaml::InputError(file + ": got fewer than two points, expected a path");
  return path;
}

}  // namespace grouser::vehicle

#include "clients/vehicle/path_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "surrogate/vehicle/yaml.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t\r"), last = cell.find_last_not_of(" \t\r");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

const std::vector<std::string> kColumns = {"s_m",       "curvature_per_m", "x_m", "y_m",
                                           "grade_deg", "bank_deg",        "soil"};
constexpr std::ptrdiff_t kFirstAngle = 4, kSoil = 6;  // in kColumns

/// A point as it stands in the file.
struct Line {
  PathPoint point;
  double x_m = 0, y_m = 0;
  std::string at;  ///< "FILE:LINE: "
};

// True: places; false: lengths and curvatures.
bool CheckColumns(const std::string& at, const std::vector<std::string>& columns) {
  for (const std::string& c : columns) {
    if (std::find(kColumns.begin(), kColumns.end(), c) == kColumns.end() ||
        std::count(columns.begin(), columns.end(), c) > 1) {
      throw yaml::InputError(at + "column " + c +
                             ": expected s_m and curvature_per_m, or x_m and y_m, and at most "
                             "grade_deg, bank_deg, soil, each once");
    }
  }
  const auto has = [&](const char* c) {
    return std::find(columns.begin(), columns.end(), c) != columns.end();
  };
  const bool places = has("x_m") || has("y_m");
  const auto must = [&](const char* c) {
    if (!has(c)) throw yaml::InputError(at + "no column " + c);
  };
  if (places && (has("s_m") || has("curvature_per_m"))) {
    throw yaml::InputError(at + "got places besides s_m or curvature_per_m, expected either");
  }
  must(places ? "x_m" : "s_m");
  must(places ? "y_m" : "curvature_per_m");
  return places;
}

double NumberOf(const std::string& at, const std::string& column, const std::string& cell) {
  double value = 0;
  const char* end = cell.data() + cell.size();
  const auto [rest, error] = std::from_chars(cell.data(), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) {
    throw yaml::InputError(at + column + ": got '" + cell + "', expected a finite number");
  }
  return value;
}

Line LineOf(const std::string& at, const std::vector<std::string>& columns,
            const std::vector<std::string>& cells, const std::vector<std::string>& soils,
            std::uint8_t otherwise) {
  if (cells.size() != columns.size()) {
    throw yaml::InputError(at + "got " + std::to_string(cells.size()) + " cells, expected " +
                           std::to_string(columns.size()));
  }
  Line line;
  line.at = at;
  PathPoint& p = line.point;
  p.soil = otherwise;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const auto which = std::find(kColumns.begin(), kColumns.end(), columns[c]) - kColumns.begin();
    if (which == kSoil) {
      const auto soil = std::find(soils.begin(), soils.end(), cells[c]);
      if (soil == soils.end()) {
        throw yaml::InputError(at + "soil: got " + cells[c] +
                               ", expected one of the vehicle, such as " +
                               yaml::NearestOf(cells[c], soils));
      }
      p.soil = static_cast<std::uint8_t>(soil - soils.begin());
      continue;
    }
    double value = NumberOf(at, columns[c], cells[c]);
    if (which >= kFirstAngle) value *= std::numbers::pi / 180;
    double* const to[] = {&p.s_m,    &p.curvature_per_m, &line.x_m,
                          &line.y_m, &p.grade_rad,       &p.bank_rad};
    *to[which] = value;
  }
  return line;
}

// Length and curvature from places: 2 sin(turn)/chord of the circle through three points.
void Measure(std::vector<Line>* lines) {
  auto& r = *lines;
  for (std::size_t i = 1; i < r.size(); ++i) {
    const double way = std::hypot(r[i].x_m - r[i - 1].x_m, r[i].y_m - r[i - 1].y_m);
    r[i].point.s_m = r[i - 1].point.s_m + way;
    if (!(r[i].point.s_m > r[i - 1].point.s_m)) {
      throw yaml::InputError(r[i].at +
                             "x_m, y_m: got the place of the line before, expected another");
    }
    if (i < 2) continue;
    const double a_x = r[i - 1].x_m - r[i - 2].x_m, a_y = r[i - 1].y_m - r[i - 2].y_m;
    const double b_x = r[i].x_m - r[i - 1].x_m, b_y = r[i].y_m - r[i - 1].y_m;
    const double chord = std::hypot(a_x + b_x, a_y + b_y);
    const double before = r[i - 1].point.s_m - r[i - 2].point.s_m;
    if (!(chord > 1e-9 * (before + way))) {
      throw yaml::InputError(r[i].at + "x_m, y_m: got a way straight back, expected a path ahead");
    }
    r[i - 1].point.curvature_per_m = 2 * (a_x * b_y - a_y * b_x) / (before * way * chord);
  }
  if (r.size() < 3) return;
  r.front().point.curvature_per_m = r[1].point.curvature_per_m;
  r.back().point.curvature_per_m = r[r.size() - 2].point.curvature_per_m;
}

}  // namespace

std::vector<vehicle::PathPoint> ReadPath(const std::string& file,
                                         const std::vector<std::string>& soils, std::uint8_t soil) {
  std::istringstream in(yaml::ReadYamlText(file));
  std::vector<std::string> columns;
  std::vector<Line> lines;
  bool places = false;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const std::string at = file + ":" + std::to_string(number) + ": ";
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const std::vector<std::string> cells = Cells(line);
    if (columns.empty()) {
      places = CheckColumns(at, cells);
      columns = cells;
      continue;
    }
    lines.push_back(LineOf(at, columns, cells, soils, soil));
    const auto last = lines.end() - 1;
    if (!places && lines.size() > 1 && !(last->point.s_m > (last - 1)->point.s_m)) {
      throw yaml::InputError(at + "s_m: expected more than in the line before");
    }
  }
  if (lines.size() < 2) {
    throw yaml::InputError(file + ": got fewer than two points, expected a path");
  }
  if (places) Measure(&lines);
  std::vector<PathPoint> path;
  for (const Line& line : lines) path.push_back(line.point);
  return path;
}

}  // namespace grouser::cli

#include "clients/vehicle/path_file.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "clients/vehicle/csv_lines.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

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
bool HasPlaces(const CsvTable& table) {
  CheckColumns(table, kColumns,
               "s_m and curvature_per_m, or x_m and y_m, and at most grade_deg, bank_deg, soil, "
               "each once");
  const bool places = HasColumn(table, "x_m") || HasColumn(table, "y_m");
  const auto must = [&](const char* c) {
    if (!HasColumn(table, c)) throw yaml::InputError(table.at + "no column " + c);
  };
  if (places && (HasColumn(table, "s_m") || HasColumn(table, "curvature_per_m"))) {
    throw yaml::InputError(table.at + "got places besides s_m or curvature_per_m, expected either");
  }
  must(places ? "x_m" : "s_m");
  must(places ? "y_m" : "curvature_per_m");
  return places;
}

Line LineOf(const CsvTable::Line& read, const std::vector<std::string>& columns,
            const std::vector<std::string>& soils, std::uint8_t otherwise) {
  Line line;
  line.at = read.at;
  PathPoint& p = line.point;
  p.soil = otherwise;
  for (std::size_t c = 0; c < read.cells.size(); ++c) {
    const auto which = std::find(kColumns.begin(), kColumns.end(), columns[c]) - kColumns.begin();
    if (which == kSoil) {
      p.soil = SoilOf(read.at, read.cells[c], soils);
      continue;
    }
    double value = NumberOf(read.at, columns[c], read.cells[c]);
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
  const CsvTable table = ReadCsv(file);
  std::vector<Line> lines;
  const bool places = !table.columns.empty() && HasPlaces(table);
  for (const CsvTable::Line& read : table.lines) {
    lines.push_back(LineOf(read, table.columns, soils, soil));
    const auto last = lines.end() - 1;
    if (!places && lines.size() > 1 && !(last->point.s_m > (last - 1)->point.s_m)) {
      throw yaml::InputError(read.at + "s_m: expected more than in the line before");
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

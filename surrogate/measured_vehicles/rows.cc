#include "surrogate/measured_vehicles/rows.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "surrogate/soils/csv_cells.h"

namespace grouser::measured {
namespace {

constexpr double kMostSpeed = 20, kMostYaw = 20, kMostCurrent = 1000, kMostPower = 1e5;

/// A table whose first line that is no comment names the columns.
class Table {
 public:
  Table(std::istream& in, std::string name) : in_(in), name_(std::move(name)) {
    if (!Advance()) throw std::invalid_argument(name_ + ": no line, expected names of columns");
    columns_ = cells_;
  }

  bool Next() {
    if (!Advance()) return false;
    if (cells_.size() != columns_.size()) {
      Fail(std::to_string(cells_.size()) + " cells, expected " + std::to_string(columns_.size()));
    }
    return true;
  }

  const std::string& Text(const char* column) {
    const std::string& cell = cells_[At(column)];
    if (cell.empty()) Fail(std::string(column) + ": got nothing, expected a word");
    return cell;
  }

  double Number(const char* column, double low, double high) {
    const double value = Parse(column);
    if (!(value >= low && value <= high)) Refuse(column, low, high);
    return value;
  }
  /// The same, or NaN.
  double Optional(const char* column, double low, double high) {
    const std::string& cell = cells_[At(column)];
    if (cell.empty() || cell == "nan") return std::numeric_limits<double>::quiet_NaN();
    return Number(column, low, high);
  }

  template <class Entry>
  std::vector<Entry> Some(std::vector<Entry> rows) const {
    if (rows.empty()) throw std::invalid_argument(name_ + ": no row, expected one or more");
    return rows;
  }

 private:
  bool Advance() {
    for (std::string line; std::getline(in_, line);) {
      ++line_;
      if (line.empty() || line[0] == '#' || line == "\r") continue;
      try {
        cells_ = surrogate::CsvCells(line);
      } catch (const std::invalid_argument& error) {
        Fail(error.what());
      }
      return true;
    }
    return false;
  }

  std::size_t At(const char* column) const {
    const auto found = std::find(columns_.begin(), columns_.end(), column);
    if (found == columns_.end()) {
      throw std::invalid_argument(name_ + ": no column " + column + ", expected one");
    }
    return static_cast<std::size_t>(found - columns_.begin());
  }

  double Parse(const char* column) const {
    const std::string& cell = cells_[At(column)];
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    const bool whole = error == std::errc() && end == cell.data() + cell.size();
    return whole ? value : std::numeric_limits<double>::quiet_NaN();
  }

  [[noreturn]] void Refuse(const char* column, double low, double high) const {
    const auto text = [](double x) { return std::to_string(static_cast<long>(x)); };
    const std::string& cell = cells_[At(column)];
    Fail(std::string(column) + ": got " + (cell.empty() ? "nothing" : cell) +
         ", expected a number from " + text(low) + " to " + text(high));
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::invalid_argument(name_ + ":" + std::to_string(line_) + ": " + what);
  }

  std::istream& in_;
  std::string name_;
  int line_ = 0;
  std::vector<std::string> columns_, cells_;
};

}  // namespace

std::vector<DriveWindow> ReadDriveWindows(std::istream& in, const std::string& name) {
  Table t(in, name);
  std::vector<DriveWindow> rows;
  const auto speed = [&](const char* column) { return t.Number(column, -kMostSpeed, kMostSpeed); };
  while (t.Next()) {
    rows.push_back({t.Text("robot"), t.Number("steady", 0, 1) == 1, speed("v_left_mps"),
                    speed("v_right_mps"), speed("vx_mps"), speed("vy_mps"),
                    t.Number("omega_radps", -kMostYaw, kMostYaw)});
  }
  return t.Some(std::move(rows));
}

std::vector<PowerRow> ReadPowerRows(std::istream& in, const std::string& name) {
  Table t(in, name);
  std::vector<PowerRow> rows;
  const auto speed = [&](const char* column) { return t.Number(column, -kMostSpeed, kMostSpeed); };
  while (t.Next()) {
    rows.push_back({t.Text("terrain"), t.Text("motion"),
                    static_cast<int>(t.Number("windows", 1, 1e6)), speed("rim_in_m_per_s"),
                    speed("rim_out_m_per_s"), t.Number("yaw_wheels_rad_per_s", -kMostYaw, kMostYaw),
                    t.Optional("yaw_imu_over_wheels", -5, 5), t.Number("cur_in_a", 0, kMostCurrent),
                    t.Number("cur_out_a", 0, kMostCurrent), t.Number("p_elec_w", 0, kMostPower)});
  }
  return t.Some(std::move(rows));
}

std::vector<CurrentSample> ReadCurrents(std::istream& in, const std::string& name) {
  Table t(in, name);
  std::vector<CurrentSample> rows;
  while (t.Next()) {
    rows.push_back({t.Number("velL", -kMostSpeed, kMostSpeed),
                    t.Number("velR", -kMostSpeed, kMostSpeed), t.Number("curL", 0, kMostCurrent),
                    t.Number("curR", 0, kMostCurrent)});
  }
  return t.Some(std::move(rows));
}

}  // namespace grouser::measured

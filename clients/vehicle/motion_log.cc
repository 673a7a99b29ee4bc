#include "clients/vehicle/motion_log.h"

#include <numbers>

#include "clients/vehicle/csv_lines.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::size_t kMostRows = 200000;  // a power with its solution takes more than 1 kB
const std::vector<std::string> kLogColumns = {
    "speed_m_per_s", "time_s", "yaw_rate_rad_per_s", "acceleration_m_per_s2", "grade_deg",
    "bank_deg",      "soil"};

}  // namespace

MotionLog ReadMotionLog(const std::string& file, const std::vector<std::string>& soils,
                        std::uint8_t soil) {
  const CsvTable table = ReadCsv(file);
  CheckColumns(table, kLogColumns,
               "speed_m_per_s and at most time_s, yaw_rate_rad_per_s, acceleration_m_per_s2, "
               "grade_deg, bank_deg, soil, each once");
  if (table.lines.empty()) throw yaml::InputError(file + ": got no row, expected a drive");
  if (table.lines.size() > kMostRows) {
    throw yaml::InputError(file + ": got " + std::to_string(table.lines.size()) +
                           " rows, expected at most " + std::to_string(kMostRows));
  }
  if (!HasColumn(table, "speed_m_per_s")) {
    throw yaml::InputError(table.at + "no column speed_m_per_s");
  }
  MotionLog log;
  for (const CsvTable::Line& line : table.lines) {
    Motion m;
    m.soil.fill(soil);
    for (std::size_t c = 0; c < line.cells.size(); ++c) {
      const std::string& column = table.columns[c];
      if (column == "soil") {
        m.soil.fill(SoilOf(line.at, line.cells[c], soils));
        continue;
      }
      const double value = NumberOf(line.at, column, line.cells[c]);
      if (column == "speed_m_per_s") m.v_x_m_per_s = value;
      if (column == "yaw_rate_rad_per_s") m.yaw_rate_rad_per_s = value;
      if (column == "acceleration_m_per_s2") m.acceleration_m_per_s2 = value;
      if (column == "grade_deg") m.grade_rad = value * kDegree;
      if (column == "bank_deg") m.bank_rad = value * kDegree;
      if (column != "time_s") continue;
      if (!log.time_s.empty() && !(value > log.time_s.back())) {
        throw yaml::InputError(line.at + "time_s: got " + line.cells[c] +
                               ", expected more than in the line before");
      }
      if (!log.time_s.empty() && value - log.time_s.back() > kLongestStepS) {
        throw yaml::InputError(line.at + "time_s: got " + line.cells[c] +
                               ", expected at most 1e9 s more than in the line before");
      }
      log.time_s.push_back(value);
    }
    log.motions.push_back(m);
  }
  return log;
}

DriveEnergy EnergyOf(const MotionLog& log, std::span<const PowerInterval> powers) {
  DriveEnergy sum;
  for (std::size_t i = 0; i + 1 < log.time_s.size(); ++i) {
    sum.Add(powers[i], log.time_s[i + 1] - log.time_s[i]);
  }
  return sum;
}

std::vector<TrajectoryStep> StepsOf(const std::string& file, const MotionLog& log) {
  if (log.time_s.size() < 2) {
    throw yaml::InputError(file + ": got " + (log.time_s.empty() ? "no column time_s" : "one row") +
                           ", expected two rows or more with times");
  }
  std::vector<TrajectoryStep> steps;
  for (std::size_t i = 0; i + 1 < log.time_s.size(); ++i) {
    steps.push_back({log.motions[i], log.time_s[i + 1] - log.time_s[i]});
  }
  return steps;
}

}  // namespace grouser::cli

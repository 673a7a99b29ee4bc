#pragma once

#include <istream>
#include <string>
#include <vector>

namespace grouser::measured {

/// A window of a skid-steered robot (data/README.md): rim speeds of its sides and the twist that it
/// had. SI; yaw to the left.
struct DriveWindow {
  std::string robot;
  bool steady;
  double left_m_per_s, right_m_per_s;
  double v_x_m_per_s, v_y_m_per_s, yaw_rate_rad_per_s;
};

/// Windows of steady driving of the Husky, binned (data/README.md). Driven forward and to the left:
/// `in` is the slower side. NaN where nothing was measured.
struct PowerRow {
  std::string terrain, motion;  ///< "ASPHALT", ...; "still", "straight", "turn", "pivot", "stuck"
  int windows;
  double rim_in_m_per_s, rim_out_m_per_s;
  double yaw_wheels_rad_per_s;                  ///< that of the wheels without slip
  double yaw_ratio;                             ///< measured yaw rate over it
  double current_in_a, current_out_a, power_w;  ///< magnitudes; `power_w` estimated from them
};

/// Straight driving at one recording of side speeds and currents.
struct CurrentSample {
  double left_m_per_s, right_m_per_s, current_left_a, current_right_a;
};

/// Read tables by the names of their columns; others are passed over. Throw std::invalid_argument
/// "NAME:LINE: COLUMN: got X, expected Y", for a column that is missing "NAME: no column ...", and
/// for a table without rows. Nothing is guessed: a cell that is no number is refused (empty and
/// "nan" are NaN where the struct says so).
std::vector<DriveWindow> ReadDriveWindows(std::istream& table, const std::string& name);
std::vector<PowerRow> ReadPowerRows(std::istream& table, const std::string& name);
std::vector<CurrentSample> ReadCurrents(std::istream& table, const std::string& name);

}  // namespace grouser::measured

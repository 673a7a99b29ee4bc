#pragma once

#include <functional>
#include <string>
#include <vector>

#include "surrogate/measured_vehicles/grounds.h"
#include "surrogate/measured_vehicles/rows.h"

namespace grouser::measured {

/// The ground with a friction level: all else of it is given beforehand.
using GroundOf = std::function<OnGround(double friction)>;

/// A window: what the robot did and what is predicted.
struct YawPoint {
  double left_m_per_s, right_m_per_s;
  double without_slip, measured, predicted;  ///< yaw rates [rad/s]
  double half_width;                         ///< of the 90 % interval
  double v_x, predicted_v_x;                 ///< forward [m/s]
  bool fitted;                               ///< the friction level was fitted to it
};

struct YawComparison {
  std::string ground;
  int windows = 0, left_out = 0;  ///< steady ones; of them faster than without slip by 0.3 rad/s
  double factor = 0, factor_rms = 0;  ///< one constant factor on the yaw rate without slip instead
  double factor_rms_all = 0;          ///< the same fitted on all rows, over all rows
  double friction = 0;                ///< fitted
  double rms = 0, rms_fitted = 0;     ///< over the rows held back; over those fitted [rad/s]
  double rms_moving = 0;              ///< over rows held back that turn by a fifth of it or more
  int stuck = 0;                      ///< rows held back that do not
  int pairs = 0;                      ///< of windows of the same rim speeds, mirrored where needed
  double repeat_rms = 0;              ///< of their difference, over sqrt(2): no law does better
  /// Forward speed over the mean rim speed, of all rows together: how much of it slip takes.
  double speed_ratio = 0, predicted_speed_ratio = 0;
  int unbalanced = 0;  ///< rows for which the solver found no balance
  int held_back = 0, covered = 0, band_low = 0, band_high = 0;  ///< of 90 % intervals
  std::vector<YawPoint> points;
};

/// Yaw rates of a robot's steady windows against those of the vehicle at their rim speeds; `track`
/// is the distance of the sides that the yaw rate without slip is counted with. Rows faster than
/// without slip by over 0.3 rad/s are left out. The friction level (0.05 to 2) is fitted on the
/// first, third, ... of those left by least squares; the others are held back.
///
/// Windows count as of the same rim speeds within 4 % of the fastest rim.
///
/// Intervals: half width q max(|yaw rate without slip|, 0.2 rad/s); q: of the n fitted rows' errors
/// over that scale the ceil(0.9 (n + 1))-th smallest. The friction is fitted on the same rows, so
/// that nothing guarantees 90 % of others: the held-back rows count how many are inside, beside the
/// band of such a count (surrogate::BinomialBand of 0.9).
YawComparison CompareYaw(const std::vector<DriveWindow>& windows, const std::string& robot,
                         double track_m, const std::string& ground_name, const GroundOf& ground);

}  // namespace grouser::measured

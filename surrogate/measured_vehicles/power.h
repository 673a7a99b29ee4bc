#pragma once

#include <string>
#include <vector>

#include "surrogate/measured_vehicles/rows.h"
#include "surrogate/measured_vehicles/terrains.h"

namespace grouser::measured {

struct Range {
  double low, middle, high;  ///< least, median and largest of the grounds' answers; NaN: none
};

/// A row of driving and what is predicted of it.
struct PowerPoint {
  std::string terrain, motion;
  bool fitted;  ///< the motor's constant was fitted to it
  int windows;
  double rim_in_m_per_s, rim_out_m_per_s;
  double measured_in_a, measured_out_a, measured_w;
  int grounds, unanswered;  ///< that stand for the terrain; of them without an answer
  Range in_a, out_a, power_w;
  double measured_yaw_ratio;  ///< NaN where not measured
  Range yaw_ratio;
};

/// How one terrain's rows that were not fitted are met.
struct PowerSummary {
  std::string terrain;
  std::string ground;  ///< what stands for it
  int rows = 0;        ///< not fitted, with a prediction
  int unanswered = 0;  ///< not fitted, without an answer of any ground
  double rms = 0;      ///< of (predicted - measured)/measured power
  double mean = 0;     ///< of the same
  double rms_straight = 0,
         rms_turning = 0;  ///< over rows straight on (fitted ones too), and the others
  double target = 0;
  int yaw_rows = 0;
  double yaw_rms = 0, yaw_measured = 0, yaw_predicted = 0;  ///< of the ratio; means
  double yaw_target = 0;
};

struct PowerComparison {
  double rim_scale = 1;
  double no_load_current_a = 0;  ///< fitted: of each side's motor
  double fit_rms = 0;            ///< of the power of the fitted rows, over measured
  std::vector<PowerPoint> points;
  std::vector<PowerSummary> terrains;
  /// Mean current of straight driving on loam over that on asphalt.
  double measured_current_ratio = 0;
  Range current_ratio{};
};

/// The vehicle's power on each terrain. Its motor's constants are those of its file, but for the
/// no-load current, the one constant that straight driving tells: least squares of the currents of
/// the rows `straight` on asphalt, floor and ice, after the torque of rolling. Rows `still` and
/// `stuck` are left out. On soils the tyre's own rolling resistance (that of asphalt) is added to
/// the rigid wheel's torque.
///
/// Currents are magnitudes; so are the predicted ones. Power is estimated from both alike, as the
/// table's own: sum of R I^2 + k G |w| I over the sides. `rim_scale`: times the rim speeds of the
/// table (1: as they stand). A ground into which wheels sink beyond the vehicle's limit, or on
/// which nothing balances, has no answer.
PowerComparison ComparePower(const std::vector<PowerRow>& rows, const vehicle::Vehicle& vehicle,
                             const PublishedGrounds& grounds, double rim_scale, Wheels wheels);

/// Straight driving of the recordings of one ground: mean of both sides' currents together, over
/// samples with both sides faster than 0.1 m/s and alike to 0.05 m/s.
struct StraightCurrent {
  double current_a = 0, speed_m_per_s = 0;
  int samples = 0;
};
StraightCurrent MeanStraight(const std::vector<CurrentSample>& samples);

/// Current on ploughed soil over that on concrete: the no-load current is fitted to the concrete,
/// the soil adds what its models say.
struct PloughedComparison {
  StraightCurrent concrete, ploughed;
  double no_load_current_a = 0;
  Range ratio{};
};
PloughedComparison ComparePloughed(const StraightCurrent& concrete, const StraightCurrent& ploughed,
                                   const vehicle::Vehicle& vehicle, const PublishedGrounds& grounds,
                                   Wheels wheels);

}  // namespace grouser::measured

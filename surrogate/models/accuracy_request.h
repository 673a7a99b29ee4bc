#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "surrogate/models/form_error.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What an error is against: a fresh DEM run's mean, or a measurement.
enum class IntervalTarget { kDem, kMeasured };

/// How good an answer has to be, or how little it may cost. What is 0 asks for
/// nothing. Precondition everywhere: finite, not negative.
struct AccuracyRequest {
  std::array<double, kOutputs> tolerance{};  ///< [N, N m, m]
  /// Of forces over the load, of moments over load r [-]; against a measurement m_z, which no
  /// testbed measures (kMeasurable), is left out.
  double share_of_load = 0;
  double budget_ns = 0;  ///< for all states of a call, by the models' costs, not by a clock
  IntervalTarget target = IntervalTarget::kDem;

  bool HasTolerance() const;
  bool IsEmpty() const { return !HasTolerance() && budget_ns == 0; }
  /// What holds at a load: the smaller of both kinds; infinite without either.
  std::array<double, kOutputs> At(double load, double radius_m) const noexcept;
};

/// Regions of an error table, mirrored in v_x and v_y; limits as the fitter's
/// (surrogate/fit/error_table.h).
enum class ErrorRegion { kBraking, kTowed, kDriving, kLateral };
inline constexpr std::size_t kErrorRegions = 4;
/// Precondition: finite, not all zero.
ErrorRegion ErrorRegionAt(double v_x, double v_y, double rim_speed) noexcept;

/// One model of a model selector, and what it says of itself.
struct SelectableModel {
  const WheelModel* model = nullptr;  ///< not owned
  /// Root mean square errors of the error table, by region: of forces over the
  /// load, of moments over load r, of sinkage [m]. 0: none.
  std::array<std::array<double, kOutputs>, kErrorRegions> rms_error{};
  TrainingDomain hull;
  double radius_m = 0;
  double cost_ns = 0;  ///< of one state
  FormErrors form;
  bool hard = false;  ///< ground that does not yield: a law, with no DEM run behind it
};

/// Error that a model claims for its answer on one output:
///
///   max((high - low)/2, 1.645 rms_error[region] s), s = load, load r or 1
///
/// its own interval (against DEM, wider outside the hull) and its own error
/// table. Infinite where there is neither; hard ground, whose interval is the spread of its
/// parameters, claims 0 for f_z and sinkage and where an output is exactly 0 (f_y straight on).
double ClaimedError(const SelectableModel& selectable, ErrorRegion region, int output, double low,
                    double high, double load) noexcept;

/// Mean over a fixed sample of `box` of the claims over load, load r or r: by
/// which models are compared where no tolerance decides.
double MeanClaim(const SelectableModel& selectable, const TrainingDomain& box);

/// What one state costs, values and intervals checked against a tolerance: the
/// fastest of twelve short runs over states of the hull, some milliseconds. [ns]
double MeasureCost(const SelectableModel& selectable);

}  // namespace grouser::surrogate

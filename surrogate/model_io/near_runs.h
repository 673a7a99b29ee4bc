#pragma once

#include <functional>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Where wheel states are near one another. With the direction e of (v_x, v_y, r w) on the unit
/// sphere, the load N and, of a model with a speed axis, its s of the Froude number (SpeedAxis):
///
///   d^2 = min over mirrors g of (|e_a - g e_b|/0.3)^2 + (ln(N_a/N_b)/0.405)^2
///         + ((s_a - s_b)/s(high))^2,  g turns v_x and r w, or v_y, or both
///
/// the coordinates of the model's fields (fit/residual_field.h) over fixed lengths
/// (kNearDirection, kNearLogLoad): those of its fit are not in the model file.
class StateSpace {
 public:
  /// speeds: TrainedSpeeds, for a wheel of `radius_m` under `gravity`.
  StateSpace(const SpeedAxis& speeds, double radius_m, double gravity_m_per_s2)
      : speeds_(speeds), radius_m_(radius_m), gravity_(gravity_m_per_s2) {}

  struct Distance {
    double total, direction, load, speed;
    bool mirrored_x, mirrored_y;  ///< g; where mirrors are equally near, the fewer
  };
  /// Precondition: finite and moving, positive loads.
  Distance Between(const VelocityState& a, double load_a, const VelocityState& b,
                   double load_b) const noexcept;

 private:
  double Speed(const VelocityState& motion) const noexcept;

  SpeedAxis speeds_;
  double radius_m_, gravity_;
};

/// A run of a model file beside a state.
struct RunBeside {
  const v1alpha1::RunSummary* run;  ///< not owned
  VelocityState motion;             ///< on the run's own side
  StateSpace::Distance distance;
};

/// The runs that `counts` picks, the nearest first, at most `most`; equally near ones as they stand
/// in the file. Runs without a motion or a load are left out. otherwise: speed of runs that name
/// none.
std::vector<RunBeside> NearestRuns(const v1alpha1::Provenance& provenance, const StateSpace& space,
                                   const VelocityState& motion, double load, double otherwise,
                                   std::size_t most,
                                   const std::function<bool(const v1alpha1::RunSummary&)>& counts);

}  // namespace grouser::surrogate

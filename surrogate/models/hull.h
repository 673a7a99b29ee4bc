#pragma once

#include <array>
#include <cstdint>

#include "surrogate/models/kinematics.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What the training runs covered. Mirrored in v_x and v_y.
struct TrainingDomain {
  double slip_min = -1, slip_max = 1;  ///< [-]
  double attack_angle_max_rad = 0;
  double load_min_n = 0, load_max_n = 0;
  double froude_max = 0;  ///< v^2/(g r) above which kRate is set; 0: never
  double gravity_m_per_s2 = 9.81;
};

/// How answers go with the Froude number Fr = M^2/(g r), M = max(|r w|, V): in
/// proportion to
///
///   u = s(min(Fr, high)) - s(reference), s(Fr) = Fr/(1 + saturation Fr).
///
/// Inertia of the soil that a wheel moves goes with the square of the speed, beside
/// what rests on friction alone (the two terms of dynamic resistive-force theory:
/// Agarwal et al. 2021, Science Advances 7): saturation 0. A fit may find that the
/// effect levels off; s is 0 and regular at rest either way.
struct SpeedAxis {
  double reference = 0;   ///< Froude number that the table itself stands for
  double high = 0;        ///< largest of the runs; 0: answers do not depend on speed
  double saturation = 0;  ///< 1/Fr at which half of the largest effect is reached

  bool present() const { return high > 0; }
  double Scale(double froude) const noexcept { return froude / (1 + saturation * froude); }
  double At(double froude) const noexcept {
    return Scale(froude < high ? froude : high) - Scale(reference);
  }
};

/// Uncertainty per output, at the middle load sqrt(load_min load_max).
struct Uncertainty {
  std::array<double, kOutputs> fit_inside{}, fit_growth{}, patch{};
  std::array<double, kOutputs> interval_factor{};
  std::array<double, kOutputs> bulldozing{};  ///< >= 0; both sds times 1 + this P
  bool form_unknown = true;                   ///< sd_form of some output is NaN in some region
  bool untuned = false;                       ///< nothing was fitted

  /// Flags of every answer that is one.
  std::uint32_t Flags() const {
    return (form_unknown ? kFormUnknown : 0u) | (untuned ? kUntuned : 0u);
  }
};

/// Where a model was trained and how sure it is there and beyond:
///
///   sd_fit   = g hypot(fit_inside, fit_growth D), D the hull distance
///   sd_patch = g patch, g = 1 + bulldozing P: a wheel that is pushed through the
///              soil rather than rolled over it is less certain (one factor for
///              both, found by what the fit misses: the interval is calibrated,
///              its division among the two is not)
///   interval = value +- factor hypot(sd_fit, sd_patch): a fresh DEM run's mean
///
/// Deviations of forces and moments are taken proportional to the load. These
/// are the scalar laws; response_kernel.inl has the same for a block of states.
class Hull {
 public:
  static constexpr double kOverloadSinkage = 0.7;  // of the radius: DEM runs end there
  static constexpr double kEdge = 1e-9;            // rounding at the hull's faces
  // One unit of hull distance beyond the box; by judgement, not fitted.
  static constexpr double kSlipReach = 0.15, kLateralReach = 0.15, kLogLoadReach = 0.3;
  static constexpr double kSpeedReach = 0.5;       // of the speed above which kRate is set
  static constexpr double kMostSpeedExcess = 1e6;  // beyond, intervals grow no more
  static constexpr double kFarFromRuns = 0.5;      // hull distance that is flagged

  /// Throws std::invalid_argument "domain: ..." or "soil: ..." if unusable.
  Hull(const TrainingDomain& box, const Uncertainty& uncertainty);

  bool Outside(const Canonical& state, double load) const noexcept;
  /// How far a state is beyond the box, its loads and (radius_m) its speeds, in units of hull
  /// distance: 0 inside, continuous, growing without bound, so that intervals do too.
  double Excess(const Canonical& state, double load, double radius_m) const noexcept;
  /// P = min(1, y^2 + B^2 p/hypot(p, q)), B = max(0, p - q), with p, y, q = v_x, |v_y|,
  /// r w over M: 0 rolling straight, 1 locked or sideways, continuous through v_x = 0.
  static double Bulldozing(const Canonical& state) noexcept;
  void AddUncertainty(double distance, double bulldozing, double load,
                      WheelAnswer* answer) const noexcept;

  const TrainingDomain& box() const { return box_; }
  const Uncertainty& uncertainty() const { return uncertainty_; }
  double middle_load() const { return middle_load_; }
  /// Froude number of a speed M [m/s].
  double Froude(double speed, double radius_m) const noexcept {
    return speed * speed / (box_.gravity_m_per_s2 * radius_m);
  }
  /// Speed [m/s] above which kRate is set; infinite where it never is.
  double Fastest(double radius_m) const noexcept;

 private:
  TrainingDomain box_;
  Uncertainty uncertainty_;
  double middle_load_;
};

}  // namespace grouser::surrogate

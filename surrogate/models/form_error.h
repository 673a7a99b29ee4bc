#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Regions of moving wheels in which DEM is compared with measurements; each state is in one.
/// Mirrored in v_x and v_y; rim: r w, in the sense of travel; V: the hub's whole speed, so that
/// braking means the same at every attack angle. The one definition of these limits: error tables
/// of `grouser validate` have them from `grouser-fit regions`.
///
///   kLocked    |rim| < 0.001 V
///   kStraight  rim >= 0.799 V (driving, or braking by at most 0.2), |v_y| <= tan(5 deg) |v_x|
///   kAngled    rim >= 0.799 V, at a larger angle
///   kBraking   what is left: braking harder, counter-rotation
enum class MeasuredRegion { kStraight, kAngled, kBraking, kLocked };
inline constexpr std::size_t kMeasuredRegions = 4;
/// Precondition: finite, not all zero.
MeasuredRegion MeasuredRegionAt(double v_x, double v_y, double rim_speed) noexcept;
inline constexpr std::array<const char*, kMeasuredRegions> kMeasuredRegionNames = {
    "straight", "angled", "braking", "locked"};

/// What tables of errors report: regions together.
struct MeasuredGroup {
  const char* name;
  std::array<bool, kMeasuredRegions> has;  ///< by MeasuredRegion
};
inline constexpr std::array<MeasuredGroup, 4> kMeasuredGroups = {
    {{"braking <= 0.2, driving", {true, true, false, false}},
     {"straight of these", {true, false, false, false}},
     {"not locked", {true, true, true, false}},
     {"locked", {false, false, false, true}}}};

/// DEM minus measurement. A state's interval that covers a measurement:
///
///   value +- hypot((high - low)/2, factor sd s), s = load/middle load, 1 for sinkage
///
/// low, high: the interval that covers a DEM run; factor: Student's for the number of measured
/// rows or angles in the region (surrogate/fit/form_fit.h). NaN: unknown.
struct FormErrors {
  struct OfRegion {
    std::array<double, kOutputs> sd, factor;
    /// sd and factor of all outputs but f_z, which is the load
    bool KnowsAll() const noexcept;
  };
  std::array<OfRegion, kMeasuredRegions> region;
  double middle_load_n = 0;  ///< 0: sd holds at every load

  FormErrors();                                   ///< nothing is known
  bool KnowsAll() const noexcept;                 ///< in all regions
  bool ClearsFlags() const noexcept;              ///< some region knows all
  bool KnowsInterval(int output) const noexcept;  ///< sd and factor in some region
  double Sd(MeasuredRegion at, int output, double load) const noexcept;
  /// factor sd s.
  double HalfWidth(MeasuredRegion at, int output, double load) const noexcept;
};

/// Where sd_form and the intervals for measurements go: n entries, or empty and not written.
struct FormView {
  struct OfOutput {
    std::span<double> sd, low, high;
  };
  std::array<OfOutput, kOutputs> output;

  bool WantsIntervals() const noexcept;
  bool WantsAny() const noexcept;
};

/// Of `count` states from `first` on; what is empty stays empty.
FormView Cut(const FormView& to, std::size_t first, std::size_t count) noexcept;

/// Completes answer i of a model: writes what `to` has room for, and sets or clears kFormUnknown.
/// Invalid states get NaN, airborne ones 0; at rest nothing is known. Precondition: where `to`
/// has low or high, `answered` has both low and high, with their answers.
void AddForm(const FormErrors& form, const WheelStatesView& in, const ResponsesView& answered,
             const FormView& to, std::size_t i) noexcept;
/// All states. Flags stay as the model set them where no region knows all and `to` wants nothing.
void AddForm(const FormErrors& form, const WheelStatesView& in, const ResponsesView& answered,
             const FormView& to) noexcept;

/// model.Evaluate and AddForm; low and high of `out` may be empty. No allocation.
void EvaluateWithForm(const WheelModel& model, const FormErrors& form, const WheelStatesView& in,
                      const ResponsesView& out, const FormView& to) noexcept;

/// Of one answer (AnswerOf), whose flags it completes. half_width: of the interval for a
/// measurement.
struct FormAnswer {
  std::array<double, kOutputs> sd, half_width;
};
FormAnswer FormOf(const FormErrors& form, const VelocityState& motion, double load,
                  WheelAnswer* answer) noexcept;

}  // namespace grouser::surrogate

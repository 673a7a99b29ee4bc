#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "surrogate/models/outputs.h"

namespace grouser::surrogate {

/// n wheel states as structure of arrays; every span has n entries, but
/// `slope_pitch`, `slope_roll`, `yaw_rate` and `pass_number` may be empty.
/// Contact frame (REP-103), SI.
struct WheelStatesView {
  std::span<const double> v_x, v_y;   ///< hub velocity [m/s]
  std::span<const double> rim_speed;  ///< r w [m/s]
  std::span<const double> load;       ///< vertical load [N], >= 0; 0: kAirborne
  std::span<const double> slope_pitch, slope_roll, yaw_rate;
  std::span<const std::uint32_t> pass_number;
};

/// Where one output goes, by Part; an empty span is not written.
struct OutputView {
  std::span<double> value, sd_fit, sd_patch, low, high;
  std::span<double> d_v_x, d_v_y, d_rim_speed, d_load;
  std::span<double> sd_soil;  ///< of mixtures (mixture_model.h), which alone write it
};
/// Its members in the order of Part.
inline constexpr std::array<std::span<double> OutputView::*, kParts> kPartMembers = {
    &OutputView::value, &OutputView::sd_fit,      &OutputView::sd_patch,
    &OutputView::low,   &OutputView::high,        &OutputView::d_v_x,
    &OutputView::d_v_y, &OutputView::d_rim_speed, &OutputView::d_load};

struct ResponsesView {
  std::array<OutputView, kOutputs> output;
  std::span<std::uint32_t> flags;        ///< required, n entries
  std::span<double> slip, attack_angle;  ///< echo; may be empty
};

/// Views of `count` states from `first` on; what is empty stays empty.
WheelStatesView Cut(const WheelStatesView& in, std::size_t first, std::size_t count) noexcept;
ResponsesView Cut(const ResponsesView& out, std::size_t first, std::size_t count) noexcept;

/// slip = (r w - v_x)/max(|r w|, V), attack angle = atan2(v_y, v_x) [rad].
/// V = r w = 0 gives {0, 0, true}.
struct SlipState {
  double slip, attack_angle_rad;
  bool is_static;
};
SlipState ToSlip(double v_x, double v_y, double rim_speed) noexcept;

/// Inverse: kinematics at speed = max(|r w|, V) > 0. For
/// slip > 1 - cos(beta) the rim is the faster, else the hub. NaN for a slip
/// that no motion has (outside [-2, 2] or beyond what beta allows).
struct VelocityState {
  double v_x, v_y, rim_speed;
};
VelocityState FromSlip(double slip, double attack_angle_rad, double speed) noexcept;

/// One state's answer; the interval is value +- half_width.
struct WheelAnswer {
  std::array<double, kOutputs> value, sd_fit, sd_patch, half_width;
  std::uint32_t flags;
};

/// How the errors of a model's answers at different states have to do with one another; see
/// draw_field.h.
struct ErrorForm {
  bool of_physics = false;  ///< nothing was fitted to runs but the physics' parameters, if they
  double friction_radius_m = 0;  ///< above 0, the wheel's: one friction, one rolling resistance
};

/// A fitted model of one wheel on one soil, immutable and thread-safe.
class WheelModel {
 public:
  virtual ~WheelModel() = default;
  /// Evaluates all states. No allocation, lock or system call. A bad state
  /// gets flag kInvalid and NaN outputs and harms no other. A load of 0 gets the one
  /// flag kAirborne and zeros in every part (also where slope, pass or yaw rate are given).
  /// Precondition: sizes as documented above (checked once, by the caller).
  virtual void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept = 0;
  /// How far the answers may lie from the law that made the model's golden
  /// vectors: a share of load, load x radius or radius. 0: rounding alone.
  virtual double Tolerance() const noexcept { return 0; }
  /// Whether a yaw rate changes the answer; else it is flagged.
  virtual bool UsesYawRate() const noexcept { return false; }
  virtual ErrorForm Errors() const noexcept { return {}; }
  /// The model whose draw is taken where the draw's uniform number is `which`: itself, but of a
  /// mixture one of its soils'.
  virtual const WheelModel& OfDraw(double /*which*/) const noexcept { return *this; }
  /// Speed max(|r w|, V) [m/s] above which answers have the flag kRate; infinite: none.
  virtual double FastestOfRuns() const noexcept { return std::numeric_limits<double>::infinity(); }
  /// Whether it holds on slopes, the load being that across the ground; else a slope that is
  /// given is flagged and answered NaN.
  virtual bool HoldsOnSlopes() const noexcept { return false; }
};

/// The answer to state i for a wheel off the ground; echoes are left alone.
void WriteAirborne(const ResponsesView& out, std::size_t i) noexcept;

/// What `model` answers to one state, by Evaluate. NaN where it writes nothing.
WheelAnswer AnswerOf(const WheelModel& model, const VelocityState& motion, double load) noexcept;

}  // namespace grouser::surrogate

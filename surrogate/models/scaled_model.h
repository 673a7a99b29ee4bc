#pragma once

#include <array>
#include <memory>

#include "surrogate/models/form_error.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// A wheel test with the dimensionless groups of another (dry grains, nothing that sticks): all
/// lengths l times as large, grains, treads and sinkage among them, gravity g times, densities and
/// frictions as they are, Young's modulus g l times. Equal are then load/(rho g r^2 b), b/r, d/r,
/// the Froude number v^2/(g r) and rho g r/E; so are slip, attack angle, slopes, pass, and every
/// answer in units of load, load r or r.
struct Similarity {
  double length = 1;   ///< l [-], > 0
  double gravity = 1;  ///< g [-], > 0

  double Force() const noexcept { return gravity * length * length * length; }
  double Moment() const noexcept { return Force() * length; }
  double Speed() const noexcept;    ///< sqrt(g l)
  double YawRate() const noexcept;  ///< sqrt(g/l)
  double Of(int output) const noexcept {
    return output == kSinkage ? length : IsMoment(output) ? Moment() : Force();
  }
  bool IsIdentity() const noexcept { return length == 1 && gravity == 1; }
};

/// How far DEM of a similar wheel is from that of the wheel itself where the grains keep their
/// Young's modulus, as those of one sand do: an sd over load, load r or r, for each doubling of the
/// stresses (g l; softer grains) and for each halving of them. 0: no difference beyond the scatter
/// of beds was seen (f_x), or the load (f_z). Source: `./grouser dem verify --case
/// size_and_gravity`, twice the size and lunar gravity; docs/validation.md, "Another size or
/// gravity".
inline constexpr std::array<double, kOutputs> kSdPerDoubling = {0, 0.041, 0, 0.016, 0.004, 0.068};
inline constexpr std::array<double, kOutputs> kSdPerHalving = {0, 0.011, 0, 0, 0, 0.031};

/// What of a model goes with size and gravity beside its answers.
TrainingDomain Scaled(TrainingDomain box, const Similarity& by) noexcept;
FormErrors Scaled(FormErrors form, const Similarity& by) noexcept;

/// A model asked for a similar wheel. States are mapped to the model's own size and gravity,
/// answers back; derivatives by the chain rule. sd_fit grows by the sds above, the interval
/// by 1.645 of them, in squares; those of f_z and of hard ground do not. Flags are those of the
/// mapped state. With l = g = 1 the bits are the model's.
class ScaledModel final : public WheelModel {
 public:
  /// radius_m: of the model's own wheel. widened: whether grains stand behind the model (hard
  /// ground is a law that scales exactly). Throws std::invalid_argument for no model and for
  /// numbers that are not positive and finite.
  ScaledModel(std::shared_ptr<const WheelModel> model, double radius_m, const Similarity& by,
              bool widened);

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;
  double Tolerance() const noexcept override { return model_->Tolerance(); }
  bool UsesYawRate() const noexcept override { return model_->UsesYawRate(); }
  bool HoldsOnSlopes() const noexcept override { return model_->HoldsOnSlopes(); }
  double FastestOfRuns() const noexcept override { return by_.Speed() * model_->FastestOfRuns(); }
  ErrorForm Errors() const noexcept override {
    ErrorForm form = model_->Errors();
    form.friction_radius_m *= by_.length;
    return form;
  }

 private:
  void MapBack(const ResponsesView& out) const noexcept;
  void Widen(const WheelStatesView& in, const ResponsesView& out) const noexcept;

  std::shared_ptr<const WheelModel> model_;
  Similarity by_;
  double radius_m_;  ///< of the similar wheel
  bool widens_ = false;
  std::array<double, kOutputs> sd_{};  ///< over load, load r or r
};

}  // namespace grouser::surrogate

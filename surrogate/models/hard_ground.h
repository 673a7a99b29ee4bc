#pragma once

#include <cstdint>
#include <span>

#include "surrogate/models/hard_ground_kernel.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// A wheel on ground that does not yield: asphalt, floor, concrete, ice.
struct HardGround {
  double friction = 0;            ///< mu, Coulomb friction of wheel on ground [-], > 0
  double slip_stiffness = 0;      ///< C, force over load and slip at slip 0 [-], > 0
  double rolling_resistance = 0;  ///< f, resisting force over load [-], >= 0
  double contact_length_m = 0;    ///< 2 a, of the contact patch along the wheel, > 0
  double contact_width_m = 0;     ///< 2 b, across, > 0
  double friction_sd = 0;         ///< standard deviation of mu [-], >= 0
  double slip_stiffness_sd = 0;   ///< of C
  double rolling_resistance_sd = 0;
};

/// A field of HardGround, as files, messages and checks know it.
struct HardGroundField {
  const char* name;
  double HardGround::*member;
  bool zero_allowed, required;
  const char* what;
};
/// All of them, once.
std::span<const HardGroundField> HardGroundFields() noexcept;

/// Isotropic brush with Coulomb friction, combined slip, rolling resistance and scrub moment.
/// With the sliding velocity of the patch s = (v_x - r w, v_y, rho w_z), S = |s|, the mean
/// distance rho of the patch's points from its middle, and x = C/(3 mu) S/|r w|:
///
///   g = 3x - 3x^2 + x^3 for x < 1, else 1          (share of friction that is mobilised)
///   f_x = -mu N g s_x/S,   f_y = -mu N g s_y/S
///   m_z = -mu N g rho s_z/S + mu N a C/(3 mu) (1 - x)^3 v_y/(r w)   (last term: x < 1)
///   torque = r f_x + f N r sgn(r w)
///
/// Sources: brush and its aligning moment, Pacejka, Tire and Vehicle Dynamics (3rd ed. 2012),
/// sections 3.2-3.3, with slip over the rolling speed |r w|; force and moment share one friction
/// by the ellipsoidal limit surface of Howe and Cutkosky 1996 (Int. J. Robotics Research 15(6)).
/// Turning in place without travel (v = r w = 0) thus meets the moment mu N rho.
/// sgn(r w) is smoothed for |r w| < 0.02 max(|r w|, V), so that a locked wheel has no rolling
/// resistance and all is continuous.
///
/// Every load, slip, slip angle and speed is inside its range; sinkage is 0. sd_fit is that of
/// friction, slip stiffness and rolling resistance, by the derivatives of the answer with respect
/// to each, their squares summed; the aligning part of m_z has none of its own. sd_patch is 0, the
/// interval value +- 1.645 sd_fit. Forces are proportional to the load. Where a yaw rate is given
/// it is used, not flagged. Gradients are analytic; a slope or a pass number changes nothing and
/// sets no flag. Eight states at a time by one kernel per instruction set, with the same bits.
class HardGroundModel final : public WheelModel {
 public:
  /// `flags`: set on every answer of a wheel on the ground (of a model file: UNTUNED,
  /// FORM_UNKNOWN). Throws std::invalid_argument "hard: FIELD: got X, expected Y".
  HardGroundModel(const HardGround& ground, double radius_m, std::uint32_t flags = 0);

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;
  bool UsesYawRate() const noexcept override { return true; }
  ErrorForm Errors() const noexcept override {
    return {.of_physics = false, .friction_radius_m = radius_m_};
  }
  bool HoldsOnSlopes() const noexcept override { return true; }

  const HardGround& ground() const { return ground_; }
  double radius_m() const { return radius_m_; }
  /// rho [m], of the contact patch as a rectangle.
  double scrub_radius_m() const { return law_.scrub_radius; }

  /// Answers by the kernel of an instruction set (isa.h), for tests; false: this machine lacks it.
  bool SelectIsa(const char* isa) noexcept;

 private:
  void Fill(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
            std::size_t count) const noexcept;
  void Finish(const WheelStatesView& in, const ResponsesView& out, std::size_t i) const noexcept;

  HardGround ground_;
  double radius_m_;
  hard::Law law_;
  hard::BlockFn kernel_;
  std::uint32_t flags_;
};

}  // namespace grouser::surrogate

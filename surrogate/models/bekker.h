#pragma once

#include <array>
#include <span>

#include "surrogate/models/bekker_batch.h"
#include "surrogate/models/bekker_law.h"
#include "surrogate/models/bekker_parameters.h"
#include "surrogate/models/kinematics.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

struct WheelGeometry {
  double radius_m = 0, width_m = 0;
};

/// Stress on a wheel's rim, per area of the rim [Pa].
struct RimStress {
  double normal;      ///< compression, >= 0
  double tangential;  ///< on the wheel, along (cos theta, sin theta): forward below the hub
  double axial;       ///< on the wheel, along +y
};

/// Quasi-static force of dry soil on a smooth rigid wheel with closed sides:
/// driven, free, braked, locked and counter-rotating, at any attack angle.
///
/// theta: central angle from straight down, positive towards travel (+x).
/// p, y, q: v_x, |v_y| and r w over M = max(|r w|, V) (see Canonical);
/// slip = q - p. z: sinkage, theta_f = acos(1 - z/r).
///
/// Contact. theta in [-theta_2, theta_1]; theta_1 = theta_f ahead and
/// theta_2 = c3 theta_f behind; peak at theta_m = (c1 + c2 slip) theta_f
/// (Wong & Reece 1967). Near v_x = 0 front and rear change places smoothly:
/// with t = x/sqrt(1 + x^2), x = (p + turn_spin q)/turn_speed, theta_1 and
/// theta_2 are theta_f (c3 + (1 - c3)(1 +- t)/2), theta_m goes with t.
///
/// Normal stress. sigma = k (h/S)^n, h = r (cos phi - cos theta_f), with Bekker's
/// k = k_c/b + k_phi or Reece's k = (c k_c' + gamma b k_phi')/b^n (1965);
/// phi maps either branch onto [theta_m, theta_f] as in Wong & Reece (1967).
/// Slip sinkage S = exp(sinkage_drive D + sinkage_brake B + sinkage_lateral y^2),
/// D and B the driving and braking part of the slip (an explicit multiplier as
/// Lyasko's; Ding et al. 2011 let n grow instead).
///
/// Shear. tau = -(c' + sigma tan phi)(1 - exp(-|j|/K)) j/|j| (Janosi & Hanamoto
/// 1961), c' = c (1 - exp(-sigma/c)): adhesion comes with contact pressure, or a
/// braked rim would pull an unloaded wheel into the ground; j the displacement
/// of the rim against the soil since the contact began, along the rim and along
/// the axle (Ishigami et al. 2007 take both):
///   j_t = r/w [p (sin theta_1 - sin theta) - q e (theta_1 - theta)],
///   j_y = r/w y (theta_1 - theta), w = smooth max(|p|, |q|),
/// counted from the rear edge where the wheel runs backwards. Its direction is
/// regular at slip 0 and at 90 degrees, where r w and v_x both vanish.
/// Grousers shear the soil at the radius r_s = e r = r + grouser_share h_g (Ding
/// et al. 2011: between rim and tips): tau acts there, on an area and at an arm
/// that are e times larger; sigma stays at the rim, to which sinkage refers.
///
/// Bulldozing. Passive pressure (Reece 1965; Hegedus' blade) on the submerged
/// side, per length dx: R(h) = 1/2 rho g N h^2 + 2 c sqrt(N) h, N = side_passive,
/// mobilised by 1 - exp(-j_y/K_b), against v_y, at its arm x for M_z; ahead of
/// a braked rim b R(z), N = front_passive, mobilised by r theta_f B / K_b,
/// against v_x and through the axle.
///
/// Balance: b r int(sigma cos theta + tau_t sin theta) dtheta = load, by a
/// bracketed search on z in (0, 1.2 r], to 1e-9 of the load (bekker_balance.h). A
/// load that even 1.2 r does not carry gives the answer there and no_equilibrium.
///
/// The integrals are sums over 16 Gauss-Legendre points a branch; against
/// Points::kFine, over the load: half of random states within 5e-6 (n 0.6 to 1.3 and
/// K > 0.1 r: 2e-5), 99 of 100 within 1e-4 (2e-4 where K < 0.02 r), the worst, straight
/// braked wheels whose shear turns round within the contact, 2e-4 (K > 0.08 r), 7e-4,
/// 8e-3 (K < 0.02 r).
///
/// The equations stand once, in bekker_law.h, for doubles, for packs of states, for packs
/// of points of one state, and for derivatives. Solve and SolveBatch give the same bits,
/// on every instruction set. Times a state: docs/tolerance.md.
///
/// Sources: Wong & Reece 1967 (J. Terramechanics 4(1), 81-98 and 4(2), 7-25);
/// Janosi & Hanamoto 1961; Reece 1965 (Proc. IMechE 180); Ding et al. 2011
/// (J. Terramechanics 48, 27-45); Ishigami et al. 2007 (J. Field Robotics 24,
/// 233-250); Lyasko 2010 (J. Terramechanics 47).
class BekkerModel {
 public:
  struct Answer {
    std::array<double, kOutputs> value;  ///< in the order of Output
    bool no_equilibrium;
    int evaluations;  ///< of the load integral
  };

  /// Where the integrals are sampled, per branch.
  enum class Points {
    kLaw,   ///< 16 of Gauss-Legendre: what the law is defined with
    kFine,  ///< 32 panels of 16, exact to about 1e-12: what that is measured against
  };

  /// Throws std::invalid_argument "name: value, expected ..." out of range.
  BekkerModel(const BekkerParameters& parameters, const WheelGeometry& wheel);

  /// Precondition: finite kinematics; load finite and > 0. A wheel that stands has
  /// f_z and sinkage, the rest 0: the mean over all directions in which it may start.
  Answer Solve(double v_x, double v_y, double rim_speed, double load) const noexcept;
  /// The same for a canonical state; outputs in the canonical half-space.
  Answer SolveCanonical(const Canonical& state, double load) const noexcept;
  /// At a given sinkage [m] in (0, 1.2 r]; f_z is what the soil carries.
  Answer AtSinkage(const Canonical& state, double sinkage,
                   Points points = Points::kLaw) const noexcept;
  /// The stresses that AtSinkage integrates, at `angle` [rad] from straight down,
  /// forward positive: with normal s, tangential t, axial a, and no passive
  /// pressure on sides or blade,
  ///   f_z = b r int(s cos + t sin), f_x = b r int(t cos - s sin), f_y = b r int a,
  ///   torque = e b r^2 int t, over theta.
  /// 0 outside the contact. Precondition as AtSinkage.
  RimStress StressAt(const Canonical& state, double sinkage, double angle) const noexcept;
  /// At many angles; `stress` has as many entries as `angle`.
  void StressesAt(const Canonical& state, double sinkage, std::span<const double> angle,
                  std::span<RimStress> stress) const noexcept;

  /// Many states at once, one in each lane of a pack; by `solver` (isa.h), else by the
  /// widest that this machine has.
  void SolveBatch(const BekkerBatch& batch, BlockSolver solver = nullptr) const noexcept;

  const BekkerParameters& parameters() const { return parameters_; }
  const WheelGeometry& wheel() const { return wheel_; }
  double max_sinkage() const { return kMostSinkage * wheel_.radius_m; }
  /// e, from 1.
  double shear_radius_ratio() const { return law_.traction; }
  const BekkerLaw<double>& law() const { return law_; }

 private:
  BekkerParameters parameters_;
  WheelGeometry wheel_;
  BekkerLaw<double> law_;
};

}  // namespace grouser::surrogate

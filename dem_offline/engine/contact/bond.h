#pragma once

#include <cstdint>

namespace grouser::dem {

/// Parallel bond (Potyondy & Cundall 2004) of a disc of radius R_B between two
/// grains, in total form: no increments, so nothing drifts.
///   F_n = -k_n A u_n,  F_t = -k_t A u_t,  M_b = -k_n I th_b,  M_t = -k_t J th_t
///   A = pi R_B^2,  I = pi R_B^4/4,  J = pi R_B^4/2
///   breaks when  -F_n/A + |M_b| R_B/I > tensile  (F_n > 0: compression)
///           or   |F_t|/A + |M_t| R_B/J > shear
///           or   L/L_0 - 1 > largest stretch,   or   L > largest length
/// L, L_0 [m]: distance of the centres, now and where the bond was made; it also
/// grows where grains slide past one another. An intact bond acts beside the
/// contact of its pair (Potyondy and Cundall; by the bond alone, pressed grains
/// squash), or instead of it; a broken one leaves the contact.
/// Source: Potyondy & Cundall, Int. J. Rock Mech. 41 (2004) 1329.
struct BondLaw {
  double normal_stiffness_n_per_m3 = 0;  ///< k_n, per area
  double shear_stiffness_n_per_m3 = 0;   ///< k_t, per area
  double tensile_strength_pa = 1e300, shear_strength_pa = 1e300;
  double largest_stretch = 1e300;   ///< L/L_0 - 1 [-]
  double largest_length_m = 1e300;  ///< of L
  double damping_ratio = 0;         ///< share of critical, on every one of the four modes
  bool beside_contact = true;       ///< false: an intact bond replaces the contact
};

struct BondState {
  std::int32_t grain_a = 0, grain_b = 0;  ///< ids
  double radius_m = 0;                    ///< R_B
  int law = 0;
};

struct BondStatistics {
  std::int64_t intact = 0, broken_in_tension = 0, broken_in_shear = 0, broken_by_stretch = 0;
  double stored_j = 0, damped_j = 0, broken_j = 0;  ///< broken: elastic energy set free
};

/// What a bond carries at present.
struct BondLoad {
  std::int32_t grain_a = 0, grain_b = 0;  ///< ids
  bool intact = true;
  double tension_n = 0, shear_n = 0;  ///< -F_n, |F_t|; 0 where it is broken
};

/// A tenth of the least LeapfrogLimit of the modes of a bond [s]. length_m: of the centres;
/// reduced mass [kg] and moment of inertia [kg m^2] of its grains.
double BondStepOf(const BondLaw& law, double disk_radius_m, double length_m, double reduced_mass_kg,
                  double reduced_inertia_kg_m2);

}  // namespace grouser::dem

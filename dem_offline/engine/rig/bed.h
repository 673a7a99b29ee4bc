#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/engine/rig/work.h"

// A bed of grains, before any experiment is made on it.

namespace grouser::dem {

/// One size class of the grain mixture.
struct SizeBin {
  double diameter_m = 0.008;
  double mass_fraction = 1.0;  ///< [-]; the bins sum to 1
};

/// How a layer is packed: between its grains while they settle. What is left out is searched for
/// until the solid fraction is met: the friction, from kLeastFriction on; where the largest still
/// packs too densely, the rolling friction beside it.
struct BedPreparation {
  std::optional<double> friction;          ///< [-]; none: searched
  std::optional<double> rolling_friction;  ///< [-]; none: the soil's own, or searched
};

/// The uppermost layer of a bed, packed otherwise than what lies under it.
struct TopLayer {
  double thickness_m = 0;     ///< 0: none
  double solid_fraction = 0;  ///< target [-]
  BedPreparation preparation;
};

/// Grain-scale description of a soil. `contact` names the laws, of grains
/// among themselves and on floor and wheel alike.
struct GrainSoil {
  double density_kg_per_m3 = 2290.0;  ///< of the grain material
  double youngs_modulus_pa = 1e7;
  double poisson_ratio = 0.3;     ///< [-]
  double restitution = 0.5;       ///< grain-grain [-], (0, 1]
  double friction = 0.5;          ///< grain-grain [-]
  double rolling_friction = 0.1;  ///< mu_r [-]
  ContactChoice contact;
  double solid_fraction = 0.58;  ///< target of the settled tile, under its top layer [-]
  BedPreparation preparation;    ///< of what lies under the top layer
  TopLayer top;
  double gravity_m_per_s2 = 9.81;  ///< magnitude, along -z
  std::vector<SizeBin> sizes;      ///< at least one
};

/// A bed to be settled: it knows its soil and its size, not what stands on it.
struct BedSpec {
  GrainSoil soil;
  double length_m = 0.28;          ///< x, periodic
  double width_m = 0.20;           ///< y, periodic
  double depth_m = 0.10;           ///< undisturbed depth above the floor
  double rayleigh_fraction = 0.2;  ///< dt over the Rayleigh time of the smallest grain [-]
  std::uint64_t seed = 1;          ///< of the grains' sizes and first places
};

/// A settled bed, periodic in x and y, cut flat at z = 0 (no grain reaches above it;
/// floor at -depth), at rest, with its contact history. Plain arrays so
/// that anybody can store it.
struct Tile {
  double length_m = 0, width_m = 0, depth_m = 0;
  std::vector<float> radius_m;         ///< [n]
  std::vector<std::int32_t> position;  ///< [3 n], fixed point, x y z per grain
  std::vector<float> velocity;         ///< [3 n] m/s
  std::vector<float> spin;             ///< [3 n] rad/s
  /// Contacts: first[n+1] into the flat arrays below. Partner: id, or a
  /// negative body number.
  std::vector<std::int32_t> contact_first;
  std::vector<std::int32_t> contact_partner;
  std::vector<float> contact_history;  ///< [history words of the laws, per contact]
  double solid_fraction = 0;      ///< reached, without a layer of the largest grains at each end
  double top_solid_fraction = 0;  ///< of the top layer; 0: there is none
  /// The undisturbed plane, from which sinkage counts: that of equal mass, where the grains would
  /// end were they a continuum of the solid fraction under it. Half a grain or so below z = 0.
  double surface_m = 0;
  double coordination = 0;
  /// Of the grains while they settled; [1]: of the top layer, 0 without one.
  std::array<double, 2> preparation_friction = {}, preparation_rolling_friction = {};
  double overlap_p99_over_radius = 0;
};

/// Called now and then; return false to stop. `fraction` in [0, 1].
using ProgressFn = std::function<bool(double fraction, const std::string& stage)>;

/// Grains on a jittered lattice that fall to make the bed: so many layers of
/// nx times ny, each grain in a cell of the largest one.
struct LooseLattice {
  double pitch_m = 0;
  double nx = 0, ny = 0, layers = 0;  ///< whole numbers; doubles: they may be huge
  double solid_m3 = 0;                ///< volume of the grains that are wanted
};
/// Of the bed under its top layer and of that layer (no layers where there is none).
std::array<LooseLattice, 2> LatticesOf(const BedSpec& bed);

/// What settling takes at most: all grains of the lattice over the longest
/// time of every attempt.
Work WorkOf(const BedSpec& bed);

/// Throws SpecError for a number out of range, lengths that do not fit each
/// other (a side of less than kLeastSideGrains grains), or more work than the
/// limits allow; nothing has been allocated by then. Fields are named as in scene
/// files (soil.grains.friction, rig.bed_length_m).
void ValidateBed(const BedSpec& bed, const WorkLimits& limits = {});

/// Across a periodic side, so that no grain meets two images of another.
inline constexpr double kLeastSideGrains = 4;
/// From floor to surface: a layer at either is left out where the solid
/// fraction is measured.
inline constexpr double kLeastDepthGrains = 3;
inline constexpr double kLeastTopGrains = 3;  ///< the same of a top layer

/// Settles, cuts and relaxes a bed. Deterministic in the spec; a seed is a new
/// tile. Looks at `progress` several times a second of work. Throws as ValidateBed; SpecError
/// where a solid fraction is not met within kFractionTolerance, with the nearest that was reached;
/// std::runtime_error when stopped by the caller or the bed does not settle.
Tile PrepareBed(const BedSpec& bed, const ProgressFn& progress, const WorkLimits& limits = {});

}  // namespace grouser::dem

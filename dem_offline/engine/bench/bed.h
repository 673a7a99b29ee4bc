#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/world/world.h"

// The beds that every timing, ours and the peers', starts from.

namespace grouser::dem::bench {

/// How a bed is made: radii uniform in mean (1 +- spread), periodic in x and y,
/// a floor at z = 0. The numbers are those of coarse sand, softened so that the
/// deepest overlaps (99 %) are about 1 % of a radius.
struct BedSource {
  std::int64_t grains = 20000;
  double mean_diameter_m = 0.002;
  double spread = 0.2;  ///< of the radius over its mean [-], < 1
  double length_m = 0;  ///< 0: a square of as many diameters as the depth leaves
  double width_m = 0;
  double density_kg_per_m3 = 2600;
  double youngs_modulus_pa = 1e7;
  double poisson_ratio = 0.3;
  double restitution = 0.5;
  double friction = 0.5;
  double rolling_friction = 0.1;
  double rolling_damping = 0.3;
  double preparation_friction = 0.1;  ///< while poured: a denser bed, hardly held up by friction
  double gravity_m_per_s2 = 9.81;
  double rayleigh_fraction = 0.2;  ///< dt over the Rayleigh time of the smallest grain [-]
  std::uint64_t seed = 1;
};

/// Grains and the box they are in; what a peer reads as well.
struct Bed {
  std::string kind;  ///< "bed", "shear" or "wheel"
  double length_m = 0, width_m = 0;
  double height_m = 0;  ///< of the volume over which stresses are averaged
  double dt_s = 0;
  double shear_rate_per_s = 0;       ///< "shear" only
  BedSource source;                  ///< it was made by
  std::vector<GrainState> grains;    ///< glued ones: the plates of "shear"
  std::int64_t free_grains() const;  ///< those that move by themselves
};

/// Names of laws in the registry.
struct BenchLaws {
  std::string tangential = "mindlin";  ///< LIGGGHTS's is "mindlin_displacement"
  std::string rolling = "epsd";        ///< or "constant_torque", "none"
};

/// Grains of one material; floor and wheel of the same, so that a peer needs no
/// rigid material.
ContactModel BenchContacts(const BedSource& source, const BenchLaws& laws = {});
double BenchStep(const BedSource& source);  ///< [s]

/// Poured and at rest, in spatial order. Deterministic. Contact histories are
/// not part of a bed: it has been let settle without them again and again, so
/// that it stays quiet when somebody starts from positions alone. Throws
/// std::runtime_error when it does not come to rest.
Bed MakeBed(const BedSource& source);

/// A bed between two rough plates (its own lowest and highest grains, glued)
/// that glide past one another along x, without gravity. Made under constant
/// normal stress until the shear is steady, kept and timed at constant volume:
/// the one condition that needs no controller and that any code repeats.
/// Starts from MakeBed(source); velocities are part of the bed.
///   I = shear rate x d sqrt(density/stress_zz) = `inertial_number`
/// where stress_zz is `stress_pa` [Pa]. Deterministic.
Bed MakeShearBed(const BedSource& source, double inertial_number = 0.01, double stress_pa = 1500);

/// Cell by cell, as a simulation that sorts its grains would have them.
void SortInSpace(Bed& bed);
/// The same grains in another order, by seed.
void Shuffle(Bed& bed, std::uint64_t seed);

/// World of a bed: floor (unless "shear"), gravity, time step, contact laws.
WorldConfig BenchConfig(const Bed& bed, int threads, const BenchLaws& laws = {});
Contents BenchContents(const Bed& bed);

/// Text: `# name=value` lines, a header line, one grain a line with 17 digits.
/// Throw std::runtime_error with the file's name.
void SaveBed(const Bed& bed, const std::string& path);
Bed LoadBed(const std::string& path);

/// What two codes must agree on, of the grain-grain contacts of one instant.
struct Physics {
  double mean_overlap_over_radius = 0;  ///< over the smaller radius [-]
  double coordination = 0;              ///< contacts with grains per grain [-]
  double stress_zz_pa = 0;              ///< sum of F_z l_z over contacts, over the volume;
  double stress_xz_pa = 0;              ///<   compression positive
  std::int64_t contacts = 0;
};
/// `volume_m3`: of the stress tensor. Contacts between two glued grains do not
/// count. Forces are worked out anew from positions, velocities (half a step
/// old) and the histories kept.
Physics Measure(const World& world, double volume_m3);

double StressVolume(const Bed& bed);  ///< length x width x height [m^3]

}  // namespace grouser::dem::bench

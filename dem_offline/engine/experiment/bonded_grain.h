#pragma once

#include <array>
#include <string>
#include <vector>

#include "dem_offline/engine/contact/bond.h"
#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/experiment/experiment.h"

// Grains made of bonded spheres: what the generator makes, and what it accepts.

namespace grouser::dem::experiment {

struct BondedGrain {
  std::vector<Vec3d> centres_m;                    ///< of the fragments, about the grain's centre
  std::vector<std::array<std::int32_t, 2>> bonds;  ///< pairs of fragments
  double reach_m = 0;                              ///< distance of the centres of its longest bond
};

/// Fragments packed at random into a sphere of the grain's diameter, and bonds between the nearest
/// pairs of them, as many as are wanted: those nearer than a reach that follows.
/// Packing: random points are pushed apart, pair by pair and half of each overlap at a time, until
/// none overlap (a force-biased packing: Moscinski & Bargiel, Mol. Simul. 3 (1989) 201, without
/// its change of size). It is loose where the fragments are few; a fragment may be left without a
/// bond, as in codes that bond what their contact radii reach.
/// `e` and the group are valid. Throws SpecError naming `field` where the fragments do not fit.
BondedGrain MakeBondedGrain(const Grains& g, Random& random, const std::string& field);

/// Law of the bonds of a grain with this reach.
BondLaw BondLawOf(const Bonding& b, double reach_m);

/// Bounds of the bonds of a group for the time step [s].
double BondStep(const Grains& g, double density_kg_per_m3);

/// Throws SpecError for what cannot be: in `group` of `e`, whose fields begin with `at`.
void CheckBonding(const Experiment& e, const std::string& at, const Grains& group);
/// Places given one by one: in the box, none within another.
void CheckPlaces(const Experiment& e, const std::string& at, const Grains& group);

/// A probe of bonds, fragments or touching grains.
void CheckBondProbe(const Experiment& e, const std::string& at, const Probe& probe);

bool HasBonds(const Experiment& e);

}  // namespace grouser::dem::experiment

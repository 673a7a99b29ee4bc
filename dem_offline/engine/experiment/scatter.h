#pragma once

#include <functional>
#include <vector>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/experiment/experiment.h"

// Grains put at random in a region, without overlap.

namespace grouser::dem::experiment {

/// Axis of a region with a radius: 2 (z), in a planar box 1 (y).
inline int AxisOf(const BoxSpec& box) { return box.planar ? 1 : 2; }

/// Area of a region seen along its axis [m^2].
double ArealOf(const Region& region, const BoxSpec& box);

/// The number of grains that a group of kScattered has by its areal fraction:
/// areal_fraction A/(pi/4 <d^2>), <d^2> by number.
std::int64_t CountByArea(const Grains& grains, const BoxSpec& box);

/// Centres of spheres of these radii in the region. They begin in disturbed hexagonal layers and
/// are moved apart, pair by pair, and out of the bodies (at rest, in the box's coordinates), until
/// no overlap is above 1e-3 of the largest radius. In a planar box all lie in its plane.
/// Throws SpecError naming `field` where that is not reached in 4000 rounds: there is
/// no room. poll is called every round.
std::vector<Vec3d> Scatter(const BoxSpec& box, const Region& region,
                           const std::vector<double>& radii, const std::vector<Body>& bodies,
                           const std::string& field, Random* random,
                           const std::function<void()>& poll);

}  // namespace grouser::dem::experiment

#pragma once

#include <string>

#include "dem_offline/engine/bodies/mesh.h"

namespace grouser::dem::experiment {

/// Finds the axle of a closed mesh of near rotational symmetry (a wheel with three or more even
/// grousers is one) and puts it on the y axis, the centre of its volume in the origin. Of the
/// principal moments of inertia of the solid, two are equal within 2 % of the largest and the third
/// belongs to the axle; it points to where its largest coordinate in the file is positive, and the
/// mesh is turned there by the shortest way. Returns that in words. Throws std::invalid_argument
/// naming the moments where no pair or more than one is equal, and for open meshes.
std::string PutOnAxle(TriangleSoup* soup, const std::string& source_name);

}  // namespace grouser::dem::experiment

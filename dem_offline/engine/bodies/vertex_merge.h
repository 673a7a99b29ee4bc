#pragma once

#include <string>

#include "dem_offline/engine/bodies/mesh.h"

namespace grouser::dem {

/// Gives vertices closer than 1e-9 of the mesh's size (or 1e-15 of their
/// distance from the origin, which is rounding) one number. Throws
/// std::invalid_argument for coordinates over 1e100.
void MergeVertices(TriangleSoup* soup, const std::string& source_name);

}  // namespace grouser::dem

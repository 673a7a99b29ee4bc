#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/mesh.h"

namespace grouser::dem {

/// Faces joined into shells of one winding, in which every edge has one or two triangles.
struct JoinedFaces {
  std::vector<std::int32_t> shell_of;    ///< of each face
  std::vector<std::int64_t> open_edges;  ///< of each shell; 0: closed
  std::vector<char> turned;              ///< faces that are wound the other way now
  std::int64_t split_edges = 0;          ///< edges that had three or more triangles
};

/// The steps of RepairMesh that split edges and turn faces. Every triangle has area and three
/// vertices of its own. Splitting makes new vertices and, where both ends of an edge hold its
/// triangles together, cuts triangles in the middle of that edge.
JoinedFaces JoinFaces(TriangleSoup* soup, const std::string& source_name);

}  // namespace grouser::dem

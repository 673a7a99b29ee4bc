#pragma once

#include <cstdint>
#include <string>

#include "dem_offline/engine/bodies/mesh.h"

namespace grouser::dem {

/// Which side of the outermost closed shells of a mesh is filled.
enum class SolidSide { kInside, kOutside };

/// What RepairMesh changed, and what a mesh is then.
struct MeshReport {
  std::int64_t without_area = 0;  ///< triangles dropped
  std::int64_t doubled = 0;       ///< second copies dropped
  std::int64_t inner_walls = 0;   ///< triangles dropped between two solids that share a face
  std::int64_t split_edges = 0;   ///< edges that three or more triangles shared
  std::int64_t turned = 0;        ///< triangles wound against the rest of their shell
  std::int64_t inside_out = 0;    ///< shells turned as a whole
  // The mesh as it is now.
  std::int64_t triangles = 0, closed_shells = 0, cavities = 0, open_shells = 0, open_edges = 0;

  bool Changed() const {
    return without_area + doubled + inner_walls + split_edges + turned + inside_out > 0;
  }
  /// "5408 triangles, 1 closed shell; 3 triangles without area dropped; 1 shell inside-out turned".
  std::string Words() const;
};

/// Makes a mesh file's triangles, vertices merged (ReadMesh), into shells that Mesh takes and that
/// hold what their outlines hold. In this order:
///  - triangles without area and copies are dropped; a neighbour across the long side of a needle
///    is cut at the needle's third vertex, so that what was closed stays closed; a wall that two
///    solids share (a copy each, both rims between their outer faces) goes, which unites them;
///  - an edge of three or more triangles is split into edges of two that each have their own
///    vertices: the outlines of solids are paired within one patch, else across the solid as
///    their windings say, else across the smaller angles; sheets that end there are paired among
///    themselves, one may end alone on a solid;
///  - the faces of a shell get one winding: of an open shell that of most of them;
///  - closed shells are turned outward (kOutside: inward, a vessel), but what lies wholly inside
///    another closed shell is a cavity or a core and keeps its side; where the outer one was
///    inside-out, a shell inside it that faces outward is turned, too.
/// A mesh that needs none of that stays as it is, to the bit. Vertices that no triangle uses go.
/// Throws std::invalid_argument "SOURCE: ..." for one-sided shells (a Moebius strip), an inner wall
/// with one copy, three sheets at one edge, no triangle with area, more than 10,000 closed shells.
MeshReport RepairMesh(TriangleSoup* soup, const std::string& source_name,
                      SolidSide solid = SolidSide::kInside);

}  // namespace grouser::dem

#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/shape.h"
#include "dem_offline/engine/core/vec3d.h"

namespace grouser::dem {

/// Triangles as read: shared vertices, counter-clockwise seen from outside.
struct TriangleSoup {
  std::vector<Vec3d> vertices;  ///< [m]
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// Reads STL (binary or ASCII) or Wavefront OBJ (v, f; polygons are fanned).
/// Vertices closer than 1e-9 of the size are merged. Throws
/// std::invalid_argument naming the source, line or face number, and what was
/// expected; never reads beyond `bytes`, never allocates more than a small
/// multiple of their length.
TriangleSoup ReadMesh(const std::string& bytes, const std::string& source_name);

/// A triangle mesh ready for contact. Smooth surfaces: triangles joined by
/// edges that bend by less than `smooth_angle_rad`. A piece whose every edge
/// has two triangles is a solid; any other piece is a thin sheet that pushes to
/// the side where the grain is (as a disc does), its distance never negative.
/// One contact per smooth surface, so a channel whose bottom is rounded holds a
/// grain at its nearest wall only. Solids that touch should be united first.
class Mesh {
 public:
  /// Throws std::invalid_argument "mesh: face 17 is degenerate ...", for
  /// indices out of range, non-finite vertices, edges of more than two
  /// triangles, neighbours wound against each other, or no triangle at all.
  /// Faces and vertices are counted from 0.
  explicit Mesh(TriangleSoup soup, double smooth_angle_rad = 0.5);

  /// As SurfacePoints of shape.h: the nearest point of each smooth surface
  /// where it is a local minimum of the distance to the whole mesh. From inside
  /// a solid (centre of the grain past the surface): its one nearest point.
  int Nearest(Vec3f p, float reach, SurfacePoint* out, int capacity) const;
  float LowerBound(Vec3f p) const;         ///< distance to the bounding box [m]
  double reach() const { return reach_; }  ///< largest vertex distance from the origin [m]
  int surfaces() const { return surfaces_; }
  const TriangleSoup& soup() const { return soup_; }

  /// Everything stays within rho <= radius about y, low <= y <= high [m].
  struct Hull {
    float radius = 0, low = 0, high = 0;
  };
  const Hull& hull() const { return hull_; }
  bool closed() const;  ///< every piece is a solid

 private:
  struct Box {
    Vec3d low, high;
  };
  /// Of the search tree. Inner nodes: children at `left` and `left + 1`.
  struct Node {
    Box box;
    std::int32_t left = 0, first = 0, count = 0;  ///< count > 0: leaf of ordered_ triangles
    std::int32_t surface = -1;                    ///< of all triangles below; -1: several
  };
  /// What of a triangle a nearest point lies on: corner 0-2, edge 3-5 (from
  /// corner e - 3 to the next), face 6.
  static constexpr int kFace = 6;
  struct Best {
    std::int32_t surface, face;
    int feature;
    double square;  ///< of the distance
    double side;    ///< > 0: p is in front of the surface there
    Vec3d foot;
    bool kept;
  };
  struct Found {
    static constexpr int kMost = 24;
    Best at[kMost];
    int count = 0;
  };

  void CheckVertices() const;
  void MakeNormals();
  void JoinEdges(double smooth_angle_rad);
  void NumberSurfaces(std::vector<std::int32_t>* smooth, std::vector<std::int32_t>* piece);
  void MakeCorners();
  void MakeTree();
  void Split(std::int32_t node, std::int32_t first, std::int32_t count);

  const Vec3d& Corner(std::int32_t face, int k) const {
    return soup_.vertices[static_cast<std::size_t>(soup_.triangles[face][k])];
  }
  int ClosestFeature(std::int32_t face, const Vec3d& p, Vec3d* foot) const;
  void Look(std::int32_t face, const Vec3d& p, double reach2, Found* found) const;
  double Side(const Best& best, const Vec3d& p) const;
  bool IsLowest(const Best& best, const Vec3d& p, double tolerance) const;
  void KeepVisible(const Vec3d& p, double tolerance, Found* found) const;
  bool Hopeless(const Node& node, const Vec3d& p, double reach2, const Found& found) const;
  SurfacePoint ToPoint(const Best& best, const Vec3d& p) const;

  TriangleSoup soup_;
  std::vector<std::int32_t> surface_of_;
  int surfaces_ = 0;
  double reach_ = 0;
  Hull hull_;
  std::vector<Vec3d> normal_;                       ///< of faces
  std::vector<std::array<std::int32_t, 3>> other_;  ///< face beyond each edge; -1: none
  std::vector<std::int32_t> piece_of_surface_;
  std::vector<char> piece_closed_;
  std::vector<Vec3d> corner_normal_;                ///< angle-weighted, of vertices
  std::vector<std::int32_t> spoke_first_, spokes_;  ///< neighbours of each vertex
  std::vector<Node> nodes_;
  std::vector<std::int32_t> ordered_;  ///< faces, as the tree's leaves name them
};

}  // namespace grouser::dem

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dem_offline/engine/core/vec3.h"

namespace grouser::dem {

/// Nearest point of a surface as seen from a point p.
struct SignedDistance {
  float distance;  ///< [m], negative inside the solid
  Vec3f normal;    ///< unit, outward from the solid at the nearest point
};

/// One convex (or hollow) part of a rigid body, in body coordinates. Solid
/// parts push grains outwards, hollow ones keep them inside.
enum class PartKind : std::int32_t {
  kHalfSpace,       ///< solid below: n = axis z of the part, through `centre`
  kCylinder,        ///< solid, axis y: radius a, half length b
  kHollowCylinder,  ///< grains live inside: axis y, radius a, half length b; open ends. Wall
                    ///< thickness c; 0: all beyond the radius is solid (a bore in a block)
  kDisc,            ///< thin, normal z, radius a; pushes to the side where the grain is
  kAnnulus,         ///< thin, normal z, radii a (inner) < b (outer)
  kBox,             ///< solid, half sizes a, b, c along x, y, z
  kPrism,           ///< solid trapezoid: z from 0 to c; half size along x goes from a (z = 0)
                    ///< to d (z = c); half size along y: b. A tooth.
  kSphere,          ///< solid, radius a (= b = c)
};

struct Part {
  PartKind kind = PartKind::kHalfSpace;
  float centre[3] = {0, 0, 0};
  float axes[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< rows: the part's x, y, z in body coordinates
  float a = 0, b = 0, c = 0, d = 0;
};

class Mesh;  // bodies/mesh.h

/// What a rigid body looks like. Parts are numbered by their place; a grain
/// keeps one contact and one history per part, and per smooth surface of the
/// mesh. Equal teeth or spheres that sit evenly around the axle (y) form a ring, of which
/// only those within reach are looked at.
struct Shape {
  std::vector<Part> parts;
  struct Ring {
    int first = 0, count = 0;  ///< parts [first, first + count), evenly spaced about y
    float outer_radius = 0;    ///< [m] nothing of the ring reaches beyond
    float half_width = 0;
  };
  std::vector<Ring> rings;
  std::shared_ptr<const Mesh> mesh;
  /// Turning about y moves no surface (no teeth, no mesh): lists need no
  /// rebuild while it spins.
  bool round = true;
  /// No point of the body is further from its origin [m]; infinite for half
  /// spaces, hollow cylinders not counted as infinite.
  float reach = 0;
};

/// One place where a grain may touch.
struct SurfacePoint {
  std::int32_t key;  ///< part number, or 1000000 + smooth surface of the mesh
  float distance;    ///< from the grain's CENTRE to the surface [m], negative inside
  Vec3f normal;      ///< unit, outward, body frame
  bool rim;          ///< radial face of a wheel (not a side, tooth or mesh)
};
inline constexpr int kMostSurfacePoints = 6;
inline constexpr std::int32_t kMeshKey = 1000000;

/// All surface points nearer than `reach` to the body-frame point p, in rising
/// order of key, at most one per part and per smooth surface, and none twice
/// where parts or surfaces share the same nearest point (to 1e-4 of reach and
/// with normals that agree), and none that another part covers (its nearest
/// point lies on or in that part, which is then nearer). Returns how many, at
/// most kMostSurfacePoints: the nearest ones.
int SurfacePoints(const Shape& shape, Vec3f p, float reach, SurfacePoint* out);

/// A lower bound of the distance from p to anything the body may bring there
/// by turning about y; for choosing neighbours [m].
float SweptDistance(const Shape& shape, Vec3f p);

/// The same for a body that does not turn about its y: tighter for floors,
/// boxes and meshes [m].
float StillDistance(const Shape& shape, Vec3f p);

// Builders. Lengths in metres; throw std::invalid_argument by field name.
Shape HalfSpace(const double normal[3]);  ///< through the origin
Shape SmoothWheel(double radius_m, double width_m);
Shape HollowCylinder(double radius_m, double length_m, double wall_m = 0);  ///< 0: a bore
Shape Disc(double radius_m);
Shape Annulus(double inner_radius_m, double outer_radius_m);
Shape Box(double x_m, double y_m, double z_m);  ///< full sizes
Shape Sphere(double radius_m);
/// Equal spheres evenly spaced about y, their centres in a circle about the origin, the first at
/// +z.
Shape SphereRing(double sphere_radius_m, double ring_radius_m, int count);

/// Bars on a wheel: grousers, teeth or lugs.
struct Tread {
  int count = 0;
  double height_m = 0;                               ///< beyond the rim
  double root_thickness_m = 0, tip_thickness_m = 0;  ///< along the rim; tip 0: as the root
  double width_m = 0;                                ///< along the axle; 0: the whole wheel
  double offset_m = 0;                               ///< of the bar's middle along the axle
  double lean_rad = 0;   ///< of the bar in the tangent plane (chevron lugs)
  double phase_rad = 0;  ///< angle of the first bar about y, from +z towards +x
};
/// Rim, closed sides (part 0), and every bar a convex part of its own. Bars
/// begin inside the rim, so that no gap opens under their ends.
Shape TreadedWheel(double radius_m, double width_m, const std::vector<Tread>& treads);
Shape FromMesh(std::shared_ptr<const Mesh> mesh);

}  // namespace grouser::dem

#pragma once

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/experiment/experiment.h"

// Bodies out of parts: shape, mass, lowest point.

namespace grouser::dem::experiment {

/// Mass, centre and tensor of inertia about the centre (xx, yy, zz, xy, xz, yz), per density.
struct MassProperties {
  double volume_m3 = 0;
  Vec3d centre_m = {0, 0, 0};
  double tensor_m5[6] = {0, 0, 0, 0, 0, 0};
};

/// The solid of revolution of a closed polygon (radius, z), counter-clockwise, about z.
TriangleSoup Revolve(const std::vector<std::array<double, 2>>& profile, int segments = 96);

/// Exact, of closed triangle meshes: sums over tetrahedra with the origin.
MassProperties MassOfMesh(const TriangleSoup& soup);
/// Sum over the parts, taken as not overlapping; treads of wheels and thin discs weigh nothing.
/// Throws SpecError naming `field` for a part without a volume (disc, annulus, open mesh) where
/// there is no other.
MassProperties MassOf(const std::vector<PartSpec>& parts, const std::string& field);

/// Throws SpecError naming the part below `field` for what cannot be built.
Shape ShapeOf(const std::vector<PartSpec>& parts, const std::string& field);
/// The shape seen from another body frame: x_old = origin + turn x_new.
Shape Moved(const Shape& shape, const Vec3d& origin_m, const Quatd& turn);

/// A body of a world. One that moves freely has its origin in the centre of mass and principal
/// axes; x_file = centre + turn x_body are then the body coordinates of its file.
struct BuiltBody {
  Body body;
  Vec3d centre_m = {0, 0, 0};
  Quatd turn = {1, 0, 0, 0};
};
/// number: of the material in the world. Throws SpecError as ShapeOf, and where a body that moves
/// freely has no mass.
BuiltBody BuildBody(const BodySpec& spec, const Material& material, int number, bool moves_freely,
                    const std::string& field);

/// Height of the lowest point of a body [m]; of half spaces and bores: of their origin.
double LowestPoint(const Body& body);

}  // namespace grouser::dem::experiment

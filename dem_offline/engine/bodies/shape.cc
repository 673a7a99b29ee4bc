// Where a grain may touch a body, and how near the body may come.
#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/bodies/shape_body.h"

namespace grouser::dem {

ShapeView ViewOf(const Shape& shape) {
  return {shape.parts.data(), shape.rings.data(), static_cast<std::int32_t>(shape.parts.size()),
          static_cast<std::int32_t>(shape.rings.size())};
}

int SurfacePoints(const Shape& shape, Vec3f p, float reach, SurfacePoint* out) {
  SurfacePoint of_mesh[kMostSurfacePoints];
  const int n = shape.mesh ? shape.mesh->Nearest(p, reach, of_mesh, kMostSurfacePoints) : 0;
  return shape_body::Points(ViewOf(shape), p, reach, of_mesh, n, out);
}

float SweptDistance(const Shape& shape, Vec3f p) {
  float nearest = shape_body::Swept(ViewOf(shape), p);
  if (shape.mesh) {
    const Mesh::Hull& hull = shape.mesh->hull();
    nearest = Min(nearest, shape_body::ToHull(p, hull.radius, hull.low, hull.high));
  }
  return shape_body::Slacken(nearest);
}

float StillDistance(const Shape& shape, Vec3f p) {
  float nearest = shape_body::Still(ViewOf(shape), p);
  if (shape.mesh) nearest = Min(nearest, shape.mesh->LowerBound(p));
  return shape_body::Slacken(nearest);
}

}  // namespace grouser::dem

// The contact queries of the step loop allocate nothing.
#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/count_allocations.h"
#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

TEST(SurfacePoints, AllocateNothing) {
  const auto mesh = std::make_shared<const Mesh>(Torus(24, 15, 0.6, [](double) { return 0.25; }));
  Tread bars;
  bars.count = 20, bars.height_m = 0.02, bars.root_thickness_m = 0.01;
  const Shape shapes[2] = {FromMesh(mesh), TreadedWheel(0.3, 0.2, {bars})};
  Random random(5);
  long points = 0;
  const long before = g_allocations;
  for (int k = 0; k < 1000; ++k) {
    const Vec3f p = random.Point(0.6);
    for (const Shape& shape : shapes) {
      SurfacePoint out[kMostSurfacePoints];
      points += SurfacePoints(shape, p, 0.1f, out);
      points += SweptDistance(shape, p) < StillDistance(shape, p);
    }
  }
  EXPECT_EQ(g_allocations, before);
  EXPECT_GT(points, 500);
}

}  // namespace
}  // namespace grouser::dem

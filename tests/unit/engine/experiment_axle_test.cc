// The axle of a mesh, found.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/mesh_axle.h"
#include "dem_offline/engine/experiment/shapes.h"

namespace grouser::dem::experiment {
namespace {

std::string AxleComplaint(TriangleSoup soup) {
  try {
    PutOnAxle(&soup, "m.stl");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(MeshAxle, AWheelAnywhereComesBackToItsAxle) {
  TriangleSoup wheel = Revolve({{0.3, -0.1}, {0.5, -0.1}, {0.6, 0}, {0.5, 0.1}, {0.3, 0.1}}, 36);
  for (Vec3d& v : wheel.vertices) {  // three lobes: no fold of 90 degrees helps
    const double s = 1 + 0.1 * std::cos(3 * std::atan2(v[1], v[0]));
    v = {s * v[0], s * v[1], v[2]};
  }
  const double volume = MassOfMesh(wheel).volume_m3;
  for (const Quatd& turn : {Quatd{1, 0, 0, 0}, Quatd{1, 1, 0, 0}, Quatd{0.3, -0.2, 0.9, 0.4},
                            Quatd{0, 1, 0, 0}, Quatd{-0.5, 0.1, 0.2, 0.8}}) {
    TriangleSoup got = wheel;
    for (Vec3d& v : got.vertices) v = Add({7, -3, 2}, MatrixOf(Unit(turn)) * v);
    const std::string said = PutOnAxle(&got, "m.stl");
    EXPECT_EQ(said.find("axle found along ("), 0u) << said;
    for (std::size_t k = 0; k < wheel.vertices.size(); ++k) {
      const Vec3d &v = got.vertices[k], &w = wheel.vertices[k];
      ASSERT_NEAR(std::abs(v[1]), std::abs(w[2]), 1e-9) << said;
      ASSERT_NEAR(std::hypot(v[0], v[2]), std::hypot(w[0], w[1]), 1e-9) << said;
    }
    EXPECT_NEAR(MassOfMesh(got).volume_m3, volume, 1e-9);  // turned, not mirrored
  }
}

TEST(MeshAxle, RefusesNamingTheMoments) {
  const auto box = [](double x, double y, double z) {
    TriangleSoup out = Revolve({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 4);  // corners on the axes
    for (Vec3d& v : out.vertices) v = {0.5 * x * (v[0] - v[1]), 0.5 * y * (v[0] + v[1]), z * v[2]};
    return out;
  };
  EXPECT_NE(AxleComplaint(box(1, 1, 1)).find("moments as 1, 1, 1, expected exactly two"),
            std::string::npos);
  const std::string said = AxleComplaint(box(1, 2, 3));
  EXPECT_NE(said.find("moments as 1, 0.7692, 0.3846"), std::string::npos) << said;
  EXPECT_EQ(AxleComplaint(box(1, 1, 3)), "accepted");
  TriangleSoup open = box(1, 1, 3);
  open.triangles.pop_back();
  EXPECT_NE(AxleComplaint(open).find("an open mesh"), std::string::npos);
}

}  // namespace
}  // namespace grouser::dem::experiment

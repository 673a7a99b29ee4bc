// The axle of a mesh from its tensor of inertia.
#include "dem_offline/engine/experiment/mesh_axle.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/shapes.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kEqual = 0.02;  // of the largest moment

std::string Triple(const char* format, const Vec3d& v) {
  std::string out;
  for (const double x : v) {
    char word[32];
    std::snprintf(word, sizeof word, format, std::abs(x) < 1e-12 ? 0.0 : x);
    out += (out.empty() ? "" : ", ") + std::string(word);
  }
  return out;
}

}  // namespace

std::string PutOnAxle(TriangleSoup* soup, const std::string& name) {
  if (!Mesh(*soup).closed()) {
    throw std::invalid_argument(name +
                                ": got an open mesh, expected closed shells: the axle is "
                                "found from the moments of their volume");
  }
  MassProperties mass = MassOfMesh(*soup);
  if (!(mass.volume_m3 > 0)) {  // a vessel: of what it holds
    TriangleSoup inner = *soup;
    for (auto& t : inner.triangles) std::swap(t[1], t[2]);
    mass = MassOfMesh(inner);
  }
  const double* m = mass.tensor_m5;
  double tensor[3][3] = {{m[0], m[3], m[4]}, {m[3], m[1], m[5]}, {m[4], m[5], m[2]}};
  const Mat3d axes = MatrixOf(ToPrincipalAxes(tensor));
  const Vec3d moments = {tensor[0][0], tensor[1][1], tensor[2][2]};
  const double largest = *std::max_element(moments.begin(), moments.end());
  if (!(largest > 0)) throw std::invalid_argument(name + ": got no volume, expected a solid");
  const std::string shares = "principal moments as " + Triple("%.4g", Scale(1 / largest, moments));
  int axle = -1, pairs = 0;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(moments[(k + 1) % 3] - moments[(k + 2) % 3]) > kEqual * largest) continue;
    axle = k;
    ++pairs;
  }
  if (pairs != 1) {
    throw std::invalid_argument(name + ": got " + shares +
                                ", expected exactly two equal within 2 %" +
                                ": the third is the axle's; else give x, y or z");
  }
  Vec3d along = {axes.m[axle], axes.m[3 + axle], axes.m[6 + axle]};
  const auto further = [](double a, double b) { return std::abs(a) < std::abs(b); };
  if (*std::max_element(along.begin(), along.end(), further) < 0) along = Scale(-1, along);
  // The shortest turn that takes `along` to y.
  const Mat3d turn = MatrixOf(Unit({1 + along[1], -along[2], 0, along[0]}));
  for (Vec3d& v : soup->vertices) v = turn * Sub(v, mass.centre_m);
  return "axle found along (" + Triple("%.6g", along) + ") of the file through (" +
         Triple("%.6g", mass.centre_m) + "), " + shares;
}

}  // namespace grouser::dem::experiment

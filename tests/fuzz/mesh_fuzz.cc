// Any bytes are a mesh or refused, as they are and repaired, and a mesh answers every query
// soundly.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

#include "dem_offline/engine/bodies/mesh_repair.h"

namespace {

using grouser::dem::Mesh;
using grouser::dem::MeshReport;
using grouser::dem::SurfacePoint;
using grouser::dem::Vec3f;

void Query(const Mesh& mesh, Vec3f p, float reach) {
  constexpr int kCapacity = 4;
  SurfacePoint out[kCapacity];
  const int n = mesh.Nearest(p, reach, out, kCapacity);
  if (n < 0 || n > kCapacity || !(mesh.LowerBound(p) >= 0)) std::abort();
  for (int i = 0; i < n; ++i) {
    const Vec3f m = out[i].normal;
    const float length = std::sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
    if (!(std::abs(length - 1) < 1e-4f)) std::abort();
    if (!(std::abs(out[i].distance) <= reach)) std::abort();
    if (i > 0 && out[i].key <= out[i - 1].key) std::abort();
  }
}

void QueryAround(const Mesh& mesh) {
  const auto& vertices = mesh.soup().vertices;
  const auto reach = static_cast<float>(mesh.reach());
  for (std::size_t v = 0; v < vertices.size() && v < 8; ++v) {
    const Vec3f p = {static_cast<float>(vertices[v][0]), static_cast<float>(vertices[v][1]),
                     static_cast<float>(vertices[v][2])};
    Query(mesh, p, reach);
    Query(mesh, {p.x, p.y, p.z + 0.1f * reach}, 0.2f * reach);
    Query(mesh, {0.5f * p.x, 0.5f * p.y, 0.5f * p.z}, reach);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    grouser::dem::TriangleSoup soup = grouser::dem::ReadMesh(bytes, "fuzz");
    try {
      QueryAround(Mesh(soup));
    } catch (const std::invalid_argument&) {  // refused as it is: as it should be
    }
    const MeshReport report = grouser::dem::RepairMesh(&soup, "fuzz");
    try {
      const Mesh mesh(soup);
      if (mesh.closed() != (report.open_shells == 0)) std::abort();
      QueryAround(mesh);
    } catch (const std::invalid_argument& error) {
      // Too large or, cut in two, too thin; never three at an edge or wound against each other.
      const std::string why = error.what();
      if (why.find("third") != why.npos || why.find("wound") != why.npos) std::abort();
    }
  } catch (const std::invalid_argument&) {  // refused: as it should be
  }
  return 0;
}

// Meshes that are no surfaces, and lists that overflow.
#include <stdexcept>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

template <class F>
std::string Complaint(F&& f) {
  try {
    f();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

void BadMeshes(Rows& rows) {
  TriangleSoup soup;
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0, 0}};
  soup.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 1, 4}};
  std::string said = Complaint([&] { Mesh m(soup); });
  rows.Holds("a mesh whose face 2 has no area is refused with the number of the face",
             said.find("face 2") != std::string::npos, said);
  soup.triangles = {{0, 1, 2}, {1, 3, 9}};
  said = Complaint([&] { Mesh m(soup); });
  rows.Holds("a mesh whose face 1 names a vertex that is not there is refused likewise",
             said.find("face 1") != std::string::npos, said);
  said =
      Complaint([] { ReadMesh("solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0", "cut.stl"); });
  rows.Holds("an STL file that breaks off is refused with its name",
             said.find("cut.stl") != std::string::npos, said);
}

void Overflow(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.1;
  const std::vector<GrainState> grains = Grid(spec, 0, 0.1, 0, 0.1, 0, 400);
  std::uint64_t hashes[2], regrown[2];
  int k = 0;
  for (const std::int64_t slots : {0, 32}) {
    WorldConfig c = spec.Config();
    c.first_pairs = slots;
    World world(c, Scene(grains, {Floor()}));
    RunOrThrow(world, 3000);
    hashes[k] = world.Hash();
    regrown[k++] = world.regrowths();
  }
  rows.Holds("neighbour lists too small to begin with are regrown", regrown[1] > 0,
             Format("%d times", static_cast<int>(regrown[1])));
  rows.Holds("and the run ends bitwise equal to one with ample lists", hashes[0] == hashes[1],
             Format("%016lx", static_cast<unsigned long>(hashes[1])));
}

}  // namespace

Cases MeshCases() {
  return {{"bad_meshes", Level::kQuick, BadMeshes}, {"list_overflow", Level::kQuick, Overflow}};
}

}  // namespace grouser::dem::verify

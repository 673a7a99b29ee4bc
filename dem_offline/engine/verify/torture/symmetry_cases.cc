// Mirrored, shifted and turned scenes (docs/engine.md, "Determinism"): forces of one step
// to 1e-5, of 100 steps to 1e-3.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/torture/compare.h"

namespace grouser::dem::verify {
namespace {

/// A square bed, loosely settled, its grains set moving and spinning.
struct Restless {
  BedSpec spec;
  std::vector<GrainState> grains;
  Restless() {
    spec.length_m = spec.width_m = 0.12;
    grains = Steadied(Settle(spec), spec.Config().frame);
    Random random(11);
    for (GrainState& g : grains) {
      for (double* v : {&g.v_x, &g.v_y, &g.v_z}) *v = random.Between(-0.005, 0.005);
      for (double* w : {&g.w_x, &g.w_y, &g.w_z}) *w = random.Between(-0.5, 0.5);
    }
  }
};

std::vector<GrainState> Image(const std::vector<GrainState>& grains, const Transform& t,
                              const Vec3d& shift) {
  std::vector<GrainState> out = grains;
  const double axial = t.Determinant();
  for (GrainState& g : out) {
    const Vec3d x = t({g.x_m, g.y_m, g.z_m}), v = t({g.v_x, g.v_y, g.v_z}),
                w = t({g.w_x, g.w_y, g.w_z});
    g.x_m = x[0] + shift[0], g.y_m = x[1] + shift[1], g.z_m = x[2] + shift[2];
    g.v_x = v[0], g.v_y = v[1], g.v_z = v[2];
    g.w_x = axial * w[0], g.w_y = axial * w[1], g.w_z = axial * w[2];
  }
  return out;
}

void Compare(Rows& rows, const char* name, const Transform& t, const Vec3d& shift) {
  const Restless bed;
  const WorldConfig c = bed.spec.Config();
  World a(c, Scene(bed.grains, {Floor()}));
  World b(c, Scene(Image(bed.grains, t, shift), {Floor(shift[2])}));
  RunOrThrow(a, 1);
  RunOrThrow(b, 1);
  const double once = ForceDistance(a, b, t);
  rows.Holds(Format("%s bed: forces after one step equal to 1e-5 of the largest", name),
             once < 1e-5, once);
  RunOrThrow(a, 99);
  RunOrThrow(b, 99);
  const double later = ForceDistance(a, b, t);
  rows.Holds(Format("%s bed: forces after 100 steps equal to 1e-3 of the largest", name),
             later < 1e-3, later);
}

void Mirrored(Rows& rows) {
  Compare(rows, "mirrored in y", {{1, 0, 0, 0, -1, 0, 0, 0, 1}}, {0, 0, 0});
}
void Shifted(Rows& rows) { Compare(rows, "shifted", Identity(), {0.0371, 0.0817, 0.25}); }
void Turned(Rows& rows) {
  Compare(rows, "turned by 90 degrees", {{0, -1, 0, 1, 0, 0, 0, 0, 1}}, {0, 0, 0});
}

}  // namespace

Cases SymmetryCases() {
  return {{"mirrored", Level::kQuick, Mirrored},
          {"shifted", Level::kQuick, Shifted},
          {"turned", Level::kQuick, Turned}};
}

}  // namespace grouser::dem::verify

// Far away, weightless, alone, hardly moving; mirrored, shifted and turned.
#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

// Scenes far away, shifted, turned or mirrored (docs/engine.md, "Determinism"): forces of
// one step to 1e-5, of 100 steps to 1e-3.

constexpr Mat3d kIdentity = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};

/// -1 for a mirror: spins and moments are axial and change their sign with it.
double Determinant(const Mat3d& t) {
  const double* m = t.m;
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// Largest distance of a grain's force (and moment over radius) in `b` from the one
/// in `a` turned or mirrored by t, over the largest force in `a`.
double ForceDistance(const World& a, const World& b, const Mat3d& t) {
  const double axial = Determinant(t);
  double largest = 0, worst = 0;
  for (std::int32_t id = 0; id < a.count(); ++id) {
    const GrainLoad &f = a.LoadOf(id), &g = b.LoadOf(id);
    const Vec3d force = t * Vec3d{f.fx, f.fy, f.fz};
    const Vec3d moment = Scale(axial, t * Vec3d{f.tx, f.ty, f.tz});
    largest = std::max<double>(largest, std::hypot(f.fx, f.fy, f.fz));
    worst = std::max(worst, std::hypot(force[0] - g.fx, force[1] - g.fy, force[2] - g.fz));
    const double turning = std::hypot(moment[0] - g.tx, moment[1] - g.ty, moment[2] - g.tz);
    worst = std::max(worst, turning / a.StateOf(id).radius_m);
  }
  return worst / largest;
}

void ExpectAlike(Rows& rows, const std::string& what, World& a, World& b, const Mat3d& t) {
  RunOrThrow(a, 1);
  RunOrThrow(b, 1);
  rows.Below(what + ": forces after one step equal to 1e-5 of the largest", 1e-5,
             ForceDistance(a, b, t));
  RunOrThrow(a, 99);
  RunOrThrow(b, 99);
  rows.Below(what + ": forces after 100 steps equal to 1e-3 of the largest", 1e-3,
             ForceDistance(a, b, t));
}

void FarAway(Rows& rows) {
  const BedSpec spec;
  const std::vector<GrainState> here = Steadied(Settle(spec), spec.Config().frame);
  const double shift = 1e4;
  std::vector<GrainState> there = here;
  for (GrainState& g : there) g.x_m += shift, g.y_m += shift, g.z_m += shift;
  WorldConfig c = spec.Config();
  World near(c, Scene(here, {Floor()}));
  c.origin_m = {shift, shift, shift};
  World far(c, Scene(there, {Plane({0, 0, 1}, c.origin_m)}));
  ExpectAlike(rows, "a bed 10 km from the origin", near, far, kIdentity);
}

void Gravities(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.1;
  const std::vector<GrainState> bed = Settle(spec);
  WorldConfig c = spec.Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  World weightless(c, Scene(bed, {Floor()}));
  RunOrThrow(weightless, std::llround(0.1 / c.dt_s));
  const double kinetic = weightless.KineticEnergy();
  RunOrThrow(weightless, std::llround(0.4 / c.dt_s));
  rows.Holds("a bed without gravity drifts apart and never gains energy",
             kinetic > 0 && weightless.KineticEnergy() <= kinetic * (1 + 1e-6),
             Format("%.3g J, then %.3g J", kinetic, weightless.KineticEnergy()));
  c.gravity_m_per_s2 = {0, 0, -1.62};
  World lunar(c, Scene(bed, {Floor()}));
  RunOrThrow(lunar, std::llround(1.5 / c.dt_s));
  double weight = 0;
  for (std::int64_t i = 0; i < lunar.count(); ++i) weight += 1.62 * lunar.grains()[i].mass;
  const double share = -lunar.wrench(0).fz / weight;
  rows.Holds("a bed under lunar gravity: the floor carries its weight to 1 %",
             std::abs(share - 1) < 0.01, share);
  rows.Below("and it is at rest: kinetic energy under 1e-6 of sum m g d", 1e-6,
             Restlessness(lunar));
}

void OneOrNone(Rows& rows) {
  BedSpec spec;
  const WorldConfig c = spec.Config();
  World none(c, Scene({}, {Floor()}));
  const StepFault fault = none.Run(1000);
  rows.Holds("no grain at all: 1000 steps, no fault, zero energy",
             fault == StepFault::kNone && none.KineticEnergy() == 0 && none.MeanContacts() == 0,
             none.KineticEnergy());
  World one(c, Scene({{0.1, 0.05, 0.03, 0.005, 2290, 0.1, 0, 0}}, {Floor()}));
  RunOrThrow(one, std::llround(2.0 / c.dt_s));
  const GrainState g = one.StateOf(0);
  const double weight = SphereMass(0.005, 2290) * 9.81;
  const double carried = -one.wrench(0).fz / weight;
  rows.Holds("one grain dropped on a floor comes to rest and the floor carries it to 0.1 %",
             std::abs(carried - 1) < 1e-3 && std::hypot(g.v_x, g.v_y, g.v_z) < 1e-5, carried);
}

void SlowCreep(Rows& rows) {
  WorldConfig c = Cell(Model({}, {1e7, 0.3}, {}), 0.3, 1e-4);
  World free(c, {{0.1, 0.1, 0, 0.005, 2500, 1e-6, 0, 0}});
  RunOrThrow(free, 1000000);
  const double way = free.StateOf(0).x_m - 0.1;
  rows.Holds("a grain creeps at 1e-6 m/s for 100 s: 0.1 mm to 0.1 %, it never stalls",
             std::abs(way / 1e-4 - 1) < 1e-3, Format("%.6g m", way));
  World far(c, {{0.1, 0.1, 0.59, 0.005, 2500, 0, 0, 1e-7}});
  RunOrThrow(far, 1000000);
  const double rise = far.StateOf(0).z_m - 0.59;
  rows.Holds("at 1e-7 m/s far up in z: 10 um to 1 %", std::abs(rise / 1e-5 - 1) < 1e-2,
             Format("%.6g m", rise));
}

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

std::vector<GrainState> Image(const std::vector<GrainState>& grains, const Mat3d& t,
                              const Vec3d& shift) {
  std::vector<GrainState> out = grains;
  const double axial = Determinant(t);
  for (GrainState& g : out) {
    const Vec3d x = Add(t * Vec3d{g.x_m, g.y_m, g.z_m}, shift), v = t * Vec3d{g.v_x, g.v_y, g.v_z},
                w = Scale(axial, t * Vec3d{g.w_x, g.w_y, g.w_z});
    g.x_m = x[0], g.y_m = x[1], g.z_m = x[2];
    g.v_x = v[0], g.v_y = v[1], g.v_z = v[2];
    g.w_x = w[0], g.w_y = w[1], g.w_z = w[2];
  }
  return out;
}

void Compare(Rows& rows, const char* name, const Mat3d& t, const Vec3d& shift) {
  const Restless bed;
  const WorldConfig c = bed.spec.Config();
  World a(c, Scene(bed.grains, {Floor()}));
  World b(c, Scene(Image(bed.grains, t, shift), {Floor(shift[2])}));
  ExpectAlike(rows, Format("%s bed", name), a, b, t);
}

void Mirrored(Rows& rows) {
  Compare(rows, "mirrored in y", {{1, 0, 0, 0, -1, 0, 0, 0, 1}}, {0, 0, 0});
}
void Shifted(Rows& rows) { Compare(rows, "shifted", kIdentity, {0.0371, 0.0817, 0.25}); }
void Turned(Rows& rows) {
  Compare(rows, "turned by 90 degrees", {{0, -1, 0, 1, 0, 0, 0, 0, 1}}, {0, 0, 0});
}

}  // namespace

Cases PlaceCases() {
  return {{"far_from_origin", Level::kQuick, FarAway},
          {"gravities", Level::kQuick, Gravities},
          {"one_or_none", Level::kQuick, OneOrNone},
          {"slow_creep", Level::kQuick, SlowCreep},
          {"mirrored", Level::kQuick, Mirrored},
          {"shifted", Level::kQuick, Shifted},
          {"turned", Level::kQuick, Turned}};
}

}  // namespace grouser::dem::verify

// Wheels where wheel tests go wrong.
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

WheelTestSpec SmallSpec() {
  WheelTestSpec s;
  s.soil.youngs_modulus_pa = 2e6;
  s.soil.rolling_friction = 0.2;
  s.soil.sizes = {{0.010, 0.5}, {0.012, 0.5}};
  s.wheel.radius_m = 0.04;
  s.wheel.width_m = 0.04;
  s.rig.bed_length_m = 0.20;
  s.rig.bed_width_m = 0.10;
  s.rig.bed_depth_m = 0.05;
  s.rig.max_time_s = 1.0;
  s.state.load_n = 6;
  return s;
}

const Tile& SmallTile() {
  static const Tile tile = PrepareBed(BedOf(SmallSpec()), nullptr);
  return tile;
}

double Mean(const WheelTestResult& r, const std::string& name) {
  for (const auto& o : r.outputs) {
    if (o.name == name) return o.mean;
  }
  throw std::runtime_error("no output " + name);
}

bool Ran(const WheelTestResult& r) {
  bool finite = r.status == RunStatus::kSteady || r.status == RunStatus::kUnsteady;
  for (const auto& o : r.outputs) finite = finite && std::isfinite(o.mean);
  return finite && !r.outputs.empty();
}

std::string Words(const WheelTestResult& r) {
  std::string out = NameOf(r.status);
  if (!r.reason.empty()) out += " (" + r.reason + ")";
  if (!r.outputs.empty()) {
    out += Format(", f_x %.2f, f_y %.2f, f_z %.2f N, torque %.3f N m", Mean(r, "f_x"),
                  Mean(r, "f_y"), Mean(r, "f_z"), Mean(r, "torque"));
  }
  return out;
}

WheelTestResult At(double slip, double degrees) {
  WheelTestSpec s = SmallSpec();
  s.state.slip = slip;
  s.state.attack_angle_rad = degrees * M_PI / 180;
  return RunWheel(s, SmallTile());
}

bool Carries(const WheelTestResult& r, double load) {
  return std::abs(Mean(r, "f_z") - load) < 0.15 * load;
}
bool Booked(const WheelTestResult& r) {
  return std::abs(r.energy.residual_j) < 0.02 * std::abs(r.energy.input_j);
}

void HardStates(Rows& rows) {
  const WheelTestResult locked = At(-1, 0);
  rows.Holds("locked wheel, towed: carries the load, brakes, energy booked to 2 %",
             Ran(locked) && Carries(locked, 6) && Mean(locked, "f_x") < 0 && Booked(locked),
             Words(locked));
  for (const double slip : {0.95, 1.0}) {
    const WheelTestResult r = At(slip, 0);
    rows.Holds(Format("stalled wheel, lambda %g: carries the load, pulls, takes torque, energy "
                      "booked to 2 %%; or overload is named",
                      slip),
               r.status == RunStatus::kOverload ||
                   (Ran(r) && Carries(r, 6) && Mean(r, "torque") > 0 && Booked(r)),
               Words(r));
  }
  const WheelTestResult counter = At(-2, 0);
  rows.Holds(
      "counter-rotating, lambda -2: carries the load, brakes, negative torque; or overload is "
      "named",
      counter.status == RunStatus::kOverload ||
          (Ran(counter) && Carries(counter, 6) && Mean(counter, "f_x") < 0 &&
           Mean(counter, "torque") < 0),
      Words(counter));
  const WheelTestResult side = At(0.5, 90);
  rows.Holds(
      "sideways at 90 degrees, spinning: carries the load, side force against motion; or "
      "overload is named",
      side.status == RunStatus::kOverload ||
          (Ran(side) && Carries(side, 6) && Mean(side, "f_y") < 0),
      Words(side));
}

void Loads(Rows& rows) {
  WheelTestSpec s = SmallSpec();
  s.state.slip = 0.2;
  s.state.load_n = 0.05;
  const WheelTestResult light = RunWheel(s, SmallTile());
  rows.Holds("barely touching, load of three grains: runs, or fails with a reason in words",
             (Ran(light) && Mean(light, "sinkage") < 0.01) ||
                 (light.status == RunStatus::kFailed && !light.reason.empty()),
             Words(light));
  s.state.load_n = 400;
  const WheelTestResult heavy = RunWheel(s, SmallTile());
  rows.Holds("far too heavy: OVERLOAD, with the reason",
             heavy.status == RunStatus::kOverload && !heavy.reason.empty(), Words(heavy));
}

/// A bed with a prescribed wheel, for poses the rig never takes.
struct Pressed {
  BedSpec spec;
  World world;
  explicit Pressed(double hub_z) : world(Build(spec, hub_z)) {}
  static World Build(const BedSpec& spec, double hub_z) {
    Body wheel;
    wheel.shape = TreadedWheel(0.035, 0.04,
                               {Tread{.count = 8, .height_m = 0.006, .root_thickness_m = 0.004}});
    wheel.motion = BodyMotion::kPrescribed;
    wheel.position_m = {0.12, 0.06, hub_z};
    WorldConfig c = spec.Config();
    c.energy = true;
    return World(c, Scene(Settle(spec), {Floor(), wheel}));
  }
  void Run(double seconds) { RunOrThrow(world, std::llround(seconds / world.config().dt_s)); }
};

void Sunk(Rows& rows) {
  BedSpec deep;
  deep.depth_m = 0.11;
  // The grains inside of the wheel's place are left out, as if it had dug in.
  std::vector<GrainState> grains;
  const double hub = 0.055, radius = 0.041;
  for (const GrainState& g : Settle(deep)) {
    const bool inside = std::hypot(g.x_m - 0.12, g.z_m - hub) < radius + g.radius_m &&
                        std::abs(g.y_m - 0.06) < 0.02 + g.radius_m;
    if (!inside) grains.push_back(g);
  }
  Body wheel;
  wheel.shape = SmoothWheel(0.041, 0.04);
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {0.12, 0.06, hub};
  wheel.spin_rad_per_s = {0, 3, 0};
  WorldConfig c = deep.Config();
  c.energy = true;
  World world(c, Scene(grains, {Floor(), wheel}));
  world.Start();
  const EnergyBalance before = world.Balance();
  RunOrThrow(world, std::llround(0.4 / c.dt_s));
  const EnergyBalance after = world.Balance();
  const Wrench& f = world.wrench(1);
  rows.Holds("a wheel sunk beyond its radius, spinning: no fault, forces finite, resisting torque",
             std::isfinite(f.fx + f.fy + f.fz) && f.ty < 0, Format("torque %.3g N m", f.ty));
  rows.Below("and its energy is booked to 1 %", 0.01,
             std::abs(after.Total() - before.Total()) / after.body_work);
}

void LiftOff(Rows& rows) {
  Pressed p(0.065 + 0.041);
  World& w = p.world;
  w.Start();
  w.body(1).velocity_m_per_s = {0, 0, -0.1};
  p.Run(0.2);
  const double pressed = w.wrench(1).fz;
  w.body(1).velocity_m_per_s = {0, 0, 0.2};
  p.Run(0.25);
  const Wrench air = w.wrench(1);
  rows.Holds("lift-off: the wheel carried weight, and in the air every component is exactly zero",
             pressed > 0.5 && air.fx == 0 && air.fy == 0 && air.fz == 0 && air.tx == 0 &&
                 air.ty == 0 && air.tz == 0,
             Format("%.3g N, then %g N", pressed, air.fz));
  w.body(1).velocity_m_per_s = {0, 0, -0.2};
  w.body(1).spin_rad_per_s = {0, 2, 0};
  p.Run(0.26);
  rows.Holds("touch-down again, spinning: the wheel is carried, no fault", w.wrench(1).fz > 0.5,
             Format("%.3g N", w.wrench(1).fz));
  const EnergyBalance e = w.Balance();
  rows.Holds("energies stay finite and every dissipation is positive",
             std::isfinite(e.Total()) && e.normal_damping > 0 && e.slip > 0 && e.rolling > 0,
             Format("slip %.3g, rolling %.3g J", e.slip, e.rolling));
}

}  // namespace

Cases WheelTortureCases() {
  return {{"wheel_states", Level::kDefault, HardStates},
          {"wheel_loads", Level::kDefault, Loads},
          {"wheel_sunk", Level::kQuick, Sunk},
          {"wheel_lift_off", Level::kQuick, LiftOff}};
}

}  // namespace grouser::dem::verify

// Sliding to rolling, rolling down an incline, and what each rolling law takes.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

/// Overlap of a sphere that rests on a rigid Hertz floor under `force`.
double Sag(const Elastic& e, double radius, double force) {
  const double k = 4.0 / 3.0 * EffectiveModulus(e, {kRigid, 0.3}) * std::sqrt(radius);
  return std::pow(force / k, 2.0 / 3.0);
}

World OnFloor(const Laws& laws, const Elastic& e, const ContactProperties& f, double radius,
              double density, Vec3d gravity, double dt, double v_x, double w_y) {
  WorldConfig c = Cell(Model(laws, e, f), 0.1, dt);
  c.gravity_m_per_s2 = gravity;
  const double z = radius - Sag(e, radius, -SphereMass(radius, density) * gravity[2]);
  return World(c, Scene({{0.05, 0.05, z, radius, density, v_x, 0, 0, 0, w_y, 0}}, {Floor()}));
}

/// MFiX DEM04: a sliding sphere rolls from t = 2/7 u0/(mu g) on, with 5/7 u0.
void SlipToRoll(Rows& rows) {
  const double r = 0.0005, g = 9.81, u0 = 0.1, dt = 2e-6;
  for (const double mu : {0.2, 0.6, 1.0}) {
    World world = OnFloor({}, {1e7, 0.3}, {.restitution = 0.5, .friction = mu}, r, 1e4, {0, 0, -g},
                          dt, u0, 0);
    double rolls_at = 0;
    for (int s = 0; s < 1000000 && rolls_at == 0; ++s) {
      RunOrThrow(world, 1);
      const GrainState b = world.StateOf(0);
      if (b.v_x - b.w_y * r < 1e-3 * u0) rolls_at = world.time_s();
    }
    const char* source = "MFiX DEM04";
    rows.Relative(Format("time of rolling mu g/u0 at mu %g [-]", mu), 2.0 / 7,
                  rolls_at * mu * g / u0, 0.006, source);
    rows.Relative(Format("speed u/u0 at mu %g [-]", mu), 5.0 / 7, world.StateOf(0).v_x / u0, 0.006,
                  source);
  }
}

void Incline(Rows& rows) {
  const double r = 0.005, g = 9.8, angle = 15 * M_PI / 180, dt = 4e-6;
  World world = OnFloor({}, {1e9, 0.3}, {.restitution = 0.5, .friction = 0.5}, r, 2500,
                        {g * std::sin(angle), 0, -g * std::cos(angle)}, dt, 0, 0);
  RunOrThrow(world, std::llround(1.0 / dt));
  rows.Absolute("speed after 1 s down 15 deg [m/s]", 1.81167, world.StateOf(0).v_x, 1e-4,
                "5/7 g sin(15 deg) t, g 9.8");
  rows.Relative("spin times radius over speed [-]", 1,
                world.StateOf(0).w_y * r / world.StateOf(0).v_x, 1e-4, "rolls without sliding");
}

/// A rolling sphere under a rolling moment mu_r R F_n slows by 5/7 mu_r g.
void RollingResistance(Rows& rows) {
  const double r = 0.005, g = 9.81, mu_r = 0.02, v = 0.1, dt = 4e-6, t = 0.3;
  for (const char* law : {"constant_torque", "epsd", "own_spin"}) {
    World world = OnFloor({.rolling = law}, {1e8, 0.3},
                          {.restitution = 0.5, .friction = 0.5, .rolling_friction = mu_r}, r, 2500,
                          {0, 0, -g}, dt, v, v / r);
    RunOrThrow(world, std::llround(0.02 / dt));  // EPSD loads its spring first
    const double first = world.StateOf(0).v_x;
    RunOrThrow(world, std::llround(t / dt));
    rows.Relative(Format("%s: speed lost in 0.3 s [m/s]", law), 5.0 / 7 * mu_r * g * t,
                  first - world.StateOf(0).v_x, 0.005, "5/7 mu_r g t");
  }
}

/// The way a sphere rolls till it rests, at the default step, 0.2 of the Rayleigh time or
/// what the laws bear, and at half of it.
void RollingConverges(Rows& rows) {
  const double r = 0.005, g = 9.81, mu_r = 0.1, v = 0.1, density = 2500;
  const Elastic sand = {1e7, 0.3};
  const ContactProperties f = {.restitution = 0.5, .friction = 0.5, .rolling_friction = mu_r};
  for (const char* law : {"constant_torque", "epsd", "own_spin"}) {
    const Laws laws = {.rolling = law};
    const double step =
        std::min(0.2 * RayleighTime(r, density, sand.youngs_modulus_pa, sand.poisson_ratio),
                 PackedLimit(Model(laws, sand, f), 0.02, r, SphereMass(r, density)));
    const auto way = [&](double dt) {
      World world = OnFloor(laws, sand, f, r, density, {0, 0, -g}, dt, v, v / r);
      RunOrThrow(world, std::llround(0.5 / dt));
      return world.StateOf(0).x_m - 0.05;
    };
    const double whole = way(step);
    rows.Relative(Format("%s: way rolled till rest, of v^2/(10/7 mu_r g) [-]", law), 1,
                  whole / (v * v / (10.0 / 7 * mu_r * g)), 0.05, "5/7 mu_r g");
    rows.Relative(Format("%s: the same at half the step over that at the step [-]", law), 1,
                  way(0.5 * step) / whole, 0.02, "converged");
  }
}

/// On a slope milder than mu_r a grain stays under EPSD, for good.
void EpsdHolds(Rows& rows) {
  const double r = 0.005, g = 9.81, dt = 1e-5, tilt = 0.05;
  World world = OnFloor({.rolling = "epsd"}, {1e7, 0.3},
                        {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1}, r, 2500,
                        {g * std::sin(tilt), 0, -g * std::cos(tilt)}, dt, 0, 0);
  RunOrThrow(world, std::llround(1.0 / dt));
  const double x = world.StateOf(0).x_m;
  RunOrThrow(world, std::llround(1.0 / dt));
  rows.AtMost("epsd: way crept in the second second on a slope of mu_r/2 [radii]", 1e-5,
              std::abs(world.StateOf(0).x_m - x) / r, "Ai et al. 2011: static");
  World over = OnFloor({.rolling = "epsd"}, {1e7, 0.3},
                       {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1}, r, 2500,
                       {g * std::sin(0.2), 0, -g * std::cos(0.2)}, dt, 0, 0);
  RunOrThrow(over, std::llround(0.5 / dt));
  rows.Relative("epsd: speed after 0.5 s on a slope of 0.2 rad [m/s]",
                5.0 / 7 * g * 0.5 * (std::sin(0.2) - 0.1 * std::cos(0.2)), over.StateOf(0).v_x,
                0.01, "5/7 g t (sin - mu_r cos)");
}

}  // namespace

Cases RollingCases() {
  return {{"slip_to_roll", Level::kQuick, SlipToRoll},
          {"rolling_incline", Level::kQuick, Incline},
          {"rolling_resistance", Level::kQuick, RollingResistance},
          {"rolling_converges", Level::kQuick, RollingConverges},
          {"epsd_holds", Level::kQuick, EpsdHolds}};
}

}  // namespace grouser::dem::verify

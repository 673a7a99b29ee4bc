// Waves, the order of the integrator, and what a pair of grains exchanges.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

// A solitary wave in a chain of beads.

/// Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733: in terms of the peak
/// bead velocity V the wave runs at (6/(5 pi rho theta))^(2/5) V^(1/5),
/// theta = 3 (1 - nu^2)/(4 E).
void Nesterenko(Rows& rows) {
  const int n = 60, first = 20, last = 45;
  const double r = 0.005, density = 7780, e = 203e9, nu = 0.3, dt = 2e-8;
  std::vector<GrainState> beads;
  for (int i = 0; i < n; ++i) {
    beads.push_back({0.25, 0.25, -0.3 + 2 * r * i, r, density, 0, 0, i == 0 ? 1.0 : 0.0});
  }
  World world(Cell(Model({}, {e, nu}, {.restitution = 1, .friction = 0}), 0.5, dt), beads);
  std::vector<double> peak(n, 0), at(n, 0);
  std::vector<double> before(n, 0), now(n, 0);
  while (world.StateOf(last).v_z < 0.3 || now[last] > before[last] || peak[last] == 0) {
    RunOrThrow(world, 1);
    before = now;
    for (int i = 0; i < n; ++i) {
      now[i] = world.StateOf(i).v_z;
      if (now[i] > peak[i]) peak[i] = now[i], at[i] = world.time_s();
    }
    if (world.time_s() > 5e-3) throw std::runtime_error("the wave never came");
  }
  double mean = 0;
  for (int i = first; i <= last; ++i) mean += peak[i] / (last - first + 1);
  const double theta = 3 * (1 - nu * nu) / (4 * e);
  const double expected = std::pow(6 / (5 * M_PI * density * theta), 0.4) * std::pow(mean, 0.2);
  rows.Relative("wave speed [m/s]", expected, 2 * r * (last - first) / (at[last] - at[first]), 0.01,
                "Nesterenko 1983");
  rows.Relative("peak bead velocity [m/s]", 0.68, mean, 0.02,
                "peak speed behind the front, about 0.68");
  rows.Relative("peak velocity, bead 45 over bead 20 [-]", 1, peak[last] / peak[first], 0.005,
                "a soliton keeps its height");
}

// Order of the integrator where motion is undamped and smooth.

/// log2 of the ratio of errors at steps h and h/2, the mean over two halvings.
double Order(const std::vector<double>& errors) {
  return 0.5 * std::log2(std::abs(errors[0] / errors[2]));
}

/// Position in the midst of a Hertz bounce against the exact solution.
void HertzBounce(Rows& rows) {
  const double r = 0.01, v = 1, density = 2500;
  const Elastic e = {1e8, 0.3};
  const double m = SphereMass(r, density), e_star = EffectiveModulus(e, {kRigid, 0.3});
  const double end = 0.8 * ExactHertz(m, r, e_star, v).contact_s;
  std::array<double, 2> y = {0, v};
  const int fine = 20000;
  for (int s = 0; s < fine; ++s) {
    y = RungeKutta<2>(
        [&](double, const std::array<double, 2>& u) {
          const double d = std::max(u[0], 0.0);
          return std::array<double, 2>{u[1], -4.0 / 3.0 * e_star * std::sqrt(r * d) * d / m};
        },
        0, y, end / fine);
  }
  std::vector<double> errors;
  for (const int steps : {16, 32, 64}) {
    World world(Cell(Model({}, e, {.restitution = 1, .friction = 0}), 0.2, end / steps),
                Scene({{0.1, 0.1, r, r, density, 0, 0, -v}}, {Floor()}));
    RunOrThrow(world, steps);
    errors.push_back(std::abs(r - world.StateOf(0).z_m - y[0]));
  }
  rows.Absolute("order of the position in a Hertz bounce [-]", 2, Order(errors), 0.2,
                "leapfrog; Runge-Kutta in double");
}

/// Two stacked grains on springs under gravity, before they part.
void TwoBodiesWithGravity(Rows& rows) {
  const double r = 0.01, k = 1e4, g = 9.81, density = 2500, m = SphereMass(r, density);
  const double end = 0.8 * std::sqrt(m / k);
  std::array<double, 4> y = {0.98 * r, 0, 2.95 * r, 0};
  const int fine = 20000;
  for (int s = 0; s < fine; ++s) {
    y = RungeKutta<4>(
        [&](double, const std::array<double, 4>& u) {
          const double low = k * (r - u[0]), mid = k * (2 * r - u[2] + u[0]);
          return std::array<double, 4>{u[1], (low - mid) / m - g, u[3], mid / m - g};
        },
        0, y, end / fine);
  }
  std::vector<double> errors;
  for (const int steps : {16, 32, 64}) {
    WorldConfig c = Cell(Model(LinearSprings(k), {1e9, 0.3}, {.restitution = 1, .friction = 0}),
                         0.2, end / steps);
    c.gravity_m_per_s2 = {0, 0, -g};
    World world(
        c, Scene({{0.1, 0.1, 0.98 * r, r, density}, {0.1, 0.1, 2.95 * r, r, density}}, {Floor()}));
    RunOrThrow(world, steps);
    errors.push_back(std::hypot(world.StateOf(0).z_m - y[0], world.StateOf(1).z_m - y[2]));
  }
  rows.Absolute("order of the position of two stacked grains [-]", 2, Order(errors), 0.2,
                "leapfrog; Runge-Kutta in double");
}

void FreeFall(Rows& rows) {
  WorldConfig c = Cell(Model({}, {1e7, 0.3}, {}), 0.2, 1e-4);
  c.gravity_m_per_s2 = {0, 0, -9.81};
  World world(c, {{0.1, 0.1, 0.3, 0.005, 2500}});
  RunOrThrow(world, 2000);
  rows.Absolute("height fallen in 0.2 s [m]", 0.5 * 9.81 * 0.04, 0.3 - world.StateOf(0).z_m, 1e-7,
                "g t^2/2");
}

// What a pair of grains exchanges: momentum, angular momentum, energy.

struct Motions {
  Vec3d linear = {0, 0, 0}, angular = {0, 0, 0};  ///< momentum; about the cell's middle
  double scale = 0, angular_scale = 0;            ///< sums of the grains' own sizes
};

Motions MotionsOf(const World& world, double middle) {
  Motions out;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState b = world.State(i);
    const double m = SphereMass(b.radius_m, b.density_kg_per_m3);
    const Vec3d p = {m * b.v_x, m * b.v_y, m * b.v_z};
    const Vec3d orbit = CrossD({b.x_m - middle, b.y_m - middle, b.z_m}, p);
    const double inertia = 0.4 * m * b.radius_m * b.radius_m;
    const Vec3d spin = {inertia * b.w_x, inertia * b.w_y, inertia * b.w_z};
    out.linear = Add(out.linear, p);
    out.angular = Add(out.angular, Add(orbit, spin));
    out.scale += Norm(p);
    out.angular_scale += Norm(orbit) + Norm(spin);
  }
  return out;
}

/// Every law that answers a pair's two sides alike. (own_spin takes each
/// grain's own spin and is exempt.)
void MomentumOfAGas(Rows& rows) {
  for (const Laws& laws : {Laws{.rolling = "epsd"}, LinearSprings(2e4, "constant_torque"),
                           Laws{"hertz_oden_martins",
                                "mindlin_displacement",
                                "none",
                                "none",
                                {{"hertz_oden_martins", "damping_kg_per_m_s", 100}}},
                           Laws{"hertz_dashpot", "linear_history", "none"},
                           Laws{"elasto_plastic", "linear_history", "epsd"},
                           Laws{"walton_braun", "kelvin_regularised", "none"},
                           Laws{"hertz_restitution", "mindlin_deresiewicz", "none"}}) {
    World world = Gas(laws, 216, 7);
    const Motions before = MotionsOf(world, 0);
    RunOrThrow(world, 4000);
    const Motions after = MotionsOf(world, 0);
    rows.AtMost(Format("%s, %s, %s: momentum lost by 216 grains, of sum |m v| [-]", laws.normal,
                       laws.tangential, laws.rolling),
                1e-6, Norm(Sub(before.linear, after.linear)) / before.scale, "Newton's third law");
  }
}

void SkewCollision(Rows& rows) {
  for (const char* rolling : {"none", "epsd", "constant_torque"}) {
    const double r = 0.01, dt = 1e-6;
    World world(Cell(Model({.rolling = rolling}, {1e8, 0.3},
                           {.restitution = 0.7, .friction = 0.5, .rolling_friction = 0.2}),
                     0.2, dt),
                {{0.1 - 0.011, 0.104, 0.003, r, 2500, 1.0, 0.1, 0, 20, -30, 10},
                 {0.1 + 0.011, 0.098, -0.002, 0.8 * r, 2500, -1.2, 0, 0.2, 0, 40, -25}});
    const Motions before = MotionsOf(world, 0.1);
    RunOrThrow(world, 4000);
    const Motions after = MotionsOf(world, 0.1);
    rows.AtMost(Format("rolling %s: momentum lost, of sum |m v| [-]", rolling), 1e-6,
                Norm(Sub(before.linear, after.linear)) / before.scale, "conservation");
    rows.AtMost(Format("rolling %s: angular momentum lost, of the sum of sizes [-]", rolling), 1e-5,
                Norm(Sub(before.angular, after.angular)) / before.angular_scale, "conservation");
  }
}

void EnergyOfAGas(Rows& rows) {
  World world = Gas({.rolling = "epsd"}, 216, 7, /*energy=*/true);
  const EnergyBalance before = world.Balance();
  RunOrThrow(world, 4000);
  const EnergyBalance after = world.Balance();
  rows.AtMost("216 colliding grains: energy not booked, of what was dissipated [-]", 0.01,
              std::abs(after.Total() - before.Total()) / after.Dissipated(), "sum of channels");
}

}  // namespace

Cases MotionCases() {
  return {{"bead_chain", Level::kQuick, Nesterenko},
          {"order_hertz_bounce", Level::kQuick, HertzBounce},
          {"order_two_bodies", Level::kQuick, TwoBodiesWithGravity},
          {"free_fall", Level::kQuick, FreeFall},
          {"momentum_gas", Level::kQuick, MomentumOfAGas},
          {"momentum_pair", Level::kQuick, SkewCollision},
          {"energy_gas", Level::kQuick, EnergyOfAGas}};
}

}  // namespace grouser::dem::verify

// Order of the integrator where motion is undamped and smooth.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

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
    WorldConfig c = Cell(Model({.normal = "linear_spring",
                                .tangential = "linear_history",
                                .settings = {{"linear_spring", "stiffness_n_per_m", k}}},
                               {1e9, 0.3}, {.restitution = 1, .friction = 0}),
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

}  // namespace

Cases OrderCases() {
  return {{"order_hertz_bounce", Level::kQuick, HertzBounce},
          {"order_two_bodies", Level::kQuick, TwoBodiesWithGravity},
          {"free_fall", Level::kQuick, FreeFall}};
}

}  // namespace grouser::dem::verify

// What a pair of grains exchanges: momentum, angular momentum, energy.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

Vec3d Cross(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Motions {
  Vec3d linear = {0, 0, 0}, angular = {0, 0, 0};  ///< momentum; about the cell's middle
  double scale = 0, angular_scale = 0;            ///< sums of the grains' own sizes
};

Motions Measure(const World& world, double middle) {
  Motions out;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState b = world.State(i);
    const double m = SphereMass(b.radius_m, b.density_kg_per_m3);
    const Vec3d p = {m * b.v_x, m * b.v_y, m * b.v_z};
    const Vec3d orbit = Cross({b.x_m - middle, b.y_m - middle, b.z_m}, p);
    const double inertia = 0.4 * m * b.radius_m * b.radius_m;
    const Vec3d spin = {inertia * b.w_x, inertia * b.w_y, inertia * b.w_z};
    for (int k = 0; k < 3; ++k) {
      out.linear[k] += p[k];
      out.angular[k] += orbit[k] + spin[k];
    }
    out.scale += std::hypot(p[0], p[1], p[2]);
    out.angular_scale +=
        std::hypot(orbit[0], orbit[1], orbit[2]) + std::hypot(spin[0], spin[1], spin[2]);
  }
  return out;
}

double Change(const Vec3d& a, const Vec3d& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Every law that answers a pair's two sides alike. (own_spin takes each
/// grain's own spin and is exempt.)
void MomentumOfAGas(Rows& rows) {
  for (const Laws& laws : {Laws{.rolling = "epsd"},
                           Laws{"linear_spring",
                                "linear_history",
                                "constant_torque",
                                "none",
                                {{"linear_spring", "stiffness_n_per_m", 2e4}}},
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
    const Motions before = Measure(world, 0);
    RunOrThrow(world, 4000);
    const Motions after = Measure(world, 0);
    rows.AtMost(Format("%s, %s, %s: momentum lost by 216 grains, of sum |m v| [-]", laws.normal,
                       laws.tangential, laws.rolling),
                1e-6, Change(before.linear, after.linear) / before.scale, "Newton's third law");
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
    const Motions before = Measure(world, 0.1);
    RunOrThrow(world, 4000);
    const Motions after = Measure(world, 0.1);
    rows.AtMost(Format("rolling %s: momentum lost, of sum |m v| [-]", rolling), 1e-6,
                Change(before.linear, after.linear) / before.scale, "conservation");
    rows.AtMost(Format("rolling %s: angular momentum lost, of the sum of sizes [-]", rolling), 1e-5,
                Change(before.angular, after.angular) / before.angular_scale, "conservation");
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

Cases MomentumCases() {
  return {{"momentum_gas", Level::kQuick, MomentumOfAGas},
          {"momentum_pair", Level::kQuick, SkewCollision},
          {"energy_gas", Level::kQuick, EnergyOfAGas}};
}

}  // namespace grouser::dem::verify

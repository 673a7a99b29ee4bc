// Adhesion by displacement control: two grains held by hand, drawn apart.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

constexpr double kRadius = 0.001;
const Elastic kGrain = {1e7, 0.3};

/// Force on the upper grain [N] against the gap [m] while it is drawn away
/// from a start `overlap` by `steps` steps of `stride`.
struct Pull {
  std::vector<double> gap, force;
  double Least() const { return *std::min_element(force.begin(), force.end()); }
  /// Gap of the last place with a force.
  double Last() const {
    double out = -1;
    for (std::size_t k = 0; k < gap.size(); ++k) {
      if (force[k] != 0) out = gap[k];
    }
    return out;
  }
  double At(double g) const {
    for (std::size_t k = 1; k < gap.size(); ++k) {
      if (gap[k] < g) continue;
      const double t = (g - gap[k - 1]) / (gap[k] - gap[k - 1]);
      return force[k - 1] + t * (force[k] - force[k - 1]);
    }
    return 0;
  }
};

Pull DrawApart(const Laws& laws, double gamma, double overlap, double stride, int steps) {
  const double dt = 1e-6;
  ContactModel model =
      Model(laws, kGrain, {.restitution = 1, .friction = 0, .surface_energy_j_per_m2 = gamma});
  GrainState low = {0.01, 0.01, 0, kRadius, 2500}, high = low;
  low.glued = high.glued = true;
  high.z_m = 2 * kRadius - overlap;
  high.v_z = stride / dt;
  World world(Cell(model, 0.02, dt), {low, high});
  world.Start();
  Pull out;
  for (int s = 0; s < steps; ++s) {
    RunOrThrow(world, 1);
    out.gap.push_back(world.StateOf(1).z_m - world.StateOf(0).z_m - 2 * kRadius);
    out.force.push_back(world.LoadOf(1).fz);
  }
  return out;
}

void JkrExact(Rows& rows) {
  const double gamma = 0.5, r = kRadius / 2, e = EffectiveModulus(kGrain, kGrain);
  const double off = 1.5 * M_PI * gamma * r;
  const double snap = 0.75 * std::cbrt(M_PI * M_PI * gamma * gamma * r / (e * e));
  const Pull pull = DrawApart({.cohesion = "jkr"}, gamma, 1.5 * snap, snap / 2000, 6000);
  const char* source = "Johnson, Kendall & Roberts 1971";
  rows.Relative("JKR: pull-off force [mN]", -1e3 * off, 1e3 * pull.Least(), 0.001,
                "JKR: 1.5 pi gamma R*");
  rows.Relative("JKR: force at zero overlap over pull-off [-]", -8.0 / 9, pull.At(0) / off, 0.002,
                source);
  rows.Relative("JKR: gap of snap-off [um]", 1e6 * snap, 1e6 * pull.Last(), 0.005, source);
  // The force where the neck snaps under displacement control: 5/9 of pull-off.
  rows.Relative("JKR: force just before snap-off over pull-off [-]", -5.0 / 9,
                pull.At(pull.Last()) / off, 0.05, source);
  double worst = 0;
  for (double a = 0.7; a < 1.6; a += 0.05) {  // contact radius over that at zero load
    const double a0 = std::cbrt(4.5 * M_PI * gamma * r * r / e);
    const double radius = a * a0;
    const double gap = std::sqrt(2 * M_PI * gamma * radius / e) - radius * radius / r;
    const double force = 4 * e * radius * radius * radius / (3 * r) -
                         std::sqrt(8 * M_PI * gamma * e * radius * radius * radius);
    if (gap > 0.98 * snap || gap < pull.gap.front()) continue;
    worst = std::max(worst, std::abs(pull.At(gap) - force) / off);
  }
  rows.AtMost("JKR: force-gap curve, worst distance over pull-off [-]", 0.005, worst, source);
}

/// Before they touch there is no neck: the way in differs from the way out.
void JkrTouch(Rows& rows) {
  const double gamma = 0.5, r = kRadius / 2, e = EffectiveModulus(kGrain, kGrain);
  const double off = 1.5 * M_PI * gamma * r;
  const double snap = 0.75 * std::cbrt(M_PI * M_PI * gamma * gamma * r / (e * e));
  const Pull in = DrawApart({.cohesion = "jkr"}, gamma, -1.2 * snap, -snap / 2000, 4000);
  double before = 0, after = 0;
  for (std::size_t k = 0; k < in.gap.size(); ++k) {
    if (in.gap[k] > 0) before = std::max(before, std::abs(in.force[k]));
    if (in.gap[k] <= 0 && after == 0) after = in.force[k];
  }
  rows.AtMost("JKR: largest force before the grains touch [N]", 0, before, "no neck yet");
  rows.Relative("JKR: force on touching over pull-off [-]", -8.0 / 9, after / off, 0.005,
                "Johnson, Kendall & Roberts 1971");
}

void JkrAsPublished(Rows& rows) {
  const double gamma = 0.5, r = kRadius / 2;
  const Pull pull = DrawApart({.cohesion = "jkr_added"}, gamma, 2e-8, 1e-10, 190);
  rows.Relative("JKR as added by Shin et al.: force at zero overlap [mN]",
                -1e3 * 6 * M_PI * gamma * r, 1e3 * pull.force.back(), 0.01,
                "6 pi gamma R*, four times JKR");
}

void CapillaryBridge(Rows& rows) {
  const double sigma = 0.072, volume = 1e-12, theta = 0.3;
  const Laws laws = {.cohesion = "capillary",
                     .settings = {{"capillary", "surface_tension_n_per_m", sigma},
                                  {"capillary", "contact_angle_rad", theta},
                                  {"capillary", "bridge_volume_m3", volume}}};
  const double rupture = (1 + theta / 2) * std::cbrt(volume);
  const Pull pull = DrawApart(laws, 0, 1e-8, rupture / 4000, 4400);
  const double at_touch = -2 * M_PI * kRadius * sigma * std::cos(theta);
  rows.Relative("capillary bridge: force at zero gap [mN]", 1e3 * at_touch, 1e3 * pull.At(1e-9),
                0.01, "2 pi R sigma cos(theta)");
  rows.Relative("capillary bridge: gap of rupture [um]", 1e6 * rupture, 1e6 * pull.Last(), 0.002,
                "Lian et al. 1993: (1 + theta/2) V^(1/3)");
  double worst = 0;
  for (double share = 0.05; share < 1; share += 0.05) {
    const double s = share * rupture * std::sqrt(kRadius / volume);
    const double force = at_touch / (1 + 1.05 * s + 2.5 * s * s);
    worst = std::max(worst, std::abs(pull.At(share * rupture) / force - 1));
  }
  rows.AtMost("capillary bridge: force-gap curve, worst relative distance [-]", 0.005, worst,
              "Willett et al. 2000, closed form");
}

}  // namespace

Cases CohesionCases() {
  return {{"jkr_exact", Level::kQuick, JkrExact},
          {"jkr_touch", Level::kQuick, JkrTouch},
          {"jkr_added", Level::kQuick, JkrAsPublished},
          {"capillary_bridge", Level::kQuick, CapillaryBridge}};
}

}  // namespace grouser::dem::verify

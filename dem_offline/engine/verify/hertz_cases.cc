// Elastic normal impacts: Chung & Ooi (2011), tests 1 and 2.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/benchmarks.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

constexpr char kTest1[] = "Chung & Ooi 2011, test 1", kTest2[] = "Chung & Ooi 2011, test 2";
constexpr char kExact[] = "Hertz 1882, closed form";

/// Worst distance of the force from k overlap^(3/2), over the peak.
double FromHertz(const Impact& hit, double e_star, double r_eff) {
  double worst = 0;
  for (const auto& p : hit.curve) {
    const double exact = 4.0 / 3.0 * e_star * std::sqrt(r_eff) * std::pow(p[1], 1.5);
    worst = std::max(worst, std::abs(p[2] - exact));
  }
  return worst / hit.peak_force_n;
}

/// Curve in the units of the publication.
std::vector<std::array<double, 3>> Scaled(const Impact& hit) {
  auto curve = hit.curve;
  for (auto& p : curve) p = {1e6 * p[0], 1e6 * p[1], 1e-3 * p[2]};
  return curve;
}

void TwoGlassSpheres(Rows& rows) {
  const double r = 0.01, dt = 1e-8, v = 10;
  const Elastic glass = {48e9, 0.2};
  World world(Cell(Model({}, glass, {.restitution = 1.0, .friction = 0.35}), 0.2, dt),
              {{0.1, 0.1, r, r, 2800, 0, 0, -v}, {0.1, 0.1, -r, r, 2800, 0, 0, v}});
  const Impact hit = Follow(world, true);
  rows.Relative("peak overlap [um]", 274, 1e6 * hit.peak_overlap_m, 0.005, kTest1);
  rows.Relative("peak force [kN]", 10.70, 1e-3 * hit.peak_force_n, 0.005, kTest1);
  rows.Relative("contact time [us]", 40.35, 1e6 * hit.contact_s, 0.005, kTest1);
  const HertzImpact exact =
      ExactHertz(SphereMass(r, 2800) / 2, r / 2, EffectiveModulus(glass, glass), 2 * v);
  rows.Relative("peak overlap [um]", 1e6 * exact.overlap_m, 1e6 * hit.peak_overlap_m, 1e-4, kExact);
  rows.Relative("contact time [us]", 1e6 * exact.contact_s, 1e6 * hit.contact_s, 1e-3, kExact);
  rows.AtMost("force against k overlap^1.5, worst distance over the peak [-]", 5e-4,
              FromHertz(hit, EffectiveModulus(glass, glass), r / 2), kExact);
  rows.Relative("rebound speed [m/s]", v, hit.after.v_z, 1e-4, "energy is kept");
  const auto curve = Scaled(hit);
  rows.AtMost("force-overlap curve, rms distance over the peak [-]", 0.01,
              CurveDeviation(kGlassForceOverlap, curve, 1, 2), kTest1);
  rows.AtMost("force-time curve, rms distance over the peak [-]", 0.01,
              CurveDeviation(kGlassForceTime, curve, 0, 2), kTest1);
}

void SphereOnRigidWall(Rows& rows) {
  const double r = 0.1, dt = 1e-7, v = 0.2;
  const Elastic aluminium = {70e9, 0.3};
  World world(Cell(Model({}, aluminium, {.restitution = 1.0, .friction = 0}), 2, dt),
              Scene({{1, 1, r, r, 2699, 0, 0, -v}}, {Floor()}));
  const Impact hit = Follow(world, true);
  rows.Relative("peak overlap [um]", 49.7, 1e6 * hit.peak_overlap_m, 0.005, kTest2);
  rows.Relative("peak force [kN]", 11.37, 1e-3 * hit.peak_force_n, 0.005, kTest2);
  rows.Relative("contact time [us]", 732, 1e6 * hit.contact_s, 0.005, kTest2);
  const HertzImpact exact =
      ExactHertz(SphereMass(r, 2699), r, EffectiveModulus(aluminium, {kRigid, 0.3}), v);
  rows.Relative("peak overlap [um]", 1e6 * exact.overlap_m, 1e6 * hit.peak_overlap_m, 1e-4, kExact);
  rows.AtMost("force against k overlap^1.5, worst distance over the peak [-]", 5e-4,
              FromHertz(hit, EffectiveModulus(aluminium, {kRigid, 0.3}), r), kExact);
  rows.Relative("rebound speed [m/s]", v, hit.after.v_z, 1e-4, "energy is kept");
  const auto curve = Scaled(hit);
  rows.AtMost("force-overlap curve, rms distance over the peak [-]", 0.01,
              CurveDeviation(kWallForceOverlap, curve, 1, 2), kTest2);
  rows.AtMost("force-time curve, rms distance over the peak [-]", 0.01,
              CurveDeviation(kWallForceTime, curve, 0, 2), kTest2);
}

}  // namespace

Cases HertzCases() {
  return {{"hertz_two_spheres", Level::kQuick, TwoGlassSpheres},
          {"hertz_rigid_wall", Level::kQuick, SphereOnRigidWall}};
}

}  // namespace grouser::dem::verify

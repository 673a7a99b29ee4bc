// Oblique impacts: against exact partial slip, and the benchmark of Chung & Ooi.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

/// Exact partial slip for any history of overlap and displacement along a line:
/// the share of friction used by each layer of normal approach (the method of
/// memory diagrams: Aleshin, Bou Matar & Van Den Abeele 2015, from Jaeger and
/// Ciavarella's superposition).
struct Layers {
  double mu, kappa, kh, step;
  std::vector<double> used;
  long depth = 0;
  double u = 0;

  double To(double overlap, double u_new) {
    const double part = mu * kappa * step;
    const long now = std::min<long>(used.size(), std::lround(overlap / step));
    for (long k = depth; k < now; ++k) {
      used[k] = std::clamp((u_new - u) / (part * (now - depth)), -1.0, 1.0);
    }
    depth = now;
    double have = 0;
    for (long k = 0; k < now; ++k) have += part * used[k];
    double miss = u_new - have;
    const double sign = miss > 0 ? 1 : -1;
    for (long k = now - 1; k >= 0 && sign * miss > 0; --k) {
      const double gain = part * (sign - used[k]);
      used[k] = std::abs(gain) >= std::abs(miss) ? used[k] + miss / part : sign;
      miss -= std::abs(gain) >= std::abs(miss) ? miss : gain;
    }
    u = u_new - miss;
    double t = 0;
    for (long k = 0; k < now; ++k) {
      t += used[k] * mu * kh * (std::pow((k + 1) * step, 1.5) - std::pow(k * step, 1.5));
    }
    return t;
  }
};

Pairing Alumina(double restitution) {
  Pairing s;
  s.a = {380e9, 0.23};
  s.b = {kRigid, 0};
  s.wall = true;
  s.r = 0.0025f;
  s.m = static_cast<float>(4.0 / 3 * M_PI * std::pow(0.0025, 3) * 4000);
  s.face.restitution = restitution;
  s.face.friction = 0.092;
  return s;
}

// Oblique elastic impacts against exact partial slip. The incremental law
// remembers one turn; below 10 degrees, where the contact rocks while it
// parts, it is 0.05 off (0.793 against 0.741 at 5 degrees).
TEST(MindlinDeresiewicz, ObliqueImpactAgainstExactPartialSlip) {
  for (const double degrees : {5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0}) {
    Pairing s = Alumina(1);
    s.tangential = "mindlin_deresiewicz";
    const double a = degrees * M_PI / 180, vn = 3.9 * std::cos(a), vt = 3.9 * std::sin(a),
                 dt = 2e-9;
    const double e = EffectiveModulus(s.a, s.b), g = EffectiveShearModulus(s.a, s.b);
    Layers exact = {
        0.092, e / (4 * g), 4.0 / 3 * e * std::sqrt(s.r), 2.5e-8, std::vector<double>(1000), 0, 0};
    double z = 0, vz = -vn, vx = vt, w = 0, u = 0;
    while ((z += vz * dt) < 0) {
      const double t = exact.To(-z, u - (vx + w) * dt);
      u = exact.u;
      vz += exact.kh * std::pow(-z, 1.5) / s.m * dt;
      vx += t / s.m * dt;
      w += 2.5 * t / s.m * dt;
    }
    const Rebound hit = Collide(s, vn, vt, dt);
    EXPECT_NEAR(hit.tangential, vx / vt, degrees < 10 ? 0.06 : 0.015) << degrees;
    EXPECT_NEAR(hit.balance, 0, 1e-5) << degrees;
  }
}

// The same along prescribed paths in which the normal force changes on each of
// the three branches.
TEST(MindlinDeresiewicz, ChangingNormalForceOnEveryBranchAgainstExactPartialSlip) {
  const double step = 2e-8, kr = 0.0025, mu = 0.4;
  const double e = EffectiveModulus({1e8, 0.3}, {1e8, 0.3});
  const double g = EffectiveShearModulus({1e8, 0.3}, {1e8, 0.3});
  const double kh = 4.0 / 3 * e * std::sqrt(kr), kappa = e / (4 * g);
  for (const double factor : {0.8, 0.9, 1.1, 1.25}) {
    Layers exact = {mu, kappa, kh, step, std::vector<double>(2000), 0, 0};
    Pairing s;
    s.tangential = "mindlin_deresiewicz";
    s.face.friction = mu;
    s.face.restitution = 1;
    Contact c(s);
    double overlap = 2e-5, u = 0;
    c.PressTo(overlap, 100);
    exact.To(overlap, 0);
    // Shares of the slip displacement: on, back, back while F changes, on again,
    // on while F changes, on past the first turn.
    const double reach = mu * kappa * overlap;
    const double moves[] = {0.6, -0.5, -0.1, 0.15, 0.15, 0.5};
    for (int leg = 0; leg < 6; ++leg) {
      const double next = leg == 2 || leg == 4 ? overlap * factor : overlap;
      double t = 0;
      for (int k = 1; k <= 400; ++k) {
        c.g.overlap = static_cast<float>(overlap + (next - overlap) * k / 400);
        u += moves[leg] * reach / 400;
        c.SlideBy(-moves[leg] * reach / 400, 0, 1);
        t = exact.To(c.g.overlap, u);
      }
      overlap = next;
      const double cap = mu * c.last.force.z;
      EXPECT_NEAR(c.last.force.x / cap, t / cap, 3e-3) << "F x " << factor << ", leg " << leg;
    }
  }
}

// Chung & Ooi (Granular Matter 13 (2011) 643), test 4, digitised: tangential
// restitution within 2.5 %.
TEST(MindlinDisplacement, PublishedObliqueImpact) {
  const struct {
    double degrees, restitution;
  } rows[] = {{5, .948},  {10, .687}, {15, .624}, {20, .616}, {25, .634}, {30, .684}, {35, .737},
              {40, .781}, {50, .845}, {60, .893}, {70, .932}, {80, .966}, {85, .983}};
  for (const auto& row : rows) {
    Pairing s = Alumina(0.98);
    s.tangential = "mindlin_displacement";
    const double a = row.degrees * M_PI / 180;
    const Rebound hit = Collide(s, 3.9 * std::cos(a), 3.9 * std::sin(a), 2e-9);
    EXPECT_NEAR(hit.tangential / row.restitution, 1, 0.025) << row.degrees;
    EXPECT_NEAR(hit.restitution, 0.98, 1e-3);
    EXPECT_NEAR(hit.balance, 0, 1e-4);
  }
}

}  // namespace
}  // namespace grouser::dem

// Normal laws in head-on collisions, against closed forms.
#include <gtest/gtest.h>

#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

Pairing Normal(const char* law) {
  Pairing s;
  s.normal = law;
  s.tangential = "linear_history";
  return s;
}

TEST(LinearSpring, RestitutionAtEverySpeedAndTimeOfContact) {
  for (const double e : {0.3, 0.6, 0.95}) {
    for (const double v : {0.001, 0.1, 2.0}) {
      Pairing s = Normal("linear_spring");
      s.face.restitution = e;
      SettingsOf<LinearSpring>(s.settings).stiffness_n_per_m = 1e5;
      const Rebound hit = Collide(s, v, 0, 2e-8);
      EXPECT_NEAR(hit.restitution, e, 1e-3) << v;
      EXPECT_NEAR(hit.balance, 0, 2e-4) << "e " << e << ", v " << v;
    }
  }
}

TEST(LinearSpring, NormkScalesTheBulkModuliOfBothGrains) {
  Pairing s = Normal("linear_spring");
  s.a = {75e9, 0.3};
  s.b = {20e9, 0.2};
  s.face.restitution = 1;
  Contact c(s);
  c.g.r_own = 0.002f;
  c.g.r_other = 0.0015f;
  c.g.overlap = 1e-6f;
  const double k1r1 = 75e9 / (3 * 0.4) * 0.002, k2r2 = 20e9 / (3 * 0.6) * 0.0015;
  const double kn = 0.01 * k1r1 * k2r2 / (k1r1 + k2r2);
  EXPECT_NEAR(c.Step(1e-7f).force.z / (kn * 1e-6), 1, 1e-5);
  s.b = {kRigid, 0};
  s.wall = true;
  Contact wall(s);
  wall.g.r_own = wall.g.r_other = wall.g.r_eff = 0.002f;
  wall.g.overlap = 1e-6f;
  EXPECT_NEAR(wall.Step(1e-7f).force.z / (0.01 * k1r1 * 1e-6), 1, 1e-5);
}

TEST(HertzRestitution, TheSameAtEverySpeed) {
  for (const double e : {0.3, 0.6, 0.95}) {
    for (const double v : {0.01, 0.1, 2.0}) {
      Pairing s = Normal("hertz_restitution");
      s.face.restitution = e;
      const Rebound hit = Collide(s, v, 0, 2e-8);
      EXPECT_NEAR(hit.restitution, e, 2e-3) << v;
      EXPECT_NEAR(hit.balance, 0, 2e-4);
    }
  }
}

// A weak damper takes c times the integral of v^2 over the undamped impact:
// 1 - e^2 = 8 c delta_max I/(m v),  I = int_0^1 sqrt(1 - x^(5/2)) dx.
TEST(HertzDashpot, WeakDampingFollowsFirstOrderAndRestitutionRisesWithSpeed) {
  const int n = 200000;
  double integral = 0;
  for (int k = 0; k < n; ++k) integral += std::sqrt(1 - std::pow((k + 0.5) / n, 2.5)) / n;
  double last = 0;
  for (const double v : {0.05, 0.2, 1.0}) {
    Pairing s = Normal("hertz_dashpot");
    const double c = 1e-4;
    SettingsOf<HertzDashpot>(s.settings).damping_n_s_per_m = c;
    const Rebound hit = Collide(s, v, 0, 2e-8);
    const double loss = 1 - hit.restitution * hit.restitution;
    const double m = 0.5e-3, kh = 4.0 / 3 * (1e8 / 0.91 / 2) * std::sqrt(0.0025);
    const double deepest = std::pow(1.25 * m * v * v / kh, 0.4);
    EXPECT_NEAR(loss / (8 * c * deepest * integral / (m * v) / 2), 1, 0.02) << v;
    EXPECT_NEAR(hit.balance, 0, 2e-4);
    EXPECT_GT(hit.restitution, last);
    last = hit.restitution;
  }
}

// The same to first order for beta delta: 1 - e^2 = 8 beta delta_max^2 I/(m v),
// I = int_0^1 x sqrt(1 - x^(5/2)) dx.
TEST(HertzOdenMartins, WeakDampingFollowsFirstOrderAndRestitutionFallsWithSpeed) {
  const int n = 200000;
  double integral = 0;
  for (int k = 0; k < n; ++k) {
    const double x = (k + 0.5) / n;
    integral += x * std::sqrt(1 - std::pow(x, 2.5)) / n;
  }
  double last = 1;
  for (const double v : {0.05, 0.2, 1.0}) {
    Pairing s = Normal("hertz_oden_martins");
    const double beta = 2;
    SettingsOf<HertzOdenMartins>(s.settings).damping_kg_per_m_s = beta;
    const Rebound hit = Collide(s, v, 0, 2e-8);
    const double loss = 1 - hit.restitution * hit.restitution;
    const double m = 0.5e-3, kh = 4.0 / 3 * (1e8 / 0.91 / 2) * std::sqrt(0.0025);
    const double deepest = std::pow(1.25 * m * v * v / kh, 0.4);
    EXPECT_NEAR(loss / (4 * beta * deepest * deepest * integral / (m * v)), 1, 0.02) << v;
    EXPECT_NEAR(hit.balance, 0, 2e-4);
    EXPECT_LT(hit.restitution, last);
    last = hit.restitution;
  }
}

/// Restitution of Thornton's law from energies, in double: the peak overlap
/// from 1/2 m v^2 = W(delta_max), what comes back 2/5 F_max (delta_max - delta_p).
double ThorntonRestitution(double kh, double fy, double m, double v) {
  const double dy = std::pow(fy / kh, 2.0 / 3), ky = 1.5 * fy / dy, in = 0.5 * m * v * v;
  const double extra = in - 0.4 * fy * dy;
  if (extra <= 0) return 1;
  const double x = (-fy + std::sqrt(fy * fy + 2 * ky * extra)) / ky, f = fy + ky * x;
  const double rho = fy / f * std::pow((2 * f + fy) / (3 * fy), 1.5);
  return std::sqrt(0.4 * f * std::pow(f / (kh * std::sqrt(rho)), 2.0 / 3) / in);
}

TEST(ElastoPlastic, RestitutionFallsWithSpeedAsTheEnergiesSay) {
  Pairing s = Normal("elasto_plastic");
  SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.05;
  const double kh = 4.0 / 3 * (1e8 / 0.91 / 2) * std::sqrt(0.0025);
  double last = 1;
  for (const double v : {0.01, 0.02, 0.03, 0.1, 0.3, 1.0, 3.0}) {
    const Rebound hit = Collide(s, v, 0, 1e-8);
    EXPECT_NEAR(hit.restitution, ThorntonRestitution(kh, 0.05, 0.5e-3, v), 1e-3) << v;
    EXPECT_LE(hit.restitution, last + 1e-5) << v;  // two of them below yield
    EXPECT_NEAR(hit.balance, 0, 1e-5) << v;
    last = hit.restitution;
  }
  EXPECT_LT(last, 0.4);
}

TEST(ElastoPlastic, ReloadingRetracesToTheLargestForce) {
  Pairing s = Normal("elasto_plastic");
  SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.05;
  Contact c(s);
  const double most = c.PressTo(1e-4, 2000);
  const double work = c.work, lost = c.lost;
  c.PressTo(1e-6, 2000);
  EXPECT_EQ(c.last.force.z, 0);  // below the overlap that stays
  const double mid = c.PressTo(9e-5, 2000);
  EXPECT_GT(mid, 0);
  EXPECT_LT(mid, most);
  EXPECT_NEAR(c.PressTo(1e-4, 2000), most, 1e-5 * most);
  EXPECT_NEAR(c.work, work, 1e-5 * work);  // nothing lost below the peak
  EXPECT_EQ(c.lost, lost);
  EXPECT_NEAR(c.work, c.lost + c.last.stored, 1e-4 * work);
  // Beyond the peak on the virgin line: slope 3/2 F_y/delta_y.
  const double kh = 4.0 / 3 * (1e8 / 0.91 / 2) * std::sqrt(0.0025);
  const double ky = 1.5 * 0.05 / std::pow(0.05 / kh, 2.0 / 3);
  EXPECT_NEAR((c.PressTo(1.2e-4, 100) - most) / 2e-5, ky, 1e-3 * ky);
}

TEST(ElastoPlastic, CriticalDampingShareTakesMore) {
  Pairing s = Normal("elasto_plastic");
  SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.05;
  const double plain = Collide(s, 0.1, 0, 1e-8).restitution;
  SettingsOf<ElastoPlastic>(s.settings).critical_damping_share = 0.1;
  const Rebound damped = Collide(s, 0.1, 0, 1e-8);
  EXPECT_LT(damped.restitution, 0.9 * plain);
  EXPECT_NEAR(damped.balance, 0, 2e-4);
}

TEST(WaltonBraun, RestitutionIsTheRootOfTheStiffnessRatio) {
  for (const double ratio : {0.1, 0.5, 1.0}) {
    for (const double v : {0.01, 1.0}) {
      Pairing s = Normal("walton_braun");
      auto& set = SettingsOf<WaltonBraun>(s.settings);
      set.loading_stiffness_n_per_m = 2e4;
      set.unloading_stiffness_n_per_m = 2e4 / ratio;
      const Rebound hit = Collide(s, v, 0, 2e-8);
      EXPECT_NEAR(hit.restitution, std::sqrt(ratio), 1e-3) << v;
      EXPECT_NEAR(hit.balance, 0, 1e-5);
    }
  }
  Pairing s = Normal("walton_braun");
  s.face.restitution = 0.7;
  EXPECT_NEAR(Collide(s, 0.1, 0, 2e-8).restitution, 0.7, 1e-3);
}

TEST(WaltonBraun, ReloadsAlongTheSteepLine) {
  Pairing s = Normal("walton_braun");
  auto& set = SettingsOf<WaltonBraun>(s.settings);
  set.loading_stiffness_n_per_m = 1e4;
  set.unloading_stiffness_n_per_m = 4e4;
  Contact c(s);
  EXPECT_NEAR(c.PressTo(1e-4, 10), 1.0, 1e-5);
  EXPECT_NEAR(c.PressTo(8e-5, 10), 0.2, 1e-5);
  EXPECT_NEAR(c.PressTo(9e-5, 10), 0.6, 1e-5);
  EXPECT_NEAR(c.PressTo(2e-4, 10), 2.0, 1e-5);
  EXPECT_NEAR(c.PressTo(1e-4, 10), 0.0, 1e-5);
}

// The bound that the time step is made from is no less than the steepest
// dF/d(overlap) met on loading and unloading.
TEST(NormalLaws, StiffnessBoundsTheSlope) {
  for (const char* law : {"hertz_restitution", "linear_spring", "hertz_oden_martins",
                          "elasto_plastic", "walton_braun", "hertz_dashpot"}) {
    Pairing s = Normal(law);
    SettingsOf<HertzOdenMartins>(s.settings).damping_kg_per_m_s = 1e3;
    SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.05;
    ContactModel model(LawsByName(s.normal, s.tangential, s.rolling, s.cohesion));
    model.AddMaterial(s.a);
    model.SetContactProperties(0, 0, s.face, s.settings);
    Contact c(s);
    double steepest = 0, last = 0;
    for (int k = 1; k <= 2000; ++k) {
      const int at = k <= 1000 ? k : 2000 - k;
      c.g.overlap = 1e-7f * static_cast<float>(at + 1e-3);
      const double f = c.Step(1.0f).force.z;
      if (at > 10) steepest = std::max(steepest, std::abs(f - last) / 1e-7);
      last = f;
    }
    const double bound = model.Bounds({1e-4, c.g.r_eff, c.g.m_eff, 1e-8}).normal.stiffness;
    EXPECT_LE(steepest, 1.01 * bound) << law;
    EXPECT_GE(steepest, 0.8 * bound) << law;
  }
}

// So is the damping bound: no less than the steepest dF/d(overlap rate).
TEST(NormalLaws, DampingBoundsTheSlope) {
  for (const char* law : {"hertz_restitution", "linear_spring", "hertz_oden_martins",
                          "elasto_plastic", "walton_braun", "hertz_dashpot"}) {
    Pairing s = Normal(law);
    SettingsOf<HertzOdenMartins>(s.settings).damping_kg_per_m_s = 1e3;
    SettingsOf<ElastoPlastic>(s.settings).critical_damping_share = 0.2;
    SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.05;
    ContactModel model(LawsByName(s.normal, s.tangential, s.rolling, s.cohesion));
    model.AddMaterial(s.a);
    model.SetContactProperties(0, 0, s.face, s.settings);
    double steepest = 0;
    for (const float overlap : {1e-6f, 1e-5f, 1e-4f}) {
      double force[2];
      for (const int moving : {0, 1}) {
        Contact c(s);
        c.g.overlap = overlap;
        c.g.v_rel = {0.0f, 0.0f, -0.01f * static_cast<float>(moving)};
        force[moving] = c.Step(1e-9f).force.z;
      }
      steepest = std::max(steepest, (force[1] - force[0]) / 0.01);
    }
    const Contact c(s);
    const double bound = model.Bounds({1e-4, c.g.r_eff, c.g.m_eff, 1e-8}).normal.damping;
    EXPECT_LE(steepest, 1.01 * bound) << law;
    EXPECT_GE(steepest, 0.7 * bound) << law;
  }
}

}  // namespace
}  // namespace grouser::dem

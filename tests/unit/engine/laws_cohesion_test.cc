// Cohesion: exact forces, distances and energies.
#include <gtest/gtest.h>

#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

struct JkrCase {
  double e, gamma, r;
};
const JkrCase kCases[] = {
    {1e6, 0.05, 1e-4}, {1e8, 0.05, 5e-3}, {5e7, 5.0, 3e-3}, {7e10, 1e-3, 1e-5}};

Pairing Sticky(const JkrCase& c, const char* law = "jkr") {
  Pairing s;
  s.cohesion = law;
  s.a = s.b = {c.e, 0.3};
  s.r = static_cast<float>(c.r);
  s.face.surface_energy_j_per_m2 = c.gamma;
  s.face.restitution = 1;
  return s;
}
double SnapOff(const JkrCase& c) {
  const double e = c.e / 0.91 / 2, r = c.r / 2;
  return -0.75 * std::cbrt(M_PI * M_PI * c.gamma * c.gamma * r / (e * e));
}

TEST(Jkr, PullOffForceAndSnapOffDistance) {
  for (const JkrCase& k : kCases) {
    Contact c(Sticky(k));
    const double snap = SnapOff(k), r = k.r / 2;
    c.PressTo(-snap, 100);
    double most = 0, broke = 0;
    const int n = 20000;
    for (int i = 0; i <= n && broke == 0; ++i) {
      const double overlap = -snap + 2.5 * snap * i / n;
      c.PressTo(overlap, 1);
      if (c.last.active) most = std::min<double>(most, c.last.force.z);
      if (!c.last.active) broke = overlap;
    }
    EXPECT_NEAR(most / (-1.5 * M_PI * k.gamma * r), 1, 1e-3) << k.e;
    EXPECT_NEAR(broke / snap, 1, 1e-3) << k.e;
    EXPECT_EQ(c.last.force.z, 0);
  }
}

TEST(Jkr, SolvesForTheContactRadiusOverTheWholeBranch) {
  for (const JkrCase& k : kCases) {
    Contact c(Sticky(k));
    const double e = k.e / 0.91 / 2, r = k.r / 2, d = std::sqrt(2 * M_PI * k.gamma / e);
    c.PressTo(1e-9, 1);
    for (const double share : {-0.999, -0.9, -0.5, -1e-3, 1e-3, 0.5, 3.0, 100.0}) {
      const double overlap = -share * SnapOff(k);
      if (overlap > 0.9 * r) continue;
      c.PressTo(overlap, 1);
      // Newton in double from far above, where the equation is convex.
      double a = std::sqrt(r * std::abs(overlap)) + std::cbrt(d * d * r * r) * 2;
      for (int i = 0; i < 200; ++i) {
        a -= (a * a / r - d * std::sqrt(a) - overlap) / (2 * a / r - 0.5 * d / std::sqrt(a));
      }
      const double f = 4 * e * a * a * a / (3 * r) - std::sqrt(8 * M_PI * k.gamma * e * a * a * a);
      const double scale = std::abs(f) + 1.5 * M_PI * k.gamma * r;
      EXPECT_NEAR(c.last.force.z, f, 2e-4 * scale) << k.e << " at " << share;
    }
  }
}

TEST(Jkr, NeckOnlyAfterTouching) {
  Contact c(Sticky(kCases[0]));
  EXPECT_FALSE((c.g.overlap = static_cast<float>(0.5 * SnapOff(kCases[0])), c.Step(1.0f).active));
  c.PressTo(1e-8, 1);
  EXPECT_TRUE((c.g.overlap = static_cast<float>(0.5 * SnapOff(kCases[0])), c.Step(1.0f).active));
  EXPECT_LT(c.last.force.z, 0);
}

// Touch, press, pull, snap: the work put in is what the law says it lost; on
// the way the stored energy follows the work.
TEST(Jkr, EnergyClosesOverACycle) {
  for (const JkrCase& k : kCases) {
    Contact c(Sticky(k));
    const double snap = SnapOff(k);
    c.g.overlap = 0;
    c.PressTo(1e-6 * -snap, 1);
    c.work = 0;
    const double touched = c.last.stored;
    EXPECT_LT(touched, 0);
    EXPECT_NEAR(c.lost, -touched, 1e-4 * -touched);
    c.PressTo(-5 * snap, 4000);
    EXPECT_NEAR(c.work, c.last.stored - touched, 1e-3 * (std::abs(touched) + std::abs(c.work)));
    c.PressTo(1.001 * snap, 8000);
    EXPECT_FALSE(c.last.active);
    EXPECT_NEAR(c.work, c.lost, 2e-3 * c.lost) << k.e;
    EXPECT_GT(c.lost, 0);
  }
}

TEST(Jkr, WithoutSurfaceEnergyIsHertz) {
  JkrCase k = {1e8, 0, 5e-3};
  Contact c(Sticky(k)), hertz(Sticky(k, "none"));
  for (const double overlap : {1e-12, 1e-9, 1e-6, 1e-3}) {
    for (Contact* x : {&c, &hertz}) {
      x->g.overlap = static_cast<float>(overlap);
      x->g.v_rel = {0.01f, 0.0f, -0.02f};
      x->Step(1e-7f);
    }
    EXPECT_NEAR(c.last.force.z / hertz.last.force.z, 1, 2e-6) << overlap;
    EXPECT_NEAR(c.last.stored / hertz.last.stored, 1, 2e-6) << overlap;
  }
  c.g.overlap = -1e-9f;
  EXPECT_FALSE(c.Step(1e-7f).active);
}

TEST(Jkr, AddsToTheStiffnessBound) {
  for (const JkrCase& k : kCases) {
    const Pairing s = Sticky(k);
    ContactModel model(LawsByName(s.normal, s.tangential, s.rolling, s.cohesion));
    model.AddMaterial(s.a);
    model.SetContactProperties(0, 0, s.face, s.settings);
    EXPECT_NEAR(model.Range(k.r, k.r / 2) / -SnapOff(k), 1, 1e-3);
    Contact c(s);
    const double top = -3 * SnapOff(k);
    c.PressTo(top, 1);
    const double f = c.last.force.z, slope = (c.PressTo(1.01 * top, 1) - f) / (0.01 * top);
    EXPECT_LE(slope, model.Bounds({1.01 * top, k.r / 2, 1e-3, 1e-8}).normal.stiffness) << k.e;
  }
}

TEST(JkrAdded, SixPiGammaRAtZeroOverlap) {
  for (const JkrCase& k : kCases) {
    Contact c(Sticky(k, "jkr_added"));
    c.PressTo(1e-12, 1);
    EXPECT_NEAR(c.last.force.z / (-6 * M_PI * k.gamma * k.r / 2), 1, 1e-3);
    c.g.overlap = -1e-12f;
    EXPECT_FALSE(c.Step(1.0f).active);
  }
}

// As printed: F_a = -2 sqrt(2 pi gamma E* a^3), a^3 = 3R*/(4E*) (F + C + sqrt(2CF + C^2)).
TEST(JkrAdded, AsPrintedAndConservative) {
  const JkrCase& k = kCases[2];
  const double e = k.e / 0.91 / 2, r = k.r / 2, big = 3 * M_PI * k.gamma * r;
  Contact c(Sticky(k, "jkr_added"));
  for (const double overlap : {1e-7, 1e-6, 1e-5, 1e-4}) {
    c.PressTo(overlap, 1);
    const double f = 4.0 / 3 * e * std::sqrt(r) * std::pow(overlap, 1.5);
    const double a3 = 3 * r / (4 * e) * (f + big + std::sqrt(2 * big * f + big * big));
    const double sum = f - 2 * std::sqrt(2 * M_PI * k.gamma * e * a3);
    EXPECT_NEAR(c.last.force.z, sum, 1e-4 * (f + big));
  }
  Contact slow(Sticky(k, "jkr_added"));
  slow.PressTo(1e-12, 1);
  slow.work = 0;
  for (const double overlap : {1e-5, 5e-5, 2e-4, 1e-12}) {
    slow.PressTo(overlap, 4000);
    EXPECT_NEAR(slow.work, slow.last.stored, 1e-3 * big * 2e-4) << overlap;
  }
}

TEST(Capillary, ForceRuptureAndEnergy) {
  for (const double angle : {0.0, 0.5}) {
    for (const double volume : {1e-12, 1e-10}) {
      Pairing s;
      s.cohesion = "capillary";
      auto& set = SettingsOf<Capillary>(s.settings);
      set.contact_angle_rad = angle;
      set.bridge_volume_m3 = volume;
      Contact c(s);
      const double r = 0.005, most = 2 * M_PI * r * 0.072 * std::cos(angle);
      const double rupture = (1 + angle / 2) * std::cbrt(volume);
      c.PressTo(-1e-6, 1);
      EXPECT_FALSE(c.last.active);  // no bridge before they touch
      c.PressTo(1e-12, 1);
      EXPECT_NEAR(c.last.force.z / -most, 1, 1e-3);
      c.work = 0;
      const double stored = c.last.stored;
      for (const double share : {0.1, 0.5, 0.999}) {
        c.PressTo(-share * rupture, 4000);
        const double x = share * rupture * std::sqrt(r / volume);
        EXPECT_NEAR(c.last.force.z, -most / (1 + 1.05 * x + 2.5 * x * x), 1e-4 * most) << share;
        EXPECT_NEAR(c.work, c.last.stored - stored, 1e-3 * c.lost) << share;
      }
      c.PressTo(-1.001 * rupture, 1);
      EXPECT_FALSE(c.last.active);
      EXPECT_NEAR(c.work, c.lost, 2e-3 * c.lost);
      c.PressTo(-0.5 * rupture, 1);
      EXPECT_FALSE(c.last.active);  // broken stays broken
    }
  }
}

TEST(Capillary, VolumeAsAShareOfTheRadiusAndRange) {
  Pairing s;
  s.cohesion = "capillary";
  SettingsOf<Capillary>(s.settings).bridge_volume_share = 0.02;
  s.wall = true;
  s.b = {kRigid, 0};
  Contact c(s);
  const double rupture = std::cbrt(0.02) * 0.005;
  c.PressTo(1e-12, 1);
  EXPECT_NEAR(c.last.force.z / (-4 * M_PI * 0.005 * 0.072), 1, 1e-3);  // sphere and plane
  c.PressTo(-0.999 * rupture, 10);
  EXPECT_TRUE(c.last.active);
  c.PressTo(-1.001 * rupture, 1);
  EXPECT_FALSE(c.last.active);
  ContactModel model(LawsByName("linear_spring", "linear_history", "none", "capillary"));
  model.AddMaterial(s.a);
  model.SetContactProperties(0, 0, s.face, s.settings);
  EXPECT_NEAR(model.Range(0.001, 0.005) / rupture, 1, 1e-3);
}

// What friction feels: under JKR the compression and twice the pull-off, with
// a bridge the compression of the grains alone.
TEST(Cohesion, Grip) {
  Pairing s = Sticky({1e8, 0.5, 5e-3});
  s.face.friction = 0.5;
  Contact jkr(s);
  jkr.PressTo(1e-6, 100);
  const double n = jkr.last.force.z, slid = -jkr.SlideBy(1e-4, 0, 1000).x;
  EXPECT_NEAR(slid, 0.5 * (n + 2 * 1.5 * M_PI * 0.5 * 0.0025), 1e-3 * slid);
  s.cohesion = "capillary";
  Contact wet(s);
  s.cohesion = "none";
  Contact dry(s);
  for (Contact* c : {&wet, &dry}) c->PressTo(1e-6, 100);
  EXPECT_LT(wet.last.force.z, dry.last.force.z);
  EXPECT_EQ(wet.SlideBy(1e-4, 0, 1000).x, dry.SlideBy(1e-4, 0, 1000).x);
}

}  // namespace
}  // namespace grouser::dem

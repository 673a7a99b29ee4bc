// Tangential laws along prescribed paths: stiffness, cap, dissipation in closed
// paths, passivity while the normal force changes, partial slip in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

const char* const kLaws[] = {"mindlin", "linear_history", "mindlin_displacement",
                             "mindlin_deresiewicz", "kelvin_regularised"};
constexpr double kEStar = 1e8 / 0.91 / 2, kGStar = 1e8 / (4 * 1.7 * 1.3), kR = 0.0025;

Pairing Shear(const char* law) {
  Pairing s;
  s.tangential = law;
  s.face.friction = 0.4;
  s.face.restitution = 1;
  SettingsOf<KelvinRegularised>(s.settings).critical_damping_share = 0;
  return s;
}
/// k_t at this overlap, from its own formula.
double Stiffness(const std::string& law, double overlap) {
  const double a = std::sqrt(kR * overlap), kn = 4.0 / 3 * kEStar * a;
  if (law == "linear_history") return 2.0 / 7 * kn;
  if (law == "kelvin_regularised") return 2 * (1 - 0.3) / (2 - 0.3) * kn;
  return 8 * kGStar * a;
}

TEST(Tangential, InitialStiffnessAndCap) {
  for (const char* law : kLaws) {
    Contact c(Shear(law));
    const double n = c.PressTo(2e-5, 200), kt = Stiffness(law, 2e-5);
    const double step = 1e-3 * 0.4 * n / kt;
    EXPECT_NEAR(-c.SlideBy(0.6 * step, 0.8 * step, 100).x / (kt * 0.6 * step), 1, 2e-3) << law;
    const Vec3f f = c.SlideBy(600 * step, 800 * step, 20000);
    c.SlideBy(6000 * step, 8000 * step, 20000);
    EXPECT_NEAR(std::hypot(c.last.force.x, c.last.force.y), 0.4 * n, 1e-4 * n) << law;
    EXPECT_NEAR(c.last.force.x / c.last.force.y, 0.75, 1e-3) << law;
    EXPECT_LE(std::hypot(f.x, f.y), 0.4001 * n) << law;
  }
}

// c = 2 share sqrt(k_t m*), or D sqrt(k_t m*) with the D of the normal law.
TEST(Tangential, Damping) {
  for (const char* law :
       {"mindlin", "linear_history", "mindlin_displacement", "kelvin_regularised"}) {
    Pairing s = Shear(law);
    s.face.restitution = 0.6;
    SettingsOf<LinearHistory>(s.settings).critical_damping_share = 0.2;
    SettingsOf<KelvinRegularised>(s.settings).critical_damping_share = 0.2;
    Contact c(s);
    c.PressTo(2e-5, 200);
    const bool shared = std::string(law).find("mindlin") == std::string::npos;
    const double d = shared ? 0.4 : 2 * std::sqrt(5.0 / 6) * LinearDampingRatio(0.6);
    const double v = 1e-3, kt = Stiffness(law, 2e-5), dt = 1e-12;
    c.g.v_rel = {static_cast<float>(v), 0.0f, 0.0f};
    const double f = -c.Step(static_cast<float>(dt)).force.x;
    EXPECT_NEAR(f, d * std::sqrt(kt * 0.5e-3) * v, 1e-3 * std::abs(f)) << law;
    EXPECT_NEAR(c.last.tangent_damping, f * v * dt, 1e-3 * f * v * dt) << law;
  }
}

TEST(LinearHistory, MindlinsRatioOnRequest) {
  Pairing s = Shear("linear_history");
  s.normal = "linear_spring";
  SettingsOf<LinearSpring>(s.settings).stiffness_n_per_m = 1e4;
  SettingsOf<LinearHistory>(s.settings).stiffness_ratio = 0;
  Contact c(s);
  c.PressTo(2e-5, 10);
  EXPECT_NEAR(-c.SlideBy(1e-8, 0, 10).x, 1e4 * 2 * 0.7 / 1.7 * 1e-8, 1e-7);
}

TEST(Kelvin, FrictionFallsFromStickingToSliding) {
  Pairing s = Shear("kelvin_regularised");
  auto& set = SettingsOf<KelvinRegularised>(s.settings);
  set.stick_friction = std::tan(27 * M_PI / 180);
  set.slide_friction = std::tan(25 * M_PI / 180);
  for (const double share : {0.01, 0.5, 1.0, 50.0}) {
    Contact c(s);
    const double n = c.PressTo(2e-5, 200), v = share * 0.0025;
    const double mu =
        std::tan(27 * M_PI / 180) -
        (std::tan(27 * M_PI / 180) - std::tan(25 * M_PI / 180)) * std::min(share, 1.0);
    EXPECT_NEAR(-c.SlideBy(1e-3, 0, 10000, 1e-7 / v).x / n, mu, 1e-4) << share;
  }
}

// Closed loops at a constant normal force, along a line and round polygons,
// below and above the cap: never a gain, and the balance closes.
TEST(Tangential, ClosedLoopsDissipate) {
  for (const char* law : kLaws) {
    for (const double size : {0.3, 0.8, 3.0}) {
      for (const int corners : {2, 3, 5, 12}) {
        Contact c(Shear(law));
        const double n = c.PressTo(2e-5, 200);
        const double reach = size * 0.4 * n / Stiffness(law, 2e-5);
        c.work = c.lost = 0;
        double before = 0, worst = 0;
        for (int turn = 0; turn < 4; ++turn) {
          for (int k = 0; k < corners; ++k) {
            const double a = 2 * M_PI * k / corners, b = 2 * M_PI * (k + 1) / corners;
            c.SlideBy(reach * (std::cos(b) - std::cos(a)), reach * (std::sin(b) - std::sin(a)),
                      1000);
            worst = std::min(worst, c.work);
          }
          // The first loop starts from rest; after it every loop is closed.
          if (turn > 0) {
            EXPECT_GE(c.work, before - 2e-5 * n * reach) << law << size << corners;
          }
          before = c.work;
        }
        EXPECT_GE(worst, -1e-5 * n * reach) << law << " " << size << " " << corners;
        const double tangential = c.work - c.lost;
        const double normal_stored = 0.4 * n * 2e-5;
        EXPECT_NEAR(tangential, c.last.stored - normal_stored, 2e-3 * c.work + 1e-4 * n * reach)
            << law << " " << size << " " << corners;
      }
    }
  }
}

/// Least running sum of tangential work over random walks of overlap and
/// position, as a share of all work done: negative where energy was made.
double WorstGain(const char* law, bool pressed_alone) {
  double worst = 0;
  for (int seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    Contact c(Shear(law));
    const double n = c.PressTo(2e-5, 200), reach = 0.4 * n / Stiffness(law, 2e-5);
    double tangential = 0, turnover = 0;
    for (int leg = 0; leg < 60; ++leg) {
      const double overlap = pressed_alone ? (leg % 2 ? 2e-5 : 4e-6) : 2e-5 * (1.05 + u(random));
      c.PressTo(overlap, 200);
      c.work = 0;
      c.SlideBy(reach * u(random), reach * u(random), 200);
      tangential += c.work;
      turnover += std::abs(c.work);
      worst = std::min(worst, tangential / turnover);
    }
  }
  return worst;
}

TEST(Tangential, PressingAndReleasingMakesNoEnergy) {
  for (const char* law :
       {"mindlin", "linear_history", "mindlin_deresiewicz", "kelvin_regularised"}) {
    EXPECT_GE(WorstGain(law, false), -1e-4) << law;
    EXPECT_GE(WorstGain(law, true), -1e-4) << law;
  }
}

// Sheared while loosely pressed, pressed hard, let go: the displacement form
// gives back more than it got (as its header says), the others do not.
TEST(Tangential, OnlyTheDisplacementFormMakesEnergy) {
  for (const char* law : kLaws) {
    Contact c(Shear(law));
    c.PressTo(1e-5, 200);
    const double reach = 0.2 * c.last.force.z / Stiffness(law, 1e-5);
    c.work = 0;
    c.SlideBy(reach, 0, 500);
    const double in = c.work;
    double tangential = in;
    c.PressTo(4e-5, 500);
    c.work = 0;
    double back = 0;
    while (c.last.force.x < 0) back += (c.SlideBy(-1e-3 * reach, 0, 1), 1e-3);
    tangential += c.work;
    if (std::string(law) == "mindlin_displacement") {
      EXPECT_NEAR(tangential / in, -1, 0.02);  // k_t doubled: twice the work comes back
    } else {
      EXPECT_GE(tangential, -1e-3 * in) << law;
    }
  }
}

// Under a constant normal force, Mindlin & Deresiewicz 1953 in closed form.
TEST(MindlinDeresiewicz, LoadingAndLoopUnderConstantNormalForce) {
  Contact c(Shear("mindlin_deresiewicz"));
  const double n = c.PressTo(2e-5, 200), kt = Stiffness("mindlin_deresiewicz", 2e-5), cap = 0.4 * n;
  const auto at = [&](double share) { return 1.5 * cap / kt * (1 - std::pow(1 - share, 2.0 / 3)); };
  double t = 0, x = 0;
  for (const double share : {0.2, 0.5, 0.8}) {
    t = -c.SlideBy(at(share) - x, 0, 4000).x;
    x = at(share);
    EXPECT_NEAR(t / cap, share, 2e-3) << share;
  }
  const auto swing = [&](double change) {  // displacement from a turn to a change of force
    return 3 * cap / kt * (1 - std::pow(1 - change / (2 * cap), 2.0 / 3));
  };
  EXPECT_NEAR(-c.SlideBy(-swing(t), 0, 4000).x / cap, 0, 2e-3);
  c.SlideBy(swing(t) - swing(2 * t), 0, 4000);
  EXPECT_NEAR(c.last.force.x / cap, t / cap, 3e-3);
  // One loop from -T to T and back dissipates the area between the branches.
  double area = 0;
  for (int k = 0; k < 4000; ++k) {
    const double f = 2 * t * (k + 0.5) / 4000;
    area += (swing(2 * t) - swing(f) - swing(2 * t - f)) * 2 * t / 4000;
  }
  c.SlideBy(swing(2 * t), 0, 4000);
  c.SlideBy(-swing(2 * t), 0, 4000);
  c.work = c.lost = 0;
  c.SlideBy(swing(2 * t), 0, 4000);
  c.SlideBy(-swing(2 * t), 0, 4000);
  EXPECT_NEAR(c.work / std::abs(area), 1, 0.02);
  EXPECT_NEAR(c.lost / std::abs(area), 1, 0.02);
}

// A small turn, a long way across it, and on: without the carried energy the
// increments would return more than was put in, each time round.
TEST(MindlinDeresiewicz, TurningAcrossMakesNoEnergy) {
  Contact c(Shear("mindlin_deresiewicz"));
  const double n = c.PressTo(2e-5, 200), reach = 0.4 * n / Stiffness("mindlin_deresiewicz", 2e-5);
  c.work = c.lost = 0;
  for (int round = 0; round < 5; ++round) {
    const double before = c.work;
    c.SlideBy(0.03 * reach, 0, 200);
    c.SlideBy(-0.005 * reach, 0, 200);
    c.SlideBy(0, 0.97 * reach, 2000);
    c.SlideBy(0.02 * reach, 0, 200);
    // Back until the force is gone.
    const Vec3f f = c.last.force;
    const double size = std::hypot(f.x, f.y), step = 1e-3 * reach;
    while (c.last.force.x * f.x + c.last.force.y * f.y > 0)
      c.SlideBy(f.x / size * step, f.y / size * step, 1);
    EXPECT_GE(c.work - before, -1e-3 * n * reach * 0.4) << round;
  }
  EXPECT_GE(c.work, 0);
  EXPECT_GE(c.lost, 0);
}

// Oblique impacts of grains on all laws: the balance closes, energy is lost.
TEST(Tangential, ObliqueImpactsCloseTheirBalance) {
  for (const char* law : kLaws) {
    for (const char* normal : {"hertz_restitution", "elasto_plastic", "hertz_oden_martins"}) {
      for (const double vt : {0.01, 0.1, 0.5}) {
        Pairing s = Shear(law);
        s.normal = normal;
        s.face.restitution = 0.8;
        SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0.1;
        SettingsOf<HertzOdenMartins>(s.settings).damping_kg_per_m_s = 100;
        EXPECT_NEAR(Collide(s, 0.3, vt, 1e-8).balance, 0, 1e-3)
            << law << " " << normal << " " << vt;
      }
    }
  }
}

// A sheared contact at rest keeps its force over a million steps.
TEST(Tangential, RestingContactDoesNotCreep) {
  for (const char* law : kLaws) {
    Contact c(Shear(law));
    c.g.n = {0.6f, 0.48f, 0.64f};
    c.PressTo(2e-5, 200);
    c.g.v_rel = {0.0f, 0.01f, -0.0075f};
    for (int k = 0; k < 20; ++k) c.Step(1e-6f);
    c.g.v_rel = {0.0f, 0.0f, 0.0f};
    c.Step(1e-6f);
    const Vec3f f = c.last.force;
    for (int k = 0; k < 1000000; ++k) c.Step(1e-6f);
    const Vec3f d = c.last.force - f;
    const Vec3f t = f - Dot(f, c.g.n) * c.g.n;
    EXPECT_GT(Dot(t, t), 0);
    EXPECT_LT(std::sqrt(Dot(d, d)), 1e-4 * std::sqrt(Dot(t, t))) << law;
  }
}

}  // namespace
}  // namespace grouser::dem

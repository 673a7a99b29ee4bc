#include "dem_offline/engine/rig/steady.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dem_offline/engine/rig/kinematics.h"

namespace grouser::dem {
namespace {

TEST(AverageBlocks, StandardErrorOfWhiteNoise) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(3, 2);
  double sum = 0;
  for (int k = 0; k < 200; ++k) {
    std::vector<double> x(1600);
    for (auto& v : x) v = normal(random);
    sum += AverageBlocks(x).standard_error;
  }
  // The largest of three estimates is on average a little above 2/sqrt(1600).
  EXPECT_GT(sum / 200, 0.05);
  EXPECT_LT(sum / 200, 0.07);
}

TEST(AverageBlocks, SeesADrift) {
  std::vector<double> x(800);
  for (int i = 0; i < 800; ++i) x[i] = 1 + 0.5 * i / 800.0 + 0.01 * std::sin(0.9 * i);
  const BlockMean m = AverageBlocks(x);
  EXPECT_NEAR(m.drift, 0.5, 0.01);
  EXPECT_GT(m.drift_t, 10);
}

Series Made(double drift) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.3);
  Series s;
  for (int i = 0; i < 2000; ++i) {
    const double transient = std::exp(-i / 100.0);
    s.time_s.push_back(1e-3 * i);
    s.f_x_n.push_back(-2 - 5 * transient + drift * i / 2000 + noise(random));
    s.f_y_n.push_back(noise(random));
    s.f_z_n.push_back(24 + noise(random));
    s.torque_n_m.push_back(0.1 + 0.01 * noise(random));
    s.sinkage_m.push_back(0.02 - 0.01 * transient + 1e-4 * noise(random));
    s.v_x_m_per_s.push_back(0.07 + 0.01 * noise(random));
    s.rim_speed_m_per_s.push_back(0.1 + 0.01 * noise(random));
    s.travel_m.push_back(1e-4 * i);
  }
  return s;
}

constexpr SteadyRule kHeld{.load_n = 24, .radius_m = 0.0625, .target_relative_error = 0.02};
constexpr SteadyRule kPulling{.load_n = 24,
                              .radius_m = 0.0625,
                              .target_relative_error = 0.02,
                              .mode = RigMode::kFreeSlip,
                              .drawbar_n = -2,
                              .speed_m_per_s = 0.1};

SteadyRule Towed() {
  SteadyRule rule = kPulling;
  rule.mode = RigMode::kTowed;
  rule.drawbar_n = 0;
  return rule;
}

TEST(FindSteady, SkipsTheTransient) {
  const SteadyWindow w = FindSteady(Made(0), 0, kHeld);
  EXPECT_TRUE(w.drift_free);
  EXPECT_TRUE(w.precise);
  EXPECT_GE(w.first, 500u);
}

TEST(FindSteady, NamesWhatDrifts) {
  const SteadyWindow w = FindSteady(Made(12), 0, kHeld);
  EXPECT_FALSE(w.drift_free);
  EXPECT_EQ(w.drifting, "f_x");
}

TEST(FindSteady, BalancedFreeAxesAreSteady) {
  EXPECT_TRUE(FindSteady(Made(0), 0, kHeld).Steady());
  EXPECT_TRUE(FindSteady(Made(0), 0, kPulling).Steady());
  Series towed = Made(0);
  for (double& t : towed.torque_n_m) t -= 0.1;
  EXPECT_TRUE(FindSteady(towed, 0, Towed()).Steady());
}

TEST(FindSteady, RefusesAFreeAxisOutOfBalance) {
  SteadyRule rule = kPulling;
  rule.drawbar_n = 5;  // 7 N more than the soil gives
  const SteadyWindow pulled = FindSteady(Made(0), 0, rule);
  EXPECT_TRUE(pulled.drift_free);
  EXPECT_EQ(pulled.unbalanced, "f_x");
  EXPECT_FALSE(pulled.Steady());
  EXPECT_FALSE(pulled.Enough());

  const SteadyWindow towed = FindSteady(Made(0), 0, Towed());  // a moment of 7 % of load r
  EXPECT_EQ(towed.unbalanced, "torque");
  EXPECT_FALSE(towed.Steady());

  Series falling = Made(0);
  for (double& f : falling.f_z_n) f -= 2;
  const SteadyWindow fell = FindSteady(falling, 0, kHeld);
  EXPECT_EQ(fell.unbalanced, "f_z");
  EXPECT_FALSE(fell.Steady());
}

TEST(FindSteady, NoiseDoesNotExcuseHalfTheLoad) {
  Series s = Made(0);
  for (std::size_t i = 0; i < s.f_z_n.size(); ++i) {
    s.f_z_n[i] += -12 + 30 * std::sin(0.02 * static_cast<double>(i));
  }
  EXPECT_EQ(FindSteady(s, 0, kHeld).unbalanced, "f_z");
}

TEST(FindSteady, RefusesAFreeSpeedThatDrifts) {
  Series s = Made(0);
  for (std::size_t i = 0; i < 2000; ++i) s.v_x_m_per_s[i] -= 5e-5 * static_cast<double>(i);
  EXPECT_TRUE(FindSteady(s, 0, kHeld).Steady());  // held: the rig moves it so
  const SteadyWindow w = FindSteady(s, 0, kPulling);
  EXPECT_EQ(w.drifting, "v_x");
  EXPECT_TRUE(w.speed_drifts);
  EXPECT_FALSE(w.Steady());

  s = Made(0);
  for (double& t : s.torque_n_m) t -= 0.1;
  for (std::size_t i = 0; i < 2000; ++i) s.rim_speed_m_per_s[i] += 2e-5 * static_cast<double>(i);
  const SteadyWindow towed = FindSteady(s, 0, Towed());
  EXPECT_EQ(towed.drifting, "rim speed");
  EXPECT_FALSE(towed.Steady());
}

TEST(FindSteady, RefusesALargeStandardError) {
  Series s = Made(0);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 120);  // of 2000 samples: 3 N and more
  for (double& f : s.f_y_n) f += noise(random);
  const SteadyWindow w = FindSteady(s, 0, kHeld);
  EXPECT_TRUE(w.drift_free);
  EXPECT_EQ(w.uncertain, "f_y");
  EXPECT_FALSE(w.Steady());
  EXPECT_FALSE(w.Enough());
}

TEST(AverageBlocks, AnExactLineDrifts) {
  std::vector<double> x(800);
  for (int i = 0; i < 800; ++i) x[i] = i / 512.0;
  EXPECT_GT(std::abs(AverageBlocks(x).drift_t), 1e3);
}

TEST(Kinematics, SlipRoundTrip) {
  for (const double beta : {0.0, 0.5, -0.7, 1.2, M_PI / 2}) {
    for (double slip = -2; slip <= 1; slip += 0.05) {
      if (slip < -1 - std::cos(beta) + 1e-9) continue;
      if (beta == M_PI / 2 && slip > 0.999) continue;
      const Motion m = MotionAt(slip, beta, 0.1);
      EXPECT_NEAR(SlipOf(m), slip, 1e-9);
      EXPECT_NEAR(std::max(std::abs(m.rim), std::hypot(m.v_x, m.v_y)), 0.1, 1e-9);
      if (std::hypot(m.v_x, m.v_y) > 1e-6) {
        EXPECT_NEAR(std::atan2(m.v_y, m.v_x), beta, 1e-6);
      }
    }
  }
  EXPECT_NEAR(SlipOf(MotionAt(1.0, M_PI / 2, 0.1)), 1.0, 1e-9);
  EXPECT_THROW(MotionAt(1.2, 0.3, 0.1), std::invalid_argument);
  EXPECT_THROW(MotionAt(-1.9, 1.2, 0.1), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::dem

// Rolling laws: size, direction, cap, and the energy they say they take.
#include <gtest/gtest.h>

#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

Pairing Rolls(const char* law) {
  Pairing s;
  s.rolling = law;
  s.face.rolling_friction = 0.1;
  return s;
}

TEST(ConstantTorque, AgainstTheRelativeSpinAtItsFullSize) {
  Contact c(Rolls("constant_torque"));
  const double n = c.PressTo(2e-5, 200), most = 0.1 * 0.0025 * n;
  EXPECT_EQ(c.last.moment.y, 0);
  for (const float w : {1e-4f, 1.0f, 100.0f}) {
    c.g.w_rel = {-0.6f * w, 0.8f * w, 5.0f};  // the spin about n does not count
    c.Step(1e-9f);
    EXPECT_NEAR(c.last.moment.x / (0.6 * most), 1, 1e-4) << w;
    EXPECT_NEAR(c.last.moment.y / (-0.8 * most), 1, 1e-4) << w;
    EXPECT_EQ(c.last.moment.z, 0);
  }
  EXPECT_NEAR(c.last.rolling / (most * 100 * 1e-9), 1, 1e-3);
}

TEST(OwnSpin, AgainstTheGrainsOwnSpinAndAShareOfItAtMost) {
  Contact c(Rolls("own_spin"));
  const double n = c.PressTo(2e-5, 200), most = 0.1 * 0.005 * n,
               inertia = 0.4 * 1e-3 * 0.005 * 0.005;
  c.g.w_rel = {50.0f, 0.0f, 0.0f};
  c.g.w_own = {0.0f, 3.0f, 4.0f};
  c.Step(1e-7f);
  EXPECT_NEAR(c.last.moment.y / (-0.6 * most), 1, 1e-4);
  EXPECT_NEAR(c.last.moment.z / (-0.8 * most), 1, 1e-4);
  const float w = static_cast<float>(0.01 * most * 1e-4 / inertia);  // would turn round
  c.g.w_own = {w, 0.0f, 0.0f};
  c.Step(1e-4f);
  EXPECT_NEAR(c.last.moment.x * 1e-4 / inertia / -w, kSpinShare, 1e-4);
  c.g.w_own = {0.0f, 0.0f, 0.0f};
  EXPECT_EQ(c.Step(1e-4f).moment.x, 0);
}

TEST(ConstantTorque, AShareOfTheRelativeSpinAtMost) {
  Contact c(Rolls("constant_torque"));
  c.PressTo(2e-5, 200);
  const double inertia = 0.2 * 1e-3 * 0.005 * 0.005, w = 1e-3;  // of two equal grains
  c.g.w_rel = {static_cast<float>(w), 0.0f, 0.0f};
  c.Step(1e-4f);
  EXPECT_NEAR(c.last.moment.x * 1e-4 / inertia / -w, kSpinShare, 1e-4);
}

// A grain amid others whose torques all act on it (twelve against the spin relative
// to equal partners, six against its own) comes to rest without its spin ever
// turning round.
TEST(ConstantTorque, ManyContactsNeverTurnTheSpinRound) {
  for (const char* law : {"constant_torque", "own_spin"}) {
    Contact c(Rolls(law));
    c.PressTo(2e-5, 200);
    const double inertia = 0.4 * 1e-3 * 0.005 * 0.005, dt = 1e-4;
    double w = 3;
    for (int k = 0; k < 100; ++k) {
      const double before = w;
      c.g.w_rel = c.g.w_own = {static_cast<float>(w), 0.0f, 0.0f};
      w += (law == std::string("own_spin") ? 6 : 12) * c.Step(static_cast<float>(dt)).moment.x /
           inertia * dt;
      EXPECT_LE(std::abs(w), before + 1e-6) << law << " step " << k;
      EXPECT_GE(w, -1e-6) << law << " step " << k;
    }
  }
}

// A rolling sphere is brought to rest by the constant torque, and the loss the
// law states is its energy, with the spin capped near rest too.
TEST(ConstantTorque, LossIsTheSpinEnergy) {
  for (const char* law : {"constant_torque", "own_spin"}) {
    Pairing s = Rolls(law);
    s.wall = true;
    s.b = {kRigid, 0};
    Contact c(s);
    const double inertia = 1.4 * 1e-3 * 0.005 * 0.005, n = c.PressTo(2e-5, 200), dt = 1e-5;
    double w = 7.3;
    c.lost = 0;
    const double stop = w * inertia / (0.1 * 0.005 * n);
    for (int k = 0; k < 10 * stop / dt; ++k) {
      c.g.w_rel = c.g.w_own = {static_cast<float>(w), 0.0f, 0.0f};
      w += c.Step(static_cast<float>(dt)).moment.x / inertia * dt;
    }
    EXPECT_NEAR(w, 0, 0.1 * 0.005 * n / inertia * dt);
    EXPECT_NEAR(c.lost / (0.5 * inertia * 7.3 * 7.3), 1, 1e-3) << law;
  }
}

TEST(Epsd, SpringUpToItsCap) {
  Pairing s = Rolls("epsd");
  s.face.rolling_damping = 0;
  Contact c(s);
  const double n = c.PressTo(2e-5, 200), arm = 0.1 * 0.0025, kr = 2.25 * n / 2e-5 * arm * arm;
  const double turn = 0.1 * arm * n / kr;
  c.g.w_rel = {static_cast<float>(turn / 1e-4), 0.0f, 0.0f};
  for (int k = 0; k < 100; ++k) c.Step(1e-6f);
  EXPECT_NEAR(-c.last.moment.x / (0.1 * arm * n), 1, 1e-3);
  for (int k = 0; k < 2000; ++k) c.Step(1e-6f);
  EXPECT_NEAR(-c.last.moment.x / (arm * n), 1, 1e-3);
}

TEST(Epsd, Damping) {
  Pairing s = Rolls("epsd");
  Contact c(s);
  const double n = c.PressTo(2e-5, 200), arm = 0.1 * 0.0025, kr = 2.25 * n / 2e-5 * arm * arm;
  const double w = 1e-2, rate = 2 * 0.3 * std::sqrt(c.g.roll_inertia * kr);
  c.g.w_rel = {static_cast<float>(w), 0.0f, 0.0f};
  c.Step(1e-12f);
  EXPECT_NEAR(-c.last.moment.x / (rate * w), 1, 1e-3);
  EXPECT_NEAR(c.last.rolling / (rate * w * w * 1e-12), 1, 1e-3);
}

}  // namespace
}  // namespace grouser::dem

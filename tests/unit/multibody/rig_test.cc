// A wheel testbed as shin2020 has it: carriage on a rail (driven), hub on a vertical slider with
// a spring-damper, wheel on a driven axle. The paper prints neither the springs nor the masses of
// its rig but the wheel's; those here are of the same kind and size.
#include <gtest/gtest.h>

#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

constexpr double kCarriage = 5, kHub = 2, kWheel = 3.31, kSpring = 4000, kDamper = 30;
constexpr double kSpeed = 0.01, kSpin = 0.1;

MultibodySpec Rig(bool driven) {
  MultibodySpec spec;
  const double axle = 0.1, i = 0.5 * kWheel * 0.095 * 0.095;
  spec.bodies = {Solid("carriage", kCarriage, {0.05, 0.05, 0.05}, {0, 0, 0.4}),
                 Solid("hub", kHub, {0.01, 0.01, 0.01}, {0, 0, axle}),
                 Solid("wheel", kWheel, {0.6 * i, i, 0.6 * i}, {0, 0, axle})};
  spec.joints = {
      JointAt(spec, "rail", JointType::kTranslational, kGround, "carriage", {0, 0, 0.4}, {1, 0, 0}),
      JointAt(spec, "column", JointType::kTranslational, "carriage", "hub", {0, 0, axle},
              {0, 0, 1}),
      JointAt(spec, "axle", JointType::kRevolute, "hub", "wheel", {0, 0, axle}, {0, 1, 0})};
  LinearSpringSpec s;
  s.name = "suspension";
  s.body_a = "carriage";
  s.body_b = "hub";
  s.stiffness_n_per_m = kSpring;
  s.damping_n_s_per_m = kDamper;
  s.free_length_m = 0.3;
  spec.linear_springs = {s};
  RotationalSpringSpec r;
  r.name = "motor";
  r.joint = "axle";
  r.damping_n_m_s_per_rad = 0.02;  // of the gear
  spec.rotational_springs = {r};
  if (driven) {
    spec.joints[0].rate = {[](double) { return kSpeed; }};
    spec.joints[2].rate = {[](double) { return kSpin; }};
  }
  return spec;
}

TEST(Rig, HangsInStaticBalanceAndSwingsWithItsFrequency) {
  MultibodySystem m(Rig(true));
  const double mass = kHub + kWheel, sag = mass * kG / kSpring;
  const double decay = kDamper / (2 * mass), w = std::sqrt(kSpring / mass - decay * decay);
  // It starts at the free length: a decaying swing about the sag.
  for (int s = 0; s < 12000; ++s) {
    m.Advance(1e-3);
    const double t = m.time_s();
    const double z =
        -sag + sag * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
    ASSERT_NEAR(m.Coordinates("column")[0], z, 1e-3 * sag) << t;
    ASSERT_NEAR(m.Coordinates("rail")[0], kSpeed * t, 1e-8);
    ASSERT_NEAR(m.Coordinates("axle")[0], kSpin * t, 1e-8);
  }
  EXPECT_NEAR(m.SpringForce("suspension"), mass * kG, 1e-3 * mass * kG);
  EXPECT_NEAR(m.Reaction("rail").fz, (mass + kCarriage) * kG, 1e-3 * mass * kG);
  // 12 s: the wheel stands where its joints leave it, to 1e-8 m.
  const Vec3d wheel = m.Placement(2).position_m;
  EXPECT_NEAR(wheel[0], kSpeed * 12, 1e-8);
  EXPECT_NEAR(wheel[1], 0, 1e-8);
  EXPECT_NEAR(m.SpringForce("motor"), -0.02 * kSpin, 1e-12);
}

TEST(Rig, LoadOnTheWheelReachesTheRail) {
  MultibodySystem m(Rig(true));
  const double mass = kHub + kWheel;
  std::vector<Wrench> grains(3);
  grains[2] = {-5, 2, 20, 0.5, -0.4, 0.1};  // of the ground on the wheel
  for (int s = 0; s < 4000; ++s) m.Advance(1e-3, grains);
  EXPECT_NEAR(m.Coordinates("column")[0], (20 - mass * kG) / kSpring, 1e-3 * mass * kG / kSpring);
  const Wrench rail = m.Reaction("rail");
  EXPECT_NEAR(rail.fx, 5, 1e-6);
  EXPECT_NEAR(rail.fy, -2, 1e-6);
  EXPECT_NEAR(rail.fz, (mass + kCarriage) * kG - 20, 1e-2);
  EXPECT_NEAR(m.ReactionIn("axle", "hub", {}).ty, 0.4 + 0.02 * kSpin, 1e-9);  // drive and gear
}

}  // namespace
}  // namespace grouser::dem

// Springs, dampers, actuators, prescribed motions and locks against their closed forms.
#include <gtest/gtest.h>

#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

/// A block on a rail along x and a wall at x = 0, without gravity.
MultibodySpec Rail(double mass, double x) {
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("block", mass, {0.1, 0.1, 0.1}, {x, 0, 0})};
  spec.joints = {
      JointAt(spec, "rail", JointType::kTranslational, kGround, "block", {x, 0, 0}, {1, 0, 0})};
  LinearSpringSpec s;
  s.name = "spring";
  s.body_b = "block";
  spec.linear_springs = {s};
  return spec;
}

/// A wheel on an axle along y, with a spring about it.
MultibodySpec Wheel(double inertia) {
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("wheel", 1, {inertia, inertia, inertia}, {0, 0, 0})};
  spec.joints = {JointAt(spec, "axle", JointType::kRevolute, kGround, "wheel", {}, {0, 1, 0})};
  RotationalSpringSpec s;
  s.name = "torsion";
  s.joint = "axle";
  spec.rotational_springs = {s};
  return spec;
}

/// x(t) of m x" + c x' + k x = 0 from x0 at rest.
double Damped(double m, double c, double k, double x0, double t) {
  const double decay = c / (2 * m), w = std::sqrt(k / m - decay * decay);
  return x0 * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
}

TEST(Springs, LinearOneDecaysAsItShould) {
  MultibodySpec spec = Rail(2, 0.6);
  spec.linear_springs[0].stiffness_n_per_m = 300;
  spec.linear_springs[0].damping_n_s_per_m = 4;
  spec.linear_springs[0].free_length_m = 0.5;
  MultibodySystem m(spec);
  for (int s = 0; s < 2000; ++s) {
    m.Advance(1e-3);
    ASSERT_NEAR(m.Coordinates("rail")[0] + 0.1, Damped(2, 4, 300, 0.1, m.time_s()), 1e-4 * 0.1);
  }
  // What went into the damper is what the spring has lost.
  const MultibodyEnergy e = m.Energy();
  EXPECT_NEAR(e.Balance(), 0.5 * 300 * 0.01, 1e-4 * 1.5);
  EXPECT_GT(e.dissipated, 1.4);
}

TEST(Springs, TheOrderIsTwo) {
  const auto error = [](double dt) {
    MultibodySpec spec = Rail(2, 0.6);
    spec.linear_springs[0].stiffness_n_per_m = 300;
    spec.linear_springs[0].damping_n_s_per_m = 10;
    spec.linear_springs[0].free_length_m = 0.5;
    MultibodySystem m(spec);
    for (int s = 0; s < std::lround(0.5 / dt); ++s) m.Advance(dt);
    return std::abs(m.Coordinates("rail")[0] + 0.1 - Damped(2, 10, 300, 0.1, 0.5));
  };
  EXPECT_NEAR(std::log2(error(2e-3) / error(1e-3)), 2, 0.1);
}

TEST(Springs, ActuatorPushesItsEndsApart) {
  MultibodySpec spec = Rail(2, 0.5);
  spec.linear_springs[0].force_n = [](double t) { return 3 * t; };
  MultibodySystem m(spec);
  for (int s = 0; s < 1000; ++s) m.Advance(1e-3);
  EXPECT_NEAR(m.Coordinates("rail")[0], 3.0 / (6 * 2), 1e-3 * 0.25);  // t^3/6
  EXPECT_NEAR(m.SpringForce("spring"), -3 * 0.999, 1e-12);            // tension
  EXPECT_NEAR(m.SpringLength("spring"), 0.75, 2e-3);
  EXPECT_NEAR(m.Energy().actuators, m.Energy().kinetic, 1e-3 * m.Energy().kinetic);
}

TEST(Springs, RotationalOneDecaysAsItShould) {
  MultibodySpec spec = Wheel(0.02);
  spec.rotational_springs[0].stiffness_n_m_per_rad = 3;
  spec.rotational_springs[0].damping_n_m_s_per_rad = 0.02;
  spec.rotational_springs[0].free_angle_rad = -0.4;
  MultibodySystem m(spec);
  for (int s = 0; s < 2000; ++s) {
    m.Advance(1e-3);
    ASSERT_NEAR(m.Coordinates("axle")[0] + 0.4, Damped(0.02, 0.02, 3, 0.4, m.time_s()), 1e-3 * 0.4);
  }
}

TEST(Springs, RotationalOneCountsWholeTurns) {
  // Wound from three turns away: the angle is not wrapped, so that it swings to six.
  MultibodySpec spec = Wheel(0.02);
  spec.rotational_springs[0].stiffness_n_m_per_rad = 3;
  spec.rotational_springs[0].free_angle_rad = 6 * M_PI;
  MultibodySystem m(spec);
  double high = 0;
  for (int s = 0; s < 1000; ++s) {
    m.Advance(1e-3);
    const double angle = m.Coordinates("axle")[0];
    high = std::max(high, angle);
    ASSERT_NEAR(angle - 6 * M_PI, Damped(0.02, 0, 3, -6 * M_PI, m.time_s()), 1e-3 * 6 * M_PI);
  }
  EXPECT_NEAR(high, 12 * M_PI, 1e-3 * 12 * M_PI);
}

TEST(Springs, TorqueSpeedsAWheelUp) {
  MultibodySpec spec = Wheel(0.02);
  spec.rotational_springs[0].torque_n_m = [](double) { return 0.5; };
  spec.rotational_springs[0].damping_n_m_s_per_rad = 0.05;
  MultibodySystem m(spec);
  for (int s = 0; s < 400; ++s) m.Advance(1e-3);
  const double rate = 0.5 / 0.05 * (1 - std::exp(-0.05 / 0.02 * (0.4 - 0.5e-3)));
  EXPECT_NEAR(m.Rates("axle")[0], rate, 1e-5 * rate);
  const MultibodyEnergy e = m.Energy();
  EXPECT_NEAR(e.actuators, e.kinetic + e.dissipated, 1e-4 * e.actuators);
}

TEST(Springs, ReactOnBothBodies) {
  // Two free bodies and a damped spring between points off their centres: momenta stay.
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("a", 1, {0.01, 0.02, 0.02}, {0, 0, 0}),
                 Solid("b", 3, {0.03, 0.02, 0.04}, {0.5, 0.1, 0})};
  LinearSpringSpec s;
  s.name = "s";
  s.body_a = "a";
  s.body_b = "b";
  s.point_a_m = {0.1, 0.05, 0};
  s.point_b_m = {0, -0.1, 0.05};
  s.stiffness_n_per_m = 100;
  s.damping_n_s_per_m = 1;
  s.free_length_m = 0.2;
  spec.linear_springs = {s};
  MultibodySystem m(spec);
  double largest = 0;
  for (int k = 0; k < 5000; ++k) {
    m.Advance(2e-4);
    const auto p = m.Momentum();
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(p[0][a], 0, 1e-12);
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(p[1][a], 0, 1e-5);
    largest = std::max(largest, m.Energy().kinetic);
  }
  EXPECT_GT(largest, 0.5);
}

TEST(Motions, FollowTheirProgramsAndBookTheirWork) {
  MultibodySpec spec = Rail(2, 0.5);
  spec.linear_springs[0].free_length_m = 0.5;
  spec.linear_springs[0].damping_n_s_per_m = 7;
  spec.joints[0].coordinate = {[](double t) { return 0.1 * std::sin(10 * t); }};
  MultibodySystem m(spec);
  double worst = 0;
  m.Advance(1e-3);
  const double start = m.Energy().Balance();
  for (int s = 1; s < 1000; ++s) {
    m.Advance(1e-3);
    ASSERT_NEAR(m.Coordinates("rail")[0], 0.1 * std::sin(10 * m.time_s()), 1e-12);
    const double t = m.time_s() - 1e-3;  // of the forces
    const double needed = -2 * 10 * std::sin(10 * t) + 7 * std::cos(10 * t);
    worst = std::max(worst, std::abs(-needed - m.ReactionIn("rail", kGround, {}).fx));
    worst = std::min(worst, 20.0);
  }
  EXPECT_LT(std::abs(m.Energy().Balance() - start), 1e-3 * m.Energy().dissipated);
  // (the drive's force is that on the block along x)
  const double t = m.time_s() - 1e-3;
  EXPECT_NEAR(m.Reaction("rail").fx, -20 * std::sin(10 * t) + 7 * std::cos(10 * t), 1e-3 * 20);
}

TEST(Motions, RatesAreIntegrated) {
  MultibodySpec spec = Wheel(0.02);
  spec.joints[0].rate = {[](double t) { return 4 * t; }};
  MultibodySystem m(spec);
  for (int s = 0; s < 1000; ++s) m.Advance(1e-3);
  EXPECT_NEAR(m.Coordinates("axle")[0], 2, 1e-9);
  EXPECT_NEAR(m.Reaction("axle").ty, 0.02 * 4, 1e-9);  // the drive's torque
}

TEST(Locks, HoldAndLetGo) {
  MultibodySpec spec = Rail(2, 0.6);
  spec.linear_springs[0].stiffness_n_per_m = 300;
  spec.linear_springs[0].free_length_m = 0.5;
  spec.joints[0].locked = true;
  MultibodySystem m(spec);
  for (int s = 0; s < 100; ++s) m.Advance(1e-3);
  EXPECT_EQ(m.Coordinates("rail")[0], 0);
  EXPECT_NEAR(m.Reaction("rail").fx, 30, 1e-9);
  m.SetLocked("rail", false);
  for (int s = 0; s < 128; ++s) m.Advance(1e-3);
  EXPECT_NEAR(m.Coordinates("rail")[0], -0.1 + 0.1 * std::cos(std::sqrt(150.0) * 0.128), 1e-3);
  EXPECT_GT(m.Energy().kinetic, 1);
  const double balance = m.Energy().Balance();
  m.SetLocked("rail", true);  // from full speed
  for (int s = 0; s < 100; ++s) m.Advance(1e-3);
  EXPECT_NEAR(m.Energy().kinetic, 0, 1e-20);
  EXPECT_LT(m.Energy().drives, -1);
  EXPECT_NEAR(m.Energy().Balance(), balance, 0.02);
}

TEST(Steps, ADamperTooStiffForTheStepIsNamed) {
  MultibodySpec spec = Rail(2, 0.6);
  spec.linear_springs[0].damping_n_s_per_m = 1e5;
  spec.bodies[0].velocity_m_per_s = {1, 0, 0};
  MultibodySystem m(spec);
  m.Advance(1e-3);
  const MultibodyState before = m.Save();
  EXPECT_NE(Message([&] { m.Advance(1e-3); }).find("too long for the dampers"), std::string::npos);
  EXPECT_EQ(m.Save().coordinates, before.coordinates);
  EXPECT_EQ(m.Save().time_s, before.time_s);
}

}  // namespace
}  // namespace grouser::dem

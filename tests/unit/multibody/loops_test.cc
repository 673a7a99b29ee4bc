// Closed loops: kinematics, drift, and states that go on with the same bits.
#include <gtest/gtest.h>

#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

MultibodyBody Bar(const std::string& name, Vec3d from, Vec3d to, double mass) {
  const Vec3d d = Sub(to, from);
  const double l = Norm(d), i = mass * l * l / 12;
  MultibodyBody b = Solid(name, mass, {1e-3 * i, i, i}, Scale(0.5, Add(from, to)));
  b.inertia_kg_m2[0] = 0.01 * i;
  const double angle = std::atan2(-d[2], d[0]);  // in the plane x-z, x along the bar
  b.orientation = TurnAbout(1, angle);
  return b;
}

/// Ground 0-(0.4,0,0), crank 0.1, coupler, rocker 0.3; hinges along y.
MultibodySpec FourBar() {
  const Vec3d o = {0, 0, 0}, a = {0, 0, 0.1}, b = {0.3, 0, 0.28}, c = {0.4, 0, 0};
  MultibodySpec spec;
  spec.bodies = {Bar("crank", o, a, 0.5), Bar("coupler", a, b, 1), Bar("rocker", c, b, 1)};
  const Vec3d y = {0, 1, 0};
  spec.joints = {JointAt(spec, "o", JointType::kRevolute, kGround, "crank", o, y),
                 JointAt(spec, "a", JointType::kRevolute, "crank", "coupler", a, y),
                 JointAt(spec, "b", JointType::kRevolute, "coupler", "rocker", b, y),
                 JointAt(spec, "c", JointType::kRevolute, kGround, "rocker", c, y)};
  return spec;
}

/// How far the hinge's frames are apart.
double Apart(const MultibodySystem& m, const JointSpec& j) {
  const auto at = [&](const std::string& body, const JointFrame& f) {
    if (body == kGround) return f.position_m;
    const BodyPlacement p = m.Placement(m.BodyNumber(body));
    return Add(p.position_m, MatrixOf(p.orientation) * f.position_m);
  };
  return Norm(Sub(at(j.parent, j.in_parent), at(j.child, j.in_child)));
}

TEST(Loops, FourBarSwingsForTwelveSecondsWithoutDrift) {
  MultibodySpec spec = FourBar();
  MultibodySystem m(spec);
  m.Advance(1e-3);
  const double start = m.Energy().Balance();
  double drift = 0, kinetic = 0, gap = 0;
  for (int s = 0; s < 12000; ++s) {
    m.Advance(1e-3);
    for (const JointSpec& j : spec.joints) drift = std::max(drift, Apart(m, j));
    gap = std::max(gap, m.Gap());
    kinetic = std::max(kinetic, m.Energy().kinetic);
    ASSERT_LT(std::abs(m.Energy().Balance() - start), 2e-3 * std::max(kinetic, 0.05)) << m.time_s();
  }
  EXPECT_LT(drift, 1e-8);
  EXPECT_LT(gap, 1e-8);
  EXPECT_GT(kinetic, 1);
}

TEST(Loops, DrivenFourBarHasTheRockersAngle) {
  MultibodySpec spec = FourBar();
  spec.joints[0].coordinate = {[](double t) { return 6 * t; }};
  MultibodySystem m(spec);
  const double coupler = std::hypot(0.3, 0.18), rocker = std::hypot(0.1, 0.28);
  for (int s = 0; s < 2000; ++s) {
    m.Advance(1e-3);
    const double t = 6 * m.time_s();
    // Freudenstein: the pin b is where both circles meet, above the ground line.
    const double ax = 0.1 * std::sin(t), az = 0.1 * std::cos(t);
    const double dx = 0.4 - ax, dz = -az, d = std::hypot(dx, dz);
    const double u = (coupler * coupler - rocker * rocker + d * d) / (2 * d);
    const double h = std::sqrt(coupler * coupler - u * u);
    const double bx = ax + u * dx / d - h * dz / d, bz = az + u * dz / d + h * dx / d;
    const BodyPlacement p = m.Placement(m.BodyNumber("rocker"));
    const Vec3d pin = Add(p.position_m, MatrixOf(p.orientation) * Vec3d{rocker / 2, 0, 0});
    ASSERT_NEAR(pin[0], bx, 1e-6) << t;
    ASSERT_NEAR(pin[2], bz, 1e-6) << t;
    ASSERT_LT(m.Gap(), 1e-10);
  }
}

TEST(Loops, ThatDoNotCloseAreNamed) {
  MultibodySpec spec = FourBar();
  spec.joints[2].in_child.position_m[0] += 1e-3;
  const std::string said = Message([&] { MultibodySystem m(spec); });
  EXPECT_NE(said.find("joint 'b': its frames are 0.001 m"), std::string::npos) << said;
  EXPECT_NE(said.find("revolute joint leaves free, expected at most 1e-6"), std::string::npos);
}

TEST(States, GoOnWithTheSameBits) {
  MultibodySpec spec = FourBar();
  MultibodyBody ball = Solid("ball", 1, {1e-3, 2e-3, 2.5e-3}, {0.4, 0.2, 0});
  ball.spin_rad_per_s = {3, 4, 5};
  spec.bodies.push_back(ball);
  spec.bodies.push_back(Solid("hung", 1, {1e-3, 2e-3, 2.5e-3}, {0, 1, 0}));
  spec.joints.push_back(
      JointAt(spec, "pivot", JointType::kSpherical, kGround, "hung", {0, 1, 0.2}, {0, 0, 1}));
  LinearSpringSpec s;
  s.name = "s";
  s.body_a = "coupler";
  s.body_b = "ball";
  s.stiffness_n_per_m = 50;
  s.damping_n_s_per_m = 0.5;
  spec.linear_springs = {s};
  MultibodySystem whole(spec), first(spec), second(spec);
  const std::vector<Wrench> push(5, Wrench{0.1, 0.2, 0.3, 0.01, 0.02, 0.03});
  for (int k = 0; k < 100; ++k) whole.Advance(1e-3, push);
  for (int k = 0; k < 50; ++k) first.Advance(1e-3, push);
  second.Advance(5e-4);  // of no account
  second.Restore(first.Save());
  for (int k = 0; k < 50; ++k) second.Advance(1e-3, push);
  EXPECT_EQ(whole.Save().coordinates, second.Save().coordinates);
  EXPECT_EQ(whole.Save().speeds, second.Save().speeds);
  EXPECT_EQ(whole.Energy().Balance(), second.Energy().Balance());
  EXPECT_EQ(whole.Placement(3).position_m, second.Placement(3).position_m);
  MultibodyState other = first.Save();
  other.speeds.pop_back();
  EXPECT_NE(Message([&] { second.Restore(other); }).find("state: speeds"), std::string::npos);
}

}  // namespace
}  // namespace grouser::dem

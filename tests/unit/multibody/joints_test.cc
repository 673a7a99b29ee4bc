// Each joint against its closed form to 0.1 % or better.
#include <gtest/gtest.h>

#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

TEST(Joints, RevoluteSwingsWithTheEllipticPeriod) {
  // A rod of length 1 m hung at its end, released at 90 degrees: T = 4 K(sin 45) sqrt(2l/(3g)).
  MultibodySpec spec;
  spec.bodies = {Solid("rod", 2, {2 / 12.0, 1e-3, 2 / 12.0}, {0, 0.5, 0})};
  spec.bodies[0].inertia_kg_m2[1] = 2e-3;
  spec.joints = {
      JointAt(spec, "hinge", JointType::kRevolute, kGround, "rod", {0, 0, 0}, {1, 0, 0})};
  MultibodySystem m(spec);
  const double period = PeriodOf(m, 1e-3, 3, [&] { return m.Placement(0).position_m[1]; });
  EXPECT_NEAR(period, 4 * EllipticK(std::sin(M_PI / 4)) * std::sqrt(2 / (3 * kG)), 1e-4 * period);
  EXPECT_NEAR(m.Placement(0).position_m[0], 0, 1e-12);
}

TEST(Joints, RevoluteReactionIsThatOfASwing) {
  // A point-like bob let go at the horizontal pulls with 3 m g at the bottom.
  MultibodySpec spec;
  spec.bodies = {Solid("bob", 2, {1e-6, 1e-6, 1e-6}, {0, 0.5, 0})};
  spec.joints = {
      JointAt(spec, "hinge", JointType::kRevolute, kGround, "bob", {0, 0, 0}, {1, 0, 0})};
  MultibodySystem m(spec);
  double most = 0;
  for (int s = 0; s < 5000; ++s) {
    m.Advance(1e-4);
    most = std::max(most, m.Reaction("hinge").fz);
  }
  EXPECT_NEAR(most, 3 * 2 * kG, 1e-3 * 60);
  // In the bob's own frame, at its centre, the pull is along the string and has no moment.
  const Wrench own = m.ReactionIn("hinge", "bob", {});
  const Wrench world = m.Reaction("hinge");
  EXPECT_NEAR(std::hypot(own.fx, own.fy, own.fz), std::hypot(world.fx, world.fy, world.fz), 1e-9);
  EXPECT_NEAR(std::abs(own.fy), std::hypot(own.fx, own.fy, own.fz), 1e-3);
  EXPECT_NEAR(std::hypot(own.tx, own.ty, own.tz), 0, 1e-3);
}

TEST(Joints, TranslationalOscillatesOnAnIncline) {
  // Slope 30 degrees, spring along it: period 2 pi sqrt(m/k), middle at m g sin/k.
  MultibodySpec spec;
  const double slope = M_PI / 6;
  const Vec3d along = {std::cos(slope), 0, -std::sin(slope)};
  spec.bodies = {Solid("block", 3, {0.1, 0.1, 0.1}, {0, 0, 0})};
  spec.joints = {JointAt(spec, "rail", JointType::kTranslational, kGround, "block", {}, along)};
  LinearSpringSpec s;
  s.name = "spring";
  s.body_b = "block";
  s.point_a_m = Scale(-1, along);
  s.stiffness_n_per_m = 200;
  s.free_length_m = 1;
  spec.linear_springs = {s};
  MultibodySystem m(spec);
  const double rest = 3 * kG * std::sin(slope) / 200;
  double low = 1, high = -1;
  const double period = PeriodOf(m, 1e-3, 4, [&] {
    const double x = m.Coordinates("rail")[0];
    low = std::min(low, x);
    high = std::max(high, x);
    return x - rest;
  });
  EXPECT_NEAR(period, 2 * M_PI * std::sqrt(3 / 200.0), 1e-5 * period);
  EXPECT_NEAR(low, 0, 1e-4 * rest);
  EXPECT_NEAR(high, 2 * rest, 1e-4 * rest);
  // The rail carries the normal part of the weight, whatever the motion.
  EXPECT_NEAR(m.ReactionIn("rail", kGround, spec.joints[0].in_parent).fz, 0, 1e-9);
  const Wrench r = m.Reaction("rail");
  EXPECT_NEAR(std::hypot(r.fx, r.fz), 3 * kG * std::cos(slope), 1e-9);
}

MultibodySpec Top(JointType type, double tilt) {
  // A symmetric top of the mass centre l above its point; spins about its axis.
  MultibodySpec spec;
  const double l = 0.1;
  const Quatd q = TurnAbout(0, tilt);
  const Vec3d axis = MatrixOf(q) * Vec3d{0, 0, 1};
  spec.bodies = {Solid("top", 1, {2e-3, 2e-3, 3e-3}, Scale(l, axis))};
  spec.bodies[0].orientation = q;
  spec.joints = {JointAt(spec, "point", type, kGround, "top", {}, {0, 0, 1})};
  return spec;
}

TEST(Joints, SphericalTopPrecessesSteadily) {
  // Steady precession W of a top with spin about its axis w_3, tilt a:
  // I_1 W^2 cos a - I_3 w_3 W + m g l = 0 (I_1 about the point).
  const double tilt = 0.5, spin = 80, i1 = 2e-3 + 0.01, i3 = 3e-3, mgl = kG * 0.1;
  const double b = i3 * spin, disc = b * b - 4 * i1 * std::cos(tilt) * mgl;
  ASSERT_GT(disc, 0);
  const double precession = (b - std::sqrt(disc)) / (2 * i1 * std::cos(tilt));
  MultibodySpec spec = Top(JointType::kSpherical, tilt);
  const Vec3d axis = MatrixOf(spec.bodies[0].orientation) * Vec3d{0, 0, 1};
  // Total spin: w_3 along the axis, and the part of W across it.
  const Vec3d up = {0, 0, precession};
  const Vec3d w = Add(Scale(spin, axis), Sub(up, Scale(DotD(up, axis), axis)));
  spec.bodies[0].spin_rad_per_s = w;
  spec.bodies[0].velocity_m_per_s = CrossD(w, spec.bodies[0].position_m);
  MultibodySystem m(spec);
  double low = 1, high = -1;
  const double period = PeriodOf(m, 2e-4, 1, [&] {
    const Vec3d p = m.Placement(0).position_m;
    low = std::min(low, p[2]);
    high = std::max(high, p[2]);
    return p[0];
  });
  EXPECT_NEAR(period, 2 * M_PI / precession, 1e-3 * period);
  EXPECT_NEAR(low, 0.1 * std::cos(tilt), 1e-5);
  EXPECT_NEAR(high, 0.1 * std::cos(tilt), 1e-5);
  EXPECT_NEAR(Norm(m.Placement(0).position_m), 0.1, 1e-12);  // no drift
}

TEST(Joints, SphericalPendulumGoesRoundACone) {
  // Conical pendulum of a ball turning with its string: W^2 = g/(l cos a).
  MultibodySpec spec;
  const double a = 0.7, l = 0.4, rate = std::sqrt(kG / (l * std::cos(a)));
  const Vec3d at = {l * std::sin(a), 0, -l * std::cos(a)};
  spec.bodies = {Solid("bob", 1, {1e-3, 1e-3, 1e-3}, at)};
  spec.bodies[0].velocity_m_per_s = {0, rate * at[0], 0};
  spec.bodies[0].spin_rad_per_s = {0, 0, rate};
  spec.joints = {JointAt(spec, "pivot", JointType::kSpherical, kGround, "bob", {}, {0, 0, 1})};
  MultibodySystem m(spec);
  const double period = PeriodOf(m, 5e-4, 2, [&] { return m.Placement(0).position_m[0]; });
  EXPECT_NEAR(period, 2 * M_PI / rate, 1e-4 * period);
}

TEST(Joints, UniversalTurnsUnevenly) {
  // Shafts at angle b: tan(out) = tan(in)/cos(b) from the fork of the input; so the speed ratio
  // is cos b/(1 - sin^2 b cos^2 in) with `in` measured from where the input's fork lies in the
  // plane of the shafts.
  const double bend = 0.5;
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("in", 1, {0.01, 0.01, 0.01}, {0, 0, 0}),
                 Solid("out", 1, {0.01, 0.01, 0.01}, {0, 0, 0})};
  const Vec3d shaft_in = {0, 0, 1}, shaft_out = {0, std::sin(bend), std::cos(bend)};
  spec.joints = {JointAt(spec, "driver", JointType::kRevolute, kGround, "in", {}, shaft_in),
                 JointAt(spec, "driven", JointType::kRevolute, kGround, "out", {}, shaft_out)};
  // The cross: along x on the side of the input (across the plane of the shafts, which is y-z),
  // along the normal of x and the output shaft on the other.
  JointSpec cross = JointAt(spec, "cross", JointType::kUniversal, "in", "out", {}, shaft_in);
  cross.in_child.orientation = Unit(Mul(TurnAbout(0, -bend), cross.in_child.orientation));
  spec.joints.push_back(cross);
  const double rate = 5;
  spec.joints[0].rate = {[=](double) { return rate; }};
  MultibodySystem m(spec);
  const double dt = 1e-3;
  for (int s = 0; s < 2000; ++s) {
    m.Advance(dt);
    const double in = rate * (m.time_s() - 0.5 * dt);
    // The fork of the input is across the plane of the shafts at in = 0.
    const double ratio = std::cos(bend) / (1 - std::pow(std::sin(bend) * std::sin(in), 2));
    ASSERT_NEAR(m.Rates("driven")[0], rate * ratio, 1e-3 * rate) << in;
    const double turned =
        std::atan2(std::sin(rate * m.time_s()) * std::cos(bend), std::cos(rate * m.time_s()));
    ASSERT_NEAR(std::remainder(m.Coordinates("driven")[0] - turned, 2 * M_PI), 0, 1e-4);
    ASSERT_LT(m.Gap(), 1e-11);
  }
}

TEST(Joints, PlanarLeavesItsPlaneFree) {
  // On a plane tilted by 20 degrees: a parabola in it, constant spin about its normal.
  const double tilt = 20 * M_PI / 180;
  MultibodySpec spec;
  spec.bodies = {Solid("puck", 2, {1e-3, 2e-3, 2.5e-3}, {0.3, 0.2, 0.1})};
  const Vec3d normal = {std::sin(tilt), 0, std::cos(tilt)};
  const Vec3d down = {std::cos(tilt), 0, -std::sin(tilt)};
  spec.bodies[0].velocity_m_per_s = {0, 0.5, 0};
  spec.bodies[0].spin_rad_per_s = Scale(7, normal);
  spec.joints = {
      JointAt(spec, "plane", JointType::kPlanar, kGround, "puck", {0.3, 0.2, 0.1}, normal, down)};
  MultibodySystem m(spec);
  for (int s = 0; s < 2000; ++s) m.Advance(1e-3);
  const double fallen = 0.5 * kG * std::sin(tilt) * 4;
  EXPECT_NEAR(m.Coordinates("plane")[0], 14, 1e-9);  // more than two turns
  EXPECT_NEAR(m.Coordinates("plane")[1], fallen, 1e-9 * fallen);
  EXPECT_NEAR(m.Coordinates("plane")[2], 1.0, 1e-9);
  const Vec3d moved = Sub(m.Placement(0).position_m, {0.3, 0.2, 0.1});
  EXPECT_NEAR(DotD(moved, normal), 0, 1e-12);
  EXPECT_NEAR(DotD(moved, down), fallen, 1e-9 * fallen);
  const Wrench r = m.Reaction("plane");
  EXPECT_NEAR(DotD({r.fx, r.fy, r.fz}, normal), 2 * kG * std::cos(tilt), 1e-9);
}

TEST(Joints, WeldCarriesWeightAndMoment) {
  MultibodySpec spec;
  spec.bodies = {Solid("arm", 2, {0.1, 0.1, 0.1}, {0.5, 0, 0})};
  spec.joints = {JointAt(spec, "wall", JointType::kWeld, kGround, "arm", {0, 0, 0}, {0, 0, 1})};
  MultibodySystem m(spec);
  m.Advance(1e-3);
  const Wrench r = m.Reaction("wall");
  EXPECT_NEAR(r.fz, 2 * kG, 1e-12);
  EXPECT_NEAR(r.ty, -2 * kG * 0.5, 1e-12);
}

TEST(Joints, ReversedOnesKeepTheirMeaning) {
  // A body that is named the parent of what is nearer to the ground: the tree runs against it.
  MultibodySpec spec;
  spec.bodies = {Solid("rod", 2, {2 / 12.0, 2e-3, 2 / 12.0}, {0, 0.5, 0})};
  spec.joints = {
      JointAt(spec, "hinge", JointType::kRevolute, "rod", kGround, {0, 0, 0}, {1, 0, 0})};
  RotationalSpringSpec s;
  s.name = "motor";
  s.joint = "hinge";
  s.torque_n_m = [](double) { return 20.0; };  // turns the ground forward: the rod back
  spec.rotational_springs = {s};
  spec.gravity_m_per_s2 = {0, 0, 0};
  MultibodySystem m(spec);
  for (int k = 0; k < 100; ++k) m.Advance(1e-3);
  const double i = 2.0 / 3, turned = 0.5 * 20 / i * 0.01;
  EXPECT_NEAR(m.Coordinates("hinge")[0], turned, 1e-9);
  EXPECT_NEAR(m.Placement(0).position_m[2], -0.5 * std::sin(turned), 1e-9);
  // On its child, the ground: what keeps the rod on its circle, outwards.
  const Wrench r = m.Reaction("hinge");
  EXPECT_GT(r.fy, 0);
}

TEST(Joints, InertiaInSkewAxesIsTheSameBody) {
  // The tensor of body axes turned by 0.6 about y: I' = R^T I R.
  const auto swing = [](bool skew) {
    MultibodySpec spec;
    MultibodyBody b = Solid("b", 1, {1e-3, 2e-3, 2.5e-3}, {0.05, 0, 0});
    b.spin_rad_per_s = {1, 2, 3};
    b.velocity_m_per_s = CrossD(b.spin_rad_per_s, b.position_m);
    if (skew) {
      const double c = std::cos(0.6), s = std::sin(0.6);
      b.orientation = TurnAbout(1, 0.6);
      b.inertia_kg_m2 = {1e-3 * c * c + 2.5e-3 * s * s, 2e-3, 1e-3 * s * s + 2.5e-3 * c * c};
      b.inertia_off_kg_m2[1] = (1e-3 - 2.5e-3) * s * c;
    }
    spec.bodies = {b};
    spec.joints = {JointAt(spec, "pivot", JointType::kSpherical, kGround, "b", {}, {0, 0, 1})};
    MultibodySystem m(spec);
    for (int k = 0; k < 500; ++k) m.Advance(1e-3);
    return m.Placement(0).position_m;
  };
  EXPECT_LT(Norm(Sub(swing(false), swing(true))), 1e-9);
}

TEST(Joints, FreeBodyKeepsItsMomenta) {
  // A tumbling book about its middle axis, mass centre beside its origin.
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("book", 1, {1e-3, 2e-3, 2.5e-3}, {0, 0, 0})};
  spec.bodies[0].centre_of_mass_m = {0.02, -0.01, 0.03};
  spec.bodies[0].spin_rad_per_s = {0.01, 10, 0.01};
  MultibodySystem m(spec);
  m.Advance(1e-4);
  const auto start = m.Momentum();
  const double mechanical = m.Energy().Mechanical();
  for (int s = 0; s < 20000; ++s) m.Advance(1e-4);
  const auto end = m.Momentum();
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(end[0][a], start[0][a], 1e-12);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(end[1][a], start[1][a], 2e-8);  // of 0.02
  EXPECT_NEAR(m.Energy().Mechanical(), mechanical, 1e-6 * mechanical);
}

}  // namespace
}  // namespace grouser::dem

// What the headers for Chrono and MAVS put before grouser/contact.h and grouser/model.h, and these
// headers themselves, compiled against stand-ins of the documented interfaces (double/).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <random>

#include "grouser/chrono.h"
#include "grouser/mavs.h"
#include "tests/unit/refusal.h"

namespace grouser {
namespace {

using ::testing::HasSubstr;
using Vector = std::array<double, 3>;
namespace ch = ::chrono::vehicle;

const Model& Sand() {
  static const Model model = Model::Open(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");
  return model;
}

void ExpectNear(const Vector& a, const Vector& b, double scale) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-12 * scale) << i;
}
Vector Of(const ::chrono::ChVector3d& v) { return {v.x(), v.y(), v.z()}; }
::chrono::ChVector3d To(const Vector& v) { return {v[0], v[1], v[2]}; }

/// Wheels that roll, slide and lean a little on a slope, some off the ground.
WheelMotion SomeMotion(std::mt19937* random) {
  std::uniform_real_distribution<double> u(-1, 1);
  WheelMotion m;
  m.ground_normal = {0.2 * u(*random), 0.2 * u(*random), 1};
  m.ground_point = {u(*random), u(*random), 0.1 * u(*random)};
  m.axle = {0.6 * u(*random), 1, 0.1 * u(*random)};
  const Vector n = timed_wheel::Unit(m.ground_normal);
  m.centre = timed_wheel::Plus(m.ground_point, 0.055 + 0.01 * u(*random), n);
  m.velocity = {0.1 * u(*random), 0.05 * u(*random), 0.01 * u(*random)};
  m.angular_velocity = {0.1 * u(*random), 2 * u(*random), 0.3 * u(*random)};
  return m;
}

TEST(TimedWheel, StepsAsWheelContactDoes) {
  std::mt19937 random(1);
  TimedWheel wheel(Sand());
  WheelContact contact(Sand());
  ContactState state;
  double time = 3, before = 3;
  for (int i = 0; i < 50; ++i) {
    WheelMotion motion = SomeMotion(&random);
    motion.time_step = time - before;
    const WheelForce expected = contact.Evaluate(motion, &state);
    for (int again = 0; again < 2; ++again) {  // the same time: the same step
      const WheelForce& got = wheel.At(time, motion);
      ExpectNear(got.force, expected.force, 1 + expected.load);
      ExpectNear(got.moment, expected.moment, 1 + expected.load);
      EXPECT_EQ(got.flags, expected.flags);
    }
    before = time;
    time += 0.01 * (1 + i % 3);
  }
  // Back in time: as a wheel that has just touched down.
  WheelMotion motion = SomeMotion(&random);
  motion.time_step = 0;
  ContactState fresh;
  const WheelForce expected = contact.Evaluate(motion, &fresh);
  ExpectNear(wheel.At(0, motion).force, expected.force, 1 + expected.load);
}

TEST(ContactPatchOf, GivesForceAndMomentBack) {
  using namespace timed_wheel;
  std::mt19937 random(2);
  WheelContact contact(Sand(), {.relaxation_over_radius = 0});
  int loaded = 0;
  for (int i = 0; i < 100; ++i) {
    const WheelMotion motion = SomeMotion(&random);
    ContactState state;
    const WheelForce f = contact.Evaluate(motion, &state);
    const ContactPatch p = PatchOf(motion, f);
    Vector force{}, moment{};
    const std::array<const Vector*, 3> axes = {&p.x, &p.y, &p.n};
    for (int k = 0; k < 3; ++k) {
      force = Plus(force, p.force[k], *axes[k]);
      moment = Plus(moment, p.moment[k], *axes[k]);
      EXPECT_NEAR(Dot(*axes[k], *axes[k]), 1, 1e-14);
    }
    EXPECT_NEAR(Dot(p.x, p.y) + Dot(p.y, p.n) + Dot(p.n, p.x), 0, 1e-14);
    moment = Plus(moment, 1, Cross(Plus(p.point, -1, motion.centre), force));
    ExpectNear(force, f.force, 1 + f.load);
    ExpectNear(moment, f.moment, 1 + f.load);
    EXPECT_NEAR(p.force[0], f.f_x, 1e-12 * (1 + f.load));
    EXPECT_NEAR(p.force[2], f.load, 1e-12 * (1 + f.load));
    EXPECT_NEAR(Dot(Plus(p.point, -1, motion.ground_point), p.n), 0, 1e-14);
    loaded += f.load > 0;
    const auto& q = p.rotation;
    const ::chrono::ChQuaternion<> rotation(q[0], q[1], q[2], q[3]);
    ExpectNear(Of(rotation.Rotate({1, 0, 0})), p.x, 10);
    ExpectNear(Of(rotation.Rotate({0, 0, 1})), p.n, 10);
  }
  EXPECT_GT(loaded, 50);
}

/// A plane through a point.
class PlaneTerrain : public ch::ChTerrain {
 public:
  double GetHeight(const ::chrono::ChVector3d& loc) const override {
    using namespace timed_wheel;
    const Vector up = Of(ch::ChWorldFrame::Vertical());
    const Vector to = Plus(point, -1, Of(loc));  // loc + t up is on the plane
    return ch::ChWorldFrame::Height(loc) + Dot(to, normal) / Dot(up, normal);
  }
  ::chrono::ChVector3d GetNormal(const ::chrono::ChVector3d&) const override {
    return To(timed_wheel::Unit(normal));
  }
  Vector point{}, normal{0, 0, 1};
};

/// A turn that brings (0, 1, 0) to `axle`.
::chrono::ChQuaternion<> TurnedTo(const Vector& axle) {
  using namespace timed_wheel;
  const Vector y = Unit(axle), z = Unit(Cross({1, 0.3, 0.1}, y)), x = Cross(y, z);
  const auto q = Quaternion(x, y, z);
  return {q[0], q[1], q[2], q[3]};
}

class ChronoTire : public ::testing::Test {
 protected:
  void TearDown() override { ch::ChWorldFrame::vertical = {0, 0, 1}; }

  const WheelForce Expected(const WheelMotion& motion) {
    ContactState state;
    return contact_.Evaluate(motion, &state);
  }
  void Put(const WheelMotion& m) {
    wheel_->state.pos = To(m.centre);
    wheel_->state.rot = TurnedTo(m.axle);
    wheel_->state.lin_vel = To(m.velocity);
    wheel_->state.ang_vel = To(m.angular_velocity);
    wheel_->state.omega = timed_wheel::Dot(timed_wheel::Unit(m.axle), m.angular_velocity);
    terrain_.point = m.ground_point;
    terrain_.normal = m.ground_normal;
  }

  WheelContact contact_{Sand()};
  PlaneTerrain terrain_;
  std::shared_ptr<ch::ChWheel> wheel_ = std::make_shared<ch::ChWheel>();
};

TEST_F(ChronoTire, HasTheForcesOfWheelContact) {
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    WheelMotion motion = SomeMotion(&random);
    if (i % 2 == 1) {  // a world with y up
      ch::ChWorldFrame::vertical = {0, 1, 0};
      for (Vector* v : {&motion.ground_normal, &motion.ground_point, &motion.axle, &motion.centre,
                        &motion.velocity, &motion.angular_velocity}) {
        *v = {(*v)[0], (*v)[2], -(*v)[1]};
      }
    } else {
      ch::ChWorldFrame::vertical = {0, 0, 1};
    }
    Put(motion);
    ChronoSoilTire tire("front left", Sand(), 1, {0.1, 0.2, 0.1});
    tire.Initialize(wheel_);
    tire.Synchronize(1, terrain_);
    tire.Advance(0.01);
    const WheelForce expected = Expected(motion);
    const ch::TerrainForce got = tire.ReportTireForce(&terrain_);
    ExpectNear(Of(got.force), expected.force, 10 + expected.load);
    ExpectNear(Of(got.moment), expected.moment, 10 + expected.load);
    EXPECT_EQ(tire.ReportTireContactData().in_contact, expected.load > 0);
    if (!(expected.load > 0)) continue;
    ExpectNear(Of(got.point), motion.centre, 1);
    // In the patch: the same force, about the patch.
    ::chrono::ChCoordsys<> frame;
    const ch::TerrainForce local = tire.ReportTireForceLocal(&terrain_, frame);
    EXPECT_NEAR(local.force.x(), expected.f_x, 1e-11 * (1 + expected.load));
    EXPECT_NEAR(local.force.z(), expected.load, 1e-11 * (1 + expected.load));
    ExpectNear(Of(frame.rot.Rotate(local.force)), expected.force, 10 + expected.load);
    const Vector arm = timed_wheel::Plus(Of(frame.pos), -1, motion.centre);
    ExpectNear(timed_wheel::Plus(Of(frame.rot.Rotate(local.moment)), 1,
                                 timed_wheel::Cross(arm, expected.force)),
               expected.moment, 10 + expected.load);
    EXPECT_NEAR(tire.ReportTireContactData().depth, expected.sinkage, 1e-12);
  }
}

// As a vehicle whose wheels take the force before the tyres are synchronised gets it in time.
TEST_F(ChronoTire, SynchronisedTwiceStepsOnce) {
  std::mt19937 random(5);
  ChronoSoilTire once("once", Sand(), 1, {0.1, 0.2, 0.1});
  ChronoSoilTire twice("twice", Sand(), 1, {0.1, 0.2, 0.1});
  once.Initialize(wheel_);
  twice.Initialize(wheel_);
  for (int i = 0; i < 20; ++i) {
    Put(SomeMotion(&random));
    once.Synchronize(0.01 * i, terrain_);
    twice.Synchronize(0.01 * i, terrain_);
    twice.Synchronize(0.01 * i, terrain_);
    EXPECT_EQ(Of(once.ReportTireForce(&terrain_).force),
              Of(twice.ReportTireForce(&terrain_).force));
  }
}

TEST_F(ChronoTire, DeflectionIsOfTheLoadWithoutDamping) {
  const double stiffness = 3e4, v = Sand().domain().speed_m_per_s, asked = 20;  // N
  const double sinkage =
      Sand().Evaluate(State{v, 0, v, asked}).output[kSinkage].value + asked / stiffness;
  WheelMotion motion;
  motion.axle = {0, 1, 0};
  motion.ground_normal = {0, 0, 1};
  motion.centre = {0, 0, Sand().radius_m() - sinkage};
  motion.angular_velocity = {0, v / Sand().radius_m(), 0};
  for (const double down : {0.0, 0.3, -0.3}) {  // at rest, an impact, a rebound
    motion.velocity = {v, 0, -down};
    Put(motion);
    ChronoSoilTire tire("tyre", Sand(), 1, {0.1, 0.2, 0.1},
                        {.tyre_stiffness = stiffness, .relaxation_over_radius = 0});
    tire.Initialize(wheel_);
    tire.Synchronize(0, terrain_);
    const double load = stiffness * tire.GetDeflection();
    EXPECT_NEAR(load, asked, 0.01) << down;
    EXPECT_EQ(std::abs(tire.soil_force().load / load - 1) > 0.5, down != 0) << down;
  }
}

TEST_F(ChronoTire, KinematicsFollowOffTheGround) {
  WheelMotion motion;
  motion.axle = {0, 1, 0.1};
  motion.ground_normal = {0, 0, 1};
  ChronoSoilTire tire("tyre", Sand(), 1, {0.1, 0.2, 0.1});
  tire.Initialize(wheel_);
  double time = 0;
  for (const double height : {-0.005, 0.02}) {  // in the soil, above it
    for (const double v : {0.1, 0.2}) {
      motion.centre = {0, 0, Sand().radius_m() + height};
      motion.velocity = {v, 0.05, 0};
      motion.angular_velocity = {0, 3, 0};
      Put(motion);
      tire.Synchronize(time += 0.1, terrain_);
      EXPECT_EQ(tire.ReportTireContactData().in_contact, height < 0);
      EXPECT_NEAR(tire.GetSlipAngle(), std::atan(0.05 / v), 1e-12);
      EXPECT_NEAR(tire.GetLongitudinalSlip(), Sand().radius_m() * 3 / std::sqrt(1.01) / v - 1,
                  1e-12);
      EXPECT_NEAR(tire.GetCamberAngle(), std::atan(0.1), 1e-12);
    }
  }
  motion.axle = {0, 0, 1};  // lies flat
  Put(motion);
  tire.Synchronize(time + 0.1, terrain_);
  EXPECT_TRUE(std::isfinite(tire.GetSlipAngle() + tire.GetLongitudinalSlip()));
  EXPECT_TRUE(std::isfinite(tire.GetCamberAngle()));
}

class OpenTire : public ChronoSoilTire {
 public:
  using ChronoSoilTire::ChronoSoilTire;
  using ChronoSoilTire::GetNormalDampingForce;
  using ChronoSoilTire::GetNormalStiffnessForce;
};

TEST_F(ChronoTire, NormalForcesAreThoseOfWheelContact) {
  const double v = Sand().domain().speed_m_per_s, depth = 0.005;
  WheelMotion motion;
  motion.axle = {0, 1, 0};
  motion.ground_normal = {0, 0, 1};
  motion.centre = {0, 0, Sand().radius_m() - depth};
  motion.angular_velocity = {0, v / Sand().radius_m(), 0};
  const OpenTire tire("tyre", Sand(), 1, {0.1, 0.2, 0.1});
  WheelContact contact(Sand(), {.relaxation_over_radius = 0});
  for (const double down : {-1.0, -0.05, 0.0, 0.1}) {
    motion.velocity = {v, 0, -down};
    ContactState state;
    const WheelForce expected = contact.Evaluate(motion, &state);
    const double force =
        tire.GetNormalStiffnessForce(depth) + tire.GetNormalDampingForce(depth, down);
    EXPECT_NEAR(force, expected.load, 1e-4 * expected.static_load) << down;
  }
  EXPECT_EQ(tire.GetNormalDampingForce(-1, 1), 0);
  EXPECT_TRUE(std::isnan(tire.GetNormalDampingForce(NAN, 1)));
  EXPECT_TRUE(std::isnan(tire.GetNormalDampingForce(depth, NAN)));
}

TEST_F(ChronoTire, RefusesWhatIsNotFinite) {
  std::mt19937 random(4);
  WheelMotion motion = SomeMotion(&random);
  motion.velocity[0] = NAN;
  Put(motion);
  ChronoSoilTire tire("rear", Sand(), 1, {0.1, 0.2, 0.1});
  tire.Initialize(wheel_);
  EXPECT_THAT(Refusal([&] { tire.Synchronize(2, terrain_); }),
              HasSubstr("chrono: tyre 'rear', time 2.0"));
  EXPECT_THAT(Refusal([] {
                ChronoSoilTire("rear", Sand(), 0, {1, 1, 1});
              }),
              HasSubstr("mass or inertia: got 0.0"));
}

TEST(MavsVti, AnswersAsTheModel) {
  const Model& model = Sand();
  MavsSoilVti vti(model);
  const double speed = model.domain().speed_m_per_s, radius = model.radius_m();
  // Slip of MAVS, of the speed along the wheel: driving 1 - v_x/(r w), braking r w/v_x - 1.
  for (const double load : {15.0, 24.0}) {
    for (const double angle : {-0.8, 0.0, 0.4}) {
      for (const double slip : {-1.0, -0.3, 0.0, 0.2, 0.6}) {
        const double v_x = slip >= 0 ? 1 - slip : 1, rim = slip >= 0 ? 1 : 1 + slip;
        const double v_y = v_x * std::tan(angle);
        const double by = speed / std::max(rim, std::hypot(v_x, v_y));
        const Answer a = model.Evaluate(State{by * v_x, by * v_y, by * rim, load});
        vti.Update(0, load, 0, slip, angle);
        EXPECT_NEAR(vti.GetDrawbarPull(), a.output[kFx].value / load, 1e-12);
        EXPECT_NEAR(vti.GetLateralTraction(), -a.output[kFy].value / load, 1e-12);
        EXPECT_NEAR(vti.GetLongitudinalTraction(), a.output[kTorque].value / load / radius, 1e-12);
        EXPECT_NEAR(vti.GetLongitudinalTraction() - vti.GetLongitudinalMotionResistance(),
                    vti.GetDrawbarPull(), 1e-14);
        EXPECT_NEAR(vti.GetSinkage(), a.output[kSinkage].value, 1e-12);
        // The same state, the same bits.
        const State same = StateOfVti(slip, angle, load, speed);
        EXPECT_EQ(vti.GetDrawbarPull(), model.Evaluate(same).output[kFx].value / load);
      }
    }
  }
  vti.Update(0, 24, 0, 0.2, 0.4);
  EXPECT_GT(vti.GetLateralTraction(), 0);  // of the slip angle's sign, as in MAVS
  vti.Update(0, 0, 0, 0.2, 0);
  EXPECT_EQ(vti.GetLongitudinalTraction(), 0);
  vti.Update(0, 24, 0, 1, 0.4);  // spins on the spot
  EXPECT_EQ(vti.answer().flags & kInvalid, 0u);
}

TEST(MavsVti, SaysSoOfWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  MavsSoilVti vti(Sand());
  const auto invalid = [&](double load, double slip, double angle) {
    vti.Update(0, load, 0, slip, angle);
    for (const double ratio : {vti.GetLongitudinalTraction(), vti.GetLateralTraction(),
                               vti.GetLongitudinalMotionResistance(), vti.GetDrawbarPull()}) {
      EXPECT_TRUE(std::isnan(ratio)) << load << ", " << slip << ", " << angle;
    }
    EXPECT_NE(vti.answer().flags & kInvalid, 0u);
  };
  for (const double bad : {nan, infinite, -infinite}) {
    invalid(bad, 0.2, 0.1);
    for (const double load : {0.0, 24.0}) {
      invalid(load, bad, 0.1);
      invalid(load, 0.2, bad);
    }
  }
  invalid(-24, 0.2, 0.1);
}

TEST(MavsVti, HasNumbersBeforeTheFirstUpdate) {
  alignas(MavsSoilVti) unsigned char room[sizeof(MavsSoilVti)];
  std::memset(room, 0xff, sizeof(room));  // NaNs, where nothing is written
  auto* vti = new (room) MavsSoilVti(Sand());
  EXPECT_EQ(vti->GetLongitudinalTraction(), 0);
  EXPECT_EQ(vti->GetLongitudinalMotionResistance(), 0);
  EXPECT_EQ(vti->GetDrawbarPull(), 0);
  EXPECT_EQ(vti->GetLateralTraction(), 0);
  EXPECT_EQ(vti->GetSinkage(), 0);
  vti->~MavsSoilVti();
}

TEST(MavsVti, RefusesAnotherWheel) {
  MavsSoilVti vti(Sand());
  EXPECT_EQ(Refusal([&] { vti.SetWheelProperties(0.05, 0.125, 0.02); }), "");
  EXPECT_THAT(Refusal([&] { vti.SetWheelProperties(0.05, 0.13, 0.02); }),
              HasSubstr("mavs: diameter: got 0.13"));
}

}  // namespace
}  // namespace grouser

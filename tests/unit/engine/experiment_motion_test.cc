// Every motion of a program, and every end of its steps, against a closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

MotionStep Step(const char* verb) {
  MotionStep s;
  s.verb = verb;
  s.free = s.verb == "release";
  return s;
}

/// Time at which a step ends that was to take `time_s`.
double WholeSteps(double time_s, double dt_s) { return std::ceil(time_s / dt_s - 1e-9) * dt_s; }

TEST(ExperimentMotion, MoveEndsAtItsDistance) {
  Experiment e = Empty();
  MotionStep move = Step("move");
  move.velocity_m_per_s = {0.3, 0, 0.4};
  move.distance_m = 0.1;
  move.ramp_s = 0.05;
  e.bodies = {Ball({move})};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  // The ramp loses half of its time.
  EXPECT_NEAR(result.run_s, 0.1 / 0.5 + 0.025, 2 * result.dt_s);
  const auto time = rec.Column("time_s"), x = rec.Column("ball.x_m"), z = rec.Column("ball.z_m");
  for (std::size_t k = 0; k < time.size(); ++k) {
    const double t = time[k];
    const double ramp = 0.25 * (t - 0.05 / M_PI * std::sin(M_PI * t / 0.05));
    const double way = t < 0.05 ? ramp : std::min(0.1, 0.5 * (t - 0.025));
    EXPECT_NEAR(x[k] - 0.5, 0.6 * way, 1e-6);
    EXPECT_NEAR(z[k] - 0.5, 0.8 * way, 1e-6);
  }
}

TEST(ExperimentMotion, StandsWhereItsDistanceEnded) {
  Experiment e = Empty();
  MotionStep move = Step("move");
  move.velocity_m_per_s = {0, 0.25, 0};
  move.distance_m = 0.03;
  e.bodies = {Ball({move})};
  e.duration_s = 0.2;
  Recorded rec;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  EXPECT_NEAR(rec.Column("ball.y_m").back(), 0.53, 1e-12);
  EXPECT_EQ(rec.Column("ball.v_y_m_per_s").back(), 0);
}

TEST(ExperimentMotion, TurnEndsAtItsAngle) {
  Experiment e = Empty();
  MotionStep turn = Step("turn");
  turn.spin_rad_per_s = {0, 2, 0};
  turn.angle_rad = 0.5;
  e.bodies = {Ball({turn})};
  e.duration_s = 0.4;
  Recorded rec;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  EXPECT_NEAR(rec.Column("ball.turned_y_rad").back(), 0.5, 1e-12);
}

TEST(ExperimentMotion, ShakeFollowsItsSine) {
  Experiment e = Empty();
  MotionStep shake = Step("shake");
  shake.amplitude_m = {0.004, 0, 0.003};
  shake.frequency_hz = 7;
  shake.for_s = 0.5;
  e.bodies = {Ball({shake})};
  e.sample_s = 0.003;
  Recorded rec;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  const auto time = rec.Column("time_s"), x = rec.Column("ball.x_m"), z = rec.Column("ball.z_m");
  double largest = 0;
  for (std::size_t k = 0; k < time.size(); ++k) {
    const double sine = std::sin(2 * M_PI * 7 * time[k]);
    EXPECT_NEAR(x[k] - 0.5, 0.004 * sine, 1e-9);
    EXPECT_NEAR(z[k] - 0.5, 0.003 * sine, 1e-9);
    largest = std::max(largest, x[k] - 0.5);
  }
  EXPECT_NEAR(largest, 0.004, 2e-5);
}

TEST(ExperimentMotion, ReleasedBodyFallsFreely) {
  Experiment e = Empty();
  MotionStep wait = Step("wait"), fall = Step("release");
  wait.for_s = 0.05;
  fall.for_s = 0.2;
  e.bodies = {Ball({wait, fall})};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done);
  const auto time = rec.Column("time_s"), z = rec.Column("ball.z_m");
  for (std::size_t k = 0; k < time.size(); ++k) {
    const double t = std::max(0.0, time[k] - WholeSteps(0.05, result.dt_s));
    EXPECT_NEAR(z[k], 0.5 - 0.5 * 9.81 * t * t, 1e-9) << time[k];
  }
}

TEST(ExperimentMotion, ReleasedBodyKeepsItsSpinAndVelocity) {
  Experiment e = Empty();
  e.gravity_m_per_s2 = 0;
  MotionStep turn = Step("turn"), fly = Step("release");
  turn.velocity_m_per_s = {0.2, 0, 0};
  turn.spin_rad_per_s = {0, 0, 3};
  turn.for_s = 0.1;
  fly.for_s = 0.1;
  e.bodies = {Ball({turn, fly})};
  e.bodies[0].parts[0].at_m = {0.02, 0, 0};  // its centre of mass turns about the origin
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done);
  EXPECT_NEAR(rec.Column("ball.w_z_rad_per_s").back(), 3, 1e-9);
  const double t = WholeSteps(0.1, result.dt_s), whole = rec.Column("time_s").back();
  EXPECT_NEAR(rec.Column("ball.turned_z_rad").back(), 3 * whole, 1e-6);
  // At t the centre is at 0.02 (cos 3t, sin 3t) from the origin, which moves at 0.2 m/s.
  const double c = 0.02 * std::cos(3 * t), s = 0.02 * std::sin(3 * t), left = whole - t;
  const double x = 0.5 + 0.2 * t + c + (0.2 - 3 * s) * left, y = 0.5 + s + 3 * c * left;
  EXPECT_NEAR(rec.Column("ball.x_m").back(), x - 0.02 * std::cos(3 * whole), 2e-5);
  EXPECT_NEAR(rec.Column("ball.y_m").back(), y - 0.02 * std::sin(3 * whole), 2e-5);
}

/// A held axis with a constant force alone: v = F/m t, with a damper F tau/m (1 - exp(-t/tau)).
TEST(ExperimentMotion, HeldAxisIsAMassWithADamper) {
  for (const double damper : {0.0, 0.02}) {
    Experiment e = Empty();
    MotionStep hold = Step("hold_force");
    hold.hold = true;
    hold.direction = {1, 0, 0};
    hold.hold_force_n = 3;
    hold.hold_mass_kg = 2;
    hold.hold_damper_s = damper;
    hold.for_s = 0.1;
    e.bodies = {Ball({hold})};
    Recorded rec;
    ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
    const auto time = rec.Column("time_s"), v = rec.Column("ball.v_x_m_per_s");
    for (std::size_t k = 1; k < time.size(); ++k) {
      const double t = time[k];
      const double expected = damper > 0 ? 1.5 * damper * (1 - std::exp(-t / damper)) : 1.5 * t;
      EXPECT_NEAR(v[k], expected, 2e-3 * expected + 1.5e-4) << damper << " " << t;
    }
  }
}

/// A plate on grains comes to rest under the force that is asked for.
TEST(ExperimentMotion, ServoReachesItsForceWithinOnePercent) {
  Experiment e = Empty();
  e.box = {0.1, 0.1, 0.3, Side::kPeriodic, Side::kPeriodic, "steel"};
  Grains g;
  g.filling = Filling::kPoured;
  g.material = "sand";
  g.sizes = {{0.012, 1.0}};
  g.count = 400;
  e.grains = {g};
  MotionStep lower = Step("lower"), hold = Step("hold_force");
  lower.velocity_m_per_s = {0, 0, -0.1};
  lower.touch = true;
  hold.hold = true;
  hold.hold_force_n = 25;
  hold.for_s = 0.4;
  BodySpec plate = Ball({lower, hold});
  plate.parts[0].shape = PartShape::kBox;
  plate.parts[0].size_m = {0.06, 0.06, 0.01};
  plate.position_m = {0.05, 0.05, 0};
  plate.above_surface_m = 0.005;
  e.bodies = {plate};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_NEAR(rec.Column("ball.f_z_n").back(), 25, 0.25);
  EXPECT_GT(rec.Column("ball.sinkage_m").back(), 0);
}

TEST(ExperimentMotion, LowerEndsAtTouchAndAtForce) {
  for (const bool touch : {true, false}) {
    Experiment e = Empty();
    e.grains[0].listed[0].x_m = e.grains[0].listed[0].y_m = 0.5;
    MotionStep lower = Step("lower"), wait = Step("wait");
    lower.velocity_m_per_s = {0, 0, -0.1};
    lower.touch = touch;
    if (!touch) lower.force_n = 1;
    wait.for_s = 0.2;
    BodySpec ball = Ball({lower, wait});
    ball.position_m = {0.5, 0.5, 0.02 + 0.05 + 0.01};
    e.bodies = {ball};
    Recorded rec;
    ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
    const double z = rec.Column("ball.z_m").back(), force = rec.Column("ball.f_z_n").back();
    // The grain rests on the floor already: its weight presses it in by micrometres.
    EXPECT_NEAR(z, 0.07, touch ? 5e-5 : 2e-3);
    if (!touch) {
      EXPECT_GT(force, 0.9);
    }
  }
}

TEST(ExperimentMotion, WaitsForAnotherBody) {
  Experiment e = Empty();
  MotionStep move = Step("move"), wait = Step("wait"), up = Step("lift");
  move.velocity_m_per_s = {0.1, 0, 0};
  move.for_s = 0.1;
  wait.until_done = "ball";
  up.velocity_m_per_s = {0, 0, 0.1};
  up.distance_m = 0.01;
  BodySpec second = Ball({wait, up});
  second.name = "second";
  second.position_m = {0.2, 0.2, 0.5};
  e.bodies = {second, Ball({move})};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_NEAR(result.run_s, 0.2, 3 * result.dt_s);
  EXPECT_NEAR(rec.Column("second.z_m").back(), 0.51, 1e-9);
}

TEST(ExperimentMotion, FailsByNameWhereAnEndDoesNotCome) {
  Experiment e = Empty();
  MotionStep lift = Step("lift");
  lift.velocity_m_per_s = {0, 0, 0.1};
  lift.force_n = 5;
  lift.most_s = 0.05;
  e.bodies = {Ball({lift})};
  const Result result = RunExperiment(e, nullptr, nullptr);
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.reason.find("'ball', step 0 (lift)"), std::string::npos) << result.reason;
}

TEST(ExperimentMotion, FailsByNameWhereABodyLeavesTheBox) {
  Experiment e = Empty();
  MotionStep fall = Step("release");
  fall.for_s = 5;
  e.bodies = {Ball({fall})};  // bodies do not meet the floor
  const Result result = RunExperiment(e, nullptr, nullptr);
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.reason.find("body 'ball' has left the box"), std::string::npos);
}

/// Whatever carries a body off in one step ends the run, by its name.
TEST(ExperimentMotion, FailsByNameWhereABodyIsGoneInAStep) {
  const auto reason = [](const MotionStep& s) {
    Experiment e = Empty();
    e.bodies = {Ball({s})};
    const Result result = RunExperiment(e, nullptr, nullptr);
    EXPECT_FALSE(result.done);
    return result.reason;
  };
  MotionStep hold = Step("hold_force"), push = Step("wait"), pull = Step("wait"),
             twist = Step("wait");
  for (MotionStep* s : {&hold, &push, &pull, &twist}) s->for_s = 0.1;
  hold.hold = true;
  hold.hold_force_n = 5;
  hold.hold_mass_kg = 1e-12;
  EXPECT_EQ(reason(hold).rfind("body 'ball' has left the box", 0), 0u) << reason(hold);
  push.free_axes = {false, false, true};
  push.applied_force_n = {0, 0, -1e300};
  EXPECT_EQ(reason(push).rfind("body 'ball' has left the box", 0), 0u) << reason(push);
  pull.free_axes = {true, false, false};
  pull.applied_force_n = {1e300, 0, 0};
  EXPECT_EQ(reason(pull).rfind("body 'ball' moves", 0), 0u) << reason(pull);
  twist.free_spin = true;
  twist.applied_torque_n_m = 1e300;
  EXPECT_EQ(reason(twist).rfind("body 'ball' turns by", 0), 0u) << reason(twist);
}

/// The frame of a bed is about its surface, so that it ends above twice its height below.
TEST(ExperimentMotion, FailsByNameBelowABed) {
  Experiment e = Empty();
  e.box = {0.1, 0.1, 0.3, Side::kPeriodic, Side::kPeriodic, "steel"};
  Grains bed;
  bed.filling = Filling::kBed;
  bed.material = "sand";
  bed.sizes = {{0.0115, 0.5}, {0.0125, 0.5}};
  bed.depth_m = 0.04;
  bed.solid_fraction = 0.628;
  e.grains = {bed};
  MotionStep fall = Step("release");
  fall.for_s = 5;
  e.bodies = {Ball({fall})};
  e.bodies[0].parts[0].radius_m = 0.001;
  e.bodies[0].position_m = {0.04, 0.04, -0.04};
  const Result result = RunExperiment(e, nullptr, nullptr);
  EXPECT_NE(result.reason.find("body 'ball' has left the box"), std::string::npos) << result.reason;
}

TEST(ExperimentMotion, RefusesABodyOutsideOfTheBox) {
  const auto refused = [](auto&& change) -> std::string {
    Experiment e = Empty();
    MotionStep wait = Step("wait");
    wait.for_s = 0.1;
    e.bodies = {Ball({wait})};
    change(e, e.bodies[0]);
    try {
      PlanOf(e);
    } catch (const SpecError& error) {
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(refused([](Experiment&, BodySpec& b) { b.position_m[0] = 50; }),
            "bodies[0].position_m");
  EXPECT_EQ(refused([](Experiment& e, BodySpec& b) {
              e.box.y = Side::kWall;
              b.position_m[1] = -0.06;
            }),
            "bodies[0].position_m");
  EXPECT_EQ(refused([](Experiment&, BodySpec& b) { b.position_m[1] = -0.04; }), "");
  EXPECT_EQ(refused([](Experiment&, BodySpec& b) {
              b.position_m[0] = 50;
              b.parts[0].shape = PartShape::kPlane;
            }),
            "");
  EXPECT_EQ(refused([](Experiment&, BodySpec& b) {  // millimetres taken as metres
              b.above_surface_m = 0;
              b.parts[0].radius_m = 50;
            }),
            "bodies[0].above_surface_m");
}

TEST(ExperimentMotion, RefusesAStepWithoutAnEnd) {
  Experiment e = Empty();
  e.bodies = {Ball({Step("wait")})};
  EXPECT_THROW(PlanOf(e), SpecError);
}

}  // namespace
}  // namespace grouser::dem::experiment

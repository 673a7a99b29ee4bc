// Degrees of freedom of a body against closed forms, and the contradictions that are refused.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "dem_offline/engine/experiment/freedoms.h"
#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kGravity = 9.81;
constexpr double kMass = 3, kInertia = 0.01;

MotionStep Free(bool x, bool z, bool spin) {
  MotionStep s;
  s.verb = "wait";
  s.free_axes = {x, false, z};
  s.free_spin = spin;
  s.for_s = 0.2;
  return s;
}

/// The ball of Empty() with a mass, turned by an angle about z.
Experiment Rig(std::vector<MotionStep> motion, double yaw_rad = 0) {
  Experiment e = Empty();
  e.bodies = {Ball(std::move(motion))};
  BodySpec& b = e.bodies[0];
  b.mass_kg = kMass;
  b.inertia_kg_m2 = {0.02, kInertia, 0.02};
  b.turn = {std::cos(0.5 * yaw_rad), 0, 0, std::sin(0.5 * yaw_rad)};
  return e;
}

TEST(ExperimentFreedoms, FreeAxisFallsUnderItsWeightAndLoad) {
  for (const double load : {0.0, -12.0}) {
    MotionStep hold, fall = Free(false, true, false);
    hold.verb = "wait";
    hold.for_s = 0.05;
    fall.applied_force_n = {0, 0, load};
    Experiment e = Rig({hold, fall});
    Recorded rec;
    const Result result = RunExperiment(e, rec.Sink(), nullptr);
    ASSERT_TRUE(result.done) << result.reason;
    const auto time = rec.Column("time_s"), z = rec.Column("ball.z_m"), x = rec.Column("ball.x_m");
    const double began = std::ceil(0.05 / result.dt_s - 1e-9) * result.dt_s;
    for (std::size_t k = 0; k < time.size(); ++k) {
      const double t = std::max(0.0, time[k] - began);
      EXPECT_NEAR(z[k], 0.5 - 0.5 * (kGravity - load / kMass) * t * t, 1e-9) << time[k];
      EXPECT_EQ(x[k], 0.5);
    }
  }
}

/// Also while the axle moves at a prescribed velocity, and from one step into the next.
TEST(ExperimentFreedoms, FreeSpinTurnsUnderATorqueAboutTheAxle) {
  const double yaw = M_PI / 6, torque = 0.3;
  MotionStep first = Free(false, false, true);
  first.applied_torque_n_m = torque;
  MotionStep second = first;
  second.verb = "move";
  second.velocity_m_per_s = {0.5, 0, 0};
  Experiment e = Rig({first, second}, yaw);
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const auto time = rec.Column("time_s"), x = rec.Column("ball.turned_x_rad"),
             y = rec.Column("ball.turned_y_rad");
  for (std::size_t k = 0; k < time.size(); ++k) {
    const double turn = 0.5 * torque / kInertia * time[k] * time[k];
    EXPECT_NEAR(x[k], -std::sin(yaw) * turn, 1e-9) << time[k];
    EXPECT_NEAR(y[k], std::cos(yaw) * turn, 1e-9) << time[k];
  }
}

/// An axis that becomes free keeps its velocity; a pull along it then is a parabola.
TEST(ExperimentFreedoms, FreeAxisBeginsWithItsVelocity) {
  MotionStep move;
  move.verb = "move";
  move.velocity_m_per_s = {0.4, 0, 0};
  move.for_s = 0.1;
  MotionStep coast = Free(true, false, false);
  coast.applied_force_n = {-1.5, 0, 0};
  Experiment e = Rig({move, coast});
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const double began = std::ceil(0.1 / result.dt_s - 1e-9) * result.dt_s;
  const double t = rec.Column("time_s").back() - began;
  EXPECT_NEAR(rec.Column("ball.x_m").back(), 0.5 + 0.4 * (began + t) - 0.25 * t * t, 1e-9);
}

TEST(ExperimentFreedoms, EndsAtTheWayAndTheTurnOfFreeAxes) {
  MotionStep pull = Free(true, false, false);
  pull.applied_force_n = {6, 0, 0};
  pull.distance_m = 0.02;
  MotionStep spin = Free(false, false, true);
  spin.applied_torque_n_m = -1;
  spin.angle_rad = 0.5;
  Recorded rec;
  const Result result = RunExperiment(Rig({pull, spin}), rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_NEAR(rec.Column("ball.x_m").back(), 0.52, 0.2 * result.dt_s);
  EXPECT_NEAR(rec.Column("ball.turned_y_rad").back(), -0.5, 10 * result.dt_s);
}

/// A wheel on grains that walls and floor hold: `row` of them touching from wall to wall along x.
Experiment OnGrains(int row, double friction, double tow_x_m) {
  constexpr double kRadius = 0.01;
  Experiment e = Empty();
  e.materials[0].youngs_modulus_pa = 2e8;
  e.interfaces = {{"sand", "any", 0.3, 10, 0, {}}, {"sand", "wheel", 0.3, friction, 0, {}}};
  e.materials.push_back({"wheel", 0, 0, 0});
  e.box = {2 * kRadius * row, 2 * kRadius, 0.5, Side::kWall, Side::kWall, "steel"};
  e.grains[0].listed.clear();
  for (int k = 0; k < row; ++k) {
    GrainState s = {};
    s.x_m = (2 * k + 1) * kRadius;
    s.y_m = s.z_m = s.radius_m = kRadius;
    e.grains[0].listed.push_back(s);
  }
  PartSpec wheel;
  wheel.shape = PartShape::kWheel;
  wheel.radius_m = 0.1;
  wheel.width_m = 0.02;
  BodySpec& b = (e.bodies = {Ball({})})[0];
  b.name = b.material = "wheel";
  b.parts = {wheel};
  b.mass_kg = kMass;
  b.inertia_kg_m2 = {0.01, kInertia, 0.01};
  b.position_m = {tow_x_m, kRadius, 2 * kRadius + 0.1};
  return e;
}

std::vector<Probe> EnergyAnd(Probe::Kind kind) {
  Probe energy, other;
  energy.kind = Probe::Kind::kEnergy;
  other.kind = kind;
  other.body = "wheel";
  return {energy, other};
}

/// I (w_0 - w) = mu m g R t while it slides, and the kinetic energy that it loses is the work of
/// sliding.
TEST(ExperimentFreedoms, SlidingFrictionBrakesAFreeWheel) {
  Experiment e = OnGrains(1, 0.3, 0.01);
  MotionStep spin_up, brake = Free(false, true, true);
  spin_up.verb = "turn";
  spin_up.about_axle = true;
  spin_up.spin_rad_per_s = {0, 20, 0};
  spin_up.free_axes[2] = true;
  spin_up.for_s = 0.1;
  brake.for_s = 0.15;
  e.bodies[0].motion = {spin_up, brake};
  e.probes = EnergyAnd(Probe::Kind::kVelocity);
  e.sample_s = 0.1;
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const double t = rec.Column("time_s").back() - 0.1;
  const double expected = 20 - 0.3 * kMass * kGravity * 0.1 * t / kInertia;
  ASSERT_GT(expected, 5);
  const double left = rec.Column("wheel.w_y_rad_per_s").back();
  EXPECT_NEAR(left, expected, 0.01 * (20 - expected));
  const double lost = 0.5 * kInertia * (20 * 20 - left * left);
  const auto work = rec.Column("energy.body_work_j"), slip = rec.Column("energy.slip_j");
  EXPECT_NEAR(work.back() - work[1], lost, 0.02 * lost);
  EXPECT_NEAR(slip.back() - slip[1], lost, 0.02 * lost);
}

/// Over fixed spheres of radius r, a pitch of 2 r: w R/v = phi/sin(phi), sin(phi) = r/(R + r).
TEST(ExperimentFreedoms, TowedWheelRollsWithoutSlipOverARigidBed) {
  Experiment e = OnGrains(20, 0.5, 0.09);
  MotionStep drop = Free(false, true, true), tow = Free(false, true, true);
  drop.for_s = 0.1;
  tow.verb = "move";
  tow.velocity_m_per_s = {0.1, 0, 0};
  tow.ramp_s = 0.05;
  tow.for_s = kNever;
  tow.distance_m = 0.18;
  e.bodies[0].motion = {drop, tow};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const auto x = rec.Column("wheel.x_m"), turned = rec.Column("wheel.turned_y_rad");
  std::size_t from = 0;
  while (x[from] < 0.11) ++from;  // from a gap between two grains to the last one
  const double phi = std::asin(0.01 / 0.11);
  EXPECT_NEAR((turned.back() - turned[from]) * 0.1 / (x.back() - x[from]), phi / std::sin(phi),
              0.01);
}

/// m g h of a dropped wheel becomes the work that it does on the grains.
TEST(ExperimentFreedoms, DroppedWeightGivesItsEnergyToTheGrains) {
  Experiment e = OnGrains(1, 0.3, 0.01);
  MotionStep drop = Free(false, true, true);
  drop.for_s = 0.5;
  BodySpec& wheel = e.bodies[0];
  wheel.motion = {drop};
  wheel.position_m[2] += 0.005;
  wheel.mass_kg = 0.05;  // not so much more than the grain's that its damper counts for nothing
  e.interfaces[1].restitution = 0.05;
  e.rayleigh_fraction = 0.01;
  e.probes = EnergyAnd(Probe::Kind::kPose);
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const double fell = wheel.position_m[2] - rec.Column("wheel.z_m").back();
  const double work = rec.Column("energy.body_work_j").back();
  EXPECT_NEAR(fell, 0.005, 1e-4);
  EXPECT_NEAR(work, 0.05 * kGravity * fell, 0.02 * work);
  EXPECT_NEAR(rec.Column("energy.residual_j").back(), 0, 0.02 * work);
}

TEST(ExperimentFreedoms, InertiaAboutTheAxleIsThatOfTheParts) {
  BodySpec b = OnGrains(1, 0.3, 0).bodies[0];
  b.mass_kg = 5;
  b.inertia_kg_m2 = {0, 0, 0};
  EXPECT_NEAR(FreeMassOf(b, {}, "body").axle_inertia_kg_m2, 0.5 * 5 * 0.01, 1e-9);
  b.mass_kg = 0;
  EXPECT_NEAR(FreeMassOf(b, {"wheel", 1000, 0, 0}, "body").mass_kg, 1000 * M_PI * 0.01 * 0.02,
              1e-6);
}

/// The field that is named where `change` makes a rig contradict itself.
std::string Refused(const std::function<void(Experiment*, MotionStep*)>& change) {
  Experiment e = Rig({Free(true, true, true)});
  change(&e, &e.bodies[0].motion[0]);
  try {
    PlanOf(e);
  } catch (const SpecError& error) {
    return error.field();
  }
  return "";
}

TEST(ExperimentFreedoms, RefusesContradictions) {
  const std::string step = "bodies[0].motion[0].";
  EXPECT_EQ(Refused([](Experiment*, MotionStep*) {}), "");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->velocity_m_per_s = {0.1, 0, 0};
            }),
            step + "free");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) { s->velocity_m_per_s = {0, 0.1, 0}; }), "");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->amplitude_m = {0, 0, 0.001};
              s->frequency_hz = 10;
            }),
            step + "free");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->hold = true;
              s->hold_force_n = 5;
            }),
            step + "free");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->spin_rad_per_s = {0, 1, 0};
            }),
            step + "free");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) { s->spin_rad_per_s = {0, 0, 1}; }), "");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->applied_force_n = {0, 1, 0};
            }),
            step + "applied_force_n");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) {
              s->free_spin = false;
              s->applied_torque_n_m = 1;
            }),
            step + "applied_torque_n_m");
  EXPECT_EQ(Refused([](Experiment* e, MotionStep*) {
              e->bodies[0].mass_kg = 0;
              e->bodies[0].inertia_kg_m2 = {0, 0, 0};
              e->materials[1].density_kg_per_m3 = 0;
            }),
            "bodies[0].mass_kg");
  EXPECT_EQ(Refused([](Experiment* e, MotionStep*) {
              e->bodies[0].inertia_kg_m2 = {0.01, 0, 0.01};
            }),
            "bodies[0].inertia_kg_m2");
  EXPECT_EQ(Refused([](Experiment* e, MotionStep*) {
              e->bodies[0].centre_m = {0.01, 0, 0};
            }),
            step + "free");
  EXPECT_EQ(Refused([](Experiment*, MotionStep* s) { s->for_s = kNever; }), "bodies[0].motion[0]");
}

}  // namespace
}  // namespace grouser::dem::experiment

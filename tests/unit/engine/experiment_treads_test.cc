// What a grouser wheel in a layer of spheres needs: treads in the soil, another time step of the
// program, a window that follows the wheel, frictions of the preparation.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/experiment/treads.h"
#include "dem_offline/engine/world/world.h"
#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kDegree = M_PI / 180;

PartSpec WheelPart(int treads) {
  PartSpec p;
  p.shape = PartShape::kWheel;
  p.radius_m = 0.1;
  p.width_m = 0.1;
  Tread t;
  t.count = treads;
  t.height_m = 0.02;
  t.root_thickness_m = 0.01;
  p.treads = {t};
  return p;
}

TEST(ExperimentTreads, EntryExitAndFlow) {
  BodySpec spec = Ball({});
  spec.parts = {WheelPart(12)};
  spec.position_m = {3.5, 0.5, 0.5};
  Body wheel = BuildBody(spec, {}, 1, false, "wheel").body;
  // Turned by 5 degrees about y: the tread straight down goes back to -5 degrees.
  wheel.orientation = {std::cos(2.5 * kDegree), 0, std::sin(2.5 * kDegree), 0};
  wheel.spin_rad_per_s = {0, 2, 0};
  const auto grain = [](double angle_deg, double distance, double speed) {
    GrainState s = {};
    // One period of the frame away.
    s.x_m = 0.5 + distance * std::sin(angle_deg * kDegree);
    s.y_m = 0.5;
    s.z_m = 0.5 - distance * std::cos(angle_deg * kDegree);
    s.radius_m = 0.004;
    s.v_x = speed;
    return s;
  };
  const double tip = 2 * std::hypot(0.12, 0.005);
  const TreadState t =
      MeasureTreads({grain(55, 0.122, 0.3 * tip),   // on the tip of one
                     grain(-35, 0.122, 0.5 * tip),  // of another
                     grain(-65, 0.130, 0.1 * tip),  // too far, and slow
                     grain(85, 0.108, 1.1 * tip),   // between tread and tip: touches
                     grain(40, 0.102, 0)},          // touches the rim only
                    wheel, 1.0);
  EXPECT_NEAR(t.tread_rad, -5 * kDegree, 1e-6);
  EXPECT_NEAR(t.entry_rad, 85 * kDegree, 1e-6);
  EXPECT_NEAR(t.exit_rad, -35 * kDegree, 1e-6);
  EXPECT_EQ(t.flow_grains, 2);
  EXPECT_NEAR(t.flow_m_per_s, 0.4 * tip, 1e-6);
  EXPECT_NEAR(t.flow_area_m2, 2 * M_PI * 0.004 * 0.004, 1e-12);
  EXPECT_TRUE(std::isnan(MeasureTreads({grain(0, 0.2, 0)}, wheel, 1.0).entry_rad));
}

TEST(ExperimentTreads, RefusesBodiesWithoutTreads) {
  Experiment e = Empty();
  MotionStep wait;
  wait.verb = "wait";
  wait.for_s = 0.1;
  e.bodies = {Ball({wait})};
  Probe p;
  p.kind = Probe::Kind::kTreads;
  p.body = "ball";
  e.probes = {p};
  EXPECT_THROW(PlanOf(e), SpecError);
  e.bodies[0].parts = {WheelPart(12)};
  EXPECT_NO_THROW(PlanOf(e));
}

/// v = -g t and z = z_0 - g t^2/2 whatever the steps: leapfrog is exact under a constant force.
TEST(ExperimentTimeStep, ChangesWithoutAKick) {
  Experiment e = Empty();
  WorldConfig c;
  c.frame = {1, 1, 4};
  c.gravity_m_per_s2 = {0, 0, -9.81};
  c.contacts = ContactsOf(e);
  c.dt_s = 1e-3;
  GrainState s = e.grains[0].listed[0];
  s.z_m = 1;
  s.density_kg_per_m3 = 2500;
  World world(c, std::vector<GrainState>{s});
  world.Run(100);
  const double v = world.State(0).v_z;
  world.SetTimeStep(2.5e-4);
  EXPECT_NEAR(world.State(0).v_z, v, 1e-6);
  EXPECT_NEAR(world.time_s(), 0.1, 1e-12);
  world.Run(400);
  EXPECT_NEAR(world.time_s(), 0.2, 1e-12);
  EXPECT_NEAR(world.State(0).v_z, -9.81 * 0.2, 2e-6);
  EXPECT_NEAR(world.State(0).z_m, 1 - 0.5 * 9.81 * 0.04, 1e-6);
  EXPECT_THROW(world.SetTimeStep(0), std::invalid_argument);
}

TEST(ExperimentTimeStep, OfTheProgramIsAShareOfThePreparations) {
  Experiment e = Empty();
  e.duration_s = 0.05;
  const Plan whole = PlanOf(e);
  e.program_step = 0.5;
  const Plan half = PlanOf(e);
  EXPECT_EQ(half.dt_s, whole.dt_s);
  EXPECT_DOUBLE_EQ(half.program_dt_s, 0.5 * whole.dt_s);
  const Result result = RunExperiment(e, nullptr, nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_NEAR(result.run_s, 0.05, half.program_dt_s);
  EXPECT_DOUBLE_EQ(result.dt_s, half.program_dt_s);
  e.program_step = 1.5;
  EXPECT_THROW(PlanOf(e), SpecError);
}

/// A settling with little friction where the law has frictions of its own.
TEST(ExperimentPreparation, ItsFrictionStandsOverThoseOfALaw) {
  Experiment e = Empty();
  e.laws.tangential = "kelvin_regularised";
  e.laws.settings = {{"kelvin_regularised", "slide_friction", 0.45}};
  EXPECT_NO_THROW(ContactsOf(e));
  EXPECT_NO_THROW(
      ContactsOf(e, {.friction = 0.1,
                     .rolling_friction = {}}));  // sliding 0.45 above sticking 0.1 would be refused
}

/// A small bed of one layer, settled and cut.
Experiment Layer() {
  Experiment e = Empty();
  e.box = {0.2, 0.1, 0.25, Side::kPeriodic, Side::kPeriodic, "steel"};
  e.box.planar = true;
  Grains g;
  g.material = "sand";
  g.sizes = {{0.008, 0.5}, {0.01, 0.5}};
  g.count = 160;
  e.grains = {g};
  Preparation settle, cut, relax;
  cut.kind = Preparation::Kind::kCut;
  cut.height_m = 0.04;
  relax.kind = Preparation::Kind::kRelax;
  e.preparation = {settle, cut, relax};
  PartSpec wheel = WheelPart(8);
  wheel.radius_m = 0.03;
  wheel.treads[0].height_m = 0.01;
  wheel.treads[0].root_thickness_m = 0.006;
  BodySpec b = Ball({});
  b.name = "wheel";
  b.parts = {wheel};
  b.position_m = {0.1, 0.05, 0};
  b.above_surface_m = 0.0005;
  MotionStep roll;
  roll.verb = "move";
  roll.velocity_m_per_s = {0.1, 0, -0.002};
  roll.spin_rad_per_s = {0, 3, 0};
  roll.distance_m = 0.5;
  b.motion = {roll};
  e.bodies = {b};
  Probe energy, pose, surface;
  energy.kind = Probe::Kind::kEnergy;
  pose.kind = Probe::Kind::kPose;
  pose.body = "wheel";
  surface.kind = Probe::Kind::kSurface;
  surface.name = "surface";
  surface.n[0] = 20;
  e.probes = {energy, pose, surface};
  return e;
}

/// The wheel goes 2.5 times the length of the bed; its window stays around it and full.
TEST(ExperimentFollow, WindowGoesWithTheWheel) {
  Experiment e = Layer();
  e.box.follow = {"wheel", 0.26, 0.45};
  Recorded rec;
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const double end = rec.Column("wheel.x_m").back();
  EXPECT_NEAR(end, 0.6, 1e-3);
  const auto x = rec.Column("x_m", "surface"), height = rec.Column("height_m", "surface");
  ASSERT_EQ(x.size(), 20u);
  EXPECT_NEAR(x.back() - x.front(), 0.26 * 19 / 20, 1e-9);
  EXPECT_LT(x.front(), end - 0.09);
  EXPECT_GT(x.back(), end + 0.07);
  for (std::size_t k = 0; k < x.size(); ++k) {  // soil everywhere; untouched in front
    EXPECT_GT(height[k], 0.02) << k;
    if (x[k] > end + 0.07) {
      EXPECT_LT(height[k], 0.042) << k;
    }
  }
  EXPECT_LT(std::abs(result.energy_residual_j), 0.01 * result.energy_input_j);
}

TEST(ExperimentFollow, RefusesWhatAWindowCannotHold) {
  const auto refused = [](auto&& change, const std::string& field) {
    Experiment e = Layer();
    e.box.follow = {"wheel", 0.26, 0.45};
    change(e);
    try {
      PlanOf(e);
      ADD_FAILURE() << field << " was not refused";
    } catch (const SpecError& error) {
      EXPECT_EQ(error.field(), field) << error.what();
    }
  };
  refused([](Experiment& e) { e.box.follow.body = "weel"; }, "box.follow.body");
  refused([](Experiment& e) { e.box.follow.length_m = 0.12; }, "box.follow.length_m");
  refused([](Experiment& e) { e.box.follow.ahead = 1; }, "box.follow.ahead");
  refused([](Experiment& e) { e.box.x = Side::kWall; }, "box.follow");
  refused(
      [](Experiment& e) {
        e.box.planar = false;
        e.preparation = {};
        e.grains[0].count = 10;
        e.grains[0].sizes = {{0.01, 1.0}};
        e.grains[0].bonds.fragment_m = 0.002;
        e.grains[0].bonds.fragments = 20;
        e.grains[0].bonds.count = 40;
        e.grains[0].bonds.law.normal_stiffness_n_per_m3 = 1e7;
        e.grains[0].bonds.law.shear_stiffness_n_per_m3 = 1e7;
      },
      "box.follow");
  refused([](Experiment& e) { e.box.disc_thickness_m = 0.01; }, "box.follow");
}

}  // namespace
}  // namespace grouser::dem::experiment

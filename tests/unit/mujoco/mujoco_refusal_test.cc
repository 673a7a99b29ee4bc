// What the adapter refuses, and in which words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/mujoco/rover_world.h"

namespace grouser::mujoco {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Refusal(const mjModel* m, const Wheels& wheels, const std::string& ground = "ground",
                    int offset = 0) {
  try {
    SoilContact soil(m, {wheels}, ground, offset);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(MujocoRefusal, NamesWhatIsNotThereAndWhatIs) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  EXPECT_EQ(Refusal(scene.m, {"wheel_*", &sand}), "");
  EXPECT_THAT(Refusal(scene.m, {"whel_*", &sand}),
              AllOf(HasSubstr("no body 'whel_*'"), HasSubstr("'wheel_front_left'")));
  EXPECT_THAT(Refusal(scene.m, {"chassis", &sand}),
              AllOf(HasSubstr("body 'chassis'"), HasSubstr("a hinge")));
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", &sand}, "floor"),
              AllOf(HasSubstr("geom 'floor'"), HasSubstr("one of 'ground'")));
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", nullptr}), HasSubstr("no model"));
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", &sand}, "ground", 1), HasSubstr("nuserdata=\"14\""));
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", &sand, {.damping_ratio = -2}}),
              HasSubstr("damping_ratio: got -2"));
  const Model small = sand.Scaled(0.05, 9.81), moon = sand.Scaled(0.0625, 1.62);
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", &small}),
              AllOf(HasSubstr("radius 0.0625"), HasSubstr("0.05")));
  EXPECT_THAT(Refusal(scene.m, {"wheel_*", &moon}), HasSubstr("gravity: got 9.81"));
  EXPECT_THROW(SoilContact(scene.m, {{"wheel_*", &sand}, {"wheel_rear_left", &sand}}, "ground"),
               std::invalid_argument);
}

TEST(MujocoRefusal, OfModelsThatWouldCarryTwiceOrForget) {
  const Model sand = Model::Open(kSand);
  const Scene twice(Changed("<geom contype=\"0\" conaffinity=\"0\"/>", "<geom/>"));
  EXPECT_THAT(Refusal(twice.m, {"wheel_*", &sand}), HasSubstr("carried twice"));
  const Scene forgets(Changed("<size nuserdata=\"13\"/>", ""));
  EXPECT_THAT(Refusal(forgets.m, {"wheel_*", &sand}),
              AllOf(HasSubstr("nuserdata: got 0"), HasSubstr("nuserdata=\"13\"")));
}

TEST(MujocoRefusal, OfWheelsThatPairsOrFixedBodiesCarryTwice) {
  const Model sand = Model::Open(kSand);
  const std::string front = "<joint name=\"front_left\"/> <geom name=\"tread\"/>";
  const std::string old = "<joint name=\"front_left\"/> <geom/>";
  const Scene named(Changed(old, front));
  EXPECT_EQ(Refusal(named.m, {"wheel_*", &sand}), "");
  const Scene pair(Changed(
      {{old, front},
       {"<actuator>", "<contact><pair geom1=\"ground\" geom2=\"tread\"/></contact><actuator>"}}));
  EXPECT_THAT(Refusal(pair.m, {"wheel_*", &sand}),
              AllOf(HasSubstr("geom 'tread'"), HasSubstr("carried twice"), HasSubstr("<pair>")));
  const std::string lug = "<body><geom name=\"lug\" contype=\"1\" conaffinity=\"1\"/></body>";
  const Scene fixed(
      Changed({{old, old + lug},
               {"hfield=\"ground\"/>", "hfield=\"ground\" contype=\"1\" conaffinity=\"1\"/>"}}));
  EXPECT_THAT(Refusal(fixed.m, {"wheel_*", &sand}),
              AllOf(HasSubstr("geom 'lug'"), HasSubstr("carried twice")));
}

TEST(MujocoRefusal, OfTheLargestRadiusAlone) {
  const Model sand = Model::Open(kSand);
  const std::string old = "<joint name=\"front_left\"/> <geom/>";
  const std::string hub = "<geom name=\"hub\" size=\"0.02 0.03\"/>";
  const std::string flange = "<geom name=\"flange\" size=\"0.08 0.03\"/>";
  const Scene with_hub(Changed(old, old + hub)), with_flange(Changed(old, old + flange));
  EXPECT_EQ(Refusal(with_hub.m, {"wheel_*", &sand}), "");
  EXPECT_THAT(Refusal(with_flange.m, {"wheel_*", &sand}),
              HasSubstr("geom 'flange' of radius 0.08"));
}

TEST(MujocoRefusal, OfGroundThatMovesOrHasNoArea) {
  const Model sand = Model::Open(kSand);
  const std::string old = "<geom name=\"ground\" type=\"hfield\" hfield=\"ground\"/>";
  const std::string plane = "<geom name=\"ground\" type=\"plane\" size=\"1 1 1\"/></body>";
  const Scene mocap(Changed(old, "<body name=\"lift\" mocap=\"true\">" + plane));
  EXPECT_THAT(Refusal(mocap.m, {"wheel_*", &sand}),
              AllOf(HasSubstr("body 'lift', which can move"), HasSubstr("no mocap")));
  const Scene line;
  line.m->hfield_nrow[0] = 1;
  EXPECT_THAT(Refusal(line.m, {"wheel_*", &sand}),
              AllOf(HasSubstr("1 rows and 141 columns"), HasSubstr("2 or more")));
  line.m->hfield_nrow[0] = 141;
  line.m->hfield_ncol[0] = 1;
  EXPECT_THAT(Refusal(line.m, {"wheel_*", &sand}), HasSubstr("141 rows and 1 columns"));
}

TEST(MujocoRefusal, SaysWhichWheelIsNotFiniteAndAddsNothing) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  World good(scene.m), bad(scene.m);
  mjData* worlds[] = {good.d, bad.d};
  for (mjData* d : worlds) mj_step1(scene.m, d);
  bad.d->cvel[6 * mj_name2id(scene.m, mjOBJ_BODY, "wheel_rear_left")] =
      std::numeric_limits<double>::quiet_NaN();
  try {
    soil.Apply(scene.m, worlds);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("'wheel_rear_left', world 1"),
                                    HasSubstr("expected finite numbers")));
  }
  for (const mjData* d : worlds) {
    for (int i = 0; i < scene.m->nv; ++i) EXPECT_EQ(d->qfrc_passive[i], 0);
  }
  const Scene other;
  World elsewhere(other.m);
  EXPECT_THROW(soil.Apply(other.m, elsewhere.d), std::invalid_argument);
}

TEST(MujocoRefusal, OneCallbackAtATimeAndTheEarlierOneIsPutBack) {
  static int calls = 0;
  mjcb_passive = [](const mjModel*, mjData*) { ++calls; };
  const mjfGeneric before = mjcb_passive;
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  {
    const PassiveForces passive(&soil);
    EXPECT_THROW(PassiveForces{&soil}, std::logic_error);
    World world(scene.m);
    calls = 0;  // of the reader's own
    mj_forward(scene.m, world.d);
    EXPECT_EQ(calls, 1);
    EXPECT_GT(world.d->qfrc_passive[2], 10);
  }
  EXPECT_EQ(mjcb_passive, before);
  mjcb_passive = nullptr;
}

}  // namespace
}  // namespace grouser::mujoco

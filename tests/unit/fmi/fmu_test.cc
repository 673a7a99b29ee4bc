#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include "tests/unit/fmi/fmu_fixture.h"

namespace grouser::fmi::testing {
namespace {

using ::testing::HasSubstr;

constexpr double kEqual = 1e-12;

void ExpectEqual(double got, double expected, double scale, const char* what) {
  EXPECT_LE(std::fabs(got - expected), kEqual * scale) << what << ": " << got << ", " << expected;
}

template <class Call>
std::string MessageOf(const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

Pose RandomPose(std::mt19937* random) {
  std::uniform_real_distribution<double> any(-1, 1);
  Pose p;
  p.yaw = 3 * any(*random);
  p.sinkage = 0.016 + 0.012 * any(*random);
  p.spin_angle = 3 * any(*random);
  p.v_x = 0.1 * any(*random);
  p.v_y = 0.05 * any(*random);
  p.v_z = 0.02 * any(*random);
  p.spin = 1.5 * any(*random);
  p.ground = any(*random);
  return p;
}

class FmuOf : public ::testing::TestWithParam<const char*> {
 protected:
  std::filesystem::path Folder() const { return kFmus / GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(Versions, FmuOf, ::testing::Values("fmi3", "fmi2"));

// Relaxation and damping off: load by LoadAtSinkage, forces by the model, both called directly.
TEST_P(FmuOf, AnswersAsTheModelDoes) {
  Fmu wheel(Folder());
  wheel.Set("relaxation_over_radius", 0);
  wheel.Set("damping_ratio", 0);
  wheel.Initialize();
  std::mt19937 random(7);
  const Model& model = Shipped();
  const double r = model.radius_m();
  for (int i = 0; i < 300; ++i) {
    const Pose p = RandomPose(&random);
    SetPose(p, &wheel);
    wheel.Step(1e-3 * i, 1e-3);
    // Rounding of the pose moves the sinkage by some 1e-16 m, and with it the load by as many
    // parts of it; what is asked of the model is what the FMU says.
    ExpectEqual(wheel.Get("contact.sinkage"), p.sinkage, r, "sinkage");
    ExpectEqual(wheel.Get("contact.v_x"), p.v_x, 1, "v_x");
    ExpectEqual(wheel.Get("contact.v_y"), p.v_y, 1, "v_y");
    ExpectEqual(wheel.Get("contact.rim_speed"), r * p.spin, 1, "rim speed");
    const State asked = {wheel.Get("contact.v_x"), wheel.Get("contact.v_y"),
                         wheel.Get("contact.rim_speed"), wheel.Get("contact.load")};
    ExpectEqual(
        asked.load,
        LoadAtSinkage(model, asked.v_x, asked.v_y, asked.rim_speed, wheel.Get("contact.sinkage")),
        asked.load, "load");
    const Answer answer = model.Evaluate(asked);
    const auto value = [&](Output o) { return answer.output[o].value; };
    ExpectEqual(wheel.Get("contact.f_x"), value(kFx), asked.load, "f_x");
    ExpectEqual(wheel.Get("contact.f_y"), value(kFy), asked.load, "f_y");
    ExpectEqual(wheel.Get("contact.torque"), value(kTorque), asked.load * r, "torque");
    ExpectEqual(wheel.Get("contact.m_z"), value(kMz), asked.load * r, "m_z");
    ExpectEqual(wheel.Get("half_width.f_x"),
                0.5 * (answer.output[kFx].high - answer.output[kFx].low), asked.load, "half width");
    ExpectEqual(wheel.Get("contact.slip"), answer.slip, 1, "slip");
    ExpectEqual(wheel.Get("contact.slip_angle"), answer.attack_angle, 1, "slip angle");
    EXPECT_EQ(wheel.Get("flags"), answer.flags);
    EXPECT_EQ(wheel.Get("extrapolated") != 0, (answer.flags & kExtrapolated) != 0);
    // In the world: x ahead of the wheel, y to its left, z up; the moment at its centre.
    const double c = std::cos(p.yaw), s = std::sin(p.yaw), n = asked.load;
    std::array<double, 3> force{}, moment{}, point{};
    wheel.Get(wheel.References("wheel_load.force"), force);
    wheel.Get(wheel.References("wheel_load.moment"), moment);
    wheel.Get(wheel.References("wheel_load.point"), point);
    ExpectEqual(force[0], c * value(kFx) - s * value(kFy), n, "force x");
    ExpectEqual(force[1], s * value(kFx) + c * value(kFy), n, "force y");
    ExpectEqual(force[2], n, n, "force z");
    const double roll = (r - p.sinkage) * value(kFy);
    ExpectEqual(moment[0], c * roll + s * value(kTorque), n * r, "moment x");
    ExpectEqual(moment[1], s * roll - c * value(kTorque), n * r, "moment y");
    ExpectEqual(moment[2], value(kMz), n * r, "moment z");
    EXPECT_EQ(point[0], 1.5);
  }
}

// With damping and relaxation: as grouser::WheelContact by steps, to kEqual of the load.
TEST_P(FmuOf, StepsAsWheelContactDoes) {
  Fmu wheel(Folder());
  wheel.Initialize();
  WheelContact contact(Shipped());
  ContactState state;
  std::mt19937 random(8);
  for (int i = 0; i < 200; ++i) {
    const Pose p = RandomPose(&random);
    SetPose(p, &wheel);
    wheel.Step(1e-3 * i, 1e-3);
    const double c = std::cos(p.yaw), s = std::sin(p.yaw);
    WheelMotion motion;
    motion.centre = {1.5, -0.7, p.ground + Shipped().radius_m() - p.sinkage};
    motion.axle = {-s, c, 0};
    motion.velocity = {c * p.v_x - s * p.v_y, s * p.v_x + c * p.v_y, p.v_z};
    motion.angular_velocity = {-s * p.spin, c * p.spin, 0};
    motion.ground_point = {0, 0, p.ground};
    motion.ground_normal = {0, 0, 1};
    motion.time_step = 1e-3;
    const WheelForce expected = contact.Evaluate(motion, &state);
    ASSERT_GT(expected.mobilised, 0);
    std::array<double, 3> force{};
    wheel.Get(wheel.References("wheel_load.force"), force);
    for (int k = 0; k < 3; ++k) ExpectEqual(force[k], expected.force[k], expected.load, "force");
    ExpectEqual(wheel.Get("contact.mobilised"), expected.mobilised, 1, "mobilised");
  }
}

TEST_P(FmuOf, ARestoredStateGoesOnWithTheSameBits) {
  Fmu wheel(Folder()), other(Folder());
  ASSERT_TRUE(wheel.description().saves_state && wheel.description().serializes_state);
  wheel.Initialize();
  std::mt19937 random(9);
  const auto go = [](Fmu* fmu, int first) {
    std::mt19937 same(static_cast<unsigned>(first));
    for (int i = 0; i < 20; ++i) {
      SetPose(RandomPose(&same), fmu);
      fmu->Step(1e-3 * (first + i), 1e-3);
    }
    return OutputsOf(*fmu);
  };
  const std::vector<double> before = go(&wheel, 0);
  const Fmu::State saved = wheel.Save();
  const Bytes bytes = wheel.Serialize(saved);
  const std::vector<double> after = go(&wheel, 20);
  ASSERT_NE(before, after);
  wheel.Restore(saved);
  EXPECT_EQ(OutputsOf(wheel), before);
  EXPECT_EQ(go(&wheel, 20), after);
  other.Restore(other.Deserialize(bytes));  // of another instance, which was not even initialised
  EXPECT_EQ(OutputsOf(other), before);
  EXPECT_EQ(go(&other, 20), after);
  EXPECT_EQ(other.Get("time"), wheel.Get("time"));
  wheel.Restore(saved);
  EXPECT_EQ(wheel.Serialize(wheel.Save()), bytes);
  // What was left out would show here: an instance of its own, the same inputs.
  wheel.Reset();
  wheel.Initialize();
  EXPECT_EQ(go(&wheel, 0), before);

  Bytes damaged = bytes;
  damaged[damaged.size() - 9] ^= 1;
  EXPECT_THAT(MessageOf([&] { (void)wheel.Deserialize(damaged); }), HasSubstr("damaged"));
  damaged = bytes;
  damaged.pop_back();
  EXPECT_THAT(MessageOf([&] { (void)wheel.Deserialize(damaged); }), HasSubstr("bytes: got"));
}

// What a wheel that is held feels is known no better than what a wheel that moves feels.
TEST_P(FmuOf, HalfWidthsAtRestAreThoseOfTheModel) {
  Fmu wheel(Folder());
  wheel.Initialize();
  Pose p;
  const auto half_widths = [&] {
    SetPose(p, &wheel);
    wheel.Step(0, 1e-4);
    std::array<double, kOutputs> half{};
    half[kFx] = wheel.Get("half_width.f_x");
    half[kFy] = wheel.Get("half_width.f_y");
    half[kTorque] = wheel.Get("half_width.torque");
    half[kMz] = wheel.Get("half_width.m_z");
    half[kSinkage] = wheel.Get("half_width.sinkage");
    return half;
  };
  const auto of_model = [&](const State& asked, Output o) {
    const Answer answer = Shipped().Evaluate(asked);
    return 0.5 * (answer.output[o].high - answer.output[o].low);
  };
  const auto resting = half_widths();
  ASSERT_EQ(wheel.Get("contact.mobilised"), 0);
  const double load = wheel.Get("contact.load");
  for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {
    EXPECT_GT(resting[o], 0) << o;
    ExpectEqual(resting[o], of_model({0, 0, 0, load}, o), load, "at rest");
  }
  p.v_x = 0.1;
  p.spin = 1.7;
  const auto starting = half_widths();
  const double m = wheel.Get("contact.mobilised");
  ASSERT_TRUE(m > 0.01 && m < 0.99) << m;
  const State asked = {wheel.Get("contact.v_x"), wheel.Get("contact.v_y"),
                       wheel.Get("contact.rim_speed"), wheel.Get("contact.load")};
  const State still = {0, 0, 0, asked.load};
  for (const Output o : {kFx, kFy, kTorque, kMz}) {
    ExpectEqual(starting[o], of_model(asked, o), asked.load, "starting");
  }
  ExpectEqual(starting[kSinkage],
              m * of_model(asked, kSinkage) + (1 - m) * of_model(still, kSinkage),
              Shipped().radius_m(), "sinkage");
}

TEST_P(FmuOf, NoForceInTheAir) {
  Fmu wheel(Folder());
  wheel.Initialize();
  Pose p;
  p.sinkage = -1e-3;
  p.v_x = 0.1;
  p.spin = 2;
  SetPose(p, &wheel);
  wheel.Step(0, 1e-3);
  for (const char* name : {"contact.load", "wheel_load.force.x", "wheel_load.force.z",
                           "wheel_load.moment.y", "half_width.f_x"}) {
    EXPECT_EQ(wheel.Get(name), 0) << name;
  }
  EXPECT_EQ(wheel.Get("flags"), kAirborne);
  EXPECT_EQ(wheel.Get("query_point.x"), 1.5);
}

TEST_P(FmuOf, RefusesBadInputAndGoesOn) {
  Fmu wheel(Folder());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(MessageOf([&] { wheel.Step(0, 1e-3); }), HasSubstr("do step: not allowed"));
  wheel.Initialize();
  Pose p;
  p.v_x = 0.1;
  p.spin = 1.7;
  SetPose(p, &wheel);
  const Fmu::State at_start = wheel.Save();
  wheel.Step(0, 1e-3);
  const std::vector<double> good = OutputsOf(wheel);
  wheel.Restore(at_start);

  for (const double bad : {nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(MessageOf([&] { wheel.Set("wheel_state.pos.z", bad); }),
                HasSubstr("wheel_state.pos.z: got"));
  }
  EXPECT_THAT(MessageOf([&] { wheel.Set("wheel_load.force.x", 1); }), HasSubstr("cannot be set"));
  EXPECT_THAT(MessageOf([&] { wheel.Set("damping_ratio", 1); }), HasSubstr("cannot be set"));
  const unsigned beyond = 1000000;
  const double value = 1;
  EXPECT_THAT(MessageOf([&] { wheel.Set({&beyond, 1}, {&value, 1}); }), HasSubstr("1000000"));
  for (const double step : {-1e-3, nan}) {
    EXPECT_THAT(MessageOf([&] { wheel.Step(0, step); }), HasSubstr("communication step size: got"));
  }
  wheel.Set("terrain_normal.z", 0);
  EXPECT_THAT(MessageOf([&] { wheel.Step(0, 1e-3); }), HasSubstr("terrain_normal (0, 0, 0)"));
  wheel.Set("terrain_normal.z", 1);
  wheel.Set("wheel_state.lin_vel.x", 1e300);  // finite, but nothing that can be squared
  EXPECT_THAT(MessageOf([&] {
                wheel.Step(0, 1e-3);
                for (const double x : OutputsOf(wheel)) EXPECT_TRUE(std::isfinite(x));
                throw std::runtime_error("finite");
              }),
              ::testing::AnyOf(HasSubstr("no answer"), HasSubstr("finite")));
  wheel.Restore(at_start);
  wheel.Step(0, 1e-3);
  EXPECT_EQ(OutputsOf(wheel), good);
  EXPECT_FALSE(wheel.messages().empty());
}

TEST_P(FmuOf, RefusesBadParametersBeforeTheFirstStep) {
  Fmu wheel(Folder());
  wheel.Set("damping_ratio", -1);
  EXPECT_THAT(MessageOf([&] { wheel.Initialize(); }), HasSubstr("damping_ratio: got -1"));
  wheel.Reset();
  wheel.Set("tyre_stiffness", -5);
  EXPECT_THAT(MessageOf([&] { wheel.Initialize(); }), HasSubstr("tyre_stiffness: got -5"));
  wheel.Reset();
  wheel.Initialize();
}

// A copy of an FMU with one thing wrong.
TEST_P(FmuOf, RefusesADamagedFmu) {
  const auto folder =
      std::filesystem::path(::testing::TempDir()) / (std::string("bad-") + GetParam());
  std::filesystem::remove_all(folder);
  std::filesystem::copy(Folder(), folder, std::filesystem::copy_options::recursive);
  const auto description = folder / "modelDescription.xml";
  std::ifstream in(description);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto write = [&](const std::string& changed) { std::ofstream(description) << changed; };
  std::string other = text;
  other.replace(other.find("grouser-") + 8, 4, "0000");
  write(other);
  EXPECT_THAT(MessageOf([&] { Fmu wheel(folder); }), HasSubstr("instantiation token"));
  write(text.substr(0, text.size() / 2));
  EXPECT_THAT(MessageOf([&] { Fmu wheel(folder); }), HasSubstr("modelDescription.xml"));
  write(text);
  for (const char* line :
       {"damping_ratio,much", "damping_ratio,0.5x", "damping_ratio", "other,1"}) {
    std::ofstream(folder / "resources/parameters.csv") << line << "\n";
    EXPECT_THAT(MessageOf([&] { Fmu wheel(folder); }), HasSubstr("expected a parameter's name"));
  }
  std::filesystem::remove(folder / "resources/wheel.model");
  EXPECT_THAT(MessageOf([&] { Fmu wheel(folder); }), HasSubstr("wheel.model"));
  std::filesystem::remove_all(folder);
}

// Hard ground: the load comes from the tyre's stiffness alone, which the FMU was made with.
TEST(FmuOnHardGround, LoadIsStiffnessTimesPenetration) {
  Fmu wheel(kFmus / "hard");
  wheel.Set("damping_ratio", 0);
  wheel.Initialize();
  const double stiffness = wheel.Get("tyre_stiffness");
  ASSERT_EQ(stiffness, 20000);
  wheel.Set("wheel_state.pos.z", wheel.Get("wheel_radius") - 1e-3);
  wheel.Set("wheel_state.lin_vel.x", 0.1);
  wheel.Set("wheel_state.ang_vel.y", 0.1 / wheel.Get("wheel_radius"));
  wheel.Step(0, 1e-3);
  EXPECT_NEAR(wheel.Get("wheel_load.force.z"), 1e-3 * stiffness, 1e-4 * stiffness * 1e-3);
  wheel.Reset();
  wheel.Set("tyre_stiffness", 0);
  EXPECT_THAT(MessageOf([&] { wheel.Initialize(); }), HasSubstr("does not sink"));
}

TEST_P(FmuOf, MillionSteps) {
  Fmu wheel(Folder());
  wheel.Initialize();
  const std::vector<unsigned> position = wheel.References("wheel_state.pos"),
                              velocity = wheel.References("wheel_state.lin_vel"),
                              spin = wheel.References("wheel_state.ang_vel"),
                              force = wheel.References("wheel_load.force");
  std::array<double, 3> in{}, out{};
  double sum = 0;
  const auto started = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000000; ++i) {
    const double t = 1e-3 * i;
    wheel.Set(position, in = {0, 0, Shipped().radius_m() - 0.015 - 0.01 * std::sin(7 * t)});
    wheel.Set(velocity, in = {0.1 * std::sin(0.3 * t), 0.03 * std::cos(0.7 * t), 0});
    wheel.Set(spin, in = {0, 1.6 * std::sin(0.31 * t), 0});
    wheel.Step(t, 1e-3);
    wheel.Get(force, out);
    sum += out[0] + out[1] + out[2];
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
  EXPECT_TRUE(std::isfinite(sum));
  EXPECT_GT(sum, 1e6);
  std::printf("%s: %.2f us a step\n", GetParam(), took.count());
}

}  // namespace
}  // namespace grouser::fmi::testing

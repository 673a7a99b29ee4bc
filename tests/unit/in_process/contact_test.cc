// grouser/contact.h: the load at a sinkage, and a simulator's wheel on a model's soil.
#include "grouser/contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "tests/unit/count_allocations.h"
#include "tests/unit/in_process/on_floor.h"

namespace grouser {
namespace {

using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const std::string kPairs = GROUSER_PAIR;

Model Open(const char* kind) { return Model::Open(kPairs + "/" + kind + ".model"); }
Model Hard() { return OnFloor(1, 1000, -2, 2); }

double SinkageAt(const Model& model, double v_x, double v_y, double rim, double load) {
  return model.Evaluate(State{v_x, v_y, rim, load}).output[kSinkage].value;
}

/// A wheel on level ground at z = 0 whose lowest point is `sinkage` deep.
WheelMotion Rolling(const Model& model, double v_x, double v_y, double rim, double sinkage) {
  WheelMotion w;
  w.centre = {0.3, -0.2, model.radius_m() - sinkage};
  w.axle = {0, 1, 0};
  w.velocity = {v_x, v_y, 0};
  w.angular_velocity = {0, rim / model.radius_m(), 0};
  w.ground_point = {5, 7, 0};
  w.ground_normal = {0, 0, 2};
  w.time_step = 0.001;
  return w;
}

const ContactOptions kAtOnce = {.damping_ratio = 0, .relaxation_over_radius = 0};

TEST(LoadAtSinkage, InvertsWhereTheSinkageRisesWithTheLoad) {
  const Model model = Open("bekker");
  for (const double load : {7.01, 12.0, 24.0, 33.0, 60.0, 110.0}) {
    for (const double rim : {0.0, 0.05, 0.2}) {
      const double sinkage = SinkageAt(model, 0.05, 0.02, rim, load);
      if (sinkage > 1.19 * model.radius_m()) continue;  // where the model ends
      EXPECT_NEAR(LoadAtSinkage(model, 0.05, 0.02, rim, sinkage), load, 2e-4 * load + 1e-5);
      // A tyre gives way by load/k.
      EXPECT_NEAR(LoadAtSinkage(model, 0.05, 0.02, rim, sinkage + load / 900, 900), load,
                  2e-4 * load + 1e-5);
    }
  }
}

// The fitted sinkage of the hybrid falls between two loads.
TEST(LoadAtSinkage, RisesWithTheSinkageOfEveryModel) {
  bool falls = false;
  for (const char* kind : {"bekker", "hybrid", "lookup"}) {
    const Model model = Open(kind);
    for (const double rim : {0.0, 0.05, 0.07, 0.5}) {
      double before = 0, sunk = 0;
      for (double load = 0.5; load < 130; load *= 1.05) {
        const double sinkage = SinkageAt(model, 0.05, 0.01, rim, load);
        falls |= sinkage < sunk - 1e-5;
        sunk = sinkage;
      }
      for (double z = 1e-6; z < 0.15; z = 1.03 * z + 2e-5) {
        const double load = LoadAtSinkage(model, 0.05, 0.01, rim, z);
        ASSERT_GE(load, before * (1 - 1e-5)) << kind << " rim " << rim << " z " << z;
        ASSERT_GT(load, 0);
        before = load;
      }
    }
  }
  EXPECT_TRUE(falls);  // else this shows nothing of a sinkage that falls
}

TEST(LoadAtSinkage, IsProportionalBelowAndBeyondTheLoadsOfTheTraining) {
  const Model model = Open("lookup");
  const double least = SinkageAt(model, 0.05, 0, 0.06, model.domain().load_min_n);
  EXPECT_NEAR(LoadAtSinkage(model, 0.05, 0, 0.06, 0.3 * least), 0.3 * model.domain().load_min_n,
              1e-3);
  const double deep = LoadAtSinkage(model, 0.05, 0, 0.06, 0.06);
  EXPECT_GT(deep, 20);
  EXPECT_NEAR(LoadAtSinkage(model, 0.05, 0, 0.06, 0.12), 2 * deep, 1e-3 * deep);
}

TEST(LoadAtSinkage, HardGroundIsTheTyreAlone) {
  const Model hard = Hard();
  EXPECT_NEAR(LoadAtSinkage(hard, 1, 0, 1, 0.002, 2e4), 40, 1e-6);
  EXPECT_EQ(LoadAtSinkage(hard, 1, 0, 1, 0), 0);
  EXPECT_EQ(LoadAtSinkage(hard, 1, 0, 1, 0.002), INFINITY);  // a rigid wheel cannot
  EXPECT_EQ(LoadAtSinkage(hard, 1, 0, 1, -1, 2e4), 0);
  EXPECT_TRUE(std::isnan(LoadAtSinkage(hard, 1, 0, 1, kNaN, 2e4)));
  EXPECT_TRUE(std::isnan(LoadAtSinkage(hard, kNaN, 0, 1, 0.1, 2e4)));
}

// Also where the wheel is on a slope, has its axle the other way round, and is one of many.
TEST(WheelContact, ForcesAreTheModelsAtItsSlipAngleAndLoad) {
  for (const char* kind : {"bekker", "hybrid", "lookup"}) {
    const Model model = Open(kind);
    WheelContact contact(model, kAtOnce);
    std::vector<WheelMotion> wheels;
    for (const double rim : {-0.03, 0.0, 0.05, 0.08}) {
      for (const double v_y : {-0.04, 0.0, 0.02}) {
        wheels.push_back(Rolling(model, 0.05, v_y, rim, 0.012));
      }
    }
    std::vector<ContactState> states(wheels.size());
    std::vector<WheelForce> forces(wheels.size());
    ASSERT_TRUE(contact.Evaluate(wheels, states, forces));
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      const WheelForce& f = forces[i];
      const double v_y = wheels[i].velocity[1],
                   rim = model.radius_m() * wheels[i].angular_velocity[1];
      const Answer a = model.Evaluate(State{0.05, v_y, rim, f.load});
      EXPECT_NEAR(f.force[0], a.output[kFx].value, 1e-12);
      EXPECT_NEAR(f.force[1], a.output[kFy].value, 1e-12);
      EXPECT_NEAR(f.force[2], f.load, 1e-12);
      EXPECT_NEAR(f.moment[0], (model.radius_m() - 0.012) * a.output[kFy].value, 1e-12);
      EXPECT_NEAR(f.moment[1], -a.output[kTorque].value, 1e-12);
      EXPECT_NEAR(f.moment[2], a.output[kMz].value, 1e-12);
      EXPECT_EQ(f.flags, a.flags);
      EXPECT_NEAR(f.sinkage, 0.012, 1e-15);
      EXPECT_GE(a.output[kSinkage].value, 0.012 - 2e-7 * model.radius_m());
      ContactState state;
      WheelMotion other = wheels[i];
      for (double& x : other.axle) x *= -3;
      const WheelForce g = contact.Evaluate(other, &state);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(g.force[k], f.force[k], 1e-12);
        EXPECT_NEAR(g.moment[k], f.moment[k], 1e-12);
      }
    }
  }
}

// Finite, but its square is not: no direction, and no wheel in the air.
TEST(WheelContact, RefusesDirectionsTooLongToBeSquared) {
  const Model model = Open("hybrid");
  WheelContact contact(model);
  const WheelMotion good = Rolling(model, 0.05, 0, 0.06, 0.01);
  for (auto direction : {&WheelMotion::axle, &WheelMotion::ground_normal}) {
    WheelMotion bad = good;
    for (double& x : bad.*direction) x *= 1e200;
    ContactState state;
    const WheelForce force = contact.Evaluate(bad, &state);
    EXPECT_EQ(force.flags, kInvalid);
    EXPECT_TRUE(std::isnan(force.load) && std::isnan(force.force[2]));
  }
}

TEST(WheelContact, TurnsWithTheGround) {
  const Model model = Open("hybrid");
  WheelContact contact(model, kAtOnce);
  ContactState state;
  const WheelForce level = contact.Evaluate(Rolling(model, 0.05, 0.01, 0.06, 0.01), &state);
  // World turned by 0.3 about y: x axis to (cos, 0, -sin), z axis to (sin, 0, cos).
  const double c = std::cos(0.3), s = std::sin(0.3);
  const auto turn = [&](std::array<double, 3> a) {
    return std::array<double, 3>{c * a[0] + s * a[2], a[1], -s * a[0] + c * a[2]};
  };
  WheelMotion w = Rolling(model, 0.05, 0.01, 0.06, 0.01);
  for (auto* a :
       {&w.centre, &w.axle, &w.velocity, &w.angular_velocity, &w.ground_point, &w.ground_normal}) {
    *a = turn(*a);
  }
  const WheelForce f = contact.Evaluate(w, &state);
  const auto force = turn(level.force), moment = turn(level.moment);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(f.force[k], force[k], 1e-5);  // the load is sought to 1e-7 of the radius
    EXPECT_NEAR(f.moment[k], moment[k], 1e-6);
  }
}

TEST(WheelContact, InTheAirIsNoForceAndForgets) {
  const Model model = Open("hybrid");
  WheelContact contact(model);
  ContactState state = {0.5, 0.1, 0.4};
  const WheelForce f = contact.Evaluate(Rolling(model, 0.05, 0.01, 0.06, -1e-9), &state);
  EXPECT_EQ(f.force, (std::array<double, 3>{}));
  EXPECT_EQ(f.moment, (std::array<double, 3>{}));
  EXPECT_EQ(f.flags, kAirborne);
  EXPECT_EQ(state.v_x, 0);
  EXPECT_EQ(state.rim, 0);
}

// du/dt = (u* - u) M/sigma at constant motion: any steps end at the same u.
TEST(WheelContact, RelaxesExactlyOverTravel) {
  const Model model = Open("hybrid");
  WheelContact contact(
      model, {.damping_ratio = 0, .relaxation_over_radius = 0.4, .shear_damping_ratio = 0});
  WheelMotion w = Rolling(model, 0.05, 0.02, 0.06, 0.01);
  ContactState one, many;
  w.time_step = 0.32;
  const WheelForce f = contact.Evaluate(w, &one);
  w.time_step = 0.01;
  WheelForce g;
  for (int i = 0; i < 32; ++i) g = contact.Evaluate(w, &many);
  const double left = std::exp(-0.06 * 0.32 / (0.4 * model.radius_m()));
  EXPECT_NEAR(one.v_x, 0.05 / 0.06 * (1 - left), 1e-14);
  EXPECT_NEAR(one.v_y, 0.02 / 0.06 * (1 - left), 1e-14);
  EXPECT_NEAR(one.rim, 1 - left, 1e-14);
  EXPECT_NEAR(many.v_x, one.v_x, 1e-13);
  EXPECT_NEAR(g.force[0], f.force[0], 1e-6);
  EXPECT_NEAR(f.mobilised, 1 - left, 1e-14);
  // From rest towards a steady motion slip stays what it is, and the forces build up in proportion.
  const Answer a = model.Evaluate(State{0.05, 0.02, 0.06, f.load});
  EXPECT_NEAR(f.force[0], (1 - left) * a.output[kFx].value, 1e-12);
  w.time_step = 100;
  EXPECT_NEAR(contact.Evaluate(w, &many).mobilised, 1, 1e-12);
}

// A wheel that reverses over a few millimetres: the force goes through 0 without a jump. Without
// relaxation it jumps at the turn.
TEST(WheelContact, ReversesWithoutAJump) {
  const Model model = Open("hybrid");
  for (const bool relaxed : {true, false}) {
    WheelContact contact(model,
                         {.damping_ratio = 0, .relaxation_over_radius = relaxed ? 0.3 : 0.0});
    ContactState state;
    double before = 0, jump = 0;
    for (int i = 0; i < 4000; ++i) {
      const double v = 0.05 * std::sin(0.002 * i);
      const double force = contact.Evaluate(Rolling(model, v, 0, 0.3 * v, 0.01), &state).force[0];
      if (i > 0) jump = std::max(jump, std::fabs(force - before));
      before = force;
    }
    if (relaxed) {
      EXPECT_LT(jump, 0.2);  // of some 15 N
    } else {
      EXPECT_GT(jump, 5);
    }
  }
}

// A mass on a wheel that neither drives nor rolls, on a slope: it slides until shear holds it, and
// stands; steeper than the model holds it slides on.
TEST(WheelContact, HoldsALockedWheelUpToWhatTheModelHolds) {
  const Model model = Open("hybrid");
  const double load = 20, sinkage = SinkageAt(model, 1, 0, 0, load);
  const double held = -model.Evaluate(State{0.05, 0, 0, load}).output[kFx].value;
  ASSERT_GT(held, 2);
  for (const double share : {0.5, 1.3}) {
    for (const double dt : {0.001, 0.002}) {
      WheelContact contact(model, {.damping_ratio = 0});
      ContactState state;
      const double mass = load / 9.81;
      double v = 0, way = 0, late = 0;
      for (int i = 0; i * dt < 20; ++i) {
        WheelMotion w = Rolling(model, v, 0, 0, sinkage);
        w.time_step = dt;
        const WheelForce f = contact.Evaluate(w, &state);
        v += dt / mass * (share * held + f.force[0] * (load / f.load));  // the load stays
        way += dt * v;
        if (i * dt > 10) late = std::max(late, std::fabs(v));
      }
      if (share < 1) {
        EXPECT_LT(std::fabs(way), 2 * 0.3 * model.radius_m()) << dt;
        EXPECT_LT(late, 1e-5) << dt;
      } else {
        EXPECT_NEAR(v, 0.3 * held / mass * 20, 0.05 * v) << dt;
      }
    }
  }
}

// A mass drops onto a locked wheel: what it has of energy never rises by more than a step's error,
// and every bounce is lower.
TEST(WheelContact, TakesEnergyOfTheNormalMotion) {
  for (const char* kind : {"bekker", "hybrid"}) {
    const Model model = Open(kind);
    WheelContact contact(model);
    const double mass = 2.4, dt = 1e-4;
    double height = 0.03, speed = 0, lowest = 0, peak = 0.03;
    double passed = 0;  // work of the force beyond that of the load without damping
    WheelContact undamped(model, {.damping_ratio = 0});
    ContactState state;
    for (int i = 0; i < 60000; ++i) {
      WheelMotion w = Rolling(model, 0, 0, 0, -height);
      w.velocity[2] = speed;
      const double force = contact.Evaluate(w, &state).load;
      const double elastic = undamped.Evaluate(w, &state).load;
      ASSERT_GE(force, 0);
      ASSERT_LE((force - elastic) * speed, 1e-12) << "damping drives";
      passed += (force - elastic) * speed * dt;
      const double before = speed;
      speed += dt * (force / mass - 9.81);
      height += dt * speed;
      lowest = std::min(lowest, height);
      if (before > 0 && speed <= 0 && height > -0.012) {
        EXPECT_LT(height, peak);
        peak = height;
      }
    }
    EXPECT_LT(passed, -0.1 * mass * 9.81 * 0.03);
    EXPECT_LT(std::fabs(speed), 1e-3);  // it rests
    EXPECT_NEAR(contact.Evaluate(Rolling(model, 0, 0, 0, -height), &state).load, mass * 9.81, 0.05);
    EXPECT_LT(lowest, height);
  }
}

TEST(WheelContact, IsItsPlainStateAndAllocatesOnceOnly) {
  const Model model = Open("hybrid");
  WheelContact contact(model), other(model);
  std::vector<WheelMotion> wheels;
  for (int i = 0; i < 40; ++i) {
    wheels.push_back(Rolling(model, 0.05, 0.001 * i, 0.06, 0.0005 * i - 0.002));
  }
  std::vector<ContactState> states(40);
  std::vector<WheelForce> first(40), again(40);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(contact.Evaluate(wheels, states, first));
  const std::vector<ContactState> saved = states;
  ASSERT_TRUE(contact.Evaluate(wheels, states, first));
  states = saved;
  const long before = g_allocations.load();
  ASSERT_TRUE(contact.Evaluate(wheels, states, again));
  EXPECT_EQ(g_allocations.load(), before);
  EXPECT_EQ(std::memcmp(first.data(), again.data(), 40 * sizeof(WheelForce)), 0);
  for (std::size_t i = 0; i < 40; ++i) {  // alone as among others
    ContactState state = saved[i];
    const WheelForce alone = other.Evaluate(wheels[i], &state);
    EXPECT_EQ(alone.force, first[i].force);
    EXPECT_EQ(alone.moment, first[i].moment);
  }
}

TEST(WheelContact, FlagsWhatIsNotFiniteAndHarmsNoOther) {
  const Model model = Open("hybrid");
  WheelContact contact(model);
  std::vector<WheelMotion> wheels(8, Rolling(model, 0.05, 0, 0.06, 0.01));
  std::vector<ContactState> states(8, {0.1, 0.2, 0.3});
  wheels[0].centre[1] = kNaN;
  wheels[1].velocity[0] = INFINITY;
  wheels[2].axle = {0, 0, 0};
  wheels[3].ground_normal = {0, 0, 0};
  wheels[4].time_step = -1e-9;
  states[5].rim = kNaN;
  wheels[6].axle = {0, 0.01, 1};  // lies on its side, in the ground
  wheels[6].centre[2] = 0.0001;
  std::vector<WheelForce> out(8);
  ASSERT_TRUE(contact.Evaluate(wheels, states, out));
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(out[i].flags, kInvalid) << i;
    EXPECT_TRUE(std::isnan(out[i].force[2])) << i;
  }
  EXPECT_EQ(states[0].v_x, 0.1);
  EXPECT_EQ(out[6].force, (std::array<double, 3>{}));
  EXPECT_EQ(out[6].flags, kExtrapolated);
  EXPECT_GT(out[7].force[2], 1);
  EXPECT_FALSE(contact.Evaluate(wheels, std::span(states).first(7), out));
}

TEST(WheelContact, RefusesWhatMakesNoSense) {
  const Model sand = Open("hybrid"), hard = Hard();
  const auto refusal = [](const Model& model, const ContactOptions& options) -> std::string {
    try {
      WheelContact contact(model, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(sand, {.tyre_stiffness = 0}), HasSubstr("tyre_stiffness: got 0"));
  EXPECT_THAT(refusal(sand, {.damping_ratio = -1}), HasSubstr("damping_ratio: got -1"));
  EXPECT_THAT(refusal(sand, {.relaxation_over_radius = kNaN}), HasSubstr("relaxation_over_radius"));
  EXPECT_THAT(refusal(sand, {.shear_damping_ratio = -1}), HasSubstr("shear_damping_ratio: got -1"));
  EXPECT_THAT(refusal(hard, {}), HasSubstr("does not sink"));
  EXPECT_EQ(refusal(hard, {.tyre_stiffness = 1e4}), "");
}

}  // namespace
}  // namespace grouser

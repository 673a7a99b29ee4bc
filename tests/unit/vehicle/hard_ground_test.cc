#include "surrogate/models/hard_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "surrogate/models/state_batch.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::surrogate {
namespace {

using vehicle::testing::Asphalt;

const HardGroundModel& Model() {
  static const HardGroundModel model(Asphalt(), 0.2);
  return model;
}

TEST(HardGround, StiffAtSmallSlipAndCoulombBeyond) {
  // f_x = C N sigma at small slip over the rolling speed; mu N when all slides.
  const double load = 100, rim = 1, sigma = 1e-6;
  EXPECT_NEAR(AnswerOf(Model(), {rim * (1 - sigma), 0, rim}, load).value[kFx], 12 * load * sigma,
              1e-4 * 12 * load * sigma);
  EXPECT_DOUBLE_EQ(AnswerOf(Model(), {0.1, 0, 1}, load).value[kFx], 0.8 * load);
  EXPECT_DOUBLE_EQ(AnswerOf(Model(), {1, 0, 0}, load).value[kFx], -0.8 * load);
  // Sideways the same friction, against the motion.
  const WheelAnswer side = AnswerOf(Model(), {0, 0.5, 0}, load);
  EXPECT_NEAR(side.value[kFy], -0.8 * load, 1e-9);
  EXPECT_NEAR(side.value[kFx], 0, 1e-12);
}

TEST(HardGround, CombinedSlipNeverExceedsFriction) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> speed(-2, 2);
  for (int i = 0; i < 1000; ++i) {
    const WheelAnswer a = AnswerOf(Model(), {speed(random), speed(random), speed(random)}, 50);
    EXPECT_LE(std::hypot(a.value[kFx], a.value[kFy]), 0.8 * 50 * (1 + 1e-12));
  }
}

TEST(HardGround, RollsFreelyAgainstRollingResistance) {
  // Where the torque is 0 the wheel drags with f N.
  double low = 1, high = 1.2;  // v_x over rim speed: from no slip to a dragging rim
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (AnswerOf(Model(), {middle, 0, 1}, 100).value[kTorque] > 0 ? low : high) = middle;
  }
  EXPECT_NEAR(AnswerOf(Model(), {low, 0, 1}, 100).value[kFx], -0.02 * 100, 1e-9);
}

TEST(HardGround, TurningInPlaceMeetsTheScrubMoment) {
  StateBatch batch(2);
  batch.yaw_rate = {0.7, -0.7};
  batch.Set(0, 0, 0, 0, 100);
  batch.Set(1, 0, 0, 0, 100);
  Model().Evaluate(batch.In(), batch.Out());
  // Mean distance from the middle by a sum over the patch of 0.06 m x 0.1 m.
  double mean = 0;
  const int n = 400;
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      mean += std::hypot(0.06 * ((i + 0.5) / n - 0.5), 0.1 * ((k + 0.5) / n - 0.5)) / (n * n);
    }
  }
  EXPECT_NEAR(Model().scrub_radius_m(), mean, 1e-5 * mean);
  EXPECT_NEAR(batch.part[kMz][kValue][0], -0.8 * 100 * mean, 1e-3);
  EXPECT_EQ(batch.part[kMz][kValue][0], -batch.part[kMz][kValue][1]);
}

TEST(HardGround, AlignsTheWheelWithItsMotion) {
  // Small slip angle: moment of the lateral force at a third of the half contact length.
  const WheelAnswer a = AnswerOf(Model(), {1, 1e-6, 1}, 100);
  EXPECT_LT(a.value[kFy], 0);
  EXPECT_NEAR(a.value[kMz], -a.value[kFy] * 0.03 / 3, 1e-4 * std::fabs(a.value[kFy]) * 0.01);
}

TEST(HardGround, MirrorsToTheLastBit) {
  const WheelAnswer a = AnswerOf(Model(), {0.9, 0.1, 1}, 80),
                    b = AnswerOf(Model(), {0.9, -0.1, 1}, 80),
                    c = AnswerOf(Model(), {-0.9, 0.1, -1}, 80);
  for (int o = 0; o < kOutputs; ++o) {
    EXPECT_EQ(a.value[o], kOutputFields[o].parity_y * b.value[o]) << kOutputFields[o].name;
    EXPECT_EQ(a.value[o], kOutputFields[o].parity_x * c.value[o]) << kOutputFields[o].name;
  }
}

TEST(HardGround, GradientsAreThoseOfItsAnswers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> speed(-1, 1), near(-0.05, 0.05);
  for (int i = 0; i < 400; ++i) {
    const double rim = speed(random);
    const bool rolling = i % 2 == 0;
    const double at[4] = {rolling ? rim + near(random) : speed(random),
                          rolling ? near(random) : speed(random), rim, 100 * (1.1 + speed(random))};
    StateBatch batch(9);
    batch.yaw_rate.assign(9, 0.3);
    const double h[4] = {1e-7, 1e-7, 1e-7, 1e-4};
    batch.Set(8, at[0], at[1], at[2], at[3]);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t side = 0; side < 2; ++side) {
        double x[4] = {at[0], at[1], at[2], at[3]};
        x[a] += side == 0 ? -h[a] : h[a];
        batch.Set(2 * a + side, x[0], x[1], x[2], x[3]);
      }
    }
    Model().Evaluate(batch.In(), batch.Out());
    for (int o = 0; o < kOutputs; ++o) {
      for (std::size_t a = 0; a < 4; ++a) {
        const double expected =
            (batch.part[o][kValue][2 * a + 1] - batch.part[o][kValue][2 * a]) / (2 * h[a]);
        const double got = batch.part[o][kDvX + static_cast<int>(a)][8];
        EXPECT_NEAR(got, expected, 2e-4 * (std::fabs(expected) + at[3]))
            << kOutputFields[o].name << " axis " << a << " state " << at[0] << " " << at[1] << " "
            << at[2];
      }
    }
  }
}

TEST(HardGround, FlagsWhatCannotBeAnswered) {
  StateBatch batch(4);
  batch.Set(0, NAN, 0, 1, 10);
  batch.Set(1, 1, 0, 1, -1);
  batch.Set(2, 1, 0, 1, 0);
  batch.Set(3, 0, 0, 0, 10);
  Model().Evaluate(batch.In(), batch.Out());
  EXPECT_EQ(batch.flags[0], kInvalid);
  EXPECT_TRUE(std::isnan(batch.part[kFx][kValue][0]));
  EXPECT_EQ(batch.flags[1], kInvalid);
  EXPECT_EQ(batch.flags[2], kAirborne);
  EXPECT_EQ(batch.part[kFz][kValue][2], 0);
  EXPECT_EQ(batch.flags[3], kStatic);
  EXPECT_EQ(batch.part[kFz][kValue][3], 10);
}

TEST(HardGround, RefusesParametersByName) {
  const auto message = [](HardGround ground) -> std::string {
    try {
      HardGroundModel model(ground, 0.2);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message(Asphalt()), "");
  HardGround ground = Asphalt();
  ground.friction = 0;
  EXPECT_NE(message(ground).find("hard: friction: got 0"), std::string::npos);
  ground = Asphalt();
  ground.contact_width_m = NAN;
  EXPECT_NE(message(ground).find("contact_width_m"), std::string::npos);
}

// Every part of every output, batches of all sizes from none to two groups, all instruction sets.
TEST(HardGround, AllInstructionSetsAndBatchesGiveTheSameBits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> speed(-1, 1), load(0, 200);
  HardGround ground = Asphalt();
  ground.friction_sd = 0.08;
  ground.slip_stiffness_sd = 2;
  ground.rolling_resistance_sd = 0.01;
  HardGroundModel model(ground, 0.2), other(ground, 0.2);
  ASSERT_TRUE(model.SelectIsa("baseline"));
  EXPECT_FALSE(model.SelectIsa("mmx"));
  for (const char* isa : {"baseline", "avx2", "avx512"}) {
    if (!other.SelectIsa(isa)) continue;  // not this machine's
    for (std::size_t n = 0; n <= 17; ++n) {
      StateBatch batch(n), one(1);
      batch.yaw_rate.resize(n);
      for (std::size_t i = 0; i < n; ++i) {
        const double v = speed(random), slip = i % 2 == 0 ? 0.02 : 1;
        batch.Set(i, v, slip * speed(random), v + slip * speed(random),
                  i % 5 == 4 ? 0 : load(random));
        batch.yaw_rate[i] = i % 3 == 0 ? 0 : speed(random);
      }
      other.Evaluate(batch.In(), batch.Out());
      for (std::size_t i = 0; i < n; ++i) {
        one.yaw_rate = {batch.yaw_rate[i]};
        one.Set(0, batch.v_x[i], batch.v_y[i], batch.rim_speed[i], batch.load[i]);
        model.Evaluate(one.In(), one.Out());
        EXPECT_EQ(one.flags[0], batch.flags[i]);
        for (int o = 0; o < kOutputs; ++o) {
          for (const auto part : kPartMembers) {
            EXPECT_EQ((one.Out().output[o].*part)[0], (batch.Out().output[o].*part)[i])
                << isa << " " << n << " " << i << " output " << o;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace grouser::surrogate

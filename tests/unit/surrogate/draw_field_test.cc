// Coherent draws: what they are at one state, what they share between states, and that they are
// always the same.
#include "surrogate/models/draw_field.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "surrogate/models/hard_ground.h"
#include "surrogate/models/isa.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;
constexpr ErrorForm kForm{.of_physics = true, .friction_radius_m = 0};

/// Answers and interval half widths that vary with the state, in proportion to the load.
class Varying final : public WheelModel {
 public:
  explicit Varying(bool of_physics = false) : of_physics_(of_physics) {}
  ErrorForm Errors() const noexcept override {
    return {.of_physics = of_physics_, .friction_radius_m = 0};
  }
  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override {
    for (std::size_t i = 0; i < in.load.size(); ++i) {
      out.flags[i] = 0;
      for (int o = 0; o < kOutputs; ++o) {
        const double value = (1 + o) * in.load[i] * (2 + in.v_x[i]);
        const double half = (0.1 + 0.05 * o + std::fabs(in.v_y[i])) * in.load[i];
        const OutputView& to = out.output[o];
        if (!to.value.empty()) to.value[i] = value;
        if (!to.low.empty()) to.low[i] = value - half;
        if (!to.high.empty()) to.high[i] = value + half;
      }
    }
  }

 private:
  bool of_physics_;
};

/// n states all about, straight ones and ones at rest among them.
StateBatch SomeStates(std::size_t n) {
  StateBatch batch(n);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  for (std::size_t i = 0; i < n; ++i) {
    const double x = u(random), y = u(random), rim = u(random);
    batch.Set(i, x, i % 5 == 0 ? 0 : y, i % 7 == 0 ? 0 : rim, 20 * std::exp(u(random)));
  }
  batch.Set(0, 0, 0, 0, 20);
  return batch;
}

void Draw(const WheelModel& model, const Draws& draws, std::uint32_t k, StateBatch* batch) {
  const std::vector<std::uint32_t> all(batch->size(), k);
  EvaluateDraws(model, {}, draws, all, batch->In(), batch->Out(), {});
}

double ErrorOf(const ErrorForm& form, const Draws& draws, std::size_t k, int o,
               const VelocityState& v, double load) {
  return UnitErrorOf(form, draws[k], o, v.v_x, v.v_y, v.rim_speed, load);
}

double Correlation(const ErrorForm& form, int o, const VelocityState& a, double load_a,
                   const VelocityState& b, double load_b) {
  const Draws draws("sand", 500);
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t k = 0; k < draws.size(); ++k) {
    const double x = ErrorOf(form, draws, k, o, a, load_a),
                 y = ErrorOf(form, draws, k, o, b, load_b);
    ab += x * y;
    aa += x * x;
    bb += y * y;
  }
  return ab / std::sqrt(aa * bb);
}

// At every state and output: mean, standard deviation and tails of 1,024 draws; limits are 4.5
// standard errors.
class DrawFieldOf : public ::testing::TestWithParam<bool> {};  // of physics alone
INSTANTIATE_TEST_SUITE_P(Forms, DrawFieldOf, ::testing::Bool());

TEST_P(DrawFieldOf, AgreesWithTheIntervalAtEveryState) {
  const Varying model(GetParam());
  const Draws draws("sand", Draws::kMost);
  StateBatch batch = SomeStates(40), drawn = batch;
  model.Evaluate(batch.In(), batch.Out());
  const auto n = static_cast<double>(draws.size());
  std::array<std::vector<std::array<double, 4>>, kOutputs> sums;  // mean, square, below, above
  for (auto& of : sums) of.resize(batch.size());
  for (std::uint32_t k = 0; k < draws.size(); ++k) {
    Draw(model, draws, k, &drawn);
    for (int o = 0; o < kOutputs; ++o) {
      const auto& part = batch.part[o];
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const double sd = (part[kHigh][i] - part[kValue][i]) / kTwoSided90;
        const double value = drawn.part[o][kValue][i], error = (value - part[kValue][i]) / sd;
        sums[o][i][0] += error / n;
        sums[o][i][1] += error * error / n;
        sums[o][i][2] += (value < part[kLow][i]) / n;
        sums[o][i][3] += (value > part[kHigh][i]) / n;
      }
    }
  }
  for (int o = 0; o < kOutputs; ++o) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto& [mean, square, below, above] = sums[o][i];
      EXPECT_NEAR(mean, 0, 4.5 / std::sqrt(n)) << kOutputFields[o].name << " " << i;
      EXPECT_NEAR(square, 1, 4.5 * std::sqrt(2 / n)) << kOutputFields[o].name << " " << i;
      EXPECT_NEAR(below, 0.05, 4.5 * std::sqrt(0.05 * 0.95 / n)) << kOutputFields[o].name;
      EXPECT_NEAR(above, 0.05, 4.5 * std::sqrt(0.05 * 0.95 / n)) << kOutputFields[o].name;
    }
  }
}

TEST_P(DrawFieldOf, NeighboursAgreeAndFarStatesDoNot) {
  const ErrorForm form{.of_physics = GetParam(), .friction_radius_m = 0};
  const VelocityState at = FromSlip(0.1, 20 * kOneDegree, 1);
  for (const Output o : kPredicted) {
    EXPECT_GT(Correlation(form, o, at, 20, FromSlip(0.13, 21 * kOneDegree, 1), 21), 0.9);
    EXPECT_GT(Correlation(form, o, at, 20, FromSlip(0.1, 20 * kOneDegree, 0.3), 20),
              0.999);  // speed
    double last = 1;
    for (const double slip : {0.2, 0.4, 0.6}) {
      const double now = Correlation(form, o, at, 20, FromSlip(slip, 20 * kOneDegree, 1), 20);
      EXPECT_LT(now, last) << kOutputFields[o].name << " " << slip;
      last = now;
    }
    // Of physics, half of the variance is common to far states (less where symmetry turns the
    // sign).
    const double far = Correlation(form, o, at, 20, FromSlip(0.6, 60 * kOneDegree, 1), 50);
    if (!form.of_physics) {
      EXPECT_LT(std::fabs(far), 0.35) << kOutputFields[o].name;
    } else if (kOutputFields[o].parity_y > 0) {
      EXPECT_GT(far, 0.2) << kOutputFields[o].name;
    }
  }
  // Outputs of one state, and soils, have nothing to do with one another: 4.5 standard errors.
  const Draws sand("sand", Draws::kMost), loam("loam", Draws::kMost);
  double outputs = 0, soils = 0;
  for (std::size_t k = 0; k < Draws::kMost; ++k) {
    const double x = ErrorOf(form, sand, k, kFx, at, 20);
    outputs += x * ErrorOf(form, sand, k, kTorque, at, 20) / Draws::kMost;
    soils += x * ErrorOf(form, loam, k, kFx, at, 20) / Draws::kMost;
  }
  EXPECT_LT(std::fabs(outputs), 4.5 / std::sqrt(Draws::kMost));
  EXPECT_LT(std::fabs(soils), 4.5 / std::sqrt(Draws::kMost));
}

// A wheel that is mirrored, on ground that is mirrored (what breaks the symmetry turns its sign),
// errs by the mirrored amount, to the last bit.
TEST(DrawField, MirrorsOfAWheelAreMirrorsOfItsErrors) {
  const Draws draws("sand", 5);
  const auto mirrored = [](const draws::Member& member, bool x, bool y) {
    draws::Member m = member;
    for (int o = 0; o < kOutputs; ++o) {
      const int sign = (x ? kOutputFields[o].parity_x : 1) * (y ? kOutputFields[o].parity_y : 1);
      for (double& a : m.breaking[o].a) a *= sign;
      for (double& b : m.breaking[o].b) b *= sign;
    }
    return m;
  };
  for (std::size_t k = 0; k < draws.size(); ++k) {
    for (int o = 0; o < kOutputs; ++o) {
      const double one = UnitErrorOf(kForm, draws[k], o, 0.3, 0.1, 0.4, 20);
      EXPECT_EQ(UnitErrorOf(kForm, mirrored(draws[k], false, true), o, 0.3, -0.1, 0.4, 20),
                kOutputFields[o].parity_y * one);
      EXPECT_EQ(UnitErrorOf(kForm, mirrored(draws[k], true, false), o, -0.3, 0.1, -0.4, 20),
                kOutputFields[o].parity_x * one);
    }
  }
  // On the same ground: alike where nothing is odd, nearly opposite for a lateral force.
  const VelocityState left = FromSlip(0.1, 35 * kOneDegree, 1),
                      right = {left.v_x, -left.v_y, left.rim_speed};
  EXPECT_GT(Correlation(kForm, kFx, left, 20, right, 20), 0.9999);
  EXPECT_GT(Correlation(kForm, kSinkage, left, 20, right, 20), 0.9999);
  EXPECT_LT(Correlation(kForm, kFy, left, 20, right, 20), -0.8);
}

// The batched path, by every instruction set, in batches of every size, is the scalar one.
TEST_P(DrawFieldOf, BatchIsTheScalarReference) {
  const Varying model(GetParam());
  const Draws draws("sand", 9);
  StateBatch means = SomeStates(131);
  model.Evaluate(means.In(), means.Out());
  std::vector<const draws::Member*> member(means.size());
  for (std::size_t i = 0; i < member.size(); ++i) {
    member[i] = i % 10 == 9 ? nullptr : &draws[i % 10];
  }
  StateBatch first = means;
  for (const char* isa : {"baseline", "avx2", "avx512"}) {
    const draws::BlockFn kernel = DrawKernelFor(isa);
    if (kernel == nullptr) continue;
    for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{64}, means.size()}) {
      StateBatch now = means;
      for (std::size_t at = 0; at < now.size(); at += size) {
        const std::size_t count = std::min(size, now.size() - at);
        const WheelStatesView in = now.In(at, count);
        DrawBatch batch{in.v_x,  in.v_y, in.rim_speed,
                        in.load, {},     std::span(member).subspan(at, count),
                        {},      {},     {}};
        const ResponsesView out = now.Out(at, count);
        for (int o = 0; o < kOutputs; ++o) {
          batch.value[o] = out.output[o].value;
          batch.high[o] = out.output[o].high;
        }
        AddErrors(model, batch, kernel);
      }
      if (std::strcmp(isa, "baseline") == 0 && size == 1) first = now;
      for (int o = 0; o < kOutputs; ++o) {
        EXPECT_EQ(first.part[o][kValue], now.part[o][kValue]) << isa << " " << size;
      }
    }
  }
  for (int o = 0; o < kOutputs; ++o) {
    for (std::size_t i = 0; i < means.size(); ++i) {
      const double value = means.part[o][kValue][i];
      const double sd = (means.part[o][kHigh][i] - value) / kTwoSided90;
      const double error = member[i] == nullptr
                               ? 0
                               : UnitErrorOf(model.Errors(), *member[i], o, means.v_x[i],
                                             means.v_y[i], means.rim_speed[i], means.load[i]);
      const double drawn = std::fmax(value + sd * error, o == kSinkage ? 0 : -1e300);
      EXPECT_NEAR(first.part[o][kValue][i], drawn, 1e-12 * (std::fabs(value) + sd));
    }
  }
}

// Derivatives of the errors, against differences of the scalar reference; sd is a share of the
// load.
TEST_P(DrawFieldOf, SlopesAreThoseOfTheReference) {
  const Varying model(GetParam());
  const Draws draws("sand", 2);
  constexpr double kSd = 0.3, kStep = 1e-6;
  for (std::size_t i = 0; i < 30; ++i) {
    const auto x = static_cast<double>(i);
    std::array<double, 4> at = {0.5 - 0.03 * x, i % 3 == 0 ? 0 : 0.2, 0.4, 10 + x};
    const draws::Member* const member = &draws[i % 2];
    std::array<std::array<double, 4>, kOutputs> slope{};
    std::array<double, kOutputs> value{}, high;
    high.fill(kTwoSided90 * kSd * at[3]);
    value[kSinkage] = 100;
    high[kSinkage] += 100;
    DrawBatch batch{{&at[0], 1},  {&at[1], 1}, {&at[2], 1}, {&at[3], 1}, {},
                    {&member, 1}, {},          {},          {}};
    for (int o = 0; o < kOutputs; ++o) {
      batch.value[o] = {&value[o], 1};
      batch.high[o] = {&high[o], 1};
      for (std::size_t k = 0; k < 4; ++k) batch.slope[o][k] = {&slope[o][k], 1};
    }
    AddErrors(model, batch);
    for (int o = 0; o < kOutputs; ++o) {
      for (std::size_t k = 0; k < 4; ++k) {
        const auto error = [&](double step) {
          std::array<double, 4> moved = at;
          moved[k] += step;
          return kSd * moved[3] *
                 UnitErrorOf(model.Errors(), *member, o, moved[0], moved[1], moved[2], moved[3]);
        };
        const double exact = (error(kStep) - error(-kStep)) / (2 * kStep);
        EXPECT_NEAR(slope[o][k], exact, 1e-6 * (kSd * at[3] + std::fabs(exact)))
            << kOutputFields[o].name << " by " << k << " at " << i;
      }
    }
  }
}

// The bits of some draws, as they were when this was written: on every machine, at every time.
TEST(DrawField, TheSameBitsAlwaysAndForEveryCount) {
  const Varying model;
  std::uint64_t hash = 0xcbf29ce484222325;
  const Draws few("sand", 3), many("sand", 300);
  for (std::uint32_t k = 0; k < few.size(); ++k) {
    StateBatch one = SomeStates(50), two = one;
    // States without functions of the C library in them.
    for (std::size_t i = 0; i < one.size(); ++i) {
      const auto x = static_cast<double>(i);
      one.Set(i, x / 50, 0.3 - x / 100, 0.5, 10 + x);
      two.Set(i, x / 50, 0.3 - x / 100, 0.5, 10 + x);
    }
    Draw(model, few, k, &one);
    Draw(model, many, k, &two);
    for (int o = 0; o < kOutputs; ++o) {
      EXPECT_EQ(one.part[o][kValue], two.part[o][kValue]);
      for (const double value : one.part[o][kValue]) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3;
      }
    }
  }
  EXPECT_EQ(hash, 5373748692779770773u);
  EXPECT_THROW(Draws("sand", 0), std::invalid_argument);
  EXPECT_THROW(Draws("sand", Draws::kMost + 1), std::invalid_argument);
}

// Hard ground: a draw is the ground with another friction and another rolling resistance, at all
// states at once; exactly where the wheel slides, as the interval is that of small changes.
TEST(DrawField, HardGroundHasOneFrictionADraw) {
  HardGround ground{.friction = 0.6,
                    .slip_stiffness = 12,
                    .rolling_resistance = 0.03,
                    .contact_length_m = 0.06,
                    .contact_width_m = 0.1,
                    .friction_sd = 0.1,
                    .rolling_resistance_sd = 0.01};
  const HardGroundModel model(ground, 0.2);
  const Draws draws("floor", 30);
  StateBatch drawn(4), exact(4);
  for (StateBatch* b : {&drawn, &exact}) {
    b->Set(0, 0.2, 0.1, 1.0, 100);
    b->Set(1, 1.0, -0.8, 0.2, 50);
    b->Set(2, -0.5, 0.3, -1.5, 70);
    b->Set(3, 0, 0, 0, 70);  // in place
    b->yaw_rate = {0, 2, -0.4, 1};
  }
  for (std::uint32_t k = 0; k < draws.size(); ++k) {
    Draw(model, draws, k, &drawn);
    HardGround other = ground;
    other.friction += ground.friction_sd * draws[k].friction;
    other.rolling_resistance += ground.rolling_resistance_sd * draws[k].rolling;
    if (other.rolling_resistance < 0) continue;
    HardGroundModel(other, 0.2).Evaluate(exact.In(), exact.Out());
    for (const Output o : kPredicted) {
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        EXPECT_NEAR(drawn.part[o][kValue][i], exact.part[o][kValue][i], 1e-9) << k << " " << i;
      }
    }
  }
  // The torque alone is the torque beside all others.
  StateBatch alone(4, {kValue});
  alone.v_x = drawn.v_x;
  alone.v_y = drawn.v_y;
  alone.rim_speed = drawn.rim_speed;
  alone.load = drawn.load;
  alone.yaw_rate = drawn.yaw_rate;
  ResponsesView out;
  out.flags = alone.flags;
  out.output[kTorque].value = alone.part[kTorque][kValue];
  const std::vector<std::uint32_t> k(4, 29);
  EvaluateDraws(model, {}, draws, k, alone.In(), out, {});
  EXPECT_EQ(alone.part[kTorque][kValue], drawn.part[kTorque][kValue]);
}

}  // namespace
}  // namespace grouser::surrogate

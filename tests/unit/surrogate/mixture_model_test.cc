// Soils of which one is the right one, against sums written out.
#include "surrogate/models/mixture_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/records/model_file.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/models/draw_field.h"
#include "surrogate/models/hard_ground.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadius = 0.0625, kWidth = 0.05, kGravity = 9.81;

std::shared_ptr<const WheelModel> Hard(double friction, double resistance, std::uint32_t flags) {
  return std::make_shared<HardGroundModel>(HardGround{.friction = friction,
                                                      .slip_stiffness = 12,
                                                      .rolling_resistance = resistance,
                                                      .contact_length_m = 0.02,
                                                      .contact_width_m = 0.04,
                                                      .friction_sd = 0.1 * friction,
                                                      .rolling_resistance_sd = 0.003},
                                           kRadius, flags);
}
const std::shared_ptr<const WheelModel>& Sand() {
  static const std::shared_ptr<const WheelModel> sand =
      MakeModel(records::ReadModelFile(GROUSER_SMALL_MODEL).model);
  return sand;
}

MixturePart Part1(std::shared_ptr<const WheelModel> model, double weight) {
  return {std::move(model), weight, kRadius, kWidth, kGravity};
}

StateBatch States() {
  StateBatch b(150);
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double t = static_cast<double>(i) / 150;
    b.Set(i, 0.02 + 0.1 * t, 0.05 * std::sin(20 * t), 0.09 + 0.04 * std::cos(31 * t), 12 + 25 * t);
  }
  return b;
}

/// Evaluates with room for sd_soil.
struct Answered {
  StateBatch batch = States();
  std::array<std::vector<double>, kOutputs> sd_soil;
  explicit Answered(const WheelModel& model) {
    ResponsesView out = batch.Out();
    for (int o = 0; o < kOutputs; ++o) {
      sd_soil[o].assign(batch.size(), kUndefined);
      out.output[o].sd_soil = sd_soil[o];
    }
    model.Evaluate(batch.In(), out);
  }
};

TEST(MixtureModel, IsTheMeanAndTheVarianceOfItsSoils) {
  const double weights[] = {3, 0, 1.5, 0.5}, sum = 5;
  const std::shared_ptr<const WheelModel> models[] = {
      Sand(), Hard(0.9, 0.02, kStatic), Hard(0.5, 0.05, kUntuned), Hard(0.1, 0.01, 0)};
  std::vector<MixturePart> parts;
  for (int k = 0; k < 4; ++k) parts.push_back(Part1(models[k], weights[k]));
  const MixtureModel mixture(parts);
  ASSERT_EQ(mixture.parts().size(), 3u);
  EXPECT_TRUE(mixture.UsesYawRate());
  const Answered got(mixture);
  std::vector<Answered> of;
  for (const auto& model : models) of.emplace_back(*model);
  double largest = 0;
  for (std::size_t i = 0; i < got.batch.size(); ++i) {
    EXPECT_EQ(got.batch.flags[i],
              of[0].batch.flags[i] | of[2].batch.flags[i] | of[3].batch.flags[i]);
    EXPECT_EQ(got.batch.slip[i], of[3].batch.slip[i]);
    for (int o = 0; o < kOutputs; ++o) {
      const auto at = [&](int k, int p) { return of[k].batch.part[o][p][i]; };
      const auto mean = [&](int p) {
        double x = 0;
        for (int k = 0; k < 4; ++k) x += weights[k] / sum * at(k, p);
        return x;
      };
      double fit = 0, patch = 0, within = 0, between = 0;
      for (int k = 0; k < 4; ++k) {
        const double w = weights[k] / sum, half = at(k, kHigh) - at(k, kValue);
        fit += w * at(k, kSdFit) * at(k, kSdFit);
        patch += w * at(k, kSdPatch) * at(k, kSdPatch);
        within += w * half * half;
        between += w * std::pow(at(k, kValue) - mean(kValue), 2);
      }
      const double half = std::sqrt(within + std::pow(kTwoSided90, 2) * between);
      const double expected[kParts] = {mean(kValue),        std::sqrt(fit),      std::sqrt(patch),
                                       mean(kValue) - half, mean(kValue) + half, mean(kDvX),
                                       mean(kDvY),          mean(kDRim),         mean(kDLoad)};
      for (int p = 0; p < kParts; ++p) {
        EXPECT_NEAR(got.batch.part[o][p][i], expected[p],
                    1e-12 * std::fmax(50, std::fabs(expected[p])))
            << kOutputFields[o].name << " part " << p;
      }
      EXPECT_NEAR(got.sd_soil[o][i], std::sqrt(between), 1e-7);
      largest = std::fmax(largest, got.sd_soil[o][i]);
    }
  }
  EXPECT_GT(largest, 1);
}

TEST(MixtureModel, OneSoilIsThatSoil) {
  const Answered own(*Sand());
  const Answered twice(MixtureModel({Part1(Sand(), 0.3), Part1(Sand(), 0.6)}));
  const Answered alone(MixtureModel({Part1(Hard(0.9, 0, 0), 0), Part1(Sand(), 7)}));
  EXPECT_EQ(own.batch.flags, alone.batch.flags);
  for (int o = 0; o < kOutputs; ++o) {
    for (const Part p : {kValue, kDvX, kDvY, kDRim, kDLoad}) {
      EXPECT_EQ(own.batch.part[o][p], alone.batch.part[o][p]);
      EXPECT_EQ(own.batch.part[o][p], twice.batch.part[o][p]);
    }
    for (std::size_t i = 0; i < own.batch.size(); ++i) {
      EXPECT_EQ(twice.sd_soil[o][i], 0);
      EXPECT_EQ(alone.sd_soil[o][i], 0);
      for (const Part p : {kSdFit, kSdPatch, kLow, kHigh}) {
        EXPECT_NEAR(alone.batch.part[o][p][i], own.batch.part[o][p][i], 1e-13 * 50);
      }
    }
  }
}

TEST(MixtureModel, BadStatesAndWheelsOffTheGround) {
  const MixtureModel mixture({Part1(Sand(), 1), Part1(Hard(0.5, 0.02, 0), 1)});
  StateBatch b(3);
  b.Set(0, kUndefined, 0, 0.1, 20);
  b.Set(1, 0.1, 0, 0.1, 0);
  b.Set(2, 0.08, 0, 0.1, 20);
  std::vector<double> sd_soil(3, 7);
  ResponsesView out = b.Out();
  out.output[kFx].sd_soil = sd_soil;
  mixture.Evaluate(b.In(), out);
  EXPECT_EQ(b.flags[0], std::uint32_t{kInvalid});
  EXPECT_EQ(b.flags[1], std::uint32_t{kAirborne});
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      EXPECT_TRUE(std::isnan(b.part[o][p][0]));
      EXPECT_EQ(b.part[o][p][1], 0);
      EXPECT_TRUE(std::isfinite(b.part[o][p][2]));
    }
  }
  EXPECT_TRUE(std::isnan(sd_soil[0]));
  EXPECT_EQ(sd_soil[1], 0);
  EXPECT_GT(sd_soil[2], 0);
}

TEST(MixtureModel, AnswersWhatIsAskedAlone) {
  const MixtureModel mixture({Part1(Sand(), 1), Part1(Hard(0.5, 0.02, 0), 2)});
  const Answered all(mixture);
  for (int p = 0; p < kParts; ++p) {
    StateBatch some = States();
    ResponsesView out;
    for (int o = 0; o < kOutputs; ++o) out.output[o].*kPartMembers[p] = some.part[o][p];
    out.flags = some.flags;
    mixture.Evaluate(some.In(), out);
    for (int o = 0; o < kOutputs; ++o) EXPECT_EQ(some.part[o][p], all.batch.part[o][p]) << p;
  }
  StateBatch some = States();
  std::vector<double> sd_soil(some.size());
  ResponsesView out;
  out.output[kTorque].sd_soil = sd_soil;
  out.flags = some.flags;
  mixture.Evaluate(some.In(), out);
  EXPECT_EQ(sd_soil, all.sd_soil[kTorque]);
}

/// Of draw k at all states.
StateBatch Drawn(const WheelModel& model, const Draws& draws, std::uint32_t k) {
  StateBatch batch = States();
  const std::vector<std::uint32_t> all(batch.size(), k);
  EvaluateDraws(model, {}, draws, all, batch.In(), batch.Out(), {});
  return batch;
}

// Each draw is that of one soil, at all states, to the last bit; all but the value are the
// mixture's.
TEST(MixtureModel, ADrawIsThatOfOneOfItsSoils) {
  const double weights[] = {0.5, 0.3, 0.2};
  const std::shared_ptr<const WheelModel> models[] = {Sand(), Hard(0.9, 0.02, 0),
                                                      Hard(0.3, 0.05, 0)};
  std::vector<MixturePart> parts;
  for (int k = 0; k < 3; ++k) parts.push_back(Part1(models[k], weights[k]));
  const MixtureModel mixture(parts);
  const Answered mean(mixture);
  const Draws draws("sand or floor", 500);
  std::array<int, 3> taken{};
  for (std::uint32_t k = 0; k < draws.size(); ++k) {
    const StateBatch got = Drawn(mixture, draws, k);
    int soil = -1;
    for (int s = 0; s < 3; ++s) {
      const StateBatch of = Drawn(*models[s], draws, k);
      bool same = true;
      for (int o = 0; o < kOutputs; ++o) same &= got.part[o][kValue] == of.part[o][kValue];
      if (same) soil = s;
    }
    ASSERT_GE(soil, 0) << k;
    ++taken[static_cast<std::size_t>(soil)];
    if (k % 50 != 0) continue;
    EXPECT_EQ(got.flags, mean.batch.flags);
    for (int o = 0; o < kOutputs; ++o) EXPECT_EQ(got.part[o][kHigh], mean.batch.part[o][kHigh]);
  }
  for (std::size_t s = 0; s < 3; ++s) {
    EXPECT_NEAR(taken[s] / 500.0, weights[s], 4.5 * std::sqrt(weights[s] * (1 - weights[s]) / 500));
  }
  // Draws that differ from state to state, and the torque alone.
  StateBatch all = States(), alone = States();
  std::vector<std::uint32_t> k(all.size());
  for (std::size_t i = 0; i < k.size(); ++i) k[i] = static_cast<std::uint32_t>(7 * i % 500);
  EvaluateDraws(mixture, {}, draws, k, all.In(), all.Out(), {});
  ResponsesView out;
  out.flags = alone.flags;
  out.output[kTorque].value = alone.part[kTorque][kValue];
  EvaluateDraws(mixture, {}, draws, k, alone.In(), out, {});
  for (std::size_t i = 0; i < k.size(); ++i) {
    const StateBatch one = Drawn(mixture, draws, k[i]);
    EXPECT_EQ(all.part[kFx][kValue][i], one.part[kFx][kValue][i]);
    EXPECT_EQ(alone.part[kTorque][kValue][i], one.part[kTorque][kValue][i]);
  }
}

// Over the draws: mean and standard deviation, 4.5 standard errors. (Where no draw is clamped.)
TEST(MixtureModel, DrawsHaveItsMeanAndVariance) {
  const MixtureModel mixture({Part1(Sand(), 1), Part1(Hard(0.6, 0.03, 0), 1)});
  const Answered mean(mixture);
  const Draws draws("sand or floor", Draws::kMost);
  const auto n = static_cast<double>(draws.size());
  std::vector<StateBatch> drawn;
  for (std::uint32_t k = 0; k < draws.size(); ++k) drawn.push_back(Drawn(mixture, draws, k));
  for (const Output o : {kFx, kFy, kTorque, kMz}) {
    for (std::size_t i = 0; i < mean.batch.size(); i += 10) {
      double sum = 0, square = 0;
      for (const StateBatch& d : drawn) {
        const double error = d.part[o][kValue][i] - mean.batch.part[o][kValue][i];
        sum += error / n;
        square += error * error / n;
      }
      const double sd =
          (mean.batch.part[o][kHigh][i] - mean.batch.part[o][kValue][i]) / kTwoSided90;
      EXPECT_NEAR(sum, 0, 4.5 * sd / std::sqrt(n)) << kOutputFields[o].name << " " << i;
      EXPECT_NEAR(square, sd * sd, 4.5 * sd * sd * std::sqrt(2 / n)) << kOutputFields[o].name;
    }
  }
}

TEST(MixtureModel, DrawsOfOneSoilAreItsOwn) {
  const std::shared_ptr<const WheelModel> floor = Hard(0.6, 0.03, 0);
  const MixtureModel alone({Part1(floor, 3), Part1(Sand(), 0)});
  const Draws draws("floor", 20);
  for (std::uint32_t k = 0; k < draws.size(); ++k) {
    const StateBatch got = Drawn(alone, draws, k), own = Drawn(*floor, draws, k);
    for (int o = 0; o < kOutputs; ++o) EXPECT_EQ(got.part[o][kValue], own.part[o][kValue]);
  }
  // A wheel that no soil answers for on a slope stays without an answer.
  StateBatch sloped = States();
  const std::vector<double> pitch(sloped.size(), 0.1);
  WheelStatesView in = sloped.In();
  in.slope_pitch = pitch;
  const MixtureModel both({Part1(floor, 1), Part1(Sand(), 1)});
  const std::vector<std::uint32_t> k(sloped.size(), 3);
  EvaluateDraws(both, {}, draws, k, in, sloped.Out(), {});
  for (const double value : sloped.part[kFx][kValue]) EXPECT_TRUE(std::isnan(value));
}

std::string Refusal(std::vector<MixturePart> parts) {
  try {
    const MixtureModel mixture(std::move(parts));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(MixtureModel, RefusesWhatIsNoMixture) {
  const auto expect = [](std::vector<MixturePart> parts, const char* what) {
    const std::string got = Refusal(std::move(parts));
    EXPECT_NE(got.find(what), std::string::npos) << got;
    EXPECT_EQ(got.find("mixture: "), 0u) << got;
  };
  expect({}, "0 models");
  expect({Part1(Sand(), 1), Part1(nullptr, 1)}, "without a model");
  expect({Part1(Sand(), 1), Part1(Sand(), -0.1)}, "weight -0.1");
  expect({Part1(Sand(), kUndefined)}, "weight");
  expect({Part1(Sand(), std::numeric_limits<double>::infinity())}, "weight");
  expect({Part1(Sand(), 0), Part1(Sand(), 0)}, "sum 0");
  expect({Part1(Sand(), 1e308), Part1(Sand(), 1e308)}, "sum");
  expect({Part1(Sand(), 1), {Sand(), 1, 0.07, kWidth, kGravity}}, "radius");
  expect({Part1(Sand(), 1), {Sand(), 1, kRadius, 0.06, kGravity}}, "width");
  expect({Part1(Sand(), 1), {Sand(), 1, kRadius, kWidth, 1.62}}, "gravity");
  const auto mixed =
      std::make_shared<MixtureModel>(std::vector{Part1(Sand(), 1), Part1(Hard(1, 0, 0), 1)});
  expect({Part1(mixed, 1)}, "of a mixture");
}

TEST(Mixed, ErrorsAgainstMeasurementsAddInSquares) {
  FormErrors a, b;
  a.middle_load_n = 20;
  b.middle_load_n = 40;
  a.region[0].sd = {3, 0, 0, 0.2, kUndefined, 0.004};
  b.region[0].sd = {8, 0, 0, 0.4, 1, 0.003};
  a.region[0].factor.fill(2);
  b.region[0].factor.fill(3);
  const FormErrors both[] = {a, b};
  const double weights[] = {0.25, 0.75};
  const FormErrors mixed = Mixed(both, weights);
  // At 40 N the first's 3 is 6, the second's 8.
  EXPECT_DOUBLE_EQ(mixed.Sd(MeasuredRegion::kStraight, kFx, 40), std::sqrt(0.25 * 36 + 0.75 * 64));
  EXPECT_DOUBLE_EQ(mixed.HalfWidth(MeasuredRegion::kStraight, kFx, 40),
                   std::sqrt(0.25 * 144 + 0.75 * 576));
  EXPECT_DOUBLE_EQ(mixed.Sd(MeasuredRegion::kStraight, kSinkage, 40),
                   std::sqrt(0.25 * 16e-6 + 0.75 * 9e-6));
  EXPECT_EQ(mixed.HalfWidth(MeasuredRegion::kStraight, kFy, 40), 0);
  EXPECT_TRUE(std::isnan(mixed.Sd(MeasuredRegion::kStraight, kMz, 40)));
  EXPECT_TRUE(std::isnan(mixed.Sd(MeasuredRegion::kLocked, kFx, 40)));
}

}  // namespace
}  // namespace grouser::surrogate

// Answers that depend on the speed: T + u T_rate, u by SpeedAxis::At.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "surrogate/models/spline.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using testing::Anywhere;
using testing::InsideHull;
using testing::ScaleOf;

constexpr double kGravity = 9.81, kRadius = 0.0625;
constexpr SpeedAxis kAxis{0.4, 1.5, 0.7};

double SpeedOf(double froude) { return std::sqrt(froude * kGravity * kRadius); }

/// A smooth rate with the mirrors of its channel, from the unit sphere's direction.
double RateAt(int channel, const ChartPoint& at) {
  const double x = std::cos(at.lateral_rad) * std::cos(at.direction_rad);
  const double q = std::cos(at.lateral_rad) * std::sin(at.direction_rad);
  const double y = std::sin(at.lateral_rad);
  switch (channel) {
    case kFx:
      return -0.3 * x;
    case kFy:
      return -0.4 * y;
    case kTorque:
      return 0.2 * q;
    case kMz:
      return 0.1 * x * y;
    case kSinkage:
      return 0.1 * (1 - 0.5 * y * y);
    default:
      return 0;
  }
}

/// The small model with a speed axis, as a file would have it.
v1alpha1::Model FastMessage() {
  v1alpha1::Model message = testing::SmallMessage();
  const auto& table = message.residual();
  TableAxes axes;
  axes.direction = table.direction_knots_rad_size() - 1;
  axes.lateral = table.lateral_knots_rad_size() - 1;
  axes.load = table.log_load_knots_size() - 1;
  axes.log_load_min = table.log_load_knots(0);
  axes.log_load_max = table.log_load_knots(axes.load);
  TableCoefficients rates;
  for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {
    std::vector<double> values;
    for (const TableNode& node : TableNodes(axes)) values.push_back(RateAt(o, node.chart));
    rates[o] = InterpolateTable(axes, ResidualTable::ParityOf(o), values);
  }
  SetSpeed(kAxis, rates, &message);
  message.mutable_domain()->set_froude_max(1.6);
  return message;
}

const HybridModel& Fast() {
  static const HybridModel model = [] {
    HybridModel made = MakeHybrid(FastMessage());
    made.Tabulate();
    return made;
  }();
  return model;
}

/// Inside the hull, at speeds up to a Froude number of 2.
StateBatch AtManySpeeds(const HybridModel& model, std::size_t n, unsigned seed) {
  StateBatch b = InsideHull(model.hull(), n, seed);
  for (std::size_t i = 0; i < n; ++i) {
    const double factor = 0.1 + 5 * static_cast<double>(i) / static_cast<double>(n);
    for (auto* v : {&b.v_x, &b.v_y, &b.rim_speed}) (*v)[i] *= factor;
  }
  return b;
}

double FroudeOf(const StateBatch& b, std::size_t i) {
  const double m = std::max(std::fabs(b.rim_speed[i]), std::hypot(b.v_x[i], b.v_y[i]));
  return m * m / (kGravity * kRadius);
}

TEST(SpeedAxis, TheAnswerGoesWithTheFroudeNumberAndStopsAtItsEnd) {
  const HybridModel& model = Fast();
  for (const double froude : {0.0001, 0.4, 1.0, 1.5, 5.0}) {
    const VelocityState v = FromSlip(0.3, 0.5, SpeedOf(froude));
    const VelocityState slow = FromSlip(0.3, 0.5, SpeedOf(kAxis.reference));
    const auto at = model.EvaluateOne(v.v_x, v.v_y, v.rim_speed, 20);
    const auto reference = model.EvaluateOne(slow.v_x, slow.v_y, slow.rim_speed, 20);
    const Canonical state = ToCanonical(v.v_x, v.v_y, v.rim_speed);
    const double end = std::min(froude, 1.5);
    const double u = end / (1 + 0.7 * end) - 0.4 / (1 + 0.7 * 0.4);
    for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {
      // 2e-4: the rate's own table.
      EXPECT_NEAR(at.value[o] - reference.value[o], u * RateAt(o, ToChart(state)) * ScaleOf(o, 20),
                  2e-4 * ScaleOf(o, 20))
          << kOutputFields[o].name << " at " << froude;
    }
    EXPECT_EQ((at.flags & kRate) != 0, froude > 1.6);
  }
}

TEST(SpeedAxis, TheTableIsTheScalarLaw) {
  const HybridModel& model = Fast();
  StateBatch b = AtManySpeeds(model, 10000, 1);
  model.Evaluate(b.In(), b.Out());
  std::array<std::vector<double>, kOutputs> errors;
  int fast = 0, other_flags = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const auto exact = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    fast += FroudeOf(b, i) > kAxis.high;
    other_flags += exact.flags != b.flags[i];
    for (int o = 0; o < kOutputs; ++o) {
      errors[o].push_back(std::fabs(b.part[o][kValue][i] - exact.value[o]) / exact.sd_patch[o]);
      const double half = b.part[o][kHigh][i] - b.part[o][kValue][i];
      EXPECT_NEAR(half, exact.half_width[o], 2e-3 * exact.half_width[o]);
      EXPECT_NEAR(b.part[o][kValue][i] - b.part[o][kLow][i], half, 1e-9);
    }
  }
  EXPECT_GT(fast, 500);
  EXPECT_LE(other_flags, 10);
  for (int o = 0; o < kOutputs; ++o) {
    std::sort(errors[o].begin(), errors[o].end());
    EXPECT_LT(errors[o][errors[o].size() * 99 / 100], 0.1) << kOutputFields[o].name;
  }
}

TEST(SpeedAxis, GradientsAreThoseOfTheAnswers) {
  const HybridModel& model = Fast();
  StateBatch b = AtManySpeeds(model, 2000, 3);
  model.Evaluate(b.In(), b.Out());
  const std::vector<double>* inputs[3] = {&b.v_x, &b.v_y, &b.rim_speed};
  int compared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    StateBatch low = b, high = b;
    std::vector<double>* moved[2][3] = {{&low.v_x, &low.v_y, &low.rim_speed},
                                        {&high.v_x, &high.v_y, &high.rim_speed}};
    std::vector<double> width(b.load.size());
    for (std::size_t i = 0; i < b.load.size(); ++i) {
      const double step = 1e-3 * SpeedOf(FroudeOf(b, i));
      (*moved[0][axis])[i] = (*inputs[axis])[i] - step;
      (*moved[1][axis])[i] = (*inputs[axis])[i] + step;
      width[i] = (*moved[1][axis])[i] - (*moved[0][axis])[i];
    }
    model.Evaluate(low.In(), low.Out());
    model.Evaluate(high.In(), high.Out());
    for (std::size_t i = 0; i < b.load.size(); ++i) {
      const double hub = std::hypot(b.v_x[i], b.v_y[i]), rim = std::fabs(b.rim_speed[i]);
      // Not across the creases: |r w| = V, the end of the axis.
      if (std::fabs(hub - rim) < 3e-3 * std::max(hub, rim)) continue;
      if (std::fabs(FroudeOf(b, i) / kAxis.high - 1) < 0.01) continue;
      ++compared;
      for (int o = 0; o < kOutputs; ++o) {
        const double difference = (high.part[o][kValue][i] - low.part[o][kValue][i]) / width[i];
        const double scale = ScaleOf(o, b.load[i]) * 2e-3 / width[i];
        EXPECT_NEAR(b.part[o][kDvX + axis][i], difference,
                    2e-3 * scale + 5e-3 * std::fabs(difference))
            << kOutputFields[o].name << " by " << axis << " at " << i;
      }
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST(SpeedAxis, InstructionSetsGiveTheSameBitsAndBatchesTheirStates) {
  HybridModel model = MakeHybrid(FastMessage());
  model.Tabulate();
  StateBatch best = AtManySpeeds(model, 1003, 5);
  model.Evaluate(best.In(), best.Out());
  ASSERT_TRUE(model.SelectIsa("baseline"));
  StateBatch base = AtManySpeeds(model, 1003, 5);
  model.Evaluate(base.In(), base.Out());
  EXPECT_EQ(base.part, best.part);
  EXPECT_EQ(base.flags, best.flags);
  for (const std::size_t i : {std::size_t{0}, std::size_t{500}, std::size_t{1002}}) {
    StateBatch one(1);
    one.Set(0, best.v_x[i], best.v_y[i], best.rim_speed[i], best.load[i]);
    model.Evaluate(one.In(), one.Out());
    for (int o = 0; o < kOutputs; ++o) {
      for (std::size_t p = 0; p < one.part[o].size(); ++p) {
        EXPECT_EQ(one.part[o][p][0], best.part[o][p][i]);
      }
    }
  }
}

TEST(SpeedAxis, BeyondItsEndAnswersHoldAndWiden) {
  const HybridModel& model = Fast();
  const double near = SpeedOf(1.59) / std::hypot(1, 0.2);
  double last = 0;
  for (const double factor : {1.0, 1.05, 1.5, 3.0, 100.0, 1e20, 1e90, 1e140}) {
    StateBatch b(1);
    const double m = factor * near;
    b.Set(0, m, 0.2 * m, 0.8 * m, 20);
    model.Evaluate(b.In(), b.Out());
    const auto end = model.EvaluateOne(near, 0.2 * near, 0.8 * near, 20);
    EXPECT_EQ((b.flags[0] & kRate) != 0, factor > 1.01) << factor;
    for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {
      EXPECT_NEAR(b.part[o][kValue][0], end.value[o], 2e-3 * ScaleOf(o, 20)) << factor;
      EXPECT_TRUE(std::isfinite(b.part[o][kHigh][0]));
    }
    const double width = b.part[kFx][kHigh][0] - b.part[kFx][kValue][0];
    EXPECT_GE(width, last) << factor;
    if (factor == 3.0) {
      EXPECT_GT(width, 2 * last);
    }
    last = width;
  }
}

TEST(SpeedAxis, LookupHasItToo) {
  v1alpha1::Model message = FastMessage();
  message.set_kind(v1alpha1::MODEL_KIND_LOOKUP);
  const auto model = MakeScalar(message);
  const auto at = [&](double m) { return model->EvaluateOne(m, 0.3 * m, 0.9 * m, 20); };
  const double y = at(SpeedOf(1.2)).value[kFy], slow = at(SpeedOf(0.4)).value[kFy];
  const ChartPoint chart = ToChart(ToCanonical(1, 0.3, 0.9));
  const double u = kAxis.At(1.2 * (1 + 0.09)) - kAxis.At(0.4 * (1 + 0.09));  // V^2 = 1.09 m^2
  EXPECT_NEAR(y - slow, u * RateAt(kFy, chart) * 20, 2e-3 * 20);
  EXPECT_NEAR(at(1e120).value[kFy], at(SpeedOf(2)).value[kFy], 1e-5 * 20);
  EXPECT_TRUE(at(1e120).flags & kRate);
  EXPECT_FALSE(at(1e-120).flags & kRate);
  EXPECT_NEAR(at(1e-120).value[kFy], at(1e-6).value[kFy], 1e-5 * 20);
}

TEST(SpeedAxis, RefusesWhatMakesNoSense) {
  const auto why = [](const v1alpha1::Model& message) -> std::string {
    try {
      MakeScalar(message);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  v1alpha1::Model bad = FastMessage();
  EXPECT_EQ(why(bad), "");
  bad.mutable_residual()->set_froude_max(0);
  EXPECT_THAT(why(bad), ::testing::HasSubstr("froude_max"));
  bad = FastMessage();
  bad.mutable_residual()->set_froude_reference(9);
  EXPECT_THAT(why(bad), ::testing::HasSubstr("froude_reference"));
  bad = FastMessage();
  bad.mutable_residual()->set_froude_saturation(-1);
  EXPECT_THAT(why(bad), ::testing::HasSubstr("froude_saturation"));
  bad = FastMessage();
  bad.mutable_residual()->mutable_rate_coefficients()->RemoveLast();
  EXPECT_THAT(why(bad), ::testing::HasSubstr("rate_coefficients: 6 channels"));
  bad = FastMessage();
  bad.mutable_residual()->mutable_rate_coefficients(0)->mutable_values()->RemoveLast();
  EXPECT_THAT(why(bad), ::testing::HasSubstr("coefficients[0]"));
}

}  // namespace
}  // namespace grouser::surrogate

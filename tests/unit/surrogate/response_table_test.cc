// The table of the whole answer against the scalar law it was made from.
#include "surrogate/models/response_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using testing::Anywhere;
using testing::InsideHull;
using testing::ScaleOf;
using testing::Small;

// The stated error: a tenth of sd_patch at the 99th percentile. The largest
// stand where |r w| = V, where the physics has a crease.
TEST(ResponseTable, IsTheScalarLawInsideTheHull) {
  const HybridModel& model = Small();
  ASSERT_TRUE(model.tabulated());
  StateBatch b = InsideHull(model.hull(), 20000, 1);
  model.Evaluate(b.In(), b.Out());
  std::array<std::vector<double>, kOutputs> errors;
  int other_flags = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const auto exact = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    other_flags += exact.flags != b.flags[i];
    for (int o = 0; o < kOutputs; ++o) {
      const auto& p = b.part[o];
      errors[o].push_back(std::fabs(p[kValue][i] - exact.value[o]) / exact.sd_patch[o]);
      EXPECT_NEAR(p[kSdFit][i], exact.sd_fit[o], 2e-3 * exact.sd_fit[o]);
      EXPECT_NEAR(p[kSdPatch][i], exact.sd_patch[o], 1e-6 * exact.sd_patch[o]);
      EXPECT_NEAR(p[kHigh][i] - p[kValue][i], exact.half_width[o], 2e-3 * exact.half_width[o]);
      EXPECT_NEAR(p[kValue][i] - p[kLow][i], exact.half_width[o], 2e-3 * exact.half_width[o]);
    }
    EXPECT_NEAR(b.part[kFz][kValue][i], b.load[i], 1e-6 * b.load[i]);
  }
  EXPECT_LE(other_flags, 10);  // at the faces themselves
  for (int o = 0; o < kOutputs; ++o) {
    std::sort(errors[o].begin(), errors[o].end());
    EXPECT_LT(errors[o][errors[o].size() * 99 / 100], 0.1) << kOutputFields[o].name;
    EXPECT_LT(errors[o].back(), 0.6) << kOutputFields[o].name;
  }
}

TEST(ResponseTable, IntervalsOfWheelsThatBulldozeGrowAsTheLawSays) {
  v1alpha1::Model message = testing::SmallMessage();
  for (int o = 0; o < kOutputs; ++o) message.add_sd_bulldozing(0.5 * o);
  HybridModel model = MakeHybrid(message);
  model.Tabulate();
  StateBatch b = InsideHull(model.hull(), 2000, 3);
  model.Evaluate(b.In(), b.Out());
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const auto exact = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    const double most = std::max(std::hypot(b.v_x[i], b.v_y[i]), std::fabs(b.rim_speed[i]));
    const double forward = std::fabs(b.v_x[i]) / most, y = b.v_y[i] / most;
    const double rim = (b.v_x[i] < 0 ? -b.rim_speed[i] : b.rim_speed[i]) / most;
    const double brake = std::max(0.0, forward - rim), plane = std::hypot(forward, rim);
    for (int o = 0; o < kOutputs; ++o) {
      const auto& p = b.part[o];
      const double share = std::min(1.0, y * y + brake * brake * forward / plane);
      const double grown = 1 + 0.5 * o * share;
      const double middle = o == kSinkage ? 1
                                          : b.load[i] / std::sqrt(message.domain().load_min_n() *
                                                                  message.domain().load_max_n());
      EXPECT_NEAR(p[kSdPatch][i], grown * middle * message.sd_patch(o), 1e-5 * p[kSdPatch][i]);
      EXPECT_NEAR(exact.sd_patch[o], p[kSdPatch][i], 1e-5 * p[kSdPatch][i]);
      EXPECT_NEAR(p[kSdFit][i], exact.sd_fit[o], 2e-3 * exact.sd_fit[o]);
      EXPECT_NEAR(p[kHigh][i] - p[kValue][i], exact.half_width[o], 2e-3 * exact.half_width[o]);
    }
  }
}

// What the server's self-test relies on.
TEST(ResponseTable, GoldenVectorsComeOutToItsTolerance) {
  const v1alpha1::Model message = testing::SmallMessage();
  EXPECT_EQ(MakeHybrid(message).Tolerance(), 0);  // without its table: the law itself
  const HybridModel& model = Small();
  StateBatch b(static_cast<std::size_t>(message.golden_size()));
  for (int i = 0; i < message.golden_size(); ++i) {
    const auto& g = message.golden(i);
    b.Set(i, g.v_x_m_per_s(), g.v_y_m_per_s(), g.rim_speed_m_per_s(), g.load_n());
  }
  model.Evaluate(b.In(), b.Out());
  for (int i = 0; i < message.golden_size(); ++i) {
    for (int o = 0; o < kOutputs; ++o) {
      EXPECT_NEAR(b.part[o][kValue][i], message.golden(i).value(o),
                  model.Tolerance() * ScaleOf(o, b.load[i]))
          << kOutputFields[o].name << " " << i;
    }
  }
}

TEST(ResponseTable, AnswersEverywhereAndSaysWhereItExtrapolates) {
  const HybridModel& model = Small();
  StateBatch b = Anywhere(4000, 2);
  model.Evaluate(b.In(), b.Out());
  int without_equilibrium = 0, other_flags = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const auto exact = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    other_flags += exact.flags != b.flags[i];
    EXPECT_EQ(exact.flags & kNoEquilibrium, b.flags[i] & kNoEquilibrium) << i;
    without_equilibrium += (b.flags[i] & kNoEquilibrium) != 0;
    const TrainingDomain& hull = model.hull();
    if (b.load[i] < 0.99 * hull.load_min_n || b.load[i] > 1.01 * hull.load_max_n) {
      EXPECT_TRUE(b.flags[i] & kExtrapolated) << i;
    }
    for (int o = 0; o < kOutputs; ++o) {
      for (const auto& part : b.part[o]) ASSERT_TRUE(std::isfinite(part[i])) << i;
      EXPECT_NEAR(b.part[o][kValue][i], exact.value[o], 0.06 * ScaleOf(o, b.load[i])) << i;
      const double half = b.part[o][kHigh][i] - b.part[o][kValue][i];
      EXPECT_NEAR(half, exact.half_width[o], 0.06 * exact.half_width[o]) << i;
    }
  }
  EXPECT_GT(without_equilibrium, 50);  // the scan does reach them
  EXPECT_LE(other_flags, 40);          // at thresholds of distance and sinkage
}

// Through both ends of the load axis, where the scalar law takes over.
TEST(ResponseTable, IsContinuousInTheLoad) {
  const HybridModel& model = Small();
  const auto largest_jump = [&](std::size_t steps, double x, double y, double u) {
    StateBatch b(steps + 1);
    for (std::size_t i = 0; i <= steps; ++i) {
      b.Set(i, x, y, u, std::pow(300.0, static_cast<double>(i) / static_cast<double>(steps)));
    }
    model.Evaluate(b.In(), b.Out());
    double largest = 0;
    for (std::size_t i = 1; i <= steps; ++i) {
      for (int o = 0; o < kOutputs; ++o) {
        for (const int p : {kValue, kLow, kHigh}) {
          const double ratio = o == kSinkage ? 1 : b.load[i] / b.load[i - 1];
          const double step = std::fabs(b.part[o][p][i] - ratio * b.part[o][p][i - 1]);
          largest = std::max(largest, step / ScaleOf(o, b.load[i]));
        }
      }
    }
    return largest;
  };
  for (const auto& s : {std::array{0.1, 0.0, 0.12},
                        {0.1, 0.05, 0.05},
                        {0.05, 0.1, -0.02},
                        {0.1, 0.1, 0.0},
                        {0.0, 0.1, 0.0}}) {
    const double coarse = largest_jump(1000, s[0], s[1], s[2]);
    const double fine = largest_jump(4000, s[0], s[1], s[2]);
    EXPECT_LT(coarse, 0.1);
    EXPECT_LT(fine, 0.4 * coarse);
  }
}

// Central differences of the answers themselves, by v_x, v_y, rim speed, load.
TEST(ResponseTable, GradientsAreThoseOfTheAnswers) {
  const HybridModel& model = Small();
  StateBatch b = InsideHull(model.hull(), 2000, 3);
  model.Evaluate(b.In(), b.Out());
  const std::vector<double>* inputs[4] = {&b.v_x, &b.v_y, &b.rim_speed, &b.load};
  std::array<std::array<double, 4>, kOutputs> size{};
  for (int axis = 0; axis < 4; ++axis) {
    StateBatch low = b, high = b;
    std::vector<double>* moved[2][4] = {{&low.v_x, &low.v_y, &low.rim_speed, &low.load},
                                        {&high.v_x, &high.v_y, &high.rim_speed, &high.load}};
    for (std::size_t i = 0; i < b.load.size(); ++i) {
      const double speed = std::max(std::fabs(b.rim_speed[i]), std::hypot(b.v_x[i], b.v_y[i]));
      const double step = 1e-3 * (axis == 3 ? b.load[i] : speed);
      (*moved[0][axis])[i] = (*inputs[axis])[i] - step;
      (*moved[1][axis])[i] = (*inputs[axis])[i] + step;
    }
    model.Evaluate(low.In(), low.Out());
    model.Evaluate(high.In(), high.Out());
    for (std::size_t i = 0; i < b.load.size(); ++i) {
      const double width = (*moved[1][axis])[i] - (*moved[0][axis])[i];
      for (int o = 0; o < kOutputs; ++o) {
        const double difference = (high.part[o][kValue][i] - low.part[o][kValue][i]) / width;
        const double slope = b.part[o][kDvX + axis][i];
        const double scale = ScaleOf(o, b.load[i]) * 2e-3 / width;  // for a change by M or load
        EXPECT_NEAR(slope, difference, 2e-3 * scale + 5e-3 * std::fabs(difference))
            << kOutputFields[o].name << " by " << axis << " at " << i;
        size[o][axis] = std::max(size[o][axis], std::fabs(slope) / scale);
      }
    }
  }
  for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {  // something was compared
    for (int axis = 0; axis < 4; ++axis) EXPECT_GT(size[o][axis], 0.02) << kOutputFields[o].name;
  }
}

TEST(ResponseTable, MirrorsAreExactGradientsIncluded) {
  const HybridModel& model = Small();
  StateBatch b = Anywhere(1003, 4), left = b, back = b;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    left.v_y[i] = -b.v_y[i];
    back.v_x[i] = -b.v_x[i];
    back.rim_speed[i] = -b.rim_speed[i];
  }
  for (StateBatch* batch : {&b, &left, &back}) model.Evaluate(batch->In(), batch->Out());
  for (int o = 0; o < kOutputs; ++o) {
    const auto parity = ResidualTable::ParityOf(o);
    const int by_left[4] = {parity.y, -parity.y, parity.y, parity.y};
    const int by_back[4] = {-parity.x, parity.x, -parity.x, parity.x};
    const auto &p = b.part[o], &l = left.part[o], &r = back.part[o];
    for (std::size_t i = 0; i < b.load.size(); ++i) {
      EXPECT_EQ(l[kValue][i], parity.y * p[kValue][i]);
      EXPECT_EQ(r[kValue][i], parity.x * p[kValue][i]);
      for (const int part : {kSdFit, kSdPatch}) {
        EXPECT_EQ(l[part][i], p[part][i]);
        EXPECT_EQ(r[part][i], p[part][i]);
      }
      for (int a = 0; a < 4; ++a) {
        EXPECT_EQ(l[kDvX + a][i], by_left[a] * p[kDvX + a][i]) << i << " " << a;
        EXPECT_EQ(r[kDvX + a][i], by_back[a] * p[kDvX + a][i]) << i << " " << a;
      }
    }
  }
}

TEST(ResponseTable, StraightAheadAndSidewaysTheMirroredOutputsVanish) {
  const HybridModel& model = Small();
  StateBatch b(2);
  b.Set(0, 0.1, 0, 0.13, 24);
  b.Set(1, 0, -0.1, 0, 24);
  model.Evaluate(b.In(), b.Out());
  for (const Output o : {kFy, kMz}) EXPECT_EQ(b.part[o][kValue][0], 0);
  for (const Output o : {kFx, kTorque}) EXPECT_EQ(b.part[o][kValue][1], 0);
  for (const Output o : {kFx, kTorque, kFz, kSinkage}) EXPECT_EQ(b.part[o][kDvX + 1][0], 0);
  EXPECT_LT(b.part[kFy][kDvX + 1][0], 0);  // the side pushes back
}

// At the pole, v_x = rim = 0, slopes come from differences, a little away from
// it from the chart: the two must meet, but for the few per cent by which a
// tensor product of polar coordinates keeps a cone there. At rest only the load
// has slopes.
TEST(ResponseTable, GradientsAreFiniteAndMeetAtThePole) {
  const HybridModel& model = Small();
  StateBatch b(4);
  b.Set(0, 0, 0.1, 0, 24);
  b.Set(1, 2e-4, 0.1, 0, 24);
  b.Set(2, 0, 0.1, 2e-4, 24);
  b.Set(3, 0, 0, 0, 24);
  model.Evaluate(b.In(), b.Out());
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = ScaleOf(o, 24) / 0.1;
    for (int a = 0; a < 3; ++a) {
      const double pole = b.part[o][kDvX + a][0];
      EXPECT_NEAR(b.part[o][kDvX + a][1], pole, 0.04 * scale) << kOutputFields[o].name << a;
      EXPECT_NEAR(b.part[o][kDvX + a][2], pole, 0.04 * scale) << kOutputFields[o].name << a;
      EXPECT_EQ(b.part[o][kDvX + a][3], 0);
    }
  }
  EXPECT_LT(b.part[kFx][kDvX][0], -0.5 * 24 / 0.1);  // resists v_x
  EXPECT_NEAR(b.part[kFz][kDvX + 3][3], 1, 1e-4);
  EXPECT_GT(b.part[kSinkage][kDvX + 3][3], 0);
}

// A wheel that many loads from `lightest` to 40 N sink beyond any equilibrium.
HybridModel OnSoftSoil(double k_phi, double lightest) {
  BekkerParameters soft;
  soft.k_phi = k_phi;
  TrainingDomain hull;
  hull.attack_angle_max_rad = 1.5;
  hull.load_min_n = lightest;
  hull.load_max_n = 40;
  HybridModel model(BekkerModel(soft, {0.0625, 0.05}), {}, hull, Uncertainty{});
  model.Tabulate();
  return model;
}

// Soft soil: many states have no equilibrium within the hull's loads. The table rounds
// that corner off, but knows where it is and what the soil carries beyond it.
TEST(ResponseTable, KnowsTheLargestLoadWithAnEquilibrium) {
  const HybridModel model = OnSoftSoil(4e4, 2);
  ASSERT_TRUE(model.tabulated());
  StateBatch b = InsideHull(model.hull(), 4000, 11);
  model.Evaluate(b.In(), b.Out());
  int lost = 0, clear = 0, off = 0;
  double worst = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const WheelAnswer exact = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    const double most = model.physics()
                            .AtSinkage(ToCanonical(b.v_x[i], b.v_y[i], b.rim_speed[i]),
                                       model.physics().max_sinkage())
                            .value[kFz];
    const double margin = std::log(std::max(most, 1e-30) / b.load[i]);
    if (std::fabs(margin) > 0.01) {
      ASSERT_EQ((b.flags[i] & kNoEquilibrium) != 0, margin < 0) << i;
    }
    ASSERT_EQ((exact.flags & kNoEquilibrium) != 0, margin < 0) << i;
    lost += (exact.flags & kNoEquilibrium) != 0;
    clear += margin > 0.8;
    ASSERT_NEAR(b.part[kFz][kValue][i], exact.value[kFz], 0.01 * b.load[i]) << i;
    ASSERT_GE(b.part[kFz][kHigh][i], b.part[kFz][kValue][i]) << i;
    ASSERT_LE(b.part[kFz][kLow][i], b.part[kFz][kValue][i]) << i;
    for (int o = 0; o < kOutputs; ++o) {
      const double miss = std::fabs(b.part[o][kValue][i] - exact.value[o]) / ScaleOf(o, b.load[i]);
      if (margin > 0.8) off += miss > 0.01;
      worst = std::max(worst, miss);
    }
  }
  EXPECT_GT(lost, 100);
  EXPECT_GT(clear, 500);
  EXPECT_LT(off, 0.01 * kOutputs * clear);
  EXPECT_LT(worst, 0.15);  // at the corner, far beyond the sinkage of an overload
}

// What the soil carries has slopes of its own: f_z follows it, not the load.
TEST(ResponseTable, BeyondTheLargestLoadVerticalForceStays) {
  const HybridModel model = OnSoftSoil(1e4, 10);
  StateBatch b(2);
  b.Set(0, 0.07, 0.02, 0.1, 30);
  b.Set(1, 0.07, 0.02, 0.1, 31);
  model.Evaluate(b.In(), b.Out());
  ASSERT_TRUE(b.flags[0] & kNoEquilibrium);
  EXPECT_TRUE(b.flags[0] & kExtrapolated);
  EXPECT_NEAR(b.part[kFz][kValue][0], b.part[kFz][kValue][1], 1e-3);
  EXPECT_NEAR(b.part[kFz][kDvX + 3][0], 0, 1e-3);
  EXPECT_NE(b.part[kFz][kDvX][0], 0);
}

}  // namespace
}  // namespace grouser::surrogate

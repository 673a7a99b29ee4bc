// What every tabulated model promises, and the lookup model.
#include "surrogate/models/tabulated_model.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "surrogate/models/lookup.h"
#include "surrogate/models/spline.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using testing::Anywhere;
using testing::InsideHull;
using testing::Small;
using testing::SmallMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

bool SameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// States of every kind among ordinary ones.
StateBatch Mixed(std::size_t n) {
  StateBatch b = InsideHull(Small().hull(), n, 5);
  const StateBatch any = Anywhere(n, 6);
  const double odd[][4] = {{kNaN, 0, 0, 24},      {0.1, kInf, 0, 24},   {0.1, 0, 0.1, 0},
                           {0.1, 0, 0, -3},       {0.1, 0, 0.1, kNaN},  {0, 0, 0, 24},
                           {0, 0.1, 0, 24},       {1e-300, 0, 0, 24},   {1e200, 1e200, 0, 24},
                           {0.1, 0, 0.1, 1e-300}, {0.1, 0, 0.1, 1e300}, {0, 0, -0.1, 24}};
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 5 == 0) b.Set(i, any.v_x[i], any.v_y[i], any.rim_speed[i], any.load[i]);
    if (i % 7 == 0) {
      const auto& s = odd[i / 7 % std::size(odd)];
      b.Set(i, s[0], s[1], s[2], s[3]);
    }
  }
  return b;
}

void ExpectSameRow(const StateBatch& a, std::size_t i, const StateBatch& b, std::size_t k) {
  EXPECT_EQ(a.flags[i], b.flags[k]) << i;
  EXPECT_TRUE(SameBits(a.slip[i], b.slip[k])) << i;
  EXPECT_TRUE(SameBits(a.attack_angle[i], b.attack_angle[k])) << i;
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      EXPECT_TRUE(SameBits(a.part[o][p][i], b.part[o][p][k]))
          << i << " " << kOutputFields[o].name << " " << p << ": " << a.part[o][p][i] << " "
          << b.part[o][p][k];
    }
  }
}

TEST(TabulatedModel, ABatchIsItsStatesOneByOne) {
  StateBatch all = Mixed(301);
  Small().Evaluate(all.In(), all.Out());
  for (std::size_t i = 0; i < all.load.size(); ++i) {
    StateBatch one(1);
    one.Set(0, all.v_x[i], all.v_y[i], all.rim_speed[i], all.load[i]);
    Small().Evaluate(one.In(), one.Out());
    ExpectSameRow(all, i, one, 0);
  }
}

TEST(TabulatedModel, InstructionSetsGiveTheSameBits) {
  HybridModel model = Small();
  ASSERT_TRUE(model.SelectIsa("baseline"));
  EXPECT_FALSE(model.SelectIsa("mmx"));
  StateBatch plain = Mixed(501);
  model.Evaluate(plain.In(), plain.Out());
  for (const char* isa : {"avx2", "avx512"}) {
    if (!model.SelectIsa(isa)) continue;  // not this machine's
    StateBatch wide = Mixed(501);
    model.Evaluate(wide.In(), wide.Out());
    for (std::size_t i = 0; i < plain.load.size(); ++i) ExpectSameRow(plain, i, wide, i);
  }
}

TEST(TabulatedModel, GradientsDoNotChangeTheValues) {
  StateBatch with = Mixed(301), without = with;
  Small().Evaluate(with.In(), with.Out());
  ResponsesView out = without.Out();
  for (OutputView& o : out.output) o.d_v_x = o.d_v_y = o.d_rim_speed = o.d_load = {};
  Small().Evaluate(without.In(), out);
  for (int o = 0; o < kOutputs; ++o) {
    for (std::size_t i = 0; i < with.load.size(); ++i) {
      EXPECT_TRUE(SameBits(with.part[o][0][i], without.part[o][0][i]));
      EXPECT_TRUE(std::isnan(without.part[o][kDvX][i]));  // an empty span is not written
    }
  }
}

TEST(TabulatedModel, OddStatesAreFlaggedAndHarmNoOther) {
  StateBatch b = Mixed(128), ordinary = InsideHull(Small().hull(), 128, 5);
  Small().Evaluate(b.In(), b.Out());
  Small().Evaluate(ordinary.In(), ordinary.Out());
  int invalid = 0, still = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const bool usable = std::isfinite(std::hypot(b.v_x[i], b.v_y[i])) && b.load[i] >= 0;
    EXPECT_EQ((b.flags[i] & kInvalid) != 0, !usable) << i;
    invalid += !usable;
    still += (b.flags[i] & kStatic) != 0;
    for (const auto& output : b.part) {
      for (const auto& part : output) EXPECT_EQ(std::isfinite(part[i]), usable) << i;
    }
    if (i % 5 != 0 && i % 7 != 0) ExpectSameRow(b, i, ordinary, i);
  }
  EXPECT_GE(invalid, 5);
  EXPECT_GE(still, 1);
}

TEST(TabulatedModel, ContextIsFlagged) {
  StateBatch b(9);
  for (std::size_t i = 0; i < 9; ++i) b.Set(i, 0.1, 0, 0.1, 24);
  const std::vector<double> pitch{0, 0.1, 0, 0, kNaN, 0, 0, 0, 0};
  const std::vector<double> yaw{0, 0, 0.2, 0, 0, 0, 0, 0, 0};
  const std::vector<std::uint32_t> pass{1, 1, 1, 2, 1, 1, 1, 1, 0};
  WheelStatesView in = b.In();
  in.slope_pitch = pitch;
  in.yaw_rate = yaw;
  in.pass_number = pass;
  Small().Evaluate(in, b.Out());
  const std::uint32_t plain = b.flags[0];
  EXPECT_EQ(plain & (kSlope | kClamped | kVirginAssumed), 0u);
  EXPECT_EQ(b.flags[1], plain | kSlope);
  EXPECT_EQ(b.flags[2], plain | kClamped);
  EXPECT_EQ(b.flags[3], plain | kVirginAssumed);
  EXPECT_EQ(b.flags[4], kInvalid);
  EXPECT_EQ(b.flags[8], plain);
  // A slope and a second pass are not answered as if they were none.
  for (const auto& output : b.part) {
    for (const auto& part : output) {
      for (const std::size_t i : {1, 3, 4}) EXPECT_TRUE(std::isnan(part[i])) << i;
      for (const std::size_t i : {0, 2, 5, 8}) EXPECT_TRUE(std::isfinite(part[i])) << i;
    }
  }
}

TEST(TabulatedModel, EchoesAreThoseOfToSlip) {
  StateBatch b = Anywhere(1000, 8);
  b.Set(0, -0.1, 0, 0, 24);
  b.Set(1, 0, 0, -0.1, 24);
  b.Set(2, -0.1, -0.0, 0.1, 24);
  Small().Evaluate(b.In(), b.Out());
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const SlipState s = ToSlip(b.v_x[i], b.v_y[i], b.rim_speed[i]);
    EXPECT_NEAR(b.slip[i], s.slip, 1e-14) << i;
    EXPECT_NEAR(b.attack_angle[i], s.attack_angle_rad, 1e-14) << i;
  }
}

TEST(TabulatedModel, EvaluationAllocatesNothing) {
  StateBatch b = Mixed(301);
  const WheelStatesView in = b.In();
  const ResponsesView out = b.Out();
  const HybridModel& model = Small();
  const long before = g_allocations;
  model.Evaluate(in, out);
  EXPECT_EQ(g_allocations - before, 0);
  const auto probe = std::make_unique<int>(1);  // the counter does count
  EXPECT_GT(g_allocations - before, 0);
}

// A smooth field with each channel's parity, and its coefficients.
struct Field {
  TableAxes axes{24, 9, 6, std::log(8.0), std::log(60.0)};
  std::array<std::vector<double>, ResponseTable::kChannels> nodes, coefficients;
  std::array<std::span<const double>, ResponseTable::kChannels> spans;

  Field() {
    for (int c = 0; c < ResponseTable::kChannels; ++c) {
      const auto parity = ResidualTable::ParityOf(c);
      for (const TableNode& node : TableNodes(axes)) {
        const double plane = std::cos(node.chart.lateral_rad);
        const double x = plane * std::cos(node.chart.direction_rad);
        const double y = node.chart.lateral_rad == 0 ? 0 : std::sin(node.chart.lateral_rad);
        const double even = 0.1 + 0.05 * x * x + 0.02 * y * y + 0.01 * node.log_load;
        nodes[c].push_back(even * (parity.x < 0 ? x : 1) * (parity.y < 0 ? y : 1));
      }
      coefficients[c] = InterpolateTable(axes, parity, nodes[c]);
      spans[c] = coefficients[c];
    }
  }
};

LookupModel MakeLookup(const Field& field) {
  TrainingDomain hull;
  hull.attack_angle_max_rad = kPi / 3;
  hull.load_min_n = 12;
  hull.load_max_n = 40;
  hull.froude_max = 0.1;
  Uncertainty u;
  u.fit_inside.fill(0.1);
  u.fit_growth.fill(1.0);
  u.patch.fill(0.2);
  u.interval_factor.fill(1.7);
  return LookupModel(field.axes, field.spans, hull, u, {0.0625, 0.05});
}

// One flag and zeros in every part, whatever the wheel does; by the table, by the scalar
// law alone and by the lookup model. A load below 0 and kinematics that are none stay INVALID.
TEST(TabulatedModel, AWheelOffTheGroundAnswersZeros) {
  const HybridModel scalar = MakeHybrid(SmallMessage());
  const LookupModel lookup = MakeLookup(Field());
  for (const TabulatedModel* model :
       {static_cast<const TabulatedModel*>(&Small()), static_cast<const TabulatedModel*>(&scalar),
        static_cast<const TabulatedModel*>(&lookup)}) {
    StateBatch b(11);
    for (std::size_t i = 0; i < b.size(); ++i) b.Set(i, 0.1, 0.02, 0.12, i < 8 ? 0 : 24);
    b.Set(1, 0, 0, 0, 0);
    b.Set(2, -0.1, 0, -0.3, -0.0);
    b.Set(3, 1e200, 0, 0, 0);
    b.Set(4, kNaN, 0, 0.1, 0);
    b.Set(5, 0.1, 0, 0.1, -1e-9);
    b.slope_pitch.assign(b.size(), 0.0);
    b.slope_pitch[6] = 0.2;
    b.slope_pitch[7] = kNaN;
    model->Evaluate(b.In(), b.Out());
    for (const std::size_t i : {0, 1, 2, 3, 6}) {
      EXPECT_EQ(b.flags[i], std::uint32_t{kAirborne}) << i;
      for (const auto& output : b.part) {
        for (const auto& part : output) EXPECT_EQ(part[i], 0) << i;
      }
      EXPECT_TRUE(std::isfinite(b.slip[i]));
    }
    for (const std::size_t i : {4, 5, 7}) EXPECT_EQ(b.flags[i], std::uint32_t{kInvalid}) << i;
    for (const std::size_t i : {8, 9, 10}) {
      EXPECT_EQ(b.flags[i] & (kAirborne | kInvalid), 0u) << i;
      EXPECT_EQ(b.part[kFz][kValue][i], b.part[kFz][kValue][8]);
    }
  }
}

TEST(Spline, TakesTheValuesOfItsNodes) {
  const Field field;
  const ResidualTable table(field.axes, field.spans);
  const auto places = TableNodes(field.axes);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto values = table.Evaluate(places[i].chart, places[i].log_load);
    for (int c = 0; c < ResidualTable::kChannels; ++c) {
      EXPECT_NEAR(values[c], field.nodes[c][i], 1e-12) << c << " " << i;
    }
  }
}

TEST(Lookup, IsItsTable) {
  const Field field;
  const LookupModel model = MakeLookup(field);
  const ResidualTable table(field.axes, field.spans);
  StateBatch b = Anywhere(2000, 9);
  model.Evaluate(b.In(), b.Out());
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const Canonical state = ToCanonical(b.v_x[i], b.v_y[i], b.rim_speed[i]);
    const auto channels = table.Evaluate(ToChart(state), std::log(b.load[i]));
    std::array<double, kOutputs> value;
    for (int o = 0; o < kOutputs; ++o) value[o] = channels[o] * testing::ScaleOf(o, b.load[i]);
    ApplyMirrors(state, &value);
    for (int o = 0; o < kOutputs; ++o) {
      EXPECT_NEAR(b.part[o][0][i], value[o], 2e-6 * testing::ScaleOf(o, b.load[i])) << i;
    }
  }
}

TEST(Lookup, KeepsItsEdgeBeyondItsLoadsAndWidens) {
  const Field field;
  const LookupModel model = MakeLookup(field);
  StateBatch b(6);
  const double loads[] = {60, 120, 1e4, 1e36, 24, 24};
  for (std::size_t i = 0; i < 6; ++i) b.Set(i, 0.1, 0.02, 0.12, loads[i]);
  b.Set(5, 0, 0, 0, 24);
  model.Evaluate(b.In(), b.Out());
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(b.flags[i] & kExtrapolated);
    EXPECT_NEAR(b.part[kFx][0][i] / loads[i], b.part[kFx][0][0] / 60, 1e-6);
    EXPECT_NEAR(b.part[kSinkage][0][i], b.part[kSinkage][0][0], 1e-7);
    if (i == 0) continue;
    EXPECT_GT(b.part[kFx][1][i] / loads[i], b.part[kFx][1][i - 1] / loads[i - 1]);
  }
  EXPECT_NEAR(b.part[kFx][8][2], b.part[kFx][0][2] / loads[2], 1e-6);  // proportional there
  EXPECT_EQ(b.flags[4], kFormUnknown);
  EXPECT_TRUE(b.flags[5] & kStatic);
  EXPECT_EQ(b.part[kFx][0][5], 0);
  EXPECT_EQ(b.part[kFz][0][5], 24);
  EXPECT_GT(b.part[kSinkage][0][5], 0);
}

TEST(Lookup, RefusesWhatItCannotUse) {
  Field field;
  EXPECT_NO_THROW(MakeLookup(field));
  field.coefficients[kFy][3] = kNaN;
  EXPECT_THROW(MakeLookup(field), std::invalid_argument);
  field.spans[kFy] = field.spans[kFy].first(5);
  EXPECT_THROW(MakeLookup(field), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::surrogate

#include "surrogate/models/hybrid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <memory>
#include <new>
#include <numbers>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "surrogate/models/state_batch.h"
#include "tests/unit/count_allocations.h"

namespace grouser::surrogate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Random coefficients with each channel's parity in them: what the fitter's
// interpolation makes, without the fitter.
ResidualTable RandomTable(double size, double distance = 0.1) {
  const TableAxes axes{12, 5, 4, std::log(8.0), std::log(90.0)};
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0, size);
  std::array<std::vector<double>, ResidualTable::kChannels> channels;
  std::array<std::span<const double>, ResidualTable::kChannels> spans;
  for (int c = 0; c < ResidualTable::kChannels; ++c) {
    if (c == ResidualTable::kShare) continue;  // added to physics
    const ResidualTable::Parity parity = ResidualTable::ParityOf(c);
    const int n = axes.direction, m = axes.lateral + 3, row = axes.load + 3;
    channels[c].resize(ResidualTable::Size(axes));
    const auto at = [&](int i, int j, int k) -> double& {
      return channels[c][(i * m + j) * row + k];
    };
    for (int i = 0; i < n + 3; ++i) {
      for (int j = 0; j < m; ++j) {
        for (int k = 0; k < row; ++k) {
          // At the pole (last rows) all directions meet: nothing there.
          at(i, j, k) = j >= m - 4 ? 0 : normal(random);
          if (c == ResidualTable::kDistance) at(i, j, k) = distance * std::fabs(at(i, j, k)) / size;
        }
      }
    }
    for (int k = 0; k < row; ++k) {
      for (int i = 0; i < n + 3; ++i) {
        if (parity.y < 0) at(i, 1, k) = 0;
        at(i, 0, k) = parity.y * at(i, 2, k);
      }
      for (int j = 0; j < m; ++j) {
        for (int i = 0; i < 3; ++i) at(n + i, j, k) = parity.x * at(i, j, k);
      }
    }
    spans[c] = channels[c];
  }
  return ResidualTable(axes, spans);
}

TrainingDomain MakeHull() {
  TrainingDomain hull;
  hull.slip_min = -1;
  hull.slip_max = 0.9;
  hull.attack_angle_max_rad = kPi / 3;
  hull.load_min_n = 16;
  hull.load_max_n = 36;
  hull.froude_max = 0.1;
  return hull;
}

Uncertainty MakeUncertainty() {
  Uncertainty u;
  u.fit_inside.fill(0.3);
  u.fit_growth.fill(2.0);
  u.patch.fill(0.4);
  u.interval_factor.fill(1.8);
  u.bulldozing.fill(0.2);
  u.form_unknown = true;
  return u;
}

HybridModel MakeHybridModel(double size = 0.02, double distance = 0.1) {
  return {BekkerModel(BekkerParameters{}, {0.0625, 0.05}), RandomTable(size, distance), MakeHull(),
          MakeUncertainty()};
}

// Everything asked for but gradients, the context given.
struct Batch : StateBatch {
  explicit Batch(std::size_t n) : StateBatch(n, {kValue, kSdFit, kSdPatch, kLow, kHigh}) {
    for (std::size_t i = 0; i < n; ++i) Set(i, 0.1, 0, 0.1, 24);
    slope_pitch = slope_roll = yaw_rate = std::vector<double>(n, 0.0);
    pass_number.assign(n, 1);
    slip = attack_angle = part[kFx][kValue];
  }
};

TEST(ResidualTable, OneChannelIsThatOfTheWholeTable) {
  const TableAxes axes{5, 4, 3, std::log(8.0), std::log(90.0)};
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  std::array<std::vector<double>, ResidualTable::kChannels> channels;
  std::array<std::span<const double>, ResidualTable::kChannels> spans;
  for (int c = 1; c < ResidualTable::kChannels; ++c) {  // the first has none
    channels[c].resize(ResidualTable::Size(axes));
    for (double& x : channels[c]) x = unit(random);
    spans[c] = channels[c];
  }
  const ResidualTable table(axes, spans);
  for (int i = 0; i < 100; ++i) {
    const ChartPoint at{(unit(random) - 0.5) * kPi, unit(random) * kPi / 2};
    const double log_load = std::log(100 * unit(random));
    const auto whole = table.Evaluate(at, log_load);
    for (int c = 0; c < ResidualTable::kChannels; ++c) {
      EXPECT_EQ(ResidualTable::EvaluateChannel(axes, spans[c], at, log_load), whole[c]);
    }
  }
  const std::span<const double> cut = spans[1].first(spans[1].size() - 1);
  EXPECT_THROW(ResidualTable::EvaluateChannel(axes, cut, {}, 3), std::invalid_argument);
}

// A table that is everywhere the same, of even outputs alone, with a share.
HybridModel MakeShared(double share, const BekkerParameters& physics = {}) {
  const TableAxes axes{45, 18, 6, std::log(2.0), std::log(200.0)};
  std::array<std::vector<double>, ResidualTable::kChannels> channels;
  std::array<std::span<const double>, ResidualTable::kChannels> spans;
  const auto fill = [&](int channel, double value) {
    channels[channel].assign(ResidualTable::Size(axes), value);
    spans[channel] = channels[channel];
  };
  fill(kSinkage, 0.3);
  fill(ResidualTable::kShare, share);
  return {BekkerModel(physics, {0.0625, 0.05}), ResidualTable(axes, spans), MakeHull(),
          MakeUncertainty()};
}

TEST(Hybrid, ATableWithAShareLeavesTheRestToPhysics) {
  const HybridModel none = MakeShared(0), half = MakeShared(0.5), all = MakeShared(1);
  for (const double v_y : {0.0, 0.02, 0.08}) {
    const auto physics = none.physics().Solve(0.1, v_y, 0.12, 24).value;
    const auto added = none.EvaluateOne(0.1, v_y, 0.12, 24).value;
    const auto mixed = half.EvaluateOne(0.1, v_y, 0.12, 24).value;
    const auto table = all.EvaluateOne(0.1, v_y, 0.12, 24).value;
    for (int o = 0; o < kOutputs; ++o) {
      const double of_table = o == kSinkage ? 0.3 * 0.0625 : 0;
      EXPECT_NEAR(added[o], physics[o] + of_table, 1e-12);
      if (o == kFz) continue;
      EXPECT_NEAR(mixed[o], 0.5 * physics[o] + of_table, 1e-12);
      EXPECT_NEAR(table[o], of_table, 1e-12);
    }
    for (const auto& value : {added, mixed, table}) EXPECT_NEAR(value[kFz], 24, 1e-6);
  }
}

// Where physics find no sinkage that carries the load, and runs did.
TEST(Hybrid, ATableThatIsTheAnswerCarriesTheLoad) {
  for (const double share : {0.0, 1.0}) {
    HybridModel model = MakeShared(share);
    const double load = 20 * model.physics()
                                 .AtSinkage(ToCanonical(0.1, 0, 0.1), model.physics().max_sinkage())
                                 .value[kFz];
    ASSERT_TRUE(model.physics().Solve(0.1, 0, 0.1, load).no_equilibrium);
    const auto at = model.EvaluateOne(0.1, 0, 0.1, load);
    EXPECT_EQ((at.flags & kNoEquilibrium) == 0, share == 1);
    EXPECT_NEAR(at.value[kFz], share == 1 ? load : load / 20, 1e-6 * load);
  }
}

// Physics that hold most of the answer say whether the soil carries the load; runs do from about
// a half.
TEST(Hybrid, PhysicsThatAreMostOfTheAnswerKeepNoEquilibrium) {
  for (const double share : {0.1, 0.2, 0.3, 0.4, 0.75, 0.9}) {
    const HybridModel law = MakeShared(share);
    HybridModel table = MakeShared(share);
    table.Prepare();
    const double most =
        law.physics().AtSinkage(ToCanonical(0.1, 0, 0.1), law.physics().max_sinkage()).value[kFz];
    for (const double times : {1.05, 1.5, 4.0}) {
      const double load = times * most, carried = load * std::pow(times, share - 1);
      const auto at = law.EvaluateOne(0.1, 0, 0.1, load);
      const auto by_table = AnswerOf(table, {0.1, 0, 0.1}, load);
      const std::uint32_t want = share < 0.5 ? kNoEquilibrium | kClamped : 0u;
      EXPECT_EQ(at.flags & (kNoEquilibrium | kClamped), want) << share << " " << times;
      EXPECT_EQ(by_table.flags & (kNoEquilibrium | kClamped), want) << share << " " << times;
      EXPECT_NEAR(at.value[kFz], share < 0.5 ? carried : load, 1e-9 * load) << share;
      EXPECT_NEAR(by_table.value[kFz], at.value[kFz], 0.01 * load) << share << " " << times;
    }
  }
}

// A law whose shear presses the wheel down where it is locked deep in the soil carries nothing.
TEST(Hybrid, PhysicsThatCarryNothingGetFlagsAndNumbers) {
  BekkerParameters grips;
  grips.friction_angle = 1.3;
  grips.shear_modulus = 1e-4;
  for (const double share : {0.0, 0.2, 1.0}) {
    const HybridModel model = MakeShared(share, grips);
    const auto deep =
        model.physics().AtSinkage(ToCanonical(0.1, 0, -0.1), model.physics().max_sinkage());
    ASSERT_LE(deep.value[kFz], 0);
    const auto at = model.EvaluateOne(0.1, 0, -0.1, 24);
    EXPECT_EQ((at.flags & kNoEquilibrium) != 0, share < 0.5) << share;
    for (const double value : at.value) EXPECT_TRUE(std::isfinite(value)) << share;
  }
}

TEST(Hybrid, ItsFineTableIsThatOfAShare) {
  HybridModel model = MakeShared(0.5);
  const HybridModel law = MakeShared(0.5);
  model.Prepare();
  for (const double v_y : {0.0, 0.02, 0.08}) {
    for (const double load : {18.0, 24.0, 34.0}) {
      const auto want = law.EvaluateOne(0.1, v_y, 0.12, load);
      const auto got = AnswerOf(model, {0.1, v_y, 0.12}, load);
      for (int o = 0; o < kOutputs; ++o) {
        EXPECT_NEAR(got.value[o], want.value[o], 4e-3 * OutputScale(o, load, 0.0625));
      }
      EXPECT_EQ(got.flags, want.flags);
    }
  }
}

TEST(Hybrid, BadStatesGetNaNAndHarmNoOther) {
  const HybridModel model = MakeHybridModel();
  Batch b(12);
  b.v_x[1] = kNaN;
  b.v_y[2] = kInf;
  b.rim_speed[3] = -kInf;
  b.load[4] = -1e-300;
  b.load[5] = -24;
  b.load[6] = kNaN;
  b.slope_pitch[7] = kNaN;
  b.yaw_rate[8] = kInf;
  b.v_x[9] = b.v_y[9] = std::numeric_limits<double>::max();  // hypot overflows
  model.Evaluate(b.In(), b.Out());
  for (const std::size_t i : {1, 2, 3, 4, 5, 6, 7, 8, 9}) {
    EXPECT_EQ(b.flags[i], kInvalid) << i;
    for (const auto& output : b.part) {
      for (const auto& part : output) {
        if (!part.empty()) EXPECT_TRUE(std::isnan(part[i])) << i;
      }
    }
  }
  for (const std::size_t i : {0, 10, 11}) {
    EXPECT_EQ(b.flags[i], kFormUnknown) << i;
    for (int o = 0; o < kOutputs; ++o) {
      const auto& p = b.part[o];
      EXPECT_TRUE(std::isfinite(p[0][i]));
      EXPECT_LT(p[3][i], p[0][i]);
      EXPECT_GT(p[4][i], p[0][i]);
      EXPECT_EQ(p[0][i], b.part[o][0][0]);
    }
  }
}

// Inside the box, but no run near: said as well, and the interval is wider.
TEST(Hybrid, FarFromEveryRunIsExtrapolated) {
  const HybridModel near = MakeHybridModel(0.02, 0.1), far = MakeHybridModel(0.02, 1.0);
  const auto here = near.EvaluateOne(0.1, 0, 0.1, 24), there = far.EvaluateOne(0.1, 0, 0.1, 24);
  EXPECT_EQ(here.flags & kExtrapolated, 0u);
  EXPECT_NE(there.flags & kExtrapolated, 0u);
  EXPECT_GT(there.half_width[kFx], here.half_width[kFx]);
}

// Beyond the box the interval grows with the way beyond it.
TEST(Hybrid, IntervalsGrowBeyondTheBox) {
  const HybridModel model = MakeHybridModel(0.02, 0.0);
  double last = 0;
  for (const double load : {24.0, 60.0, 120.0, 240.0}) {
    const auto a = model.EvaluateOne(0.1, 0, 0.1, load);
    EXPECT_GT(a.half_width[kSinkage], last) << load;
    last = a.half_width[kSinkage];
  }
}

TEST(Hybrid, FlagsSayWhatTheModelDoesNotCover) {
  const HybridModel model = MakeHybridModel(0.001);
  Batch b(12);
  b.v_x[0] = b.rim_speed[0] = 0;    // static
  b.v_x[1] = 0.01, b.v_y[1] = 0.1;  // beyond 60 degrees
  b.load[2] = 50;                   // above the training loads
  b.load[3] = 5;
  b.v_x[4] = b.rim_speed[4] = 3;  // Froude number 14
  b.slope_pitch[5] = 0.1;
  b.pass_number[6] = 2;
  b.yaw_rate[7] = 0.2;
  b.load[8] = 1e5;                         // nothing carries this
  b.v_x[9] = 0.05, b.rim_speed[9] = -0.1;  // counter-rotating, rim the faster
  b.pass_number[10] = 0;                   // not given
  model.Evaluate(b.In(), b.Out());
  const auto has = [&](std::size_t i, Flag flag) { return (b.flags[i] & flag) != 0; };
  EXPECT_TRUE(has(0, kStatic));
  for (const Output o : {kFx, kFy, kTorque, kMz}) EXPECT_EQ(b.part[o][0][0], 0);
  EXPECT_NEAR(b.part[kFz][0][0], 24, 1e-5);
  EXPECT_GT(b.part[kSinkage][0][0], 0);
  EXPECT_TRUE(has(1, kExtrapolated));
  EXPECT_TRUE(has(2, kExtrapolated));
  EXPECT_TRUE(has(3, kExtrapolated));
  EXPECT_TRUE(has(4, kRate));
  EXPECT_TRUE(has(5, kSlope));
  EXPECT_TRUE(has(6, kVirginAssumed));
  EXPECT_TRUE(has(7, kClamped));
  EXPECT_TRUE(has(8, kNoEquilibrium));
  EXPECT_TRUE(has(9, kExtrapolated));
  EXPECT_EQ(b.flags[10], kFormUnknown);
  EXPECT_EQ(b.flags[11], kFormUnknown);
  for (const auto& output : b.part) {
    for (const auto& part : output) {
      for (std::size_t i = 0; i < part.size(); ++i) {
        const bool answered = i != 5 && i != 6;
        EXPECT_EQ(std::isfinite(part[i]), answered) << i;
      }
    }
  }
}

TEST(Hybrid, MirrorSymmetriesAreExactAndLateralOutputsVanishStraightAhead) {
  const HybridModel model = MakeHybridModel();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const double x = any(random), y = any(random), u = any(random), load = 24 + 8 * any(random);
    const auto a = model.EvaluateOne(x, y, u, load);
    const auto left = model.EvaluateOne(x, -y, u, load);
    const auto back = model.EvaluateOne(-x, y, -u, load);
    for (int o = 0; o < kOutputs; ++o) {
      const ResidualTable::Parity parity = ResidualTable::ParityOf(o);
      EXPECT_EQ(left.value[o], parity.y * a.value[o]);
      EXPECT_EQ(back.value[o], parity.x * a.value[o]);
      EXPECT_EQ(left.half_width[o], a.half_width[o]);
      EXPECT_EQ(back.half_width[o], a.half_width[o]);
    }
    const auto ahead = model.EvaluateOne(x, 0, u, load);
    EXPECT_EQ(ahead.value[kFy], 0);
    EXPECT_EQ(ahead.value[kMz], 0);
  }
  const auto sideways = model.EvaluateOne(0, 0.1, 0, 24);
  EXPECT_EQ(sideways.value[kFx], 0);
  EXPECT_EQ(sideways.value[kTorque], 0);
}

TEST(Hybrid, IsContinuousEverywhereButAtRest) {
  const HybridModel model = MakeHybridModel();
  const auto jump = [&](int steps, int path) {
    double largest = 0;
    HybridModel::Answer last{};
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps, a = 2 * kPi * t;
      double v[3] = {0, 0, 0}, load = 24;
      if (path == 0) v[0] = std::cos(a), v[2] = std::sin(a);
      if (path == 1) v[0] = std::cos(a), v[1] = std::sin(a), v[2] = 0.5;
      if (path == 2) v[1] = std::cos(a), v[2] = std::sin(a);
      if (path == 3) v[0] = std::cos(a), v[1] = std::sin(a);
      if (path == 4) v[0] = 1, v[1] = 0.3, v[2] = 0.8, load = 2 * std::pow(75.0, t);
      const auto now = model.EvaluateOne(v[0], v[1], v[2], load);
      for (int o = 0; o < kOutputs && i > 0; ++o) {
        const double scale = o == kSinkage ? 0.0625 : o == kTorque || o == kMz ? 1.5 : 24;
        largest = std::max(largest, std::fabs(now.value[o] - last.value[o]) / scale);
        largest = std::max(largest, 0.1 * std::fabs(now.half_width[o] - last.half_width[o]));
      }
      last = now;
    }
    return largest;
  };
  for (int path = 0; path < 5; ++path) {
    const double coarse = jump(4000, path), fine = jump(8000, path);
    EXPECT_LT(fine, 0.03) << path;
    EXPECT_LT(fine, 0.6 * coarse) << path;
  }
}

TEST(Hybrid, EvaluationAllocatesNothing) {
  const HybridModel model = MakeHybridModel();
  Batch b(256);
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> any(-1, 1);
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    b.v_x[i] = any(random);
    b.v_y[i] = any(random);
    b.rim_speed[i] = any(random);
    b.load[i] = i % 17 == 0 ? -1 : 24;
  }
  const WheelStatesView in = b.In();
  const ResponsesView out = b.Out();
  const long before = g_allocations;
  model.Evaluate(in, out);
  EXPECT_EQ(g_allocations - before, 0);
  const auto probe = std::make_unique<int>(1);  // the counter does count
  EXPECT_GT(g_allocations - before, 0);
}

TEST(Hybrid, EmptySpansAreNotWritten) {
  const HybridModel model = MakeHybridModel();
  StateBatch b(1, {});
  b.Set(0, 0.1, 0, 0.1, 24);
  b.part[kFx][kValue] = {0};
  model.Evaluate(b.In(), b.Out());
  EXPECT_EQ(b.part[kFx][kValue][0], model.EvaluateOne(0.1, 0, 0.1, 24).value[kFx]);
}

TEST(Hybrid, PrintsItsSpeed) {  // a figure for the log, no limit
  const HybridModel model = MakeHybridModel();
  Batch b(10000);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> any(-1, 1);
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    b.v_x[i] = std::fabs(any(random));
    b.v_y[i] = any(random);
    b.rim_speed[i] = std::fabs(any(random));
  }
  const std::clock_t start = std::clock();
  model.Evaluate(b.In(), b.Out());
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::printf("hybrid: %.0f ns of processor time per state, batch 10000\n", seconds * 1e5);
  EXPECT_EQ(std::count(b.flags.begin(), b.flags.end(), ~std::uint32_t{0}), 0);
}

TEST(ResidualTable, InterpolatesItsNodesAndFadesSmoothly) {
  // A spline with all coefficients 1 is 1 everywhere (partition of unity).
  const TableAxes axes{6, 4, 3, 0, 2};
  const std::vector<double> ones(ResidualTable::Size(axes), 1.0);
  std::array<std::span<const double>, ResidualTable::kChannels> channels;
  channels[kSinkage] = ones;
  const ResidualTable table(axes, channels);
  for (double d = -kPi / 2; d <= kPi / 2; d += 0.1) {
    for (double l = 0; l <= kPi / 2; l += 0.1) {
      for (double load = -1; load < 3; load += 0.3) {
        const auto value = table.Evaluate({d, l}, load);
        EXPECT_NEAR(value[kSinkage], 1, 1e-12);
        EXPECT_EQ(value[kFx], 0);
      }
    }
  }
}

TEST(ResidualTable, RefusesBadSizesAndNumbers) {
  const TableAxes axes{6, 4, 3, 0, 2};
  std::vector<double> values(ResidualTable::Size(axes) - 1, 1.0);
  std::array<std::span<const double>, ResidualTable::kChannels> channels;
  channels[kFx] = values;
  EXPECT_THROW(ResidualTable(axes, channels), std::invalid_argument);
  values.push_back(kNaN);
  channels[kFx] = values;
  EXPECT_THROW(ResidualTable(axes, channels), std::invalid_argument);
  channels[kFx] = {};
  EXPECT_THROW(ResidualTable({0, 4, 3, 0, 2}, channels), std::invalid_argument);
  EXPECT_THROW(ResidualTable({6, 4, 3, 2, 2}, channels), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::surrogate

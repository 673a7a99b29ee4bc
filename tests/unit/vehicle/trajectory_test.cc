// Powers of many motions and costs of trajectories: those of single motions, bit for bit.
#include "surrogate/vehicle/trajectory.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "surrogate/vehicle/fields.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::Asphalt;
using testing::Cart;
using testing::OnHard;
using testing::Rover;
using testing::Skid;
using testing::WithFriction;

constexpr double kSds = 1.6448536269514722;

std::uint64_t Bits(double value) { return std::bit_cast<std::uint64_t>(value); }

surrogate::HardGround Spread(double friction) {
  surrogate::HardGround ground = WithFriction(friction);
  ground.friction_sd = 0.2 * friction;
  ground.rolling_resistance_sd = 0.004;
  return ground;
}

/// Good and bad ones: of every kind that a planner samples, at rest, too steep, no numbers.
std::vector<Motion> Motions(std::size_t n, std::size_t soils) {
  std::mt19937 random(5);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Motion> motions(n);
  for (std::size_t i = 0; i < n; ++i) {
    Motion& m = motions[i];
    m.v_x_m_per_s = i % 17 == 3 ? 0 : draw(-0.5, 1.5);
    m.yaw_rate_rad_per_s = i % 5 == 0 ? 0 : draw(-0.8, 0.8);
    m.acceleration_m_per_s2 = draw(-0.5, 0.5);
    m.grade_rad = i % 11 == 7 ? 0.7 : draw(-0.2, 0.2);
    m.bank_rad = draw(-0.1, 0.1);
    m.worse_by_sd = i % 7 == 2 ? 0.5 : 0;
    m.soil.fill(static_cast<std::uint8_t>(random() % soils));
    if (i % 29 == 20) m.v_x_m_per_s = NAN;
    if (i % 31 == 9) m.soil.fill(static_cast<std::uint8_t>(soils));  // there is none
  }
  return motions;
}

std::string WhatDiffers(const PowerInterval& a, const PowerInterval& b) {
  std::string fields;
  const auto look = [&](const std::string& name, double x, double y) {
    if (Bits(x) != Bits(y)) fields += " " + name;
  };
  for (const auto& f : kPowerFields) look(f.name, a.mean.*f.member, b.mean.*f.member);
  for (const auto& f : kIntervalFields) look(f.name, a.*f.member, b.*f.member);
  for (const auto& f : kSolutionFields) {
    look(f.name, a.solution.*f.member, b.solution.*f.member);
  }
  if (a.solution.reasons != b.solution.reasons) fields += " reasons";
  if (a.solution.balanced != b.solution.balanced) fields += " balanced";
  return fields;
}

TEST(PowerBatch, IsThatOfEachMotionBitForBit) {
  for (const Vehicle& v : {Skid(), Cart(), Rover()}) {
    OnHard on(v, {Spread(0.8), Spread(0.15)});
    OnHard other(v, {Spread(0.8), Spread(0.15)});
    const std::vector<Motion> motions = Motions(200, 2);
    PowerBatch batch(on.solver.get());
    ASSERT_EQ(batch.MostAt(kSds), PowerBatch::kMost);
    ASSERT_EQ(batch.MostAt(0), PowerBatch::kMostMeans);
    std::size_t balanced = 0, ends = 0;
    for (const double sds : {kSds, 0.0}) {
      for (std::size_t first = 0; first < motions.size(); first += batch.MostAt(sds)) {
        const auto some =
            std::span(motions).subspan(first, std::min(batch.MostAt(sds), motions.size() - first));
        const auto powers = batch.Of(some, sds, {});
        ASSERT_EQ(powers.size(), some.size());
        for (std::size_t i = 0; i < some.size(); ++i) {
          const PowerInterval alone = PowerOf(other.solver.get(), some[i], sds);
          ASSERT_EQ(WhatDiffers(powers[i], alone), "") << v.name << " " << first + i << " " << sds;
          balanced += alone.solution.balanced;
          ends += alone.solution.balanced && std::isnan(alone.electric_low);
        }
      }
    }
    EXPECT_GT(balanced, 150u) << v.name;
    EXPECT_LT(balanced, 390u) << v.name;
    EXPECT_GT(ends, 0u) << v.name << ": some have no balance on worse ground";
  }
}

TEST(PowerBatch, HasTheRoomThatIsAskedFor) {
  OnHard on(Skid());
  EXPECT_EQ(PowerBatch(on.solver.get(), 3).MostAt(kSds), 3u);
  EXPECT_EQ(PowerBatch(on.solver.get(), 3000).MostAt(kSds), PowerBatch::kMost);
  const Motion motion = Motion::OnPath(0.5, 0.2);
  PowerBatch one(on.solver.get(), 1);
  EXPECT_EQ(WhatDiffers(one.Of({&motion, 1}, kSds, {})[0], PowerOf(on.solver.get(), motion, kSds)),
            "");
}

TEST(Trajectories, AreSumsOverTheirStepsAndLeastMargins) {
  Vehicle v = Skid();
  for (Drive& d : v.drives) d.motor.torque_limit_n_m = 40;
  OnHard on(v, {Spread(0.8), Spread(0.15)});
  const std::vector<Motion> motions = Motions(150, 2);
  const std::vector<std::size_t> steps = {1, 40, 7, 21, 80, 1};
  const auto lasts = [](std::size_t i) { return 0.1 + 0.01 * static_cast<double>(i % 13); };
  std::size_t next = 0;
  std::vector<PowerInterval> told;
  TrajectoryEvaluator evaluator(on.solver.get());
  const auto costs = evaluator.CostsOf(
      steps,
      [&] {
        return TrajectoryStep{motions[next], lasts(next++)};
      },
      kSds, {}, [&](const PowerInterval& p) { told.push_back(p); });
  ASSERT_EQ(costs.size(), steps.size());
  ASSERT_EQ(next, 150u);
  ASSERT_EQ(told.size(), 150u);
  std::size_t i = 0, without = 0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    double joules = 0, high = 0, seconds = 0;
    double least = INFINITY;
    std::uint32_t reasons = 0, of = 0;
    int first = -1, at = -1;
    std::size_t left_out = 0;
    for (int j = 0; j < static_cast<int>(steps[k]); ++j, ++i) {
      const PowerInterval p = PowerOf(on.solver.get(), motions[i], kSds);
      ASSERT_EQ(WhatDiffers(p, told[i]), "") << i;
      const Solution& s = p.solution;
      reasons |= s.reasons;
      if (s.reasons != 0 && first < 0) first = j;
      seconds += lasts(i);
      const double margin = std::min({s.tip_margin, s.torque_margin, s.sinkage_margin});
      if (s.balanced && margin < least) {
        least = margin;
        at = j;
        of = margin == s.tip_margin      ? std::uint32_t{kTips}
             : margin == s.torque_margin ? std::uint32_t{kOverTorque}
                                         : std::uint32_t{kSinksIn};
      }
      if (!s.balanced || std::isnan(p.electric_high)) {
        ++left_out;
        continue;
      }
      joules += p.mean.electric * lasts(i);
      high += p.electric_high * lasts(i);
    }
    const TrajectoryCost& c = costs[k];
    EXPECT_EQ(c.energy.joules, joules) << k;
    EXPECT_EQ(c.energy.high, high) << k;
    EXPECT_EQ(c.energy.left_out, left_out) << k;
    EXPECT_EQ(c.duration_s, seconds) << k;
    EXPECT_EQ(c.reasons, reasons) << k;
    EXPECT_EQ(c.first_step, first) << k;
    EXPECT_EQ(c.least_margin_step, at) << k;
    EXPECT_EQ(c.least_margin_of, of) << k;
    EXPECT_TRUE(at >= 0 ? c.least_margin == least : std::isnan(c.least_margin)) << k;
    without += left_out;
  }
  EXPECT_GT(without, 0u);
}

// A vehicle that rolls freely goes its way all the same.
TEST(Trajectories, TheWayCountsWhereNoPowerIsTaken) {
  surrogate::HardGround ground = WithFriction(0.8);
  ground.rolling_resistance = 0;
  OnHard on(Skid(), {ground});
  const TrajectoryStep level{Motion::OnPath(0.5, 0), 3};
  const std::size_t one = 1;
  const TrajectoryCost c = TrajectoryEvaluator(on.solver.get())
                               .CostsOf(
                                   {&one, 1}, [&] { return level; }, kSds)
                               .front();
  ASSERT_EQ(c.energy.joules, 0);
  EXPECT_EQ(c.energy.left_out, 0u);
  EXPECT_NEAR(c.energy.metres, 1.5, 1e-9);
}

// What a client does with a drive that is too long for one call.
TEST(Trajectories, CostsOfSingleStepsAddUpToTheBitsOfTheWhole) {
  OnHard on(Skid(), {Spread(0.8), Spread(0.15)});
  const std::vector<Motion> motions = Motions(150, 2);
  const auto at = [&](std::size_t i) {
    return TrajectoryStep{motions[i], 0.1 + 0.01 * static_cast<double>(i % 13)};
  };
  TrajectoryEvaluator evaluator(on.solver.get());
  const std::size_t all = motions.size();
  std::size_t next = 0;
  const TrajectoryCost whole = evaluator
                                   .CostsOf(
                                       {&all, 1}, [&] { return at(next++); }, kSds)
                                   .front();
  next = 0;
  TrajectoryCost sum;
  const std::vector<std::size_t> ones(all, 1);
  int step = 0;
  for (const auto& c : evaluator.CostsOf(
           ones, [&] { return at(next++); }, kSds))
    sum.Add(step++, c);
  EXPECT_EQ(sum.duration_s, whole.duration_s);
  EXPECT_EQ(sum.energy.joules, whole.energy.joules);
  EXPECT_EQ(sum.energy.low, whole.energy.low);
  EXPECT_EQ(sum.energy.high, whole.energy.high);
  EXPECT_EQ(sum.energy.seconds, whole.energy.seconds);
  EXPECT_EQ(sum.energy.metres, whole.energy.metres);
  EXPECT_EQ(sum.energy.left_out, whole.energy.left_out);
  EXPECT_EQ(sum.energy.left_out_s, whole.energy.left_out_s);
  EXPECT_EQ(sum.reasons, whole.reasons);
  EXPECT_EQ(sum.first_step, whole.first_step);
  EXPECT_EQ(sum.first_reasons, whole.first_reasons);
  EXPECT_EQ(sum.least_margin, whole.least_margin);
  EXPECT_EQ(sum.least_margin_of, whole.least_margin_of);
  EXPECT_EQ(sum.least_margin_step, whole.least_margin_step);
  EXPECT_GT(whole.energy.left_out, 0u);
  EXPECT_GT(whole.least_margin_step, 0);
}

TEST(Trajectories, OneThatNothingBalancesHasNoMargin) {
  OnHard on(Skid(), {WithFriction(0.1)});
  TrajectoryStep step{Motion::OnPath(0.5, 0), 2};
  step.motion.grade_rad = 0.5;
  const std::size_t one = 1;
  const TrajectoryCost c = TrajectoryEvaluator(on.solver.get())
                               .CostsOf(
                                   {&one, 1}, [&] { return step; }, kSds)
                               .front();
  EXPECT_EQ(c.reasons, std::uint32_t{kNoBalance});
  EXPECT_EQ(c.first_step, 0);
  EXPECT_EQ(c.first_reasons, std::uint32_t{kNoBalance});
  EXPECT_TRUE(std::isnan(c.least_margin));
  EXPECT_EQ(c.least_margin_of, 0u);
  EXPECT_EQ(c.least_margin_step, -1);
  EXPECT_EQ(c.energy.left_out, 1u);
  EXPECT_EQ(c.energy.left_out_s, 2);
  EXPECT_EQ(c.energy.joules, 0);
  EXPECT_EQ(c.duration_s, 2);
}

}  // namespace
}  // namespace grouser::vehicle

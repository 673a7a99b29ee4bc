// Work that takes long ends within a bounded number of solves once it is told to.
#include "surrogate/vehicle/stop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/trajectory.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::Skid;
using testing::WithFriction;

/// Hard ground that counts the wheels it is asked for, and sets a flag at one of them.
class CountingModel final : public surrogate::WheelModel {
 public:
  explicit CountingModel(double friction) : model_(WithFriction(friction), 0.165) {}

  void Evaluate(const surrogate::WheelStatesView& in,
                const surrogate::ResponsesView& out) const noexcept override {
    count_ += static_cast<long>(in.load.size());
    if (stop_at > 0 && count_ >= stop_at) stop = true;
    model_.Evaluate(in, out);
  }
  bool UsesYawRate() const noexcept override { return true; }

  /// Counts `work` anew, with the flag set at wheel `at` (0: never). False: it was stopped.
  template <class Work>
  bool Run(long at, const Work& work) {
    count_ = 0;
    stop = false;
    stop_at = at;
    try {
      work();
    } catch (const Stopped&) {
      return false;
    }
    return true;
  }
  long count() const { return count_; }

  mutable std::atomic<bool> stop{false};
  long stop_at = 0;

 private:
  surrogate::HardGroundModel model_;
  mutable long count_ = 0;
};

// Most wheels that a solve asks for: every evaluation of every start, and the last one.
constexpr long kWheelsOfASolve = 4 * (4 * 40 + 1);

class StopTest : public ::testing::Test {
 protected:
  StopTest() : grounds_{{"ground"}, {&model_}} {
    options_.speed_limit_m_per_s = 4;
    options_.stop = StopWhen(&model_.stop);
  }

  // `work` ends as soon as it should, wherever it is told to.
  template <class Work>
  void EndsSoon(const Work& work, std::size_t solves) {
    ASSERT_TRUE(model_.Run(0, work));
    const long all = model_.count(), most = static_cast<long>(solves) * kWheelsOfASolve;
    for (const double share : {0.001, 0.2, 0.4, 0.6, 0.8, 0.95}) {
      const long at = 1 + static_cast<long>(share * static_cast<double>(all));
      EXPECT_FALSE(model_.Run(at, work)) << share;
      EXPECT_LE(model_.count(), at + most) << share << " of " << all;
    }
  }

  CountingModel model_{0.4};
  Grounds grounds_;
  SpeedOptions options_;
};

// Every point unlike the one before.
TEST_F(StopTest, PlanEndsAndLeavesThePlannerAsGoodAsNew) {
  std::vector<PathPoint> path(400);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double x = static_cast<double>(i);
    path[i] = {0.1 * x, std::sin(7 * x * x), 0.4 * std::sin(3 * x * x), 0.4 * std::cos(5 * x * x),
               0};
  }
  SpeedPlanner planner(Skid(), grounds_, path.size());
  std::vector<SpeedPoint> before(path.size()), after(path.size());
  planner.Plan(path, options_, before);
  EndsSoon([&] { planner.Plan(path, options_, after); }, SpeedPlanner::kMostSolvesToStop);
  EXPECT_GT(model_.count(), 0);
  model_.Run(0, [&] { planner.Plan(path, options_, after); });
  EXPECT_GT(model_.count(), 2 * static_cast<long>(SpeedPlanner::kMostSolvesToStop) *
                                kWheelsOfASolve);  // else a plan that cannot be stopped would pass
  for (std::size_t i = 0; i < path.size(); ++i) {
    ASSERT_EQ(before[i].speed_m_per_s, after[i].speed_m_per_s) << i;
    ASSERT_EQ(before[i].shortfall, after[i].shortfall) << i;
  }
}

TEST_F(StopTest, GradesProbabilityAndConstantsEnd) {
  SpeedPlanner planner(Skid(), grounds_, 1);
  EndsSoon([&] { planner.Grades(0.3, 0, options_); }, 1);
  Motion motion = Motion::OnPath(0.3, 0.2);
  motion.grade_rad = 0.2;
  EndsSoon([&] { planner.ProbabilityToGo(motion, options_); }, 1);
  const auto draws = std::make_shared<const GroundDraws>(grounds_, 400);
  planner.UseDraws(draws);
  EndsSoon([&] { planner.ProbabilityByDraws(motion, options_); }, SpeedPlanner::kMostSolvesToStop);
  std::vector<std::uint8_t> least(400, 1), most(400, 1);
  EndsSoon(
      [&] {
        std::fill(most.begin(), most.end(), 1);
        planner.KeepGoing(motion, options_, least, most);
      },
      SpeedPlanner::kMostSolvesToStop);
  std::vector<PathPoint> path(150);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].s_m = 0.1 * static_cast<double>(i);
  const std::vector<SpeedPoint> plan(path.size(), {.speed_m_per_s = 0.4});
  SpeedPlanner along(Skid(), grounds_, path.size());
  along.UseDraws(draws);
  EndsSoon([&] { along.PlanByDraws(path, options_, plan, {}); }, SpeedPlanner::kMostSolvesToStop);
  const std::vector<double> speeds = {0.3, 0.5, 0.9}, radii = {0.8, 2, 9};
  EndsSoon([&] { ConstantsOf(Skid(), grounds_, speeds, radii, StopWhen(&model_.stop)); }, 3);
}

TEST(StopWhen, IsAFlagOrTheTimeOfTheThread) {
  using std::chrono::milliseconds;
  std::atomic<bool> flag{false};
  EXPECT_NO_THROW(StopIfAsked({}));
  EXPECT_NO_THROW(StopIfAsked(StopWhen(&flag)));
  const StopWhen now(&flag, milliseconds(0)), later(&flag, milliseconds(20));
  EXPECT_THROW(StopIfAsked(now), OutOfTime);
  flag = true;
  EXPECT_THROW(StopIfAsked(StopWhen(&flag)), Stopped);
  flag = false;
  std::this_thread::sleep_for(milliseconds(40));
  EXPECT_NO_THROW(StopIfAsked(later)) << "the thread has done nothing";
  const auto from = ThreadTime();
  while (ThreadTime() < from + milliseconds(20)) continue;
  EXPECT_THROW(StopIfAsked(later), OutOfTime);
}

// Once no draw is left a trajectory's further steps cost nothing.
TEST_F(StopTest, NothingIsSolvedWhereNoDrawIsLeft) {
  SpeedPlanner planner(Skid(), grounds_, 1);
  planner.UseDraws(std::make_shared<const GroundDraws>(grounds_, 20));
  std::vector<Motion> motions(200, Motion::OnPath(0.3, 0.2));
  motions[20].grade_rad = 1.2;  // on no ground
  std::vector<std::uint8_t> least, most;
  const auto wheels_of = [&](std::size_t steps) {
    least.assign(20, 1);
    most.assign(20, 1);
    model_.Run(0,
               [&] { planner.KeepGoing(std::span(motions).first(steps), options_, least, most); });
    return model_.count();
  };
  wheels_of(20);
  EXPECT_GT(std::count(most.begin(), most.end(), 1), 0);
  const long with_the_steep_one = wheels_of(32);  // their means are solved side by side
  EXPECT_EQ(std::count(most.begin(), most.end(), 1), 0);
  EXPECT_EQ(wheels_of(200), with_the_steep_one);
  // Together as one after the other.
  motions[20].grade_rad = 0;
  motions[7].grade_rad = 0.3;
  wheels_of(30);
  std::vector<std::uint8_t> one_by_one(20, 1), same(20, 1);
  for (std::size_t i = 0; i < 30; ++i) planner.KeepGoing(motions[i], options_, one_by_one, same);
  EXPECT_EQ(least, one_by_one);
  EXPECT_EQ(most, same);
}

TEST_F(StopTest, TrajectoriesEndAndLeaveTheSolverAsGoodAsNew) {
  Solver solver(Skid(), grounds_);
  TrajectoryEvaluator evaluator(&solver);
  const std::vector<std::size_t> steps = {150, 1, 249};
  std::vector<TrajectoryCost> costs;
  const auto work = [&] {
    double x = 0;
    costs = evaluator.CostsOf(
        steps,
        [&x] {
          x += 1;
          Motion m = Motion::OnPath(0.5, std::sin(7 * x * x));
          m.grade_rad = 0.4 * std::sin(3 * x * x);
          return TrajectoryStep{m, 0.1};
        },
        1, StopWhen(&model_.stop));
  };
  work();
  const std::vector<TrajectoryCost> before = costs;
  EndsSoon(work, SpeedPlanner::kMostSolvesToStop);
  model_.Run(0, work);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    EXPECT_EQ(before[k].energy.joules, costs[k].energy.joules);
    EXPECT_EQ(before[k].reasons, costs[k].reasons);
  }
}

}  // namespace
}  // namespace grouser::vehicle

// Vehicles on coherent draws of their ground, against grounds that are those draws.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using surrogate::kOutputs, surrogate::kTwoSided90;
using testing::Asphalt;
using testing::Skid;

constexpr double kSd = 0.06;  // of forces over load, moments over load and 0.165 m

/// Asphalt that errs from state to state.
class Uncertain : public surrogate::WheelModel {
 public:
  void Evaluate(const surrogate::WheelStatesView& in,
                const surrogate::ResponsesView& out) const noexcept override {
    model_.Evaluate(in, out);
    for (int o = 0; o < kOutputs; ++o) {
      const std::span<double> high = out.output[o].high, value = out.output[o].value;
      for (std::size_t i = 0; i < high.size(); ++i) {
        const double unit = surrogate::OutputScale(o, in.load[i], 0.165);
        high[i] = value[i] + (o == surrogate::kSinkage ? 0 : kTwoSided90 * kSd * unit);
      }
    }
  }
  bool UsesYawRate() const noexcept override { return true; }
  surrogate::ErrorForm Errors() const noexcept override {
    return {.of_physics = true, .friction_radius_m = 0};
  }

 private:
  surrogate::HardGroundModel model_{Asphalt(), 0.165};
};

/// One draw of it as a ground of its own, by the scalar reference, with gradients by differences.
class Drawn final : public Uncertain {
 public:
  explicit Drawn(const surrogate::draws::Member& member) : member_(member) {}
  void Evaluate(const surrogate::WheelStatesView& in,
                const surrogate::ResponsesView& out) const noexcept override {
    Uncertain::Evaluate(in, out);
    for (std::size_t i = 0; i < in.load.size(); ++i) {
      const std::array<double, 4> at = {in.v_x[i], in.v_y[i], in.rim_speed[i], in.load[i]};
      for (int o = 0; o < kOutputs; ++o) {
        const surrogate::OutputView& to = out.output[o];
        if (o == surrogate::kSinkage || o == surrogate::kFz || to.value.empty()) continue;
        to.value[i] += ErrorAt(o, at);
        const std::span<double> by[4] = {to.d_v_x, to.d_v_y, to.d_rim_speed, to.d_load};
        for (std::size_t a = 0; a < 4; ++a) {
          if (by[a].empty()) continue;
          const double step = 1e-6 * (a == 3 ? at[3] : 1);
          std::array<double, 4> up = at, down = at;
          up[a] += step;
          down[a] -= step;
          by[a][i] += (ErrorAt(o, up) - ErrorAt(o, down)) / (2 * step);
        }
      }
    }
  }

 private:
  double ErrorAt(int o, const std::array<double, 4>& at) const {
    if (!(at[3] > 0)) return 0;
    return kSd * surrogate::OutputScale(o, at[3], 0.165) *
           surrogate::UnitErrorOf(Errors(), member_, o, at[0], at[1], at[2], at[3]);
  }
  const surrogate::draws::Member& member_;
};

/// A skid-steered vehicle on `soils` grounds of that kind, with draws.
struct OnDraws {
  explicit OnDraws(std::size_t count, std::size_t soils = 1,
                   double torque_limit = std::numeric_limits<double>::infinity()) {
    for (Drive& drive : vehicle.drives) drive.motor.torque_limit_n_m = torque_limit;
    for (std::size_t s = 0; s < soils; ++s) {
      grounds.soils.push_back("soil " + std::to_string(s));
      grounds.models.push_back(&model);
    }
    draws = std::make_shared<const GroundDraws>(grounds, count);
    planner = std::make_unique<SpeedPlanner>(vehicle, grounds, 60);
    planner->UseDraws(draws);
    limits.tip_margin = 0;
    limits.speed_limit_m_per_s = 2;
  }
  /// On draw k of the first soil, by a solver that knows of no draws, from all starts.
  Solution BruteForce(Motion motion, std::size_t k) const {
    const Drawn ground(draws->of_soil[0][k]);
    motion.draw = Motion::kMeanGround;
    Solution s;
    Solver(vehicle, {{"ground"}, {&ground}}).Solve({&motion, 1}, {&s, 1});
    return s;
  }

  Vehicle vehicle = Skid();
  Uncertain model;
  Grounds grounds;
  std::shared_ptr<const GroundDraws> draws;
  std::unique_ptr<SpeedPlanner> planner;
  SpeedOptions limits;
};

Motion Climb(double grade, double curvature = 0) {
  Motion m = Motion::OnPath(0.5, curvature);
  m.grade_rad = grade;
  return m;
}

TEST(VehicleDraws, ASolveOnADrawIsThatOfItsGround) {
  const OnDraws on(20);
  Solver solver(on.vehicle, on.grounds);
  solver.UseDraws(on.draws);
  for (const double curvature : {0.0, 0.6}) {
    std::vector<Motion> motions(20, Climb(0.2, curvature));
    for (std::size_t k = 0; k < motions.size(); ++k) motions[k].draw = static_cast<int>(k);
    std::vector<Solution> out(motions.size());
    solver.Solve(motions, out, Effort{.goal = 1e-9});
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const Solution exact = on.BruteForce(motions[k], k);
      ASSERT_TRUE(out[k].balanced) << k << " " << out[k].residual;
      ASSERT_TRUE(exact.balanced) << k;
      for (std::size_t d = 0; d < 2; ++d) {
        EXPECT_NEAR(out[k].rim_speed_m_per_s[d], exact.rim_speed_m_per_s[d], 1e-5) << k;
      }
      EXPECT_NEAR(out[k].v_y_m_per_s, exact.v_y_m_per_s, 1e-5) << k;
      EXPECT_NEAR(out[k].shaft_power_w, exact.shaft_power_w, 1e-2) << k;
      // Alone, the same bits.
      Solution alone;
      solver.Solve({&motions[k], 1}, {&alone, 1}, Effort{.goal = 1e-9});
      EXPECT_EQ(alone.shaft_power_w, out[k].shaft_power_w);
      EXPECT_EQ(alone.v_y_m_per_s, out[k].v_y_m_per_s);
    }
    EXPECT_GT(std::fabs(out[0].shaft_power_w - out[1].shaft_power_w), 0.1);
  }
}

/// Largest torque of a side's motor on the mean ground.
double TorqueOn(const OnDraws& on, const Motion& motion) {
  Solution s;
  Solver(on.vehicle, on.grounds).Solve({&motion, 1}, {&s, 1});
  return std::max(s.wheel[0].torque_n_m + s.wheel[2].torque_n_m,
                  s.wheel[1].torque_n_m + s.wheel[3].torque_n_m);
}

TEST(VehicleDraws, ProbabilityIsTheShareOfGroundsThatAreStood) {
  const double torque = TorqueOn(OnDraws(1), Climb(0.3));
  for (const double limit : {torque - 1, torque + 1, torque + 3}) {
    const OnDraws on(60, 1, limit);
    const Motion motion = Climb(0.3);
    std::size_t goes = 0;
    for (std::size_t k = 0; k < 60; ++k) {
      const Solution s = on.BruteForce(motion, k);
      goes += s.balanced && s.reasons == 0;
    }
    const GoProbability go = on.planner->ProbabilityByDraws(motion, on.limits);
    EXPECT_EQ(go.least, static_cast<double>(goes) / 60);
    EXPECT_EQ(go.most, go.least);
    EXPECT_GT(go.least, 0.05);
    EXPECT_LT(go.least, 0.99);
    const GoProbability again = on.planner->ProbabilityByDraws(motion, on.limits);
    EXPECT_EQ(again.least, go.least);
  }
}

// Errors that every wheel has for itself average out: grounds of one kind and four names.
TEST(VehicleDraws, WheelsOfOneSoilShareTheirErrors) {
  const double torque = TorqueOn(OnDraws(1), Climb(0.3));
  const OnDraws on(1000, 4, torque + 3.2 * kSd * 0.165 * 60 * 9.81 / 2);
  Motion shared = Climb(0.3), apart = shared;
  for (std::uint8_t i = 0; i < 4; ++i) apart.soil[i] = i;
  const double risk = 1 - on.planner->ProbabilityByDraws(shared, on.limits).least;
  const double of_apart = 1 - on.planner->ProbabilityByDraws(apart, on.limits).least;
  EXPECT_GT(risk, 0.01);
  EXPECT_LT(of_apart, risk / 2);
}

// Not draw by draw (what breaks the symmetry of the ground is not mirrored), but over the
// draws: 4.5 standard errors of the difference of two shares.
TEST(VehicleDraws, TurnsToTheLeftAreThoseToTheRight) {
  const OnDraws on(400);
  const double left = on.planner->ProbabilityByDraws(Climb(0.6, 0.4), on.limits).least;
  const double right = on.planner->ProbabilityByDraws(Climb(0.6, -0.4), on.limits).least;
  EXPECT_GT(left, 0.05);
  EXPECT_LT(left, 0.95);
  EXPECT_NEAR(left, right, 4.5 * std::sqrt(2 * left * (1 - left) / 400));
}

TEST(VehicleDraws, APathIsDrivenOnOneDraw) {
  // What motors can: of grip, a fold, no solver finds every balance.
  const OnDraws on(100, 1, TorqueOn(OnDraws(1), Climb(0.35, 0.2)) + 1);
  std::vector<PathPoint> path(20);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i] = {0.5 * static_cast<double>(i), 0.2, i < 10 ? 0.33 : 0.35, 0, 0};
  }
  std::vector<SpeedPoint> plan(path.size());
  for (SpeedPoint& p : plan) p.safe_m_per_s = p.speed_m_per_s = 0.5;
  std::vector<double> by_point(path.size());
  const double holds = on.planner->PlanByDraws(path, on.limits, plan, by_point);
  EXPECT_EQ(holds, on.planner->PlanByDraws(path, on.limits, plan, {}));
  // Points alike hold on the same draws; all hold where the worst does.
  EXPECT_EQ(by_point[0], by_point[9]);
  EXPECT_EQ(by_point[10], by_point[19]);
  EXPECT_LT(by_point[10], by_point[0]);
  EXPECT_EQ(holds, by_point[10]);
  EXPECT_GT(holds, 0.3);
  EXPECT_LT(holds, 0.99);
  std::size_t good = 0;
  for (std::size_t k = 0; k < 100; ++k) {
    Motion m = Motion::OnPath(0.5, 0.2);
    m.grade_rad = 0.35;
    const Solution s = on.BruteForce(m, k);
    good += s.balanced && s.reasons == 0;
  }
  EXPECT_EQ(by_point[10], static_cast<double>(good) / 100);
}

// What Plan says does not hold holds on no draw: a start that is too fast, no safe speed, rest.
TEST(VehicleDraws, APlanIsJudgedAsPlanDoes) {
  const OnDraws on(20);
  std::vector<PathPoint> path(5);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].s_m = 2 * static_cast<double>(i);
  const auto judge = [&](const SpeedOptions& options, std::vector<SpeedPoint> plan) {
    std::vector<double> at(path.size());
    const double holds = on.planner->PlanByDraws(path, options, plan, at);
    at.push_back(holds);
    return at;
  };
  SpeedOptions options = on.limits;
  options.speed_limit_m_per_s = 1;
  std::vector<SpeedPoint> plan(path.size());
  EXPECT_EQ(on.planner->Plan(path, options, plan), 0u);
  EXPECT_EQ(judge(options, plan), (std::vector<double>{1, 1, 1, 1, 1, 1}));
  std::vector<SpeedPoint> unsafe = plan;
  unsafe[4].safe_m_per_s = 0;
  EXPECT_EQ(judge(options, unsafe), (std::vector<double>{1, 1, 1, 1, 0, 0}));
  options.start_m_per_s = 3;
  EXPECT_EQ(on.planner->Plan(path, options, plan), 1u);
  EXPECT_FALSE(plan[0].holds);
  EXPECT_EQ(judge(options, plan), (std::vector<double>{0, 1, 1, 1, 1, 0}));
}

TEST(VehicleDraws, RefusesWhatMakesNoSense) {
  const OnDraws on(3);
  Solver solver(on.vehicle, on.grounds);
  Motion motion = Climb(0);
  motion.draw = 0;
  Solution s;
  solver.Solve({&motion, 1}, {&s, 1});
  EXPECT_EQ(s.reasons, kBadInput);  // no draws
  solver.UseDraws(on.draws);
  for (const int draw : {-2, 3}) {
    motion.draw = draw;
    solver.Solve({&motion, 1}, {&s, 1});
    EXPECT_EQ(s.reasons, kBadInput) << draw;
  }
  const OnDraws two(3, 2);
  EXPECT_THROW(solver.UseDraws(two.draws), std::invalid_argument);
  SpeedPlanner without(on.vehicle, on.grounds, 2);
  EXPECT_THROW(without.ProbabilityByDraws(Climb(0), on.limits), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::vehicle

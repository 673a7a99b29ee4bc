// Answers to trajectories without gRPC: the bits of single motions, draws, mixtures, cancelled
// calls.
#include <cmath>

#include "surrogate/vehicle/trajectory_messages.h"
#include "tests/unit/server/trajectory_answers.h"

namespace grouser::server {
namespace {

using testing::Of, testing::Request, testing::Response, testing::TrajectoryAnswerTest;
using vehicle::Append, vehicle::CostAt;
using vehicle::TrajectoryCost, vehicle::TrajectoryStep;

// Ragged, with every array; what a client packs and reads is what single motions give.
TEST_F(TrajectoryAnswerTest, CostsAreThoseOfSingleMotions) {
  const vehicle::VehicleFile& husky = fleet_.vehicles()[0]->file;
  std::vector<std::vector<TrajectoryStep>> trajectories;
  std::size_t i = 0;
  for (const std::size_t steps : {1, 30, 5, 64}) {
    auto& trajectory = trajectories.emplace_back();
    for (std::size_t j = 0; j < steps; ++j, ++i) {
      const double x = static_cast<double>(i);
      TrajectoryStep s{vehicle::Motion::OnPath(0.2 + 0.01 * x, std::sin(x)), 0.05 + 0.01 * (x / 7)};
      s.motion.acceleration_m_per_s2 = 0.1 * std::cos(x);
      s.motion.yaw_acceleration_rad_per_s2 = 0.1 * std::sin(2 * x);
      s.motion.grade_rad = 0.15 * std::sin(3 * x);
      s.motion.bank_rad = 0.05 * std::cos(5 * x);
      s.motion.soil.fill(static_cast<std::uint8_t>(i % 3));
      trajectory.push_back(s);
    }
  }
  Request request;
  request.set_vehicle("husky");
  for (const auto& t : trajectories) Append(t, request.mutable_trajectories());
  request.set_interval_sds(1);
  request.set_with_steps(true);
  const Response response = Good(request);
  EXPECT_EQ(response.steps().electric_w_size(), 100);
  EXPECT_GT(response.latency().nanos() + response.latency().seconds(), 0);

  vehicle::Solver solver(husky.vehicle, husky.grounds);
  int at = 0;
  bool reasons = false;
  for (std::size_t k = 0; k < trajectories.size(); ++k) {
    TrajectoryCost ours;
    for (std::size_t j = 0; j < trajectories[k].size(); ++j, ++at) {
      const TrajectoryStep& s = trajectories[k][j];
      const vehicle::PowerInterval p = PowerOf(&solver, s.motion, 1);
      ours.Add(static_cast<int>(j), s.duration_s, p);
      ASSERT_EQ(response.steps().electric_w(at), p.mean.electric);
      ASSERT_EQ(response.steps().tip_margin(at), p.solution.tip_margin);
      ASSERT_EQ(response.steps().residual(at), p.solution.residual);
      ASSERT_EQ(response.steps().reasons(at), p.solution.reasons);
    }
    const TrajectoryCost theirs = CostAt(response.costs(), k);
    EXPECT_EQ(theirs.duration_s, ours.duration_s);
    EXPECT_EQ(theirs.energy.joules, ours.energy.joules);
    EXPECT_EQ(theirs.energy.low, ours.energy.low);
    EXPECT_EQ(theirs.energy.high, ours.energy.high);
    EXPECT_EQ(theirs.energy.seconds, ours.energy.seconds);
    EXPECT_EQ(theirs.energy.metres, ours.energy.metres);
    EXPECT_EQ(theirs.energy.left_out, ours.energy.left_out);
    EXPECT_EQ(theirs.energy.left_out_s, ours.energy.left_out_s);
    EXPECT_EQ(theirs.reasons, ours.reasons);
    EXPECT_EQ(theirs.first_step, ours.first_step);
    EXPECT_EQ(theirs.first_reasons, ours.first_reasons);
    EXPECT_EQ(theirs.least_margin, ours.least_margin);
    EXPECT_EQ(theirs.least_margin_of, ours.least_margin_of);
    EXPECT_EQ(theirs.least_margin_step, ours.least_margin_step);
    reasons = reasons || ours.reasons != 0;
  }
  EXPECT_TRUE(reasons) << "ice at 0.15 rad";
  EXPECT_THROW(CostAt(response.costs(), 4), std::invalid_argument);
}

// The same steps said in every way that the message has.
TEST_F(TrajectoryAnswerTest, ArraysAreOfAllStepsOfTheLongestOrOfOne) {
  const std::vector<double> v = {0.3, 0.5, 0.7}, bend = {0.1, -0.2, 0.4};
  Request whole = Of(0, 0), by_step = Of(0, 0);
  for (Request* r : {&whole, &by_step}) {
    r->mutable_trajectories()->clear_v_x_m_per_s();
    for (const std::uint32_t steps : {2, 3, 1}) r->mutable_trajectories()->add_steps(steps);
  }
  for (const int last : {2, 3, 1}) {
    for (int j = 0; j < last; ++j) {
      const auto at = static_cast<std::size_t>(j);
      v1alpha1::Trajectories& t = *whole.mutable_trajectories();
      t.add_v_x_m_per_s(v[at]);
      t.add_yaw_rate_rad_per_s(v[at] * bend[at]);
      t.add_grade_rad(0.02);
      t.add_soil(static_cast<std::uint32_t>(j));
    }
  }
  v1alpha1::Trajectories& t = *by_step.mutable_trajectories();
  for (std::size_t j = 0; j < 3; ++j) {
    t.add_v_x_m_per_s(v[j]);
    t.add_curvature_per_m(bend[j]);
    t.add_soil(static_cast<std::uint32_t>(2 - j));
  }
  t.add_grade_rad(0.02);
  for (const char* soil : {"ice", "floor", "asphalt"}) t.add_soils(soil);
  const Response a = Good(whole), b = Good(by_step);
  EXPECT_EQ(a.costs().SerializeAsString(), b.costs().SerializeAsString());
  EXPECT_EQ(a.costs().duration_s(1), 0.1 + 0.1 + 0.1);
  EXPECT_NE(a.costs().energy_j(0), a.costs().energy_j(2));

  // By lengths: durations are theirs over the speed.
  t.clear_duration_s();
  t.add_length_m(0.2);
  const Response c = Good(by_step);
  EXPECT_EQ(c.costs().duration_s(2), 0.2 / 0.3);
  // Worse ground and no interval.
  by_step.set_worse_by_sd(1);
  by_step.set_interval_sds(0);
  const Response d = Good(by_step);
  EXPECT_EQ(d.costs().energy_low_j(0), d.costs().energy_high_j(0));
  EXPECT_NE(d.costs().energy_j(0), c.costs().energy_j(0));
  EXPECT_EQ(d.steps().ByteSizeLong(), 0u);
}

// On the floor draws are of one friction: the steepest step decides, on every draw.
TEST_F(TrajectoryAnswerTest, ATrajectoryGoesOnTheDrawsOnWhichAllItsStepsDo) {
  constexpr double kSteep = 0.489, kLess = 0.45;
  const std::vector<std::vector<double>> grades = {
      {kSteep}, {kLess}, {0}, {0, kLess, kSteep, kLess}, {kLess, 0, kLess}, {0, 1.2}};
  Request request = Of(0, 0);
  for (const auto& of : grades) {
    request.mutable_trajectories()->add_steps(static_cast<std::uint32_t>(of.size()));
    for (const double grade : of) request.mutable_trajectories()->add_grade_rad(grade);
  }
  request.mutable_trajectories()->add_soils("floor");
  request.set_draws(200);
  request.set_worse_by_sd(3);  // does not count
  const Response response = Good(request);
  const auto& least = response.go_probability_least();
  v1alpha1::SolveRequest solve;
  solve.set_vehicle("husky");
  solve.set_draws(200);
  solve.set_with_go_probability(true);
  solve.mutable_motions()->add_soils("floor");
  for (int k = 0; k < 3; ++k) {
    solve.mutable_motions()->mutable_twist()->add_v_x_m_per_s(0.5);
    solve.mutable_motions()->add_grade_rad(grades[static_cast<std::size_t>(k)][0]);
  }
  v1alpha1::SolveResponse single;
  ASSERT_TRUE(Answer({fleet_, bench_, cancelled_}, solve, &single).ok());
  ASSERT_EQ(least.size(), 6);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(least[k], single.go_probability_least(k)) << k;
    EXPECT_EQ(response.go_probability_most(k), single.go_probability_most(k)) << k;
  }
  EXPECT_GT(least[0], 0.5);
  EXPECT_GT(least[1], least[0]);
  EXPECT_LT(least[1], 1);
  EXPECT_EQ(least[2], 1);
  EXPECT_EQ(least[3], least[0]);
  EXPECT_EQ(least[4], least[1]);
  EXPECT_EQ(least[5], 0);

  request.mutable_margins()->set_tip(1);
  Refuses(StatusCode::kInvalidArgument, request, "margins.tip: 1");
  request.clear_margins();
  request.set_draws(342);
  Refuses(StatusCode::kResourceExhausted, request, "draws times soils: 1026 entries");
  request = Of(334, 3);
  request.set_draws(100);
  Refuses(StatusCode::kResourceExhausted, request,
          "draws times steps: 100200 entries, at most 100000");
}

TEST_F(TrajectoryAnswerTest, MixturesAndCancelledCalls) {
  Request request = Of(2, 3);
  v1alpha1::SoilMixture* mixture = request.add_mixtures();
  mixture->set_name("either");
  for (const char* soil : {"asphalt", "ice"}) mixture->add_of(soil), mixture->add_weight(1);
  request.mutable_trajectories()->add_yaw_rate_rad_per_s(0.3);
  for (const std::uint32_t soil : {0, 0, 0, 3, 3, 3})
    request.mutable_trajectories()->add_soil(soil);
  const Response response = Good(request);
  EXPECT_NE(response.costs().energy_j(0), response.costs().energy_j(1));
  request.clear_mixtures();
  Refuses(StatusCode::kInvalidArgument, request, "trajectories.soil[3]: 3, expected below 3");
  cancelled_ = true;
  request = Of(1, 1);
  Refuses(StatusCode::kUnavailable, request, "cancelled");
}

}  // namespace
}  // namespace grouser::server

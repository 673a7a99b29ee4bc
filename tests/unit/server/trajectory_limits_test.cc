// Trajectories that are refused by name and index, and limits: sizes before a request waits, bytes
// of the answer, time.
#include <cmath>
#include <limits>

#include "surrogate/vehicle/stop.h"
#include "surrogate/vehicle/trajectory_messages.h"
#include "tests/unit/server/trajectory_answers.h"

namespace grouser::server {
namespace {

using ::testing::HasSubstr;
using testing::Of, testing::Request, testing::Response, testing::TrajectoryAnswerTest;
using vehicle::Append, vehicle::TrajectoryStep;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST_F(TrajectoryAnswerTest, RefusesWhatMakesNoSenseByNameAndIndex) {
  RefusesInput("trajectories.steps: none, expected 1 or more", [](auto* t) { t->clear_steps(); });
  RefusesInput("trajectories.steps[1]: 0, expected 1 or more", [](auto* t) { t->set_steps(1, 0); });
  RefusesInput("trajectories.v_x_m_per_s: none", [](auto* t) { t->clear_v_x_m_per_s(); });
  RefusesInput(
      "trajectories.grade_rad: 2 entries, expected 6 (all steps), 3 (those of the longest)",
      [](auto* t) { t->add_grade_rad(0), t->add_grade_rad(0); });
  RefusesInput("trajectories.soil: 4 entries", [](auto* t) { t->mutable_soil()->Resize(4, 0); });
  RefusesInput("trajectories.duration_s: none, and no length_m, expected one of the two",
               [](auto* t) { t->clear_duration_s(); });
  RefusesInput("trajectories.length_m: 1 entries beside duration_s",
               [](auto* t) { t->add_length_m(1); });
  RefusesInput("trajectories.curvature_per_m: 1 entries beside yaw_rate_rad_per_s",
               [](auto* t) { t->add_curvature_per_m(1), t->add_yaw_rate_rad_per_s(1); });
  RefusesInput("trajectories.v_x_m_per_s[0]: nan", [](auto* t) { t->set_v_x_m_per_s(0, kNaN); });
  RefusesInput("trajectories.bank_rad[2]: inf, expected a finite number", [](auto* t) {
    for (const double bank : {0.0, 0.0, HUGE_VAL}) t->add_bank_rad(bank);
  });
  for (const double bad : {0.0, -1.0}) {
    RefusesInput("trajectories.duration_s[0]: ", [&](auto* t) { t->set_duration_s(0, bad); });
    RefusesInput("trajectories.length_m[0]: ", [&](auto* t) {
      t->clear_duration_s();
      t->add_length_m(bad);
    });
  }
  RefusesInput("trajectories.v_x_m_per_s: at step 4 of all: 0.000000, expected a speed",
               [](auto* t) {
                 t->clear_duration_s();
                 t->add_length_m(1);
                 t->mutable_v_x_m_per_s()->Resize(6, 0.5);
                 t->set_v_x_m_per_s(4, 0);
               });
  RefusesInput("trajectories.soil[0]: 3, expected below 3", [](auto* t) { t->add_soil(3); });
  RefusesInput("trajectories.soils[0]: 'mud', expected one of asphalt, floor, ice",
               [](auto* t) { t->add_soils("mud"); });
  Request request = Of(1, 1);
  request.set_interval_sds(-1);
  Refuses(StatusCode::kInvalidArgument, request, "interval_sds: -1");
  request = Of(1, 1);
  request.set_worse_by_sd(kNaN);
  Refuses(StatusCode::kInvalidArgument, request, "worse_by_sd: nan");
  request = Of(1, 1);
  request.set_vehicle("tank");
  Refuses(StatusCode::kNotFound, request, "tank");

  TrajectoryStep step{vehicle::Motion::OnPath(0.5, 0), 1};
  v1alpha1::Trajectories to;
  step.motion.soil[1] = 1;
  EXPECT_THROW(Append({&step, 1}, &to), std::invalid_argument);
  step.motion.soil[1] = 0;
  step.motion.draw = 3;
  EXPECT_THROW(Append({&step, 1}, &to), std::invalid_argument);
}

TEST_F(TrajectoryAnswerTest, RefusesTooManyStepsBeforeARequestWaits) {
  EXPECT_TRUE(Check(fleet_, Of(600, 50)).ok());
  Request request = Of(600, 50);
  request.mutable_trajectories()->add_steps(1);
  Refuses(StatusCode::kResourceExhausted, request,
          "steps of all trajectories: 30001 entries, at most 30000 in one message");
  Refuses(StatusCode::kResourceExhausted, Of(30001, 0), "trajectories.steps: 30001 entries");
  request = Of(2, 2'000'000'000);  // twice
  Refuses(StatusCode::kResourceExhausted, request, "4000000000 entries");
  request = Of(1, 1);
  for (int i = 0; i < 256; ++i) request.mutable_trajectories()->add_soils();
  Refuses(StatusCode::kResourceExhausted, request, "trajectories.soils: 256 entries");
  request = Of(1, 1);
  for (int i = 0; i < 9; ++i) request.add_mixtures();
  Refuses(StatusCode::kResourceExhausted, request, "mixtures: 9 entries, at most 8");
  // Four arrays in full are taken, even where they were received into twice the room; not all.
  request = Of(600, 50);
  const auto fill = [&](auto... edit) {
    for (const auto& numbers : {(request.mutable_trajectories()->*edit)()...}) {
      numbers->Reserve(60000);
      numbers->Resize(30000, 0.1);
    }
  };
  using v1alpha1::Trajectories;
  fill(&Trajectories::mutable_v_x_m_per_s, &Trajectories::mutable_yaw_rate_rad_per_s,
       &Trajectories::mutable_duration_s, &Trajectories::mutable_grade_rad);
  EXPECT_TRUE(Check(fleet_, request).ok()) << Check(fleet_, request).message;
  fill(&Trajectories::mutable_acceleration_m_per_s2, &Trajectories::mutable_bank_rad,
       &Trajectories::mutable_yaw_acceleration_rad_per_s2);
  Refuses(StatusCode::kResourceExhausted, request, "bytes of memory, at most 2097152");
  vehicle::Shorten(request.mutable_trajectories());  // a client sends one entry of each
  Request sent;
  ASSERT_TRUE(sent.ParseFromString(request.SerializeAsString()));
  EXPECT_EQ(sent.trajectories().bank_rad_size(), 1);
  EXPECT_TRUE(Check(fleet_, sent).ok()) << Check(fleet_, sent).message;
}

// The largest answers stay below what a client takes unless told otherwise, and take no more than
// is counted for them.
TEST_F(TrajectoryAnswerTest, TheLargestAnswersAreBelowFourMegabytes) {
  struct Case {
    int trajectories, steps;
    std::uint32_t draws;
  };
  for (const Case& c : {Case{30000, 1, 0}, Case{27400, 1, 3}, Case{1, 30000, 3}}) {
    Request request = Of(c.trajectories, c.steps);
    request.set_with_steps(true);
    request.set_interval_sds(0);
    request.set_draws(c.draws);
    const Response response = Good(request);
    EXPECT_EQ(response.costs().energy_j_size(), c.trajectories);
    EXPECT_EQ(response.steps().electric_w_size(), c.trajectories * c.steps);
    EXPECT_EQ(response.go_probability_most_size(), c.draws > 0 ? c.trajectories : 0);
    EXPECT_LT(response.ByteSizeLong(), 4u << 20);
    EXPECT_LE(response.ByteSizeLong(), MostAnswerBytes(request) + 1024) << "and tags";
    EXPECT_GT(1.1 * static_cast<double>(response.ByteSizeLong()),
              static_cast<double>(MostAnswerBytes(request)));
  }
  Request request = Of(30000, 1);
  request.set_with_steps(true);
  request.set_draws(1);
  Refuses(StatusCode::kResourceExhausted, request,
          "with_steps and draws: an answer of up to 4590000 bytes, at most 4193280");
  request.set_with_steps(false);
  EXPECT_TRUE(Check(fleet_, request).ok());
}

// A step that is hard to balance, 36 bytes of a request: the call ends when its time is over.
TEST_F(TrajectoryAnswerTest, ACallTakesNoMoreThanItsTime) {
  const Fleet fleet({GROUSER_ATV});
  VehicleBench bench(fleet);
  Request request = Of(1, 30000);
  request.set_vehicle("atv");
  v1alpha1::Trajectories& t = *request.mutable_trajectories();
  t.set_v_x_m_per_s(0, -0.12);
  t.add_yaw_rate_rad_per_s(0.86);
  t.add_grade_rad(-0.45);
  t.add_bank_rad(-0.21);
  t.add_acceleration_m_per_s2(-2.89);
  EXPECT_LT(request.ByteSizeLong(), 80u);
  ASSERT_TRUE(Check(fleet, request).ok());
  constexpr std::chrono::milliseconds kLimit(200);
  const auto start = vehicle::ThreadTime();
  Response response;
  const Status status = Answer({fleet, bench, cancelled_, kLimit}, request, &response);
  EXPECT_EQ(status.code, StatusCode::kResourceExhausted) << status.message;
  EXPECT_THAT(status.message, HasSubstr("work: more than 0.2 s of processor time"));
  EXPECT_LT(vehicle::ThreadTime() - start, 10 * kLimit) << "one round of 63 solves more";
  EXPECT_EQ(response.ByteSizeLong(), 0u);
  // As good as new.
  request = Of(1, 1);
  request.set_vehicle("atv");
  EXPECT_TRUE(Answer({fleet, bench, cancelled_}, request, &response).ok());
  EXPECT_EQ(response.costs().energy_j_size(), 1);
}

TEST_F(TrajectoryAnswerTest, SumsStayFinite) {
  RefusesInput("trajectories.duration_s[0]: ", [](auto* t) { t->set_duration_s(0, 1e308); });
  RefusesInput("at most 1e9 seconds", [](auto* t) { t->set_duration_s(0, 1.001e9); });
  RefusesInput("within 1e9 seconds", [](auto* t) {
    t->clear_duration_s();
    t->add_length_m(1e308);
  });
  Request request = Of(2, 1000);
  request.mutable_trajectories()->set_duration_s(0, 1e9);
  const Response response = Good(request);
  EXPECT_GT(response.costs().energy_j(0), 1e12);
  EXPECT_TRUE(std::isfinite(response.costs().energy_high_j(0)));
  EXPECT_DOUBLE_EQ(response.costs().distance_m(0), 0.5e12);
}

}  // namespace
}  // namespace grouser::server

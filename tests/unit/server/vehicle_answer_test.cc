// Answers for vehicles without gRPC: sizes that are refused before a request waits, faults of the
// client and of the server, memory that runs out. Replaces operator new.
#include "server/vehicle/vehicle_answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>

#include "server/vehicle/vehicle_check.h"

namespace {
std::size_t g_largest = 0;  // larger requests fail; 0: none does
void* Take(std::size_t size) {
  if (g_largest > 0 && size > g_largest) throw std::bad_alloc();
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) { return Take(size); }
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using SoilShares = std::vector<std::pair<const char*, double>>;

/// Allocations of more than so many bytes fail meanwhile.
struct Short {
  explicit Short(std::size_t largest) { g_largest = largest; }
  ~Short() { g_largest = 0; }
};

class VehicleAnswerTest : public ::testing::Test {
 protected:
  template <class Response, class Request>
  Status Ask(const Request& request, Response* response) {
    const Status checked = Check(fleet_, request);
    return checked.ok() ? Answer({fleet_, bench_, cancelled_}, request, response) : checked;
  }
  static v1alpha1::PlanSpeedRequest Plan(int n) {
    v1alpha1::PlanSpeedRequest request;
    request.set_vehicle("husky");
    request.set_speed_limit_m_per_s(1);
    for (int i = 0; i < n; ++i) request.mutable_path()->add_s_m(0.1 * i);
    return request;
  }
  static v1alpha1::SolveRequest Motions(int n) {
    v1alpha1::SolveRequest request;
    request.set_vehicle("husky");
    for (int i = 0; i < n; ++i) request.mutable_motions()->mutable_twist()->add_v_x_m_per_s(0.5);
    return request;
  }
  template <class Request>
  void ExpectExhausted(const Request& request, const char* text) {
    const Status status = Check(fleet_, request);
    EXPECT_EQ(status.code, StatusCode::kResourceExhausted) << status.message;
    EXPECT_THAT(status.message, HasSubstr(text));
  }

  Fleet fleet_{std::vector<std::string>{GROUSER_VEHICLE}};
  VehicleBench bench_{fleet_};
  std::atomic<bool> cancelled_{false};
};

TEST_F(VehicleAnswerTest, RefusesSizesBeforeARequestWaits) {
  ExpectExhausted(Motions(3001), "motions: 3001 entries, at most 3000");
  v1alpha1::SolveRequest go = Motions(120);
  go.set_with_go_probability(true);
  EXPECT_TRUE(Check(fleet_, go).ok());
  go.mutable_motions()->mutable_twist()->add_v_x_m_per_s(1);
  ExpectExhausted(go, "motions: 121 entries with go_probability, at most 120");
  ExpectExhausted(Plan(10001), "path.s_m: 10001 entries, at most 10000");

  v1alpha1::PlanSpeedRequest plan = Plan(2);
  v1alpha1::SolveRequest solve = Motions(1);
  v1alpha1::EnergyRequest energy;
  v1alpha1::GradesRequest grades;
  energy.set_vehicle("husky");
  grades.set_vehicle("husky");
  for (int i = 0; i < 256; ++i) {
    plan.mutable_path()->add_soils();
    solve.mutable_motions()->add_soils();
    energy.mutable_motions()->add_soils();
    grades.add_soils();
  }
  ExpectExhausted(plan, "path.soils: 256 entries, at most 255");
  ExpectExhausted(solve, "motions.soils: 256 entries, at most 255");
  ExpectExhausted(energy, "motions.soils: 256 entries, at most 255");
  ExpectExhausted(grades, "soils: 256 entries, at most 3");

  v1alpha1::ConstantsRequest constants;
  constants.set_vehicle("husky");  // three soils
  for (int i = 0; i < 18; ++i) constants.add_speeds_m_per_s(1), constants.add_radii_m(1);
  EXPECT_TRUE(Check(fleet_, constants).ok());
  constants.add_radii_m(1);
  ExpectExhausted(constants, "speeds times radii times soils: 1026 entries, at most 1000");
  for (int i = 0; i < 1000; ++i) constants.add_radii_m(1);
  ExpectExhausted(constants, "radii_m: 1019 entries");
}

TEST_F(VehicleAnswerTest, RefusesTooManyDrawsBeforeARequestWaits) {
  v1alpha1::SolveRequest solve = Motions(1);
  solve.set_draws(341);  // three soils
  EXPECT_TRUE(Check(fleet_, solve).ok());
  solve.set_draws(342);
  ExpectExhausted(solve, "draws times soils: 1026 entries, at most 1024");
  solve.set_draws(4000000000u);
  ExpectExhausted(solve, "draws: 4000000000 entries, at most 1024");
  solve = Motions(10);
  solve.set_draws(300);
  solve.set_with_go_probability(true);
  EXPECT_TRUE(Check(fleet_, solve).ok());
  solve.mutable_motions()->mutable_twist()->add_v_x_m_per_s(1);
  ExpectExhausted(solve, "motions: 11 entries with go_probability, at most 10");
  v1alpha1::PlanSpeedRequest plan = Plan(1000);
  plan.set_draws(100);
  EXPECT_TRUE(Check(fleet_, plan).ok());
  plan.set_draws(101);
  ExpectExhausted(plan, "draws times points: 101000 entries, at most 100000");
  plan.set_draws(342);
  ExpectExhausted(plan, "draws times soils: 1026");
}

// Sizes before a request waits, names and weights when it is answered; none is there for the next.
TEST_F(VehicleAnswerTest, MixturesAreBoundedCheckedAndOfTheirCallAlone) {
  const auto add = [](auto* request, const char* name, const SoilShares& shares) {
    v1alpha1::SoilMixture* mixture = request->add_mixtures();
    mixture->set_name(name);
    for (const auto& [soil, weight] : shares) mixture->add_of(soil), mixture->add_weight(weight);
  };
  v1alpha1::SolveRequest solve = Motions(2);
  add(&solve, "either", {{"asphalt", 7}, {"ice", 3}});
  for (const std::uint32_t soil : {0, 3}) {  // 3: after the three of the vehicle
    solve.mutable_motions()->add_soil(soil);
    solve.mutable_motions()->mutable_twist()->add_yaw_rate_rad_per_s(0.3);
  }
  v1alpha1::SolveResponse response;
  ASSERT_TRUE(Ask(solve, &response).ok());
  EXPECT_EQ(response.solutions().reasons(1), 0u);
  EXPECT_NE(response.solutions().electric_power_w(0), response.solutions().electric_power_w(1));
  solve.clear_mixtures();
  EXPECT_THAT(Ask(solve, &response).message, HasSubstr("motions.soil[1]: 3, expected below 3"));

  const auto refusal = [&](const char* name, const SoilShares& shares) {
    v1alpha1::SolveRequest bad = Motions(1);
    add(&bad, "first", {{"asphalt", 1}});
    add(&bad, name, shares);
    const Status status = Ask(bad, &response);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << status.message;
    EXPECT_THAT(status.message, HasSubstr("mixtures[1]: "));
    return status.message;
  };
  EXPECT_THAT(refusal("x", {{"mud", 1}}), HasSubstr("soil mud: none of the vehicle"));
  EXPECT_THAT(refusal("ice", {{"asphalt", 1}}), HasSubstr("soil ice: there is one"));
  EXPECT_THAT(refusal("", {{"asphalt", 1}}), HasSubstr("mixtures[1]: name: empty"));
  EXPECT_THAT(refusal("x", {{"ice", 1}, {"ice", 1}}), HasSubstr("soil ice: twice"));
  for (const double weight : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT(refusal("x", {{"ice", weight}}), HasSubstr("weight")) << weight;
  }
  EXPECT_THAT(refusal("x", {}), HasSubstr("mixture: "));
  EXPECT_THAT(refusal("x", {{"first", 1}, {"ice", 1}}), HasSubstr("mixture"));
  v1alpha1::SolveRequest uneven = Motions(1);
  uneven.add_mixtures()->add_of("ice");
  EXPECT_THAT(Ask(uneven, &response).message,
              HasSubstr("mixtures[0].weight: 0 entries, expected 1"));

  v1alpha1::PlanSpeedRequest plan = Plan(2);
  plan.set_draws(256);
  add(&plan, "a", {{"ice", 1}});
  EXPECT_TRUE(Check(fleet_, plan).ok());
  add(&plan, "b", {{"ice", 1}});
  ExpectExhausted(plan, "draws times soils: 1280 entries, at most 1024");
  v1alpha1::GradesRequest grades;
  grades.set_vehicle("husky");
  for (int i = 0; i < 4; ++i) grades.add_soils("ice");
  ExpectExhausted(grades, "soils: 4 entries, at most 3");
  add(&grades, "a", {{"ice", 1}});
  EXPECT_TRUE(Check(fleet_, grades).ok());
  v1alpha1::EnergyRequest energy;
  energy.set_vehicle("husky");
  energy.mutable_motions()->mutable_twist()->add_v_x_m_per_s(1);
  for (int i = 0; i < 8; ++i) add(&energy, "a", {{"ice", 1}});
  EXPECT_TRUE(Check(fleet_, energy).ok());
  for (int i = 0; i < 57; ++i) energy.mutable_mixtures(0)->add_of("ice");
  ExpectExhausted(energy, "mixtures.of: 65 entries in all, at most 64");
  add(&energy, "a", {{"ice", 1}});
  ExpectExhausted(energy, "mixtures: 9 entries, at most 8");
}

// What a call used is not there for the next.
TEST_F(VehicleAnswerTest, DrawsAreThoseOfTheirCallAlone) {
  v1alpha1::SolveRequest solve = Motions(3);
  for (const int draw : {-1, 0, 9}) solve.mutable_motions()->add_draw(draw);
  v1alpha1::SolveResponse with, without;
  solve.set_draws(10);
  ASSERT_TRUE(Ask(solve, &with).ok());
  EXPECT_EQ(with.solutions().reasons(1), 0u);
  EXPECT_EQ(with.solutions().reasons(2), 0u);
  EXPECT_NE(with.solutions().electric_power_w(0), with.solutions().electric_power_w(1));
  solve.set_draws(0);
  ASSERT_TRUE(Ask(solve, &without).ok());
  EXPECT_EQ(without.solutions().electric_power_w(0), with.solutions().electric_power_w(0));
  EXPECT_EQ(without.solutions().reasons(1), std::uint32_t{v1alpha1::MOTION_REASON_INPUT});
}

TEST_F(VehicleAnswerTest, RefusesArraysThatDoNotFitBeforeARequestWaits) {
  v1alpha1::SolveRequest solve = Motions(3);
  solve.mutable_motions()->add_bank_rad(0);
  EXPECT_THAT(Check(fleet_, solve).message, HasSubstr("motions.bank_rad: 1 entries"));
  v1alpha1::PlanSpeedRequest plan = Plan(3);
  plan.mutable_path()->mutable_soil()->Resize(100000, 0);
  EXPECT_EQ(Check(fleet_, plan).code, StatusCode::kInvalidArgument);
  EXPECT_THAT(Check(fleet_, plan).message, HasSubstr("path.soil: 100000 entries, expected 3"));
  plan.set_vehicle("tank");
  EXPECT_EQ(Check(fleet_, plan).code, StatusCode::kNotFound);
}

// Fields that this program does not know take memory as well: 2 bytes each on the wire.
TEST_F(VehicleAnswerTest, RefusesARequestThatTakesTooMuchMemory) {
  std::string wire = Plan(10).SerializeAsString();
  for (int i = 0; i < 300000; ++i) wire += "\x78\x01";  // field 15
  v1alpha1::PlanSpeedRequest request;
  ASSERT_TRUE(request.ParseFromString(wire));
  ExpectExhausted(request, "request: ");
  v1alpha1::PlanSpeedRequest largest = Plan(10000);
  for (int i = 0; i < 10000; ++i) {
    v1alpha1::Path* path = largest.mutable_path();
    path->add_curvature_per_m(0), path->add_grade_rad(0), path->add_bank_rad(0), path->add_soil(0);
  }
  EXPECT_TRUE(Check(fleet_, largest).ok()) << Check(fleet_, largest).message;
}

TEST_F(VehicleAnswerTest, MemoryThatRunsOutEndsACallAlone) {
  v1alpha1::PlanSpeedResponse response;
  ASSERT_TRUE(Ask(Plan(100), &response).ok());  // a planner with room for 128 points
  const v1alpha1::PlanSpeedRequest longer = Plan(1000);
  {
    const Short no_memory(300000);
    const Status status = Ask(longer, &response);
    EXPECT_EQ(status.code, StatusCode::kInternal) << status.message;
  }
  response.Clear();
  const Status status = Ask(longer, &response);  // not by the planner for 128
  EXPECT_TRUE(status.ok()) << status.message;
  EXPECT_EQ(response.plan().holds_size(), 1000);
}

TEST_F(VehicleAnswerTest, TellsTheClientsFaultFromItsOwn) {
  EXPECT_EQ(Guarded([]() -> Status { throw std::invalid_argument("ours"); }).code,
            StatusCode::kInternal);
  EXPECT_EQ(Guarded([] {
              return Reading([]() -> Status { throw std::invalid_argument("theirs"); });
            }).code,
            StatusCode::kInvalidArgument);
  v1alpha1::PlanSpeedRequest plan = Plan(3);
  plan.mutable_margins()->set_tip(1);
  v1alpha1::PlanSpeedResponse response;
  EXPECT_EQ(Ask(plan, &response).code, StatusCode::kInvalidArgument);
}

TEST_F(VehicleAnswerTest, EveryCallThatIsCancelledOrTakesTooLongEnds) {
  const auto expect_dropped = [&](const auto& request, auto response) {
    cancelled_ = true;
    EXPECT_EQ(Ask(request, &response).code, StatusCode::kUnavailable);
    cancelled_ = false;
    const std::chrono::nanoseconds no_time(0);
    const Status late = Answer({fleet_, bench_, cancelled_, no_time}, request, &response);
    EXPECT_EQ(late.code, StatusCode::kResourceExhausted);
    EXPECT_THAT(late.message,
                AllOf(HasSubstr("work: more than 0 s of processor time, expected less"),
                      HasSubstr("several calls")));
    EXPECT_TRUE(Ask(request, &response).ok()) << "with more time";
  };
  expect_dropped(Plan(10), v1alpha1::PlanSpeedResponse());
  expect_dropped(Motions(3), v1alpha1::SolveResponse());
  v1alpha1::PlanSpeedRequest drawn = Plan(10);
  drawn.set_draws(20);
  expect_dropped(drawn, v1alpha1::PlanSpeedResponse());
  v1alpha1::EnergyRequest energy;
  energy.set_vehicle("husky");
  *energy.mutable_motions() = Motions(3).motions();
  expect_dropped(energy, v1alpha1::EnergyResponse());
  v1alpha1::GradesRequest grades;
  grades.set_vehicle("husky");
  expect_dropped(grades, v1alpha1::GradesResponse());
  v1alpha1::ConstantsRequest constants;
  constants.set_vehicle("husky");
  constants.add_speeds_m_per_s(1);
  constants.add_radii_m(1);
  expect_dropped(constants, v1alpha1::ConstantsResponse());
}

}  // namespace
}  // namespace grouser::server

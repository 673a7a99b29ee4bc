// Request checks and the DEM spec made of a request.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "server/core/status.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "tests/unit/jobs/jobs_fixtures.h"
#include "tests/unit/records/throws.h"

namespace grouser::server {
namespace {

using testing::BaseModel;
using ::testing::HasSubstr;
using testing::Request;
using ::testing::StartsWith;
using v1alpha1::SubmitRefinementRequest;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// What CheckSubmit says to a changed request; "" when it passes.
std::string Verdict(const std::function<void(SubmitRefinementRequest&)>& change) {
  auto request = Request("id");
  change(request);
  try {
    CheckSubmit(request);
  } catch (const StatusError& e) {
    EXPECT_EQ(e.code(), StatusCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(RequestChecks, AcceptsAGoodRequest) {
  EXPECT_EQ(Verdict([](auto&) {}), "");
  EXPECT_EQ(Verdict([](auto& r) { r.set_model(""); }), "");
  EXPECT_EQ(Verdict([](auto& r) { r.set_request_id(std::string(128, 'x')); }), "");
  std::string umlauts;
  for (int i = 0; i < 128; ++i) umlauts += "\xc3\xa4";
  EXPECT_EQ(Verdict([&](auto& r) { r.set_request_id(umlauts); }), "") << "128 characters";
}

TEST(RequestChecks, NamesTheBadField) {
  EXPECT_THAT(Verdict([](auto& r) { r.set_priority(11); }), StartsWith("priority: 11, expected"));
  EXPECT_THAT(Verdict([](auto& r) { r.mutable_time_limit()->set_nanos(1); }),
              StartsWith("time_limit:"));
  EXPECT_THAT(Verdict([](auto& r) { r.set_request_id(""); }), StartsWith("request_id:"));
  EXPECT_THAT(Verdict([](auto& r) { r.set_request_id(std::string(129, 'x')); }),
              StartsWith("request_id:"));
  EXPECT_THAT(Verdict([](auto& r) { r.set_request_id("a\nb"); }), StartsWith("request_id:"));
  EXPECT_THAT(Verdict([](auto& r) { r.set_model("a@sha256:zz"); }), StartsWith("model:"));
  EXPECT_THAT(Verdict([](auto& r) { r.clear_state(); }), StartsWith("state:"));
  for (const double bad : {kNaN, kInf, -1.0, 0.0, -0.0}) {
    EXPECT_THAT(Verdict([&](auto& r) { r.mutable_state()->set_load_n(bad); }),
                StartsWith("state.load_n:"));
  }
  EXPECT_THAT(Verdict([](auto& r) { r.mutable_state()->set_load_n(0); }),
              ::testing::HasSubstr("a wheel off the ground"));
  for (const double bad : {kNaN, kInf, -0.1}) {
    EXPECT_THAT(Verdict([&](auto& r) { r.mutable_state()->set_speed_m_per_s(bad); }),
                StartsWith("state.speed_m_per_s:"));
  }
  for (const double bad : {kNaN, -kInf, 3.2, -3.2}) {
    EXPECT_THAT(Verdict([&](auto& r) { r.mutable_state()->set_attack_angle_rad(bad); }),
                StartsWith("state.attack_angle_rad:"));
  }
  for (const double bad : {kNaN, kInf, 1.001, -2.001}) {
    EXPECT_THAT(Verdict([&](auto& r) { r.mutable_state()->set_slip(bad); }),
                StartsWith("state.slip:"));
  }
  for (const double bad : {kNaN, -1.0, 1e9}) {
    EXPECT_THAT(Verdict([&](auto& r) { r.set_max_time_s(bad); }), StartsWith("max_time_s:"));
  }
  EXPECT_THAT(Verdict([](auto& r) { r.mutable_state()->set_drawbar_n(3); }),
              StartsWith("state.drawbar_n:"));
  EXPECT_THAT(
      Verdict([](auto& r) { r.mutable_state()->set_mode(static_cast<v1alpha1::RigMode>(9)); }),
      StartsWith("state.mode:"));
  EXPECT_THAT(Verdict([](auto& r) { r.mutable_state()->set_mode(v1alpha1::RIG_MODE_FREE_SLIP); }),
              StartsWith("state.attack_angle_rad:"));
}

TEST(RequestChecks, SlipRangeIsWhatMotionCanReach) {
  // Every (v_x, v_y, r w) on a grid gives a slip that is accepted.
  for (double angle = -std::numbers::pi; angle <= std::numbers::pi; angle += 0.1) {
    for (double speed = 0.05; speed <= 1.0; speed += 0.05) {
      for (double rim = -1.0; rim <= 1.0; rim += 0.05) {
        const double slip = (rim - speed * std::cos(angle)) / std::max(std::abs(rim), speed);
        v1alpha1::TestState state;
        state.set_slip(slip);
        state.set_attack_angle_rad(angle);
        state.set_load_n(10);
        EXPECT_NO_THROW(CheckTestState(state)) << slip << " at " << angle;
      }
    }
  }
  v1alpha1::TestState state;
  state.set_load_n(10);
  state.set_slip(-1.9);
  EXPECT_NO_THROW(CheckTestState(state));
  state.set_attack_angle_rad(std::numbers::pi / 2);
  EXPECT_THROW(CheckTestState(state), StatusError) << "no counter-rotation slip at 90 degrees";
}

TEST(RequestChecks, RefusesASlipThatTheModeHasNoUseFor) {
  for (const double slip : {0.2, kNaN}) {
    EXPECT_THAT(Verdict([&](auto& r) {
                  r.mutable_state()->set_mode(v1alpha1::RIG_MODE_TOWED);
                  r.mutable_state()->set_slip(slip);
                }),
                StartsWith("state.slip:"));
  }
}

TEST(RequestChecks, CancelAndPromoteNeedTheirIds) {
  v1alpha1::CancelJobRequest cancel;
  EXPECT_THROW(CheckCancel(cancel), StatusError);
  cancel.set_job_id("job-1");
  EXPECT_THROW(CheckCancel(cancel), StatusError);
  cancel.set_request_id("a");
  EXPECT_NO_THROW(CheckCancel(cancel));
  v1alpha1::PromoteRequest promote;
  promote.set_job_id("job-1");
  EXPECT_NO_THROW(CheckPromote(promote));
  for (const char* bad : {"previous", "candidate", "Sta ble", "sha256"}) {
    promote.set_alias(bad);
    EXPECT_THROW(CheckPromote(promote), StatusError) << bad;
  }
  promote.set_alias("canary");
  const std::string digest(64, 'a');
  for (const std::string& good : {digest, digest.substr(0, 12)}) {
    promote.set_candidate_digest(good);
    EXPECT_NO_THROW(CheckPromote(promote)) << good;
  }
  for (const std::string& bad : {digest + "a", digest.substr(0, 11), "A" + digest.substr(1)}) {
    promote.set_candidate_digest(bad);
    EXPECT_THROW(CheckPromote(promote), StatusError) << bad;
  }
}

TEST(RequestChecks, ContentDependsOnWhatIsAskedNotOnWho) {
  EXPECT_EQ(ContentOf(Request("a")), ContentOf(Request("b")));
  auto other = Request("a");
  other.set_seed(4);
  EXPECT_NE(ContentOf(Request("a")), ContentOf(other));
}

TEST(RefinementSpec, TakesSoilWheelAndRigFromTheModel) {
  auto request = Request("a");
  request.set_max_time_s(1.5);
  const auto spec = BuildSpec(BaseModel(), request);
  EXPECT_EQ(spec.soil().grains().sizes(0).diameter_m(), 0.008);
  EXPECT_EQ(spec.wheel().radius_m(), 0.0625);
  EXPECT_EQ(spec.rig().bed_length_m(), 0.3);
  EXPECT_EQ(spec.rig().max_time_s(), 1.5);
  EXPECT_EQ(spec.state().mode(), v1alpha1::RIG_MODE_RIM_SPEED);
  EXPECT_EQ(spec.state().slip(), 0.35);
  EXPECT_EQ(spec.seed(), 7u) << "the tile of most training runs";
  request.set_seed(11);
  EXPECT_EQ(BuildSpec(BaseModel(), request).seed(), 11u);
}

TEST(RefinementSpec, RunsAtTheSpeedThatIsAskedFor) {
  auto request = Request("a");
  const double own = BuildSpec(BaseModel(), request).rig().speed_m_per_s();
  EXPECT_EQ(own, BaseModel().rig().speed_m_per_s());
  request.mutable_state()->set_speed_m_per_s(3 * own);
  const auto spec = BuildSpec(BaseModel(), request);
  EXPECT_EQ(spec.rig().speed_m_per_s(), 3 * own);
  EXPECT_EQ(spec.state().speed_m_per_s(), 0);
}

TEST(RefinementSpec, EqualWorkHasOneJoinKey) {
  const auto key = [](const SubmitRefinementRequest& request, const char* digest = "aa") {
    return JoinKeyOf("cmu-smooth-62.5", digest, BuildSpec(BaseModel(), request), request);
  };
  auto same = Request("b");
  same.set_seed(7);
  same.mutable_state()->set_mode(v1alpha1::RIG_MODE_RIM_SPEED);
  EXPECT_EQ(key(Request("a")), key(same));
  EXPECT_NE(key(Request("a")), key(Request("a", 0.4)));
  EXPECT_EQ(key(Request("a")), key(Request("a"), "bb")) << "of whatever stable is";
  auto pinned = Request("f");
  pinned.set_model("cmu-smooth-62.5@sha256:aa");
  EXPECT_NE(key(Request("a")), key(pinned));
  EXPECT_NE(key(pinned), key(pinned, "bb"));
  auto named = Request("g");
  named.set_model("cmu-smooth-62.5@stable");
  EXPECT_EQ(key(Request("a")), key(named));
  auto hasty = same, as_hasty = Request("e");
  for (auto* request : {&hasty, &as_hasty}) request->mutable_time_limit()->set_seconds(60);
  EXPECT_NE(key(same), key(hasty)) << "would end at the limit of another";
  EXPECT_EQ(key(hasty), key(as_hasty));
  auto towed = Request("c", 0.1), also_towed = Request("d", 0.2);
  towed.mutable_state()->set_mode(v1alpha1::RIG_MODE_TOWED);
  also_towed.mutable_state()->set_mode(v1alpha1::RIG_MODE_TOWED);
  EXPECT_EQ(key(towed), key(also_towed)) << "slip means nothing when towed";
}

TEST(RefinementSpec, RefusesAStateThatTheSceneCannotRun) {
  auto model = BaseModel();
  model.mutable_domain()->set_load_min_n(12);
  model.mutable_domain()->set_load_max_n(48);
  const auto check = [&](double load, double speed) {
    auto request = Request("a");
    request.mutable_state()->set_load_n(load);
    request.mutable_state()->set_speed_m_per_s(speed);
    return MessageOf([&] { CheckScene(model, BuildSpec(model, request)); });
  };
  EXPECT_EQ(check(24, 0), "");
  EXPECT_EQ(check(3, 0.2), "");
  EXPECT_EQ(check(144, 0), "");
  EXPECT_THAT(check(145, 0), HasSubstr("state.load_n: 145, expected 3 to 144 N"));
  EXPECT_THAT(check(2.9, 0), HasSubstr("state.load_n: 2.9"));
  EXPECT_THAT(check(24, 1.1), HasSubstr("state.speed_m_per_s: 1.1, expected at most 1 m/s"));
}

TEST(RefinementSpec, RefusesAModelWithoutGrains) {
  auto model = BaseModel();
  model.mutable_soil()->clear_grains();
  try {
    BuildSpec(model, Request("a"));
    FAIL();
  } catch (const StatusError& e) {
    EXPECT_EQ(e.code(), StatusCode::kFailedPrecondition);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("grains"));
  }
}

TEST(RefinementSpec, ARecordAnswersItsOwnSpecOnly) {
  const auto spec = BuildSpec(BaseModel(), Request("a"));
  v1alpha1::RunRecord record;
  *record.mutable_spec() = spec;
  record.mutable_spec()->set_scene("another name");
  record.mutable_spec()->mutable_soil()->clear_source();
  EXPECT_TRUE(Answers(record, spec));
  auto earlier = spec;  // of a job of before: its soil holds a field that has gone
  ASSERT_TRUE(earlier.mutable_soil()->MergeFromString(std::string("\x2a\x02\x08\x01", 4)));
  EXPECT_TRUE(Answers(record, earlier));
  record.mutable_spec()->set_seed(8);
  EXPECT_FALSE(Answers(record, spec));
  *record.mutable_spec() = spec;
  record.mutable_spec()->mutable_state()->set_load_n(25);
  EXPECT_FALSE(Answers(record, spec));
}

}  // namespace
}  // namespace grouser::server

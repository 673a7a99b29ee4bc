// Accuracy requests: who may answer, who does, and what is refused.
#include "server/core/accuracy_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "server/core/evaluator.h"
#include "tests/unit/server/fake_model.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

Snapshot::ModelPtr Make(const std::string& name, char digest, double half,
                        const std::string& soil = "sand", double width = 0.05) {
  v1alpha1::Model message = testing::FakeMessage(name, 0.5);
  message.mutable_bekker()->set_c1(half);
  message.mutable_soil()->set_name(soil);
  message.mutable_wheel()->set_width_m(width);
  testing::AddStraightForm(half <= 1, &message);  // rough: f_x alone
  return MakeServedModel(message, std::string(64, digest), false, testing::MakeFakeModel);
}

class AccuracyRequestTest : public ::testing::Test {
 protected:
  AccuracyRequestTest() {
    std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
    const auto rough = Make("rough", 'a', 4), fine = Make("fine", 'b', 1),
               finest = Make("fine", 'c', 0.5), clay = Make("clay", 'd', 0.1, "clay"),
               wide = Make("wide", 'e', 0.1, "sand", 0.06), idle = Make("idle", 'f', 0.1);
    aliases["rough"]["stable"] = rough;
    aliases["fine"]["stable"] = fine;
    aliases["fine"]["candidate"] = finest;
    aliases["clay"]["stable"] = clay;
    aliases["wide"]["stable"] = wide;
    aliases["idle"]["previous"] = idle;
    snapshot_ = Snapshot(1, {rough, fine, finest, clay, wide, idle}, std::move(aliases));
  }

  std::vector<std::string> Who(const std::string& reference) {
    const ServedModel* model = nullptr;
    EXPECT_TRUE(snapshot_.Find(reference, &model).ok());
    std::vector<std::string> names;
    for (const ServedModel* m : snapshot_.SelectableOf(reference, *model).models) {
      names.push_back(m->message.name() + m->digest[0]);
    }
    return names;
  }

  Status Run(const std::string& reference, bool values_only = false) {
    return Evaluate(snapshot_, reference, states_, {!values_only}, &model_, &responses_, accuracy_,
                    &selection_);
  }
  void AddState(double v_x, double load) {
    states_.mutable_velocity()->add_v_x_m_per_s(v_x);
    states_.mutable_velocity()->add_v_y_m_per_s(0);
    states_.mutable_velocity()->add_rim_speed_m_per_s(0.1);
    states_.add_load_n(load);
  }
  std::string NameOf(int i) const {
    return selection_.selectable->models[selection_.answered_by[i]]->message.name();
  }

  Snapshot snapshot_;
  v1alpha1::WheelStates states_;
  v1alpha1::AccuracyRequest accuracy_;
  v1alpha1::WheelResponses responses_;
  const ServedModel* model_ = nullptr;
  Selection selection_;
};

TEST_F(AccuracyRequestTest, StableModelsOfOneWheelAndSoilMayAnswerForEachOther) {
  EXPECT_THAT(Who("rough"), UnorderedElementsAre("rougha", "fineb"));
  EXPECT_THAT(Who("fine@stable"), UnorderedElementsAre("rougha", "fineb"));
  EXPECT_THAT(Who("clay"), UnorderedElementsAre("clayd"));
  EXPECT_THAT(Who("wide"), UnorderedElementsAre("widee"));
}

TEST_F(AccuracyRequestTest, ACandidateStandsInForTheStableModelOfItsName) {
  EXPECT_THAT(Who("fine@candidate"), UnorderedElementsAre("rougha", "finec"));
  EXPECT_THAT(Who("idle@previous"), UnorderedElementsAre("rougha", "fineb", "idlef"));
}

TEST_F(AccuracyRequestTest, ADigestAnswersAlone) {
  EXPECT_THAT(Who("fine@sha256:" + std::string(12, 'b')), UnorderedElementsAre("fineb"));
  AddState(0.05, 24);
  accuracy_.set_f_x_n(0.2);
  ASSERT_TRUE(Run("rough@sha256:" + std::string(64, 'a')).ok());
  EXPECT_EQ(NameOf(0), "rough");
  EXPECT_EQ(responses_.flags(0) & v1alpha1::STATE_FLAG_TOLERANCE_UNMET,
            v1alpha1::STATE_FLAG_TOLERANCE_UNMET);
}

TEST_F(AccuracyRequestTest, TheOneThatSufficesAnswersWithItsOwnUncertainty) {
  AddState(0.05, 24);
  AddState(testing::kNan, 24);
  accuracy_.set_f_x_n(2);
  ASSERT_TRUE(Run("rough").ok());
  EXPECT_EQ(model_->message.name(), "rough");  // that was named
  EXPECT_EQ(NameOf(0), "fine");
  EXPECT_EQ(responses_.flags(0), 0u);
  EXPECT_DOUBLE_EQ(responses_.f_x().high(0) - responses_.f_x().low(0), 2);
  EXPECT_EQ(responses_.f_x().sd_form(0), 2);
  EXPECT_EQ(responses_.flags(1), v1alpha1::STATE_FLAG_INVALID);
  EXPECT_EQ(selection_.worst.excess, 0);
  accuracy_.set_f_x_n(0.8);
  ASSERT_TRUE(Run("rough").ok());
  EXPECT_EQ(NameOf(0), "fine");
  EXPECT_EQ(responses_.flags(0), v1alpha1::STATE_FLAG_TOLERANCE_UNMET);
  EXPECT_EQ(responses_.flags(1), v1alpha1::STATE_FLAG_INVALID);
  EXPECT_DOUBLE_EQ(selection_.worst.excess, 1 / 0.8);
  EXPECT_EQ(selection_.worst.index, 0u);
}

TEST_F(AccuracyRequestTest, ValuesOnlyStillChoosesByIntervals) {
  AddState(0.05, 24);
  accuracy_.set_share_of_load(2.0 / 24 / 0.0625);  // moments decide: 2 N m
  accuracy_.set_f_x_n(2);
  ASSERT_TRUE(Run("rough", true).ok());
  EXPECT_EQ(NameOf(0), "fine");
  EXPECT_EQ(responses_.f_x().low_size() + responses_.f_x().sd_form_size(), 0);
  EXPECT_EQ(responses_.flags(0), 0u);
}

TEST_F(AccuracyRequestTest, FormUnknownIsToldOfWhoAnswered) {
  AddState(0.05, 24);
  accuracy_.set_f_x_n(0.8);
  ASSERT_TRUE(Run("rough@sha256:" + std::string(64, 'a')).ok());
  EXPECT_TRUE(responses_.flags(0) & v1alpha1::STATE_FLAG_FORM_UNKNOWN);
  EXPECT_TRUE(std::isnan(responses_.torque().sd_form(0)));
  ASSERT_TRUE(Run("rough").ok());
  EXPECT_FALSE(responses_.flags(0) & v1alpha1::STATE_FLAG_FORM_UNKNOWN);
}

TEST_F(AccuracyRequestTest, AgainstAMeasurementSdFormCountsAndNoRunIsProposed) {
  v1alpha1::Model message = testing::FakeMessage("sand", 0.5);
  testing::AddStraightForm(false, &message);  // hypot(3, 4) at 24 N
  const auto model = MakeServedModel(message, std::string(64, 'a'), false, testing::MakeFakeModel);
  std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
  aliases["sand"]["stable"] = model;
  snapshot_ = Snapshot(2, {model}, std::move(aliases));
  const auto unmet = [&](double f_x, double torque) {
    accuracy_.set_f_x_n(f_x);
    accuracy_.set_torque_n_m(torque);
    EXPECT_TRUE(Run("sand").ok());
    return (responses_.flags(0) & v1alpha1::STATE_FLAG_TOLERANCE_UNMET) != 0;
  };
  AddState(0.05, 24);
  EXPECT_FALSE(unmet(3.1, 0));
  accuracy_.set_interval_target(v1alpha1::INTERVAL_TARGET_MEASURED);
  EXPECT_TRUE(unmet(4.9, 0));
  EXPECT_EQ(selection_.worst.excess, 0);
  EXPECT_FALSE(unmet(5.1, 0));
  EXPECT_DOUBLE_EQ(responses_.f_x().measured_high(0), 11);
  EXPECT_TRUE(unmet(0, 1e6));  // torque was not measured
  accuracy_.Clear();
  accuracy_.set_interval_target(v1alpha1::INTERVAL_TARGET_MEASURED);
  accuracy_.set_budget_us(100);
  const Status without = Run("sand");
  EXPECT_EQ(without.code, StatusCode::kInvalidArgument);
  EXPECT_THAT(without.message, HasSubstr("INTERVAL_TARGET_MEASURED without a tolerance"));
  accuracy_.set_interval_target(static_cast<v1alpha1::IntervalTarget>(7));
  EXPECT_THAT(Run("sand").message, HasSubstr("accuracy.interval_target: 7"));
}

TEST_F(AccuracyRequestTest, AnEmptyAccuracyRequestIsNone) {
  AddState(0.05, 24);
  AddState(0.02, 15);
  v1alpha1::WheelResponses plain;
  ASSERT_TRUE(Evaluate(snapshot_, "rough", states_, {}, &model_, &plain).ok());
  ASSERT_TRUE(Run("rough").ok());
  EXPECT_EQ(selection_.selectable, nullptr);
  EXPECT_EQ(responses_.SerializeAsString(), plain.SerializeAsString());
}

TEST_F(AccuracyRequestTest, BadNumbersNameTheField) {
  AddState(0.05, 24);
  const auto refused = [&](void (v1alpha1::AccuracyRequest::*set)(double), const char* field) {
    for (const double bad : {-1.0, testing::kNan, std::numeric_limits<double>::infinity()}) {
      accuracy_.Clear();
      (accuracy_.*set)(bad);
      const Status status = Run("rough");
      EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << field << bad;
      EXPECT_THAT(status.message,
                  AllOf(HasSubstr(std::string("accuracy.") + field + ": "), HasSubstr("expected")));
      EXPECT_EQ(selection_.selectable, nullptr);
      EXPECT_EQ(responses_.ByteSizeLong(), 0u);
    }
  };
  using v1alpha1::AccuracyRequest;
  refused(&AccuracyRequest::set_f_x_n, "f_x_n");
  refused(&AccuracyRequest::set_f_y_n, "f_y_n");
  refused(&AccuracyRequest::set_f_z_n, "f_z_n");
  refused(&AccuracyRequest::set_torque_n_m, "torque_n_m");
  refused(&AccuracyRequest::set_m_z_n_m, "m_z_n_m");
  refused(&AccuracyRequest::set_sinkage_m, "sinkage_m");
  refused(&AccuracyRequest::set_share_of_load, "share_of_load");
  refused(&AccuracyRequest::set_budget_us, "budget_us");
  accuracy_.Clear();
  accuracy_.set_budget_us(1e306);
  EXPECT_THAT(Run("rough").message, HasSubstr("budget_us"));
}

TEST(ToTestState, MirrorsIntoTheQuarterWhereRunsAre) {
  const auto forward = ToTestState(0.08, 0.02, 0.1, 24), back = ToTestState(-0.08, -0.02, -0.1, 24);
  EXPECT_EQ(forward.SerializeAsString(), back.SerializeAsString());
  EXPECT_EQ(forward.mode(), v1alpha1::RIG_MODE_RIM_SPEED);
  EXPECT_NEAR(forward.slip(), 0.2, 1e-12);
  EXPECT_NEAR(forward.attack_angle_rad(), std::atan2(0.02, 0.08), 1e-12);
  EXPECT_EQ(forward.load_n(), 24);
  EXPECT_NEAR(ToTestState(0, -0.1, 0.05, 24).attack_angle_rad(), std::numbers::pi / 2, 1e-12);
}

}  // namespace
}  // namespace grouser::server

#include "server/core/evaluator.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "server/core/model_reference.h"
#include "tests/unit/server/fake_model.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using v1alpha1::WheelResponses;
using v1alpha1::WheelStates;

constexpr double kInf = std::numeric_limits<double>::infinity();

WheelStates Velocities(int n) {
  WheelStates states;
  for (int i = 0; i < n; ++i) {
    states.mutable_velocity()->add_v_x_m_per_s(0.05);
    states.mutable_velocity()->add_v_y_m_per_s(0);
    states.mutable_velocity()->add_rim_speed_m_per_s(0.1);
    states.add_load_n(24);
  }
  return states;
}

class EvaluatorTest : public ::testing::Test {
 protected:
  EvaluatorTest() { Install(testing::FakeMessage("sand", 0.5)); }
  void Install(const v1alpha1::Model& message) {
    const auto model =
        MakeServedModel(message, std::string(64, 'a'), false, testing::MakeFakeModel);
    std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
    aliases["sand"]["stable"] = model;
    snapshot_ = Snapshot(7, {model}, std::move(aliases));
  }

  Status Run(const WheelStates& states, bool values_only = false,
             const std::string& reference = "sand") {
    return Evaluate(snapshot_, reference, states, {!values_only}, &answered_by_, &responses_);
  }

  void ExpectRefused(const WheelStates& states, StatusCode code,
                     const ::testing::Matcher<const std::string&>& text) {
    const Status status = Run(states);
    EXPECT_EQ(status.code, code);
    EXPECT_THAT(status.message, text);
    EXPECT_EQ(answered_by_, nullptr);
    EXPECT_EQ(responses_.ByteSizeLong(), 0u);
  }

  Snapshot snapshot_;
  const ServedModel* answered_by_ = nullptr;
  WheelResponses responses_;
};

// Every flag of the wire is the models' flag of the same bit and name, and none is left over.
TEST(StateFlags, AreThoseOfTheModels) {
  const auto* wire = v1alpha1::StateFlag_descriptor();
  ASSERT_EQ(wire->value_count() - 1, static_cast<int>(std::size(surrogate::kFlagFields)));
  for (const surrogate::FlagField& ours : surrogate::kFlagFields) {
    const auto* theirs = wire->FindValueByNumber(static_cast<int>(ours.flag));
    ASSERT_NE(theirs, nullptr) << ours.name;
    EXPECT_EQ(theirs->name(), std::string("STATE_FLAG_") + ours.name);
  }
}

// Outputs of the wire stand in the models' order, by name.
TEST(WireOutputs, AreThoseOfTheModels) {
  const auto* wire = v1alpha1::WheelResponses::descriptor();
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    EXPECT_EQ(wire->FindFieldByNumber(o + 1)->name(), surrogate::kOutputFields[o].name);
  }
}

TEST_F(EvaluatorTest, AnswersVelocityForm) {
  ASSERT_TRUE(Run(Velocities(2)).ok());
  ASSERT_NE(answered_by_, nullptr);
  EXPECT_EQ(answered_by_->reference, "sand@sha256:" + std::string(64, 'a'));
  ASSERT_EQ(responses_.f_x().value_size(), 2);
  EXPECT_DOUBLE_EQ(responses_.f_x().value(1), 0.5 * 24 * 0.5);
  EXPECT_DOUBLE_EQ(responses_.f_z().value(0), 24);
  EXPECT_DOUBLE_EQ(responses_.f_x().low(0), 3);
  EXPECT_DOUBLE_EQ(responses_.f_x().high(0), 9);
  EXPECT_DOUBLE_EQ(responses_.torque().sd_patch(1), 2);
  EXPECT_DOUBLE_EQ(responses_.slip().slip(0), 0.5);
  EXPECT_DOUBLE_EQ(responses_.slip().speed_m_per_s(0), 0.1);
  EXPECT_DOUBLE_EQ(responses_.velocity().v_x_m_per_s(0), 0.05);
  EXPECT_DOUBLE_EQ(responses_.interval_level(), 0.9);
  EXPECT_EQ(responses_.interval_target(), v1alpha1::INTERVAL_TARGET_DEM);
}

TEST_F(EvaluatorTest, UnknownFormIsNanAndFlaggedNeverZero) {
  ASSERT_TRUE(Run(Velocities(1)).ok());
  EXPECT_TRUE(std::isnan(responses_.f_x().sd_form(0)));
  EXPECT_EQ(responses_.flags(0), v1alpha1::STATE_FLAG_FORM_UNKNOWN);
}

TEST_F(EvaluatorTest, KnownFormIsThatOfTheStatesRegionWithItsInterval) {
  v1alpha1::Model message = testing::FakeMessage("sand", 0.5);
  testing::AddStraightForm(false, &message);
  Install(message);
  WheelStates states = Velocities(4);
  states.mutable_velocity()->set_v_y_m_per_s(1, 0.05);
  states.mutable_velocity()->set_rim_speed_m_per_s(2, 0.01);
  states.set_load_n(3, 0);
  ASSERT_TRUE(Run(states).ok());
  EXPECT_DOUBLE_EQ(responses_.f_x().sd_form(0), 2);
  EXPECT_DOUBLE_EQ(responses_.f_x().measured_low(0), 6 - 5);  // hypot(3, 2 2)
  EXPECT_DOUBLE_EQ(responses_.f_x().measured_high(0), 6 + 5);
  EXPECT_DOUBLE_EQ(responses_.f_x().high(0), 9);  // against DEM, as before
  for (const int i : {1, 2}) {
    EXPECT_TRUE(std::isnan(responses_.f_x().sd_form(i)));
    EXPECT_TRUE(std::isnan(responses_.f_x().measured_high(i)));
  }
  EXPECT_EQ(responses_.f_x().measured_low(3), 0);
  EXPECT_EQ(responses_.flags(3), v1alpha1::STATE_FLAG_AIRBORNE);
  EXPECT_EQ(responses_.torque().measured_low_size(), 0);  // unknown for all states
  EXPECT_TRUE(std::isnan(responses_.torque().sd_form(0)));
  EXPECT_EQ(responses_.flags(0), v1alpha1::STATE_FLAG_FORM_UNKNOWN);  // of torque
  ASSERT_TRUE(Run(states, true).ok());
  EXPECT_EQ(responses_.f_x().measured_low_size() + responses_.f_x().sd_form_size(), 0);
}

TEST_F(EvaluatorTest, WhereAllIsKnownNoFlagSaysOtherwise) {
  v1alpha1::Model message = testing::FakeMessage("sand", 0.5);
  testing::AddStraightForm(true, &message);
  Install(message);
  WheelStates states = Velocities(2);
  states.mutable_velocity()->set_v_y_m_per_s(1, 0.05);
  for (const bool values_only : {false, true}) {
    ASSERT_TRUE(Run(states, values_only).ok());
    EXPECT_EQ(responses_.flags(0), 0u);
    EXPECT_EQ(responses_.flags(1), v1alpha1::STATE_FLAG_FORM_UNKNOWN);
  }
}

TEST_F(EvaluatorTest, SlipFormAtTrainingSpeedEqualsItsVelocities) {
  WheelStates states;
  states.mutable_slip()->add_slip(0.2);
  states.mutable_slip()->add_attack_angle_rad(0.5);
  states.add_load_n(30);
  ASSERT_TRUE(Run(states).ok());
  EXPECT_NEAR(responses_.slip().slip(0), 0.2, 1e-12);
  EXPECT_NEAR(responses_.slip().attack_angle_rad(0), 0.5, 1e-12);
  EXPECT_NEAR(responses_.slip().speed_m_per_s(0), 0.1, 1e-15);
  EXPECT_NEAR(responses_.f_x().value(0), 0.5 * 30 * 0.2, 1e-12);
  EXPECT_NEAR(responses_.f_y().value(0), -0.5 * 30 * std::sin(0.5), 1e-12);

  WheelStates by_velocity;
  *by_velocity.mutable_velocity() = responses_.velocity();
  by_velocity.add_load_n(30);
  const double f_x = responses_.f_x().value(0);
  ASSERT_TRUE(Run(by_velocity).ok());
  EXPECT_DOUBLE_EQ(responses_.f_x().value(0), f_x);
}

TEST_F(EvaluatorTest, SlipFormWithImpossibleSlipOrSpeedIsInvalidAndAtRestStatic) {
  WheelStates states;
  const auto add = [&states](double slip, double angle, double speed) {
    states.mutable_slip()->add_slip(slip);
    states.mutable_slip()->add_attack_angle_rad(angle);
    states.mutable_slip()->add_speed_m_per_s(speed);
    states.add_load_n(24);
  };
  add(2.5, 0, 0.1);
  add(0.1, 0, -0.1);
  add(0.1, 0, testing::kNan);
  add(0.1, 0, 0);
  add(0.1, 0, 0.1);
  ASSERT_TRUE(Run(states).ok());
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(responses_.flags(i), v1alpha1::STATE_FLAG_INVALID) << i;
    EXPECT_TRUE(std::isnan(responses_.f_x().value(i))) << i;
    EXPECT_EQ(responses_.slip().slip(i), states.slip().slip(i)) << "echoed as given";
  }
  EXPECT_TRUE(responses_.flags(3) & v1alpha1::STATE_FLAG_STATIC);
  EXPECT_FALSE(responses_.flags(4) & v1alpha1::STATE_FLAG_INVALID);
}

// Sums over a vehicle stay finite: nothing of a wheel off the ground is NaN.
TEST_F(EvaluatorTest, AWheelOffTheGroundAnswersZeros) {
  WheelStates states = Velocities(4);
  states.set_load_n(1, 0);
  states.set_load_n(2, -0.0);
  ASSERT_TRUE(Run(states).ok());
  const auto* wire = WheelResponses::descriptor();
  for (const int i : {1, 2}) {
    EXPECT_EQ(responses_.flags(i), v1alpha1::STATE_FLAG_AIRBORNE);
    for (const auto& field : surrogate::kOutputFields) {
      const auto& output = dynamic_cast<const v1alpha1::OutputArray&>(
          responses_.GetReflection()->GetMessage(responses_, wire->FindFieldByName(field.name)));
      for (const auto* part : {&output.value(), &output.sd_fit(), &output.sd_patch(), &output.low(),
                               &output.high(), &output.sd_form()}) {
        EXPECT_EQ(part->Get(i), 0) << field.name;
      }
    }
  }
  EXPECT_EQ(responses_.flags(3), v1alpha1::STATE_FLAG_FORM_UNKNOWN);
  EXPECT_TRUE(std::isnan(responses_.f_x().sd_form(3)));
  ASSERT_TRUE(Run(states, /*values_only=*/true).ok());
  EXPECT_EQ(responses_.flags(1), v1alpha1::STATE_FLAG_AIRBORNE);
  EXPECT_EQ(responses_.f_z().value(1), 0);
}

TEST_F(EvaluatorTest, BadStatesAreFlaggedAndHarmNoOther) {
  WheelStates states = Velocities(6);
  states.mutable_velocity()->set_v_x_m_per_s(1, testing::kNan);
  states.mutable_velocity()->set_rim_speed_m_per_s(2, kInf);
  states.set_load_n(3, -1);
  states.mutable_velocity()->set_v_x_m_per_s(4, 0);
  states.mutable_velocity()->set_rim_speed_m_per_s(4, 0);
  ASSERT_TRUE(Run(states).ok());
  for (const int bad : {1, 2, 3}) {
    EXPECT_TRUE(responses_.flags(bad) & v1alpha1::STATE_FLAG_INVALID) << bad;
    for (const auto* output : {&responses_.f_x(), &responses_.sinkage()}) {
      EXPECT_TRUE(std::isnan(output->value(bad))) << bad;
      EXPECT_TRUE(std::isnan(output->low(bad))) << bad;
    }
  }
  EXPECT_TRUE(responses_.flags(4) & v1alpha1::STATE_FLAG_STATIC);
  for (const int good : {0, 5}) EXPECT_DOUBLE_EQ(responses_.f_x().value(good), 6) << good;
}

// The fake model has no gradients: NaN, never what the memory held before.
TEST_F(EvaluatorTest, GradientsAreThereWhereTheyWereAskedFor) {
  const auto run = [&](int n, AnswerParts parts) {
    return Evaluate(snapshot_, "sand", Velocities(n), parts, &answered_by_, &responses_);
  };
  WheelStates states = Velocities(2);
  states.set_load_n(1, 0);
  ASSERT_TRUE(Evaluate(snapshot_, "sand", states, {true, true}, &answered_by_, &responses_).ok());
  for (const auto* of : {&responses_.f_x(), &responses_.m_z(), &responses_.sinkage()}) {
    for (const auto* d : {&of->d_v_x(), &of->d_v_y(), &of->d_rim_speed(), &of->d_load()}) {
      ASSERT_EQ(d->size(), 2);
      EXPECT_TRUE(std::isnan(d->Get(0)));
      EXPECT_EQ(d->Get(1), 0) << "off the ground";
    }
  }
  ASSERT_TRUE(run(3, {true, false}).ok());
  EXPECT_EQ(responses_.f_x().d_v_x_size() + responses_.torque().d_load_size(), 0);
  ASSERT_TRUE(run(3, {false, true}).ok());
  EXPECT_EQ(responses_.f_x().d_v_y_size(), 3);
  EXPECT_EQ(responses_.f_x().low_size(), 0);
}

TEST_F(EvaluatorTest, TheLargestAnswerWithGradientsFitsAClient) {
  v1alpha1::Model message = testing::FakeMessage("sand", 0.5);
  testing::AddStraightForm(true, &message);  // with intervals for measurements, too
  Install(message);
  const auto run = [&](int n) {
    return Evaluate(snapshot_, "sand", Velocities(n), {true, true}, &answered_by_, &responses_);
  };
  ASSERT_TRUE(run(kMaxStatesWithGradients).ok());
  EXPECT_LT(responses_.ByteSizeLong(), std::size_t{4} << 20);
  const Status refused = run(kMaxStatesWithGradients + 1);
  EXPECT_EQ(refused.code, StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message, HasSubstr("5001"));
}

TEST_F(EvaluatorTest, ValuesOnlyLeavesUncertaintyOutAlsoInReusedMemory) {
  ASSERT_TRUE(Run(Velocities(3)).ok());
  ASSERT_TRUE(Run(Velocities(2), true).ok());
  EXPECT_EQ(responses_.f_x().value_size(), 2);
  EXPECT_EQ(responses_.f_x().low_size(), 0);
  EXPECT_EQ(responses_.m_z().sd_form_size(), 0);
  ASSERT_TRUE(Run(Velocities(4)).ok());
  EXPECT_EQ(responses_.f_x().low_size(), 4);
  EXPECT_EQ(responses_.flags_size(), 4);
}

TEST_F(EvaluatorTest, RefusesEmptyAndOversizedBatches) {
  ExpectRefused(Velocities(0), StatusCode::kInvalidArgument, HasSubstr("states.kinematics"));
  WheelStates empty;
  empty.mutable_velocity();
  ExpectRefused(empty, StatusCode::kInvalidArgument,
                AllOf(HasSubstr("states.load_n"), HasSubstr("empty")));
  ExpectRefused(Velocities(kMaxStates + 1), StatusCode::kResourceExhausted,
                AllOf(HasSubstr("states.load_n"), HasSubstr("10001"), HasSubstr("10000")));
  EXPECT_TRUE(Run(Velocities(kMaxStates)).ok());
}

TEST_F(EvaluatorTest, RefusesMismatchedLengthsNamingFieldAndLengths) {
  WheelStates states = Velocities(3);
  states.mutable_velocity()->add_v_y_m_per_s(0);
  ExpectRefused(states, StatusCode::kInvalidArgument,
                AllOf(HasSubstr("states.velocity.v_y_m_per_s"), HasSubstr("4"), HasSubstr("3")));
  states = Velocities(3);
  states.add_pass_number(1);
  ExpectRefused(states, StatusCode::kInvalidArgument, HasSubstr("states.pass_number: 1"));
  states = Velocities(3);
  states.add_yaw_rate_rad_per_s(0);
  ExpectRefused(states, StatusCode::kInvalidArgument, HasSubstr("states.yaw_rate_rad_per_s"));
  WheelStates slip;
  slip.mutable_slip()->add_slip(0.1);
  slip.add_load_n(24);
  ExpectRefused(slip, StatusCode::kInvalidArgument,
                HasSubstr("states.slip.attack_angle_rad: 0 entries"));
}

TEST_F(EvaluatorTest, ResolvesReferences) {
  const auto code = [this](const std::string& reference) {
    return Run(Velocities(1), false, reference).code;
  };
  EXPECT_EQ(code(""), StatusCode::kOk);
  EXPECT_EQ(code("sand@stable"), StatusCode::kOk);
  EXPECT_EQ(code("sand@sha256:aaaaaaaaaaaa"), StatusCode::kOk);
  EXPECT_EQ(code("sand@sha256:bbbbbbbbbbbb"), StatusCode::kNotFound);
  EXPECT_EQ(code("sand@candidate"), StatusCode::kNotFound);
  EXPECT_EQ(code("clay"), StatusCode::kNotFound);
  EXPECT_EQ(code("sand@sha256:aaaa"), StatusCode::kInvalidArgument);
  EXPECT_EQ(code("sand@sha256:AAAAAAAAAAAA"), StatusCode::kInvalidArgument);
  EXPECT_EQ(code("@stable"), StatusCode::kInvalidArgument);
  EXPECT_EQ(code("sand@"), StatusCode::kInvalidArgument);
  EXPECT_LT(Run(Velocities(1), false, std::string(1000000, 'x')).message.size(), 500u);
  EXPECT_THAT(Run(Velocities(1), false, "clay").message,
              AllOf(HasSubstr("clay"), HasSubstr("sand@stable")));
}

TEST(QuoteTest, CutsLongTextBetweenCharacters) {
  const std::string hundred(100, 'x');
  EXPECT_EQ(Quote("sand"), "'sand'");
  EXPECT_EQ(Quote(hundred), fmt::format("'{}'", hundred));
  EXPECT_EQ(Quote(hundred + "x"), fmt::format("'{}...'", hundred));
  // A two-byte character on the cut goes as a whole.
  const std::string before(99, 'x');
  EXPECT_EQ(Quote(before + "\xc3\xa9tail"), fmt::format("'{}...'", before));
}

}  // namespace
}  // namespace grouser::server

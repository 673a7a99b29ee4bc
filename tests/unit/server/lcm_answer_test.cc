#include "server/query/lcm/lcm_answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "grouser_lcm/wheel_query_t.hpp"
#include "server/query/lcm/lcm_record.h"
#include "tests/unit/server/fake_model.h"

namespace grouser::server {
namespace {

using grouser_lcm::wheel_query_t;
using ::testing::HasSubstr;

constexpr std::size_t kOffsetOfSenderLength = 24;  // hash, utime, sequence

wheel_query_t Query(int n) {
  wheel_query_t query;
  query.utime = 11;
  query.sequence = 42;
  query.sender = "me";
  query.model = "sand";
  query.n = n;
  query.v_x.assign(n, 0.05);
  query.v_y.assign(n, 0.0);
  query.rim_speed.assign(n, 0.1);
  query.load.assign(n, 24.0);
  return query;
}

std::vector<std::uint8_t> Encode(const wheel_query_t& query) {
  std::vector<std::uint8_t> bytes(query.getEncodedSize());
  query.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Where n stands for the sender and model of Query().
std::size_t OffsetOfN() { return kOffsetOfSenderLength + 4 + 3 + 4 + 5; }

class LcmAnswerTest : public ::testing::Test {
 protected:
  LcmAnswerTest() {
    const auto model = MakeServedModel(testing::FakeMessage("sand", 0.5), std::string(64, 'a'),
                                       false, testing::MakeFakeModel);
    std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
    aliases["sand"]["stable"] = model;
    snapshot_ = Snapshot(1, {model}, std::move(aliases));
  }
  auto Answer(const std::vector<std::uint8_t>& bytes) {
    problem_.clear();
    return AnswerLcm(snapshot_, bytes, &problem_, &measured_);
  }

  Snapshot snapshot_;
  std::string problem_;
  grouser_lcm::wheel_measured_t measured_;
};

TEST_F(LcmAnswerTest, SaysWhatIsKnownOfMeasurementsInAMessageOfItsOwn) {
  ASSERT_TRUE(Answer(Encode(Query(2))).has_value());
  EXPECT_EQ(measured_.n, 0);  // nothing
  v1alpha1::Model message = testing::FakeMessage("sand", 0.5);
  testing::AddStraightForm(false, &message);
  const auto model = MakeServedModel(message, std::string(64, 'a'), false, testing::MakeFakeModel);
  std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
  aliases["sand"]["stable"] = model;
  snapshot_ = Snapshot(2, {model}, std::move(aliases));
  const auto response = Answer(Encode(Query(2)));
  ASSERT_TRUE(response.has_value()) << problem_;
  EXPECT_EQ(measured_.n, 2);
  EXPECT_EQ(measured_.sender, "me");
  EXPECT_EQ(measured_.sequence, 42);
  EXPECT_EQ(measured_.model, response->model);
  EXPECT_DOUBLE_EQ(measured_.f_x.sd_form[1], 2);
  EXPECT_DOUBLE_EQ(measured_.f_x.high[1], response->f_x.value[1] + 5);
  EXPECT_EQ(measured_.torque.n, 0);
}

TEST_F(LcmAnswerTest, AnswersWithEchoes) {
  auto query = Query(3);
  query.v_x[1] = std::numeric_limits<double>::quiet_NaN();
  const auto response = Answer(Encode(query));
  ASSERT_TRUE(response.has_value()) << problem_;
  EXPECT_EQ(response->error, "");
  EXPECT_EQ(response->utime, 11);
  EXPECT_EQ(response->sequence, 42);
  EXPECT_EQ(response->sender, "me");
  EXPECT_EQ(response->model, "sand@sha256:" + std::string(64, 'a'));
  ASSERT_EQ(response->n, 3);
  EXPECT_DOUBLE_EQ(response->f_x.value[0], 6);
  EXPECT_DOUBLE_EQ(response->f_x.high[2], 9);
  EXPECT_DOUBLE_EQ(response->slip[2], 0.5);
  EXPECT_EQ(response->flags[0], 512);
  EXPECT_EQ(response->flags[1], 1);
  EXPECT_TRUE(std::isnan(response->f_x.value[1]));
}

TEST_F(LcmAnswerTest, AWheelOffTheGroundAnswersZeros) {
  auto query = Query(2);
  query.load[1] = 0;
  const auto response = Answer(Encode(query));
  ASSERT_TRUE(response.has_value()) << problem_;
  EXPECT_EQ(response->flags[1], static_cast<std::int32_t>(surrogate::kAirborne));
  for (const auto* output : {&response->f_x, &response->f_z, &response->sinkage}) {
    EXPECT_EQ(output->value[1], 0);
    EXPECT_EQ(output->low[1], 0);
    EXPECT_EQ(output->high[1], 0);
  }
  EXPECT_DOUBLE_EQ(response->f_x.value[0], 6);
}

TEST_F(LcmAnswerTest, RefusesTooManyStatesAndUnknownModelInTheAnswer) {
  auto response = Answer(Encode(Query(kMaxLcmStates + 1)));
  ASSERT_TRUE(response.has_value());
  EXPECT_THAT(response->error, HasSubstr("65"));
  EXPECT_EQ(response->sequence, 42);
  EXPECT_EQ(response->n, 0);
  response = Answer(Encode(Query(0)));
  ASSERT_TRUE(response.has_value());
  EXPECT_THAT(response->error, HasSubstr("n: 0"));
  auto query = Query(1);
  query.model = "clay";
  response = Answer(Encode(query));
  ASSERT_TRUE(response.has_value());
  EXPECT_THAT(response->error, HasSubstr("clay"));
}

TEST_F(LcmAnswerTest, BiggestAnswerStaysUnderTheLcmLimit) {
  auto query = Query(kMaxLcmStates);
  query.sender.assign(255, 's');
  const auto response = Answer(Encode(query));
  ASSERT_TRUE(response.has_value()) << problem_;
  EXPECT_LT(response->getEncodedSize(), 65499);
}

TEST_F(LcmAnswerTest, LyingLengthsAreAnsweredOrDroppedNeverTrusted) {
  auto bytes = Encode(Query(2));
  for (const std::uint32_t n : {0xffffffffu, 0x7fffffffu, 3u, 1u}) {
    for (int i = 0; i < 4; ++i) bytes[OffsetOfN() + i] = (n >> (24 - 8 * i)) & 0xff;
    const auto response = Answer(bytes);
    ASSERT_TRUE(response.has_value());
    EXPECT_NE(response->error, "") << n;
  }
  bytes = Encode(Query(2));
  for (const std::uint32_t length : {0u, 0xffffffffu, 0x10000u}) {
    for (int i = 0; i < 4; ++i) {
      bytes[kOffsetOfSenderLength + i] = (length >> (24 - 8 * i)) & 0xff;
    }
    EXPECT_FALSE(Answer(bytes).has_value()) << length;
    EXPECT_NE(problem_, "");
  }
}

// lcm-gen encodes up to the first NUL: the answer would be cut there.
TEST_F(LcmAnswerTest, TextWithANulInsideIsDropped) {
  auto bytes = Encode(Query(1));
  bytes[kOffsetOfSenderLength + 4] = 0;
  EXPECT_FALSE(Answer(bytes).has_value());
  bytes = Encode(Query(1));
  bytes[kOffsetOfSenderLength + 4 + 2] = 'x';  // no final NUL
  EXPECT_FALSE(Answer(bytes).has_value());
}

TEST_F(LcmAnswerTest, TruncatedForeignAndRandomBytesAreSurvived) {
  const auto whole = Encode(Query(2));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto response = Answer({whole.begin(), whole.begin() + size});
    if (response) {
      EXPECT_NE(response->error, "") << size;
    }
  }
  EXPECT_FALSE(Answer({1, 2, 3, 4, 5, 6, 7, 8, 9}).has_value());
  EXPECT_EQ(problem_, "not a wheel_query_t");
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    auto bytes = whole;
    for (int i = 0; i < 4; ++i) bytes[8 + random() % (bytes.size() - 8)] = random() & 0xff;
    Answer(bytes);
  }
}

// What was asked and answered, as the log of queries has it.
TEST_F(LcmAnswerTest, IsRecordedAsAnEvaluateWheelsCall) {
  auto query = Query(3);
  query.load = {24, 0, -1};
  query.v_y = {0.1, 0.2, 0.3};
  LcmOutcome outcome;
  const auto response = AnswerLcm(snapshot_, Encode(query), &problem_, &measured_, &outcome);
  ASSERT_TRUE(response.has_value());
  const LcmRecord record = RecordOf(outcome.query, *response, measured_);
  EXPECT_EQ(record.request.sequence(), 42u);
  EXPECT_EQ(record.request.model(), "sand");
  EXPECT_THAT(record.request.states().load_n(), ::testing::ElementsAreArray(query.load));
  EXPECT_THAT(record.request.states().velocity().v_y_m_per_s(),
              ::testing::ElementsAreArray(query.v_y));
  EXPECT_THAT(record.request.states().velocity().rim_speed_m_per_s(),
              ::testing::ElementsAreArray(query.rim_speed));
  const v1alpha1::WheelResponses& r = record.response.responses();
  EXPECT_EQ(record.response.model(), response->model);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(r.flags(i), static_cast<std::uint32_t>(response->flags[i]));
  }
  EXPECT_EQ(r.f_y().value(0), response->f_y.value[0]);
  EXPECT_EQ(r.torque().sd_fit(0), response->torque.sd_fit[0]);
  EXPECT_EQ(r.m_z().sd_patch(1), response->m_z.sd_patch[1]);
  EXPECT_EQ(r.sinkage().low(0), response->sinkage.low[0]);
  EXPECT_EQ(r.f_x().high(0), response->f_x.high[0]);
  EXPECT_EQ(r.slip().attack_angle_rad(0), response->attack_angle[0]);
  EXPECT_EQ(r.velocity().v_x_m_per_s_size(), 0) << "LCM echoes none";
  EXPECT_EQ(r.f_x().measured_low_size(), 0) << "this model knows none";
}

}  // namespace
}  // namespace grouser::server

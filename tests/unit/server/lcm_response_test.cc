#include "clients/cpp/lcm_response.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace grouser::client {
namespace {

using grouser_lcm::wheel_output_t;
using grouser_lcm::wheel_response_t;

wheel_response_t Response(int n) {
  wheel_response_t response;
  response.utime = 11;
  response.sequence = 42;
  response.sender = "me";
  response.model = "sand";
  response.n = n;
  response.flags.assign(n, 1);
  response.slip.assign(n, 0.5);
  response.attack_angle.assign(n, 0.25);
  for (wheel_output_t* output : {&response.f_x, &response.f_y, &response.f_z, &response.torque,
                                 &response.m_z, &response.sinkage}) {
    output->n = n;
    for (auto* values :
         {&output->value, &output->sd_fit, &output->sd_patch, &output->low, &output->high}) {
      values->assign(n, 7);
    }
  }
  return response;
}

std::vector<std::uint8_t> Encode(const wheel_response_t& response) {
  std::vector<std::uint8_t> bytes(response.getEncodedSize());
  response.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(DecodeResponseTest, TakesWhatTheServerSends) {
  for (const int n : {0, 3}) {
    wheel_response_t out;
    ASSERT_TRUE(DecodeResponse(Encode(Response(n)), &out));
    EXPECT_EQ(out.sequence, 42);
    EXPECT_EQ(out.sender, "me");
    EXPECT_EQ(out.n, n);
    EXPECT_EQ(out.sinkage.high.size(), static_cast<std::size_t>(n));
  }
}

TEST(DecodeResponseTest, RefusesEveryTruncationAndWhatFollows) {
  auto bytes = Encode(Response(2));
  wheel_response_t out;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeResponse({bytes.data(), size}, &out)) << size;
  }
  bytes.push_back(0);
  EXPECT_FALSE(DecodeResponse(bytes, &out));
}

// lcm-gen's decoder would resize to these, or throw.
TEST(DecodeResponseTest, RefusesLyingLengths) {
  const auto whole = Encode(Response(2));
  wheel_response_t out;
  constexpr std::size_t kSender = 24, kN = kSender + 4 + 3 + 4 + 5 + 4 + 1;
  constexpr std::size_t kFirstOutput = kN + 4 + 2 * (4 + 8 + 8);
  for (const std::size_t at : {kSender, kN, kFirstOutput}) {
    for (const std::uint32_t length : {0u, 1u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
      auto bytes = whole;
      for (int i = 0; i < 4; ++i) bytes[at + i] = (length >> (24 - 8 * i)) & 0xff;
      EXPECT_FALSE(DecodeResponse(bytes, &out)) << at << " " << length;
    }
  }
}

TEST(DecodeResponseTest, SurvivesRandomBytes) {
  const auto whole = Encode(Response(2));
  std::mt19937 random(1);
  wheel_response_t out;
  for (int round = 0; round < 2000; ++round) {
    auto bytes = whole;
    for (int i = 0; i < 4; ++i) bytes[8 + random() % (bytes.size() - 8)] = random() & 0xff;
    DecodeResponse(bytes, &out);
  }
}

TEST(DecodeMeasuredTest, TakesKnownOutputsAloneAndNothingElse) {
  grouser_lcm::wheel_measured_t sent{}, got;
  sent.sequence = 42;
  sent.sender = "me";
  sent.n = 2;
  sent.f_x.n = 2;
  for (auto* values : {&sent.f_x.sd_form, &sent.f_x.low, &sent.f_x.high}) values->assign(2, 7);
  std::vector<std::uint8_t> bytes(sent.getEncodedSize());
  sent.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  ASSERT_TRUE(DecodeMeasured(bytes, &got));
  EXPECT_EQ(got.f_x.high[1], 7);
  EXPECT_EQ(got.torque.n, 0);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeMeasured({bytes.data(), size}, &got)) << size;
  }
  bytes.push_back(0);
  EXPECT_FALSE(DecodeMeasured(bytes, &got));
  EXPECT_FALSE(DecodeMeasured(Encode(Response(2)), &got));
}

}  // namespace
}  // namespace grouser::client

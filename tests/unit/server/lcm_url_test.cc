#include "proto/lcm/lcm_url.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/unit/records/throws.h"

namespace grouser::lcm_io {
namespace {

using ::testing::HasSubstr;

std::string ProblemOf(const std::string& url) {
  return MessageOf([&] { ParseLcmUrl(url); });
}

TEST(LcmUrlTest, ReadsEveryPart) {
  const auto url =
      ParseLcmUrl("udpm://239.1.2.3:8000?ttl=2&recv_buf_size=4096&transmit_only=false");
  EXPECT_EQ(url.GroupText(), "239.1.2.3");
  EXPECT_EQ(url.port, 8000);
  EXPECT_EQ(url.ttl, 2);
  EXPECT_EQ(url.receive_bytes, 4096);
  EXPECT_EQ(url.Text(), "udpm://239.1.2.3:8000?ttl=2");
}

TEST(LcmUrlTest, DefaultsAreThoseOfLiblcm) {
  EXPECT_EQ(ParseLcmUrl("udpm://").Text(), "udpm://239.255.76.67:7667?ttl=0");
  ASSERT_EQ(unsetenv("LCM_DEFAULT_URL"), 0);
  EXPECT_EQ(EffectiveLcmUrl(""), "udpm://239.255.76.67:7667?ttl=0");
  ASSERT_EQ(setenv("LCM_DEFAULT_URL", "udpm://239.1.1.1:9", 1), 0);
  EXPECT_EQ(EffectiveLcmUrl(""), "udpm://239.1.1.1:9");
  EXPECT_EQ(EffectiveLcmUrl("udpm://"), "udpm://");
  unsetenv("LCM_DEFAULT_URL");
}

TEST(LcmUrlTest, RefusesWhatItCannotReceiveByName) {
  for (const char* url : {"", "tcpq://127.0.0.1:7700", "file:///tmp/log", "udpm://127.0.0.1:7667",
                          "udpm://lab:7667", "udpm://239.255.76.67.1:7667"}) {
    EXPECT_THAT(ProblemOf(url), HasSubstr("expected udpm://GROUP:PORT")) << url;
  }
  for (const char* url : {"udpm://239.255.76.67", "udpm://239.255.76.67:", "udpm://239.255.76.67:0",
                          "udpm://239.255.76.67:65536", "udpm://239.255.76.67:7667x"}) {
    EXPECT_THAT(ProblemOf(url), HasSubstr("port: ")) << url;
  }
  EXPECT_THAT(ProblemOf("udpm://?ttl=256"),
              HasSubstr("ttl: '256', expected a number from 0 to 255"));
  EXPECT_THAT(ProblemOf("udpm://?time=1"), HasSubstr("option 'time'"));
}

}  // namespace
}  // namespace grouser::lcm_io

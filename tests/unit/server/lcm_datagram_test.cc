#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "proto/lcm/datagram.h"

namespace grouser::lcm_io {
namespace {

Datagram Parse(const std::string& bytes) {
  return ParseDatagram({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string Header(const char* magic) { return std::string(magic) + std::string("\0\1\2\3", 4); }

TEST(LcmDatagramTest, TakesAMessageApart) {
  const std::string bytes = Header("LC02") + std::string("CHANNEL\0payload", 15);
  const Datagram message = Parse(bytes);
  ASSERT_EQ(message.kind, DatagramKind::kMessage);
  EXPECT_EQ(message.sequence, 0x00010203u);
  EXPECT_EQ(message.channel, "CHANNEL");
  EXPECT_EQ(std::string(message.payload.begin(), message.payload.end()), "payload");
}

TEST(LcmDatagramTest, PayloadMayBeEmptyAndChannelHas63CharactersAtMost) {
  const auto of_length = [](std::size_t n) { return Header("LC02") + std::string(n, 'c'); };
  const std::string longest = of_length(kMaxChannel) + std::string(1, '\0');
  const Datagram message = Parse(longest);
  ASSERT_EQ(message.kind, DatagramKind::kMessage);
  EXPECT_EQ(message.channel.size(), kMaxChannel);
  EXPECT_TRUE(message.payload.empty());
  const std::string too_long = of_length(kMaxChannel + 1) + std::string(1, '\0');
  EXPECT_EQ(Parse(too_long).kind, DatagramKind::kMalformed);
  EXPECT_EQ(Parse(of_length(20)).kind, DatagramKind::kMalformed) << "no NUL";
}

TEST(LcmDatagramTest, EveryTruncationAndForeignMagicIsMalformed) {
  const std::string head = Header("LC02") + std::string("CHANNEL\0", 8);
  for (std::size_t size = 0; size < head.size(); ++size) {
    EXPECT_EQ(Parse(head.substr(0, size)).kind, DatagramKind::kMalformed) << size;
  }
  for (const char* magic : {"LC01", "LC04", "lc02", "20CL"}) {
    EXPECT_EQ(Parse(Header(magic) + std::string("C\0x", 3)).kind, DatagramKind::kMalformed);
  }
}

TEST(LcmDatagramTest, FragmentIsToldByItsWholeHeader) {
  const std::string fragment = Header("LC03") + std::string(12, '\xff');
  EXPECT_EQ(Parse(fragment).kind, DatagramKind::kFragment);
  EXPECT_EQ(Parse(fragment).sequence, 0x00010203u);
  EXPECT_TRUE(Parse(fragment).payload.empty());
  EXPECT_EQ(Parse(fragment.substr(0, 19)).kind, DatagramKind::kMalformed);
}

}  // namespace
}  // namespace grouser::lcm_io

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "server/net/address.h"
#include "server/net/call_records.h"
#include "server/net/connection_table.h"
#include "server/net/listener.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string RefusalOf(const std::string& text) {
  try {
    ParseAddress(text);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

TEST(AddressTest, RefusesByName) {
  for (const std::string text : {"", "localhost", ":50151", "host:", "host:x", "host:65536", "h:-1",
                                 "::1:5", "unix:", "h:1x", "[]:1"}) {
    EXPECT_THAT(RefusalOf(text), AllOf(HasSubstr("'" + text + "'"), HasSubstr("HOST:PORT")));
  }
  EXPECT_THAT(RefusalOf("unix:" + std::string(108, 'x')), HasSubstr("1 to 107 bytes"));
}

TEST(AddressTest, ReadsAllForms) {
  for (const char* text :
       {"127.0.0.1:0", "[::1]:50151", "0.0.0.0:65535", "unix:/a/b", "unix:rel"}) {
    EXPECT_EQ(ParseAddress(text).Text(), text);
  }
  EXPECT_EQ(ParseAddress("unix:///run/x").path, "/run/x");
  EXPECT_EQ(ParseAddress("[::1]:7").host, "::1");
}

TEST(AddressTest, KnowsWhatOnlyThisMachineReaches) {
  for (const char* text : {"127.0.0.1:1", "127.9.9.9:1", "localhost:1", "[::1]:1", "unix:/a"}) {
    EXPECT_TRUE(ParseAddress(text).is_local()) << text;
  }
  for (const char* text : {"0.0.0.0:1", "128.0.0.1:1", "[::]:1", "rover:1", "127.evil:1"}) {
    EXPECT_FALSE(ParseAddress(text).is_local()) << text;
  }
}

TEST(RequestIdTest, TakesWhatIsHarmlessAndMakesUpTheRest) {
  EXPECT_EQ(RequestIdOf("a-Z_0:9."), "a-Z_0:9.");
  for (const std::string given : {"", "a b", "a\n", "\"", "\x80"}) {
    EXPECT_THAT(RequestIdOf(given), ::testing::MatchesRegex("[0-9a-f]{16}")) << given;
  }
  EXPECT_EQ(RequestIdOf(std::string(64, 'x')).size(), 64u);
  EXPECT_EQ(RequestIdOf(std::string(65, 'x')).size(), 16u);
  EXPECT_NE(RequestIdOf(""), RequestIdOf(""));
}

TEST(ConnectionTableTest, CountsWhatIsStillTheSameSocket) {
  ConnectionTable table(2);
  int first[2], second[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, first), 0);
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, second), 0);
  table.Add(first[0]);
  EXPECT_FALSE(table.IsFull());
  table.Add(second[0]);
  EXPECT_TRUE(table.IsFull());
  ::close(first[0]);
  EXPECT_FALSE(table.IsFull());
  // Another file under the same number is no connection.
  ASSERT_EQ(::open("/dev/null", O_RDONLY), first[0]);
  EXPECT_EQ(table.CountOpen(), 1u);
  table.EndAll();
  char byte = 0;
  EXPECT_EQ(::read(second[0], &byte, 1), 0) << "end of file";
  for (const int fd : {first[0], first[1], second[0], second[1]}) ::close(fd);
}

class UnixListenerTest : public ::testing::Test {
 protected:
  std::string Refusal() {
    try {
      const auto second = Listen();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  }
  std::unique_ptr<Listener> Listen() {
    return std::make_unique<Listener>(loop_, ParseAddress("unix:" + path_), 10,
                                      [](int, int fd) { ::close(fd); });
  }

  testing::TempDir dir_;
  std::string path_ = dir_ / "socket";
  boost::asio::io_context loop_;
};

TEST_F(UnixListenerTest, ALiveSocketIsNotTakenAndADeadOneIs) {
  {
    const auto listener = Listen();
    struct stat file {};
    ASSERT_EQ(::stat(path_.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0777, 0600u);
    EXPECT_THAT(Refusal(), AllOf(HasSubstr("unix:" + path_), HasSubstr("in use")));
    EXPECT_EQ(::access(path_.c_str(), F_OK), 0);
  }
  EXPECT_NE(::access(path_.c_str(), F_OK), 0) << "removed at the end";
  {  // What a killed server leaves: a bound file that nobody listens on.
    boost::asio::local::stream_protocol::acceptor dead(
        loop_, boost::asio::local::stream_protocol::endpoint(path_));
  }
  EXPECT_EQ(::access(path_.c_str(), F_OK), 0);
  EXPECT_EQ(Refusal(), "");
}

TEST_F(UnixListenerTest, OtherFilesAndOtherServersSocketsStay) {
  std::ofstream(path_) << "text";
  EXPECT_THAT(Refusal(), HasSubstr("no socket"));
  EXPECT_EQ(::access(path_.c_str(), F_OK), 0);
  ::unlink(path_.c_str());
  auto first = Listen();
  ::unlink(path_.c_str());
  const auto second = Listen();
  first.reset();
  EXPECT_EQ(::access(path_.c_str(), F_OK), 0) << "the second's file";
}

}  // namespace
}  // namespace grouser::server

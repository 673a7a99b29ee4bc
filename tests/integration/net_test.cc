// What both programs do on the network: too many connections, a lost address,
// SIGTERM under load.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "grouser/v1alpha1/jobs_service.grpc.pb.h"
#include "proto/records/status_code.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::Milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A connection that says nothing, or just enough to be an HTTP/2 client.
int Connect(const std::string& address, bool speaks) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
  EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  const std::string preface("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33);
  if (speaks) {
    EXPECT_EQ(::send(fd, preface.data(), preface.size(), 0), 33);
  }
  return fd;
}

bool Answers(const std::string& address, Milliseconds limit = Milliseconds(10000)) {
  try {
    return client::IsServing(address, "", limit);
  } catch (const client::ClientError&) {
    return false;
  }
}

class NetTest : public ::testing::TestWithParam<const char*> {
 protected:
  testing::ServerProcess Start(std::vector<std::string> more, int descriptors = 0) {
    if (GetParam() == std::string("grouser-server")) more.push_back("--no-lcm");
    return testing::ServerProcess(dir_.path(), std::move(more), GetParam(), descriptors);
  }
  testing::TempDir dir_;
};
INSTANTIATE_TEST_SUITE_P(Programs, NetTest, ::testing::Values("grouser-server", "grouser-jobs"),
                         [](const auto& info) { return std::string(info.param).substr(8); });

TEST_P(NetTest, MoreConnectionsThanDescriptorsPass) {
  auto server = Start({"--idle-s", "0.5"}, 256);
  ASSERT_TRUE(Answers(server.address()));
  std::vector<int> idle;
  for (int i = 0; i < 300; ++i) idle.push_back(Connect(server.address(), i % 2 == 0));
  EXPECT_TRUE(testing::Eventually([&] { return Answers(server.address()); }))
      << "idle connections make room while they are open";
  for (const int fd : idle) ::close(fd);
  EXPECT_TRUE(testing::Eventually([&] { return Answers(server.address()); }));
  server.program().Signal(SIGTERM);
  EXPECT_EQ(server.program().Wait(), 0);
}

TEST_P(NetTest, ALostAddressEndsTheProgram) {
  const std::string socket = dir_ / "socket";
  auto server = Start({"--grpc", "unix:" + socket, "--probe-s", "0.05"});
  EXPECT_EQ(server.address(), "unix:" + socket);
  EXPECT_TRUE(Answers(server.address()));
  EXPECT_TRUE(server.program().Running());
  ::unlink(socket.c_str());
  EXPECT_EQ(server.program().Wait(), 1);
  EXPECT_THAT(server.program().Stderr(),
              AllOf(HasSubstr("cannot reach myself (3 of 3)"), HasSubstr("it ends")));
}

v1alpha1::EvaluateWheelsRequest SomeStates() {
  v1alpha1::EvaluateWheelsRequest request;
  for (int i = 0; i < 50; ++i) {
    request.mutable_states()->add_load_n(24);
    request.mutable_states()->mutable_slip()->add_slip(0.01 * i);
    request.mutable_states()->mutable_slip()->add_attack_angle_rad(0);
  }
  return request;
}

/// Unary calls without a pause from several threads; counts codes.
class Hammer {
 public:
  explicit Hammer(const std::function<grpc::StatusCode()>& call) {
    for (auto& thread : threads_) {
      thread = std::jthread([this, call](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          const auto code = call();
          const std::lock_guard lock(mutex_);
          ++counts_[records::StatusCodeName(code)];
        }
      });
    }
  }
  std::map<std::string, int> Counts() {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, int> counts_;
  std::array<std::jthread, 4> threads_;
};

TEST(Sigterm, EveryMessageOfAStreamThatWasSentBeforeIsAnswered) {
  testing::TempDir dir;
  testing::MakeStable(dir.path(), testing::PhysicsModel("sand"));
  testing::ServerProcess server(dir.path(), {"--no-lcm", "--drain-s", "60"});
  const auto stub = v1alpha1::TerrainService::NewStub(client::MakeChannel(server.address()));
  grpc::ClientContext context;
  const auto stream = stub->StreamWheels(&context);
  constexpr std::uint64_t kMessages = 300;
  auto request = SomeStates();
  for (std::uint64_t i = 0; i < kMessages; ++i) {  // nothing is read meanwhile
    request.set_sequence(i);
    ASSERT_TRUE(stream->Write(request));
  }
  server.program().Signal(SIGTERM);
  v1alpha1::EvaluateWheelsResponse response;
  std::uint64_t answered = 0;
  for (; stream->Read(&response); ++answered) {
    EXPECT_EQ(response.sequence(), answered);
    EXPECT_EQ(response.responses().flags_size(), 50);
  }
  EXPECT_EQ(answered, kMessages);
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(server.program().Wait(), 0) << server.program().Stderr();
}

/// No call may end otherwise than answered or UNAVAILABLE, and the last ones
/// with that.
void ExpectCleanEnd(testing::ServerProcess& server, const std::function<grpc::StatusCode()>& call) {
  std::map<std::string, int> counts;
  {
    Hammer hammer(call);
    ASSERT_TRUE(testing::Eventually([&] { return hammer.Counts()["OK"] > 100; }));
    server.program().Signal(SIGTERM);
    EXPECT_EQ(server.program().Wait(), 0) << server.program().Stderr();
    const int before = hammer.Counts()["UNAVAILABLE"];
    ASSERT_TRUE(testing::Eventually([&] { return hammer.Counts()["UNAVAILABLE"] > before + 4; }));
    counts = hammer.Counts();
  }
  counts.erase("OK");
  counts.erase("UNAVAILABLE");
  EXPECT_TRUE(counts.empty()) << counts.begin()->second << " calls ended with "
                              << counts.begin()->first;
}

TEST(Sigterm, QueriesAreAnsweredOrUnavailable) {
  testing::TempDir dir;
  testing::MakeStable(dir.path(), testing::PhysicsModel("sand"));
  testing::ServerProcess server(dir.path(), {"--no-lcm", "--drain-s", "1"});
  const auto stub = v1alpha1::TerrainService::NewStub(client::MakeChannel(server.address()));
  ExpectCleanEnd(server, [&] {
    grpc::ClientContext context;
    v1alpha1::EvaluateWheelsResponse response;
    return stub->EvaluateWheels(&context, SomeStates(), &response).error_code();
  });
}

TEST(Sigterm, RequestsAboutJobsAreAnsweredOrUnavailable) {
  testing::TempDir dir;
  testing::ServerProcess server(dir.path(), {"--drain-s", "1"}, "grouser-jobs");
  const auto stub = v1alpha1::JobsService::NewStub(client::MakeChannel(server.address()));
  ExpectCleanEnd(server, [&] {
    grpc::ClientContext context;
    v1alpha1::ListJobsResponse response;
    return stub->ListJobs(&context, {}, &response).error_code();
  });
}

}  // namespace
}  // namespace grouser

// Peers that take no answer, say nothing, or send anything: the server goes on, and an honest new
// client is answered meanwhile. GROUSER_LONG in the environment: the long form.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <list>
#include <random>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "tests/integration/h2_connection.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using std::chrono::steady_clock;
using testing::H2Answer;
using testing::H2Connection;

constexpr char kEvaluate[] = "/grouser.v1alpha1.TerrainService/EvaluateWheels";
constexpr char kStream[] = "/grouser.v1alpha1.TerrainService/StreamWheels";
constexpr int kOk = 0, kResourceExhausted = 8;

bool Long() { return std::getenv("GROUSER_LONG") != nullptr; }

v1alpha1::EvaluateWheelsRequest States(int n) {
  v1alpha1::EvaluateWheelsRequest request;
  for (int i = 0; i < n; ++i) {
    request.mutable_states()->add_load_n(24);
    request.mutable_states()->mutable_slip()->add_slip(0.2);
    request.mutable_states()->mutable_slip()->add_attack_angle_rad(0);
  }
  return request;
}

/// Asks over a new connection each time until it goes; every call must be answered. The longest
/// time that one took is for the reader, no test.
class HonestClient {
 public:
  explicit HonestClient(std::string address)
      : thread_([this, address](const std::stop_token& stop) {
          const std::string message = States(4).SerializeAsString();
          while (!stop.stop_requested()) {
            const auto start = steady_clock::now();
            Ask(address, message);
            const std::chrono::duration<double, std::milli> spent = steady_clock::now() - start;
            worst_ms_ = std::max(worst_ms_, spent.count());
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
          }
        }) {}
  ~HonestClient() {
    thread_.request_stop();
    thread_.join();
    EXPECT_GT(answered_, 0);
    EXPECT_EQ(failed_, 0) << "of " << failed_ + answered_ << ": " << why_;
    ::testing::Test::RecordProperty("honest_worst_ms", std::to_string(worst_ms_));
    std::printf("honest client: %d answers over new connections, the slowest after %.1f ms\n",
                answered_, worst_ms_);
  }

 private:
  void Ask(const std::string& address, const std::string& message) {
    try {
      H2Connection connection(address);
      connection.Call(kEvaluate, message);
      H2Answer answer;
      if (connection.Wait(20000, &answer) && answer.status == kOk && answer.bytes > 0) {
        ++answered_;
        return;
      }
      why_ = "status " + std::to_string(answer.status);
    } catch (const std::runtime_error& e) {
      why_ = e.what();
    }
    ++failed_;
  }

  int answered_ = 0, failed_ = 0;
  double worst_ms_ = 0;
  std::string why_;
  std::jthread thread_;
};

class OverloadTest : public ::testing::Test {
 protected:
  OverloadTest() { testing::MakeStable(dir_.path(), testing::PhysicsModel("sand")); }
  testing::TempDir dir_;
};

TEST_F(OverloadTest, ClientsThatGiveNoWindowHoldLittleAndNotForLong) {
  testing::ServerProcess server(dir_.path(),
                                {"--no-lcm", "--memory-budget-mb", "32", "--answer-s", "1"});
  const std::string big = States(10000).SerializeAsString();
  int refused = 0, cancelled = 0, hinted = 0;
  {
    const HonestClient honest(server.address());
    std::list<H2Connection> peers;
    for (int i = 0; i < 8; ++i) {
      H2Connection& peer = peers.emplace_back(server.address(), 0);
      // Before the server says how many calls it takes, as few as any takes.
      for (int k = 0; k < 8; ++k) peer.Call(k % 4 == 0 ? kStream : kEvaluate, big);
      peer.Flush();
    }
    const auto until = steady_clock::now() + std::chrono::seconds(Long() ? 60 : 2);
    while (steady_clock::now() < until) {
      for (H2Connection& peer : peers) {
        H2Answer answer;
        if (!peer.Wait(20, &answer)) continue;
        refused += answer.status == kResourceExhausted;
        hinted += answer.pushback_ms > 0;
        cancelled += answer.status != kResourceExhausted;
        EXPECT_NE(answer.status, kOk) << "it has no window to come through";
        peer.Call(kEvaluate, big);
        peer.Flush();
      }
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(hinted, 0) << "a refusal says when to try again";
  EXPECT_GT(cancelled, 0) << "an answer that is not taken is cancelled";
  EXPECT_TRUE(server.program().Running()) << server.program().Stderr();
}

/// Whatever a client sends, in frames that are right, half right, and no frames at all.
void SendAnything(const std::string& address, std::mt19937& random) {
  const auto any = [&](std::size_t most) {
    std::string bytes(random() % (most + 1), 0);
    for (char& c : bytes) c = static_cast<char>(random());
    return bytes;
  };
  std::string good = States(8).SerializeAsString();
  H2Connection peer(address);
  for (int i = 0; i < 20 && peer.open(); ++i) {
    std::string message = good;
    switch (random() % 4) {
      case 0:
        message = any(300);
        break;
      case 1:
        message.resize(random() % message.size());
        break;
      default:
        message[random() % message.size()] = static_cast<char>(random());
    }
    peer.Call(random() % 2 ? kEvaluate : kStream, message, 100,
              random() % 8 == 0 ? random() % (message.size() + 1) : SIZE_MAX);
    peer.Flush();
    H2Answer answer;
    if (i % 4 == 3) peer.Wait(50, &answer);
  }
  if (random() % 2) peer.SendRaw(any(200));
}

TEST_F(OverloadTest, FuzzedMessagesEndNoServer) {
  testing::ServerProcess server(dir_.path());
  const HonestClient honest(server.address());
  std::mt19937 random(1);
  const auto until = steady_clock::now() + std::chrono::seconds(Long() ? 300 : 1);
  int connections = 0;
  for (; steady_clock::now() < until; ++connections) SendAnything(server.address(), random);
  std::printf("%d connections of 20 fuzzed messages\n", connections);
  EXPECT_TRUE(server.program().Running()) << server.program().Stderr();
}

TEST_F(OverloadTest, IdleConnectionsLeaveRoom) {
  constexpr int kDescriptors = 1024, kIdle = 2000;
  testing::ServerProcess server(dir_.path(), {"--no-lcm", "--idle-s", "1"}, "grouser-server",
                                kDescriptors);
  std::vector<int> idle;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string address = server.address();
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
  const HonestClient honest(address);
  for (int i = 0; i < kIdle; ++i) {
    // Not waiting: beyond the server's limit they stay in the kernel's queue.
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) break;  // of this test's own limit
    ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    idle.push_back(fd);
  }
  testing::SleepMilliseconds(Long() ? 20000 : 2000);
  std::printf("%zu idle connections\n", idle.size());
  for (const int fd : idle) ::close(fd);
  EXPECT_TRUE(server.program().Running()) << server.program().Stderr();
}

TEST_F(OverloadTest, AStreamAnswersInBandWhatItHasNoMemoryFor) {
  // A request of 10,000 states alone takes more than a connection may hold of 8 MiB once its first
  // answer is under way: nobody takes answers while all is sent.
  testing::ServerProcess server(dir_.path(), {"--no-lcm", "--memory-budget-mb", "8"});
  const client::TerrainClient client(server.address(), client::Milliseconds(20000));
  const auto stream = client.OpenStream();
  constexpr int kMessages = 8;
  auto request = States(10000);
  std::jthread sender([&] {
    for (int i = 0; i < kMessages; ++i) {
      request.set_sequence(static_cast<std::uint64_t>(i));
      ASSERT_TRUE(stream->Send(request));
    }
  });
  testing::SleepMilliseconds(500);
  try {
    client.Evaluate(States(10000));
    ADD_FAILURE() << "there is memory for it";
  } catch (const client::ClientError& error) {
    EXPECT_EQ(error.code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << error.what();
    ASSERT_TRUE(error.retry_after().has_value());
    EXPECT_GT(error.retry_after()->count(), 0);
  }
  int refused = 0, answered = 0;
  v1alpha1::EvaluateWheelsResponse response;
  for (int i = 0; i < kMessages; ++i) {
    ASSERT_TRUE(stream->Receive(&response));
    EXPECT_EQ(response.sequence(), static_cast<std::uint64_t>(i));
    if (!response.has_error()) {
      ++answered;
      continue;
    }
    EXPECT_EQ(response.error().code(), kResourceExhausted);
    const auto retry = client::RetryAfter(response.error());
    ASSERT_TRUE(retry.has_value());
    EXPECT_GT(retry->count(), 0);
    ++refused;
  }
  sender.join();
  stream->Finish();
  EXPECT_GT(answered, 0);
  EXPECT_GT(refused, 0);
}

TEST_F(OverloadTest, AStreamWaitsForAnAnswerNoLongerThanItsLimit) {
  testing::ServerProcess server(dir_.path());
  const client::TerrainClient client(server.address(), client::Milliseconds(200));
  const auto stream = client.OpenStream();
  v1alpha1::EvaluateWheelsResponse response;
  ASSERT_TRUE(stream->Send(States(4)) && stream->Receive(&response));
  EXPECT_FALSE(stream->Receive(&response)) << "nothing was asked";
  try {
    stream->Finish();
    ADD_FAILURE() << "ended well";
  } catch (const client::ClientError& error) {
    EXPECT_EQ(error.code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_NE(std::string(error.what()).find("no answer within 200 ms"), std::string::npos);
  }
}

}  // namespace
}  // namespace grouser

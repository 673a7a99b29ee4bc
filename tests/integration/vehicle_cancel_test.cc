// VehicleService by a real server: calls that are cancelled or late, and its end, while it plans.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <list>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "clients/cpp/vehicle_client.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::VehicleClient;

constexpr int kWaiting = 64;  // VehicleService::kMostWaiting
constexpr int kBusy = 8;      // plans that keep two threads busy for many seconds

/// No point is like the one before: seconds of one thread.
v1alpha1::PlanSpeedRequest Hostile() {
  v1alpha1::PlanSpeedRequest request;
  request.set_vehicle("cart");
  request.set_speed_limit_m_per_s(6);
  request.set_draws(10);  // seconds, also of a quick machine
  for (int i = 0; i < 10000; ++i) {
    const double x = i;
    request.mutable_path()->add_s_m(0.1 * x);
    request.mutable_path()->add_curvature_per_m(0.3 * std::sin(7 * x * x));
    request.mutable_path()->add_grade_rad(0.3 * std::sin(3 * x * x));
    request.mutable_path()->add_bank_rad(0.2 * std::cos(5 * x * x));
    request.mutable_path()->add_soil(static_cast<std::uint32_t>(i % 2));
  }
  return request;
}
v1alpha1::PlanSpeedRequest Short() {
  v1alpha1::PlanSpeedRequest request;
  request.set_vehicle("husky");
  request.set_speed_limit_m_per_s(1);
  for (int i = 0; i < 20; ++i) request.mutable_path()->add_s_m(0.1 * i);
  return request;
}

/// A call that goes on beside this thread; cancelled at the end.
class Pending {
 public:
  Pending(v1alpha1::VehicleService::Stub* stub, v1alpha1::PlanSpeedRequest request)
      : request_(std::move(request)) {
    stub->async()->PlanSpeed(&context_, &request_, &response_, [this](const grpc::Status& status) {
      status_ = status;
      ended_ = true;
    });
  }
  ~Pending() {
    Cancel();
    Wait();
  }
  void Cancel() { context_.TryCancel(); }
  bool Ended() const { return ended_; }
  grpc::StatusCode Wait() {
    EXPECT_TRUE(testing::Eventually([this] { return Ended(); }));
    return status_.error_code();
  }
  bool Refused() { return Ended() && Wait() == grpc::StatusCode::RESOURCE_EXHAUSTED; }
  const v1alpha1::PlanSpeedResponse& response() const { return response_; }

 private:
  v1alpha1::PlanSpeedRequest request_;
  v1alpha1::PlanSpeedResponse response_;
  grpc::ClientContext context_;
  grpc::Status status_;
  std::atomic<bool> ended_{false};
};

class VehicleCancelTest : public ::testing::Test {
 protected:
  VehicleCancelTest() { testing::MakeStable(dir_.path(), testing::PhysicsModel("sand")); }
  static std::vector<std::string> Arguments(const char* threads) {
    // One connection fills the queue by itself.
    return {"--no-lcm",
            "--vehicles",
            GROUSER_VEHICLES,
            "--vehicle-threads",
            threads,
            "--drain-s",
            "0.5",
            "--max-calls",
            "256"};
  }
  static auto Stub(const testing::ServerProcess& server) {
    return v1alpha1::VehicleService::NewStub(client::MakeChannel(server.address()));
  }
  // Whether no thread takes up a short call within a tenth of a second.
  static bool IsBusy(const testing::ServerProcess& server) {
    try {
      VehicleClient(server.address(), client::Milliseconds(100)).PlanSpeed(Short());
    } catch (const client::ClientError& error) {
      return error.code() == grpc::StatusCode::DEADLINE_EXCEEDED;
    }
    return false;
  }
  testing::TempDir dir_;
};

// Far more calls than have room are cancelled while both threads are busy: a call that comes then
// finds a place, and is answered as soon as the busy ones are cancelled as well.
TEST_F(VehicleCancelTest, CancelledCallsGiveTheirPlacesUp) {
  testing::ServerProcess server(dir_.path(), Arguments("2"));
  const auto stub = Stub(server);
  std::list<Pending> busy, waiting;
  for (int i = 0; i < kBusy; ++i) busy.emplace_back(stub.get(), Hostile());
  // Long requests arrive in pieces: the short ones below could overtake them, and fill the queue.
  ASSERT_TRUE(testing::Eventually([&] { return IsBusy(server); }));
  for (int i = 0; i < 2 * kWaiting; ++i) waiting.emplace_back(stub.get(), Short());
  ASSERT_TRUE(testing::Eventually([&] {  // the queue is full
    return std::any_of(waiting.begin(), waiting.end(), [](Pending& p) { return p.Refused(); });
  }));
  for (Pending& p : waiting) p.Cancel();
  for (Pending& p : waiting) p.Wait();
  std::list<Pending> honest;
  const auto taken = [&] {
    honest.emplace_back(stub.get(), Short());
    testing::SleepMilliseconds(200);  // a refusal comes at once
    return !honest.back().Refused();
  };
  int tries = 1;
  while (!taken() && tries < 10) ++tries;
  EXPECT_FALSE(honest.back().Refused()) << tries;
  EXPECT_GE(std::count_if(busy.begin(), busy.end(), [](Pending& p) { return !p.Ended(); }), 2);
  for (Pending& p : busy) p.Cancel();
  EXPECT_EQ(honest.back().Wait(), grpc::StatusCode::OK);
  EXPECT_EQ(honest.back().response().plan().holds_size(), 20);
}

// A client whose deadline passes costs no place and no time: both threads answer again, and so does
// the rest of the server.
TEST_F(VehicleCancelTest, LateCallsAreDropped) {
  testing::ServerProcess server(dir_.path(), Arguments("2"));
  std::vector<std::thread> clients;
  std::atomic<int> late{0};
  for (int i = 0; i < 12; ++i) {
    clients.emplace_back([&] {
      try {
        VehicleClient(server.address(), client::Milliseconds(50)).PlanSpeed(Hostile());
      } catch (const client::ClientError& error) {
        late += error.code() == grpc::StatusCode::DEADLINE_EXCEEDED;
      }
    });
  }
  for (auto& thread : clients) thread.join();
  EXPECT_EQ(late, 12);
  const VehicleClient client(server.address(), client::Milliseconds(60000));
  EXPECT_EQ(client.PlanSpeed(Short()).plan().holds_size(), 20);
  EXPECT_EQ(client::TerrainClient(server.address()).ListModels().models_size(), 1);
}

// Of two servers with the same plan under way, the one that is told to end does so before the other
// has its answer.
TEST_F(VehicleCancelTest, TheServerEndsWhileItPlans) {
  testing::TempDir other_dir;
  testing::MakeStable(other_dir.path(), testing::PhysicsModel("sand"));
  testing::ServerProcess server(dir_.path(), Arguments("1")),
      other(other_dir.path(), Arguments("1"));
  const auto stub = Stub(server), other_stub = Stub(other);
  Pending left(other_stub.get(), Hostile()), ended(stub.get(), Hostile());
  testing::SleepMilliseconds(200);  // both are under way
  server.program().Signal(SIGTERM);
  EXPECT_TRUE(testing::Eventually([&] { return !server.program().Running(); }));
  EXPECT_FALSE(left.Ended());
  EXPECT_EQ(server.program().Wait(), 0);
  EXPECT_NE(ended.Wait(), grpc::StatusCode::OK);
}

}  // namespace
}  // namespace grouser

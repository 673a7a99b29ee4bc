// VehicleService by a real server: calls that are cancelled or late, and its end, while it plans.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <functional>
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

void Begin(v1alpha1::VehicleService::Stub* stub, grpc::ClientContext* context,
           const v1alpha1::PlanSpeedRequest* request, v1alpha1::PlanSpeedResponse* response,
           std::function<void(grpc::Status)> done) {
  stub->async()->PlanSpeed(context, request, response, std::move(done));
}
void Begin(v1alpha1::VehicleService::Stub* stub, grpc::ClientContext* context,
           const v1alpha1::EvaluateTrajectoriesRequest* request,
           v1alpha1::EvaluateTrajectoriesResponse* response,
           std::function<void(grpc::Status)> done) {
  stub->async()->EvaluateTrajectories(context, request, response, std::move(done));
}

/// A call that goes on beside this thread; cancelled at the end.
template <class Request, class Response>
class Call {
 public:
  Call(v1alpha1::VehicleService::Stub* stub, Request request) : request_(std::move(request)) {
    Begin(stub, &context_, &request_, &response_, [this](const grpc::Status& status) {
      status_ = status;
      text_ = status.error_message();
      ended_ = true;
    });
  }
  ~Call() {
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
  const Response& response() const { return response_; }
  const std::string& text() const { return text_; }

 private:
  Request request_;
  Response response_;
  grpc::ClientContext context_;
  grpc::Status status_;
  std::string text_;
  std::atomic<bool> ended_{false};
};
using Pending = Call<v1alpha1::PlanSpeedRequest, v1alpha1::PlanSpeedResponse>;

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

// 40 bytes that ask for megabytes: what waits is counted with its answer.
TEST_F(VehicleCancelTest, AnswersAreCountedBeforeTheyAreMade) {
  std::vector<std::string> arguments = Arguments("1");
  arguments.insert(arguments.end(), {"--memory-budget-mb", "16"});
  testing::ServerProcess server(dir_.path(), arguments);
  const auto stub = Stub(server);
  const Pending busy(stub.get(), Hostile());
  ASSERT_TRUE(testing::Eventually([&] { return IsBusy(server); }));
  v1alpha1::EvaluateTrajectoriesRequest request;
  request.set_vehicle("husky");
  request.set_with_steps(true);
  request.mutable_trajectories()->add_steps(30000);
  request.mutable_trajectories()->add_v_x_m_per_s(0.5);
  request.mutable_trajectories()->add_duration_s(0.1);
  std::list<Call<v1alpha1::EvaluateTrajectoriesRequest, v1alpha1::EvaluateTrajectoriesResponse>>
      large;
  for (int i = 0; i < 6; ++i) large.emplace_back(stub.get(), request);
  const auto refused = [&] {
    return std::count_if(large.begin(), large.end(), [](auto& call) { return call.Refused(); });
  };
  // Each takes 3.5 MB of 16.8, and one connection as much as it leaves free: two fit.
  EXPECT_TRUE(testing::Eventually([&] { return refused() == 4; })) << refused();
  for (auto& call : large) {
    if (call.Refused()) EXPECT_EQ(call.text().find("overload: "), 0u) << call.text();
  }
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

// A server that is still loading its models says so; in this process, so that the test decides how
// long that takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <thread>

#include "clients/cpp/channel.h"
#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "clients/cpp/wheel_states.h"
#include "server/query/terrain_server.h"
#include "surrogate/model_io/load_model.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using client::ClientError;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(LoadingServer, AnswersUnavailableUntilItsModelsAreThere) {
  testing::TempDir dir;
  testing::MakeStable(dir.path(), testing::PhysicsModel("sand"));
  std::promise<void> go;
  const auto gone = go.get_future().share();
  ServerConfig config;
  config.state_dir = dir.path();
  config.lcm = false;
  TerrainServer server(config, [gone](const auto& message, const auto& kept) {
    gone.wait();
    return surrogate::MakeModel(message, kept);
  });
  NetOptions net;
  net.grpc = "127.0.0.1:0";
  server.Start(net, [] {});
  std::thread loading([&] { server.Load(); });
  const std::string address = server.grpc().address();
  const client::TerrainClient asker(address, client::Milliseconds(30000));
  v1alpha1::EvaluateWheelsRequest request;
  client::AddVelocityState(0.08, 0.01, 0.1, 24, request.mutable_states());
  const std::function<void()> calls[] = {[&] { asker.Evaluate(request); },
                                         [&] { asker.ListModels(); },
                                         [&] { asker.GetModel("sand"); }};
  for (const auto& call : calls) {
    try {
      call();
      ADD_FAILURE() << "expected UNAVAILABLE";
    } catch (const ClientError& e) {
      EXPECT_EQ(e.code(), grpc::StatusCode::UNAVAILABLE) << e.what();
      EXPECT_THAT(std::string(e.what()), HasSubstr("being loaded; ask again"));
    }
  }
  const std::string service = TerrainServer::ServiceNames().front();
  EXPECT_FALSE(client::IsServing(address, service, client::Milliseconds(30000)));
  EXPECT_THAT(server.WhyNotReady(), ElementsAre("models are being loaded"));
  go.set_value();
  loading.join();
  for (const auto& call : calls) EXPECT_NO_THROW(call());
  EXPECT_TRUE(client::IsServing(address, service, client::Milliseconds(30000)));
  EXPECT_THAT(server.WhyNotReady(), IsEmpty());
  server.grpc().Drain();
  server.grpc().Close();
}

}  // namespace
}  // namespace grouser::server

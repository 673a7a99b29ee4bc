// grouser-server as a process, asked over gRPC on the loopback.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "clients/cpp/wheel_states.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/models/state_batch.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::ClientError;
using client::TerrainClient;
using ::testing::AllOf;
using ::testing::HasSubstr;
using v1alpha1::EvaluateWheelsRequest;
using v1alpha1::EvaluateWheelsResponse;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

EvaluateWheelsRequest Request(int n, const std::string& model = "") {
  EvaluateWheelsRequest request;
  request.set_sequence(5);
  request.set_model(model);
  request.mutable_states();
  for (int i = 0; i < n; ++i) {
    client::AddVelocityState(0.08, 0.01, 0.1, 24, request.mutable_states());
  }
  return request;
}

class QueryServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    digest_ = testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
    server_ = std::make_unique<testing::ServerProcess>(
        dir_.path(), std::vector<std::string>{"--no-lcm", "--reflection"});
    client_ = std::make_unique<TerrainClient>(server_->address(), client::Milliseconds(30000));
  }

  void ExpectRefused(const EvaluateWheelsRequest& request, grpc::StatusCode code,
                     const ::testing::Matcher<std::string>& text) {
    try {
      client_->Evaluate(request);
      ADD_FAILURE() << "expected a refusal";
    } catch (const ClientError& e) {
      EXPECT_EQ(e.code(), code);
      EXPECT_THAT(std::string(e.what()), text);
    }
  }
  void ExpectAnswers() { EXPECT_EQ(client_->Evaluate(Request(1)).responses().flags_size(), 1); }

  testing::TempDir dir_;
  std::string digest_;
  std::unique_ptr<testing::ServerProcess> server_;
  std::unique_ptr<TerrainClient> client_;
};

TEST_F(QueryServerTest, Unary) {
  const auto response = client_->Evaluate(Request(3, "sand"));
  EXPECT_EQ(response.sequence(), 5u);
  EXPECT_EQ(response.model(), "sand@sha256:" + digest_);
  EXPECT_EQ(response.generation(), 1u);
  EXPECT_FALSE(response.has_error());
  ASSERT_EQ(response.responses().f_z().value_size(), 3);
  EXPECT_NEAR(response.responses().f_z().value(0), 24, 1e-3);
  EXPECT_GT(response.responses().sinkage().value(0), 0);
  EXPECT_LT(response.responses().f_x().low(0), response.responses().f_x().high(0));
  EXPECT_TRUE(std::isnan(response.responses().f_x().sd_form(0)));
}

std::array<const v1alpha1::OutputArray*, surrogate::kOutputs> OutputsOf(
    const v1alpha1::WheelResponses& r) {
  return {&r.f_x(), &r.f_y(), &r.f_z(), &r.torque(), &r.m_z(), &r.sinkage()};
}

// Over unary calls and streams the bits of the process itself, which are the slopes of the values.
TEST_F(QueryServerTest, GradientsAreThoseInProcessAndOfTheValues) {
  constexpr double kState[] = {0.08, 0.01, 0.1, 24};
  constexpr double kStep = 1e-4;
  EvaluateWheelsRequest request;
  client::AddVelocityState(kState[0], kState[1], kState[2], kState[3], request.mutable_states());
  for (int k = 0; k < 4; ++k) {
    for (const double sign : {1.0, -1.0}) {
      double s[4];
      for (int j = 0; j < 4; ++j) s[j] = kState[j] * (j == k ? 1 + sign * kStep : 1);
      client::AddVelocityState(s[0], s[1], s[2], s[3], request.mutable_states());
    }
  }
  request.set_with_gradients(true);
  const auto unary = client_->Evaluate(request).responses();
  const auto stream = client_->OpenStream();
  EvaluateWheelsResponse streamed;
  ASSERT_TRUE(stream->Send(request) && stream->Receive(&streamed));
  stream->Finish();
  const auto model = surrogate::MakeModel(testing::PhysicsModel("sand"));
  surrogate::StateBatch own(1);
  own.Set(0, kState[0], kState[1], kState[2], kState[3]);
  model->Evaluate(own.In(), own.Out());
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    const auto* a = OutputsOf(unary)[o];
    const auto* b = OutputsOf(streamed.responses())[o];
    const std::array<double, 4> got = {a->d_v_x(0), a->d_v_y(0), a->d_rim_speed(0), a->d_load(0)};
    EXPECT_EQ(got,
              (std::array<double, 4>{b->d_v_x(0), b->d_v_y(0), b->d_rim_speed(0), b->d_load(0)}));
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(got[k], own.part[o][surrogate::kDvX + k][0]);
      const double slope = (a->value(1 + 2 * k) - a->value(2 + 2 * k)) / (2 * kStep * kState[k]);
      const double scale = surrogate::OutputScale(o, kState[3], 0.0625) / kState[k];
      EXPECT_NEAR(got[k], slope, 2e-3 * scale) << surrogate::kOutputFields[o].name << " " << k;
    }
  }
  request.set_with_gradients(false);
  EXPECT_EQ(client_->Evaluate(request).responses().f_x().d_v_x_size(), 0);
}

TEST_F(QueryServerTest, BiggestBatchAndOneMore) {
  EXPECT_EQ(client_->Evaluate(Request(10000)).responses().f_x().high_size(), 10000);
  ExpectRefused(Request(10001), grpc::StatusCode::RESOURCE_EXHAUSTED,
                AllOf(HasSubstr("states.load_n"), HasSubstr("10001")));
  ExpectAnswers();
}

TEST_F(QueryServerTest, BadMessagesNameTheField) {
  ExpectRefused(Request(1, "clay"), grpc::StatusCode::NOT_FOUND,
                AllOf(HasSubstr("clay"), HasSubstr("sand@stable")));
  ExpectRefused(Request(0), grpc::StatusCode::INVALID_ARGUMENT, HasSubstr("states.kinematics"));
  auto mismatched = Request(2);
  mismatched.mutable_states()->add_load_n(1);
  ExpectRefused(mismatched, grpc::StatusCode::INVALID_ARGUMENT,
                HasSubstr("states.velocity.v_x_m_per_s: 2 entries, expected 3"));
  auto too_big = Request(1);
  too_big.set_model(std::string(5 * 1024 * 1024, 'x'));
  ExpectRefused(too_big, grpc::StatusCode::RESOURCE_EXHAUSTED, HasSubstr("message"));
  ExpectAnswers();
}

TEST_F(QueryServerTest, BadStatesAreFlaggedWhileOthersAreAnswered) {
  auto request = Request(5);
  auto* velocity = request.mutable_states()->mutable_velocity();
  velocity->set_v_x_m_per_s(1, kNan);
  request.mutable_states()->set_load_n(2, -3);
  velocity->set_rim_speed_m_per_s(3, std::numeric_limits<double>::infinity());
  const auto responses = client_->Evaluate(request).responses();
  for (const int bad : {1, 2, 3}) {
    EXPECT_TRUE(responses.flags(bad) & v1alpha1::STATE_FLAG_INVALID) << bad;
    EXPECT_TRUE(std::isnan(responses.f_x().value(bad))) << bad;
  }
  for (const int good : {0, 4}) {
    EXPECT_FALSE(responses.flags(good) & v1alpha1::STATE_FLAG_INVALID) << good;
    EXPECT_TRUE(std::isfinite(responses.f_x().value(good))) << good;
  }
}

TEST_F(QueryServerTest, StreamAnswersErrorsInBandAndGoesOn) {
  const auto stream = client_->OpenStream();
  EvaluateWheelsResponse response;
  auto request = Request(2, "clay");
  for (std::uint64_t round = 0; round < 3; ++round) {
    request.set_sequence(100 + round);
    request.set_model("clay");
    ASSERT_TRUE(stream->Send(request));
    ASSERT_TRUE(stream->Receive(&response));
    EXPECT_EQ(response.sequence(), 100 + round);
    EXPECT_EQ(response.error().code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_THAT(response.error().message(), HasSubstr("clay"));
    EXPECT_FALSE(response.has_responses());
    request.set_model("");
    ASSERT_TRUE(stream->Send(request));
    ASSERT_TRUE(stream->Receive(&response));
    EXPECT_FALSE(response.has_error());
    EXPECT_EQ(response.responses().f_x().value_size(), 2);
  }
  EXPECT_NO_THROW(stream->Finish());
}

TEST_F(QueryServerTest, StreamKeepsOrderWithManyInFlight) {
  const auto stream = client_->OpenStream();
  constexpr std::uint64_t kMessages = 200;
  std::thread sender([&] {
    auto request = Request(50);
    for (std::uint64_t i = 0; i < kMessages; ++i) {
      request.set_sequence(i);
      ASSERT_TRUE(stream->Send(request));
    }
  });
  EvaluateWheelsResponse response;
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    ASSERT_TRUE(stream->Receive(&response));
    EXPECT_EQ(response.sequence(), i);
    EXPECT_EQ(response.responses().flags_size(), 50);
  }
  sender.join();
  EXPECT_NO_THROW(stream->Finish());
}

TEST_F(QueryServerTest, AbandonedStreamsAndPassedDeadlinesHarmNobody) {
  for (int i = 0; i < 20; ++i) {
    const auto stream = client_->OpenStream();
    stream->Send(Request(10000));
  }
  const TerrainClient hasty(server_->address(), client::Milliseconds(-1000));  // already passed
  try {
    hasty.Evaluate(Request(1));
    ADD_FAILURE() << "expected DEADLINE_EXCEEDED";
  } catch (const ClientError& e) {
    EXPECT_EQ(e.code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  ExpectAnswers();
}

TEST_F(QueryServerTest, ListModelsFollowsTheRepositoryWhileQueriesGoOn) {
  auto listing = client_->ListModels();
  ASSERT_EQ(listing.models_size(), 1);
  EXPECT_EQ(listing.models(0).digest(), digest_);
  EXPECT_THAT(listing.models(0).aliases(), ::testing::ElementsAre("stable"));
  EXPECT_DOUBLE_EQ(listing.models(0).radius_m(), 0.0625);
  const auto newer = testing::MakeStable(dir_.path(), testing::PhysicsModel("sand", 9e5));
  ASSERT_TRUE(testing::Eventually(
      [&] { return client_->Evaluate(Request(1)).model() == "sand@sha256:" + newer; }));
  EXPECT_EQ(client_->Evaluate(Request(1)).generation(), 2u);
  EXPECT_EQ(client_->Evaluate(Request(1, "sand@previous")).model(), "sand@sha256:" + digest_);
  EXPECT_EQ(client_->Evaluate(Request(1, "sand@sha256:" + digest_.substr(0, 12))).model(),
            "sand@sha256:" + digest_);
  EXPECT_EQ(client_->ListModels().models_size(), 2);
  const auto one = client_->GetModel("sand");
  EXPECT_EQ(one.model().digest(), newer);
  EXPECT_THAT(one.model().aliases(), ::testing::ElementsAre("stable"));
  EXPECT_THROW(client_->GetModel("mud"), ClientError);
}

TEST_F(QueryServerTest, ExplainsWhatItAnswers) {
  v1alpha1::ExplainRequest request;
  request.set_model("sand");
  *request.mutable_state() = Request(1).states();
  const auto evaluated = client_->Evaluate(Request(1, "sand"));
  const auto response = client_->Explain(request);
  const v1alpha1::Explanation& e = response.explanation();
  EXPECT_EQ(response.generation(), evaluated.generation());
  EXPECT_EQ(e.model(), evaluated.model());
  EXPECT_EQ(e.flags(), evaluated.responses().flags(0));
  ASSERT_EQ(e.outputs_size(), 6);
  EXPECT_EQ(e.outputs(0).value(), evaluated.responses().f_x().value(0));
  EXPECT_EQ(e.outputs(5).high(), evaluated.responses().sinkage().high(0));
  EXPECT_EQ(e.outputs(1).sd_fit(), evaluated.responses().f_y().sd_fit(0));
  EXPECT_THAT(e.notes(), ::testing::Contains("no runs recorded in this model file"));
  // A state that cannot be answered is explained; a message that makes no sense is refused.
  request.mutable_state()->set_load_n(0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(client_->Explain(request).explanation().flags(), v1alpha1::STATE_FLAG_INVALID);
  const auto refused = [&](const auto& change) {
    v1alpha1::ExplainRequest bad = request;
    change(&bad);
    try {
      client_->Explain(bad);
    } catch (const ClientError& error) {
      return error.code();
    }
    return grpc::StatusCode::OK;
  };
  using R = v1alpha1::ExplainRequest*;
  EXPECT_EQ(refused([](R) {}), grpc::StatusCode::OK);
  EXPECT_EQ(refused([](R r) { r->set_model("mud"); }), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(refused([](R r) { r->set_model("sand@sha256:xyz"); }),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused([](R r) { r->clear_state(); }), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused([](R r) { r->set_max_runs(21); }), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused([](R r) { r->set_max_runs(4'000'000'000u); }),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused([](R r) {
              r->mutable_state()->add_yaw_rate_rad_per_s(1),
                  r->mutable_state()->add_yaw_rate_rad_per_s(1);
            }),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused([](R r) { r->mutable_state()->mutable_load_n()->Resize(10'000, 1); }),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
}

// A client that knows of no limits takes 4 MB; the models' provenance is three times that.
TEST_F(QueryServerTest, AStockClientListsManyModelsWithLongProvenance) {
  constexpr int kModels = 20, kRuns = 500;
  for (int i = 1; i < kModels; ++i) {
    auto model = testing::PhysicsModel("sand-" + std::to_string(i));
    for (int run = 0; run < kRuns; ++run) {
      auto* summary = model.mutable_provenance()->add_runs();
      summary->set_sha256(std::string(64, 'a'));
      for (int bin = 0; bin < 144; ++bin) summary->mutable_stress()->add_normal_pa(bin);
    }
    testing::MakeStable(dir_.path(), model);
  }
  ASSERT_TRUE(testing::Eventually([&] { return client_->ListModels().models_size() == kModels; }));
  grpc::ChannelArguments plain;
  plain.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub = v1alpha1::TerrainService::NewStub(
      grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), plain));
  grpc::ClientContext listing, getting;
  v1alpha1::ListModelsResponse page;
  const auto listed = stub->ListModels(&listing, {}, &page);
  ASSERT_TRUE(listed.ok()) << listed.error_message();
  EXPECT_EQ(page.models_size(), kModels);
  EXPECT_LT(page.ByteSizeLong(), 1'000'000u);
  v1alpha1::GetModelRequest request;
  request.set_model("sand-7");
  v1alpha1::GetModelResponse one;
  const auto got = stub->GetModel(&getting, request, &one);
  ASSERT_TRUE(got.ok()) << got.error_message();
  EXPECT_EQ(one.provenance().runs_size(), kRuns);
}

TEST_F(QueryServerTest, DamagedRepositoryKeepsTheServerAnswering) {
  std::ofstream(dir_ / "models/aliases.json") << "{ damaged";
  std::ofstream(dir_ / "models/foreign.model") << "not a model";
  ASSERT_TRUE(testing::Eventually(
      [&] { return server_->program().Stderr().find("aliases.json") != std::string::npos; }));
  EXPECT_EQ(client_->Evaluate(Request(1)).model(), "sand@sha256:" + digest_);
}

TEST_F(QueryServerTest, HealthAndReflection) {
  const client::Milliseconds limit(30000);
  EXPECT_TRUE(client::IsServing(server_->address(), "", limit));
  EXPECT_TRUE(client::IsServing(server_->address(), "grouser.v1alpha1.TerrainService", limit));
  EXPECT_THROW(client::IsServing(server_->address(), "no.such.Service", limit), ClientError);

  // ServerReflectionRequest {string list_services = 7 "*"}; the answer carries
  // the names as plain text.
  grpc::GenericStub stub(client::MakeChannel(server_->address()));
  grpc::ClientContext context;
  context.set_deadline(client::DeadlineAfter(limit));
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareCall(
      &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  const auto complete = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  ASSERT_TRUE(complete());
  grpc::Slice question("\x3a\x01*", 3);
  call->Write(grpc::ByteBuffer(&question, 1), nullptr);
  ASSERT_TRUE(complete());
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  ASSERT_TRUE(complete());
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(answer.Dump(&slices).ok());
  std::string bytes;
  for (const auto& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  EXPECT_THAT(bytes, HasSubstr("grouser.v1alpha1.TerrainService"));
  EXPECT_THAT(bytes, HasSubstr("grpc.health.v1.Health"));
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  complete();
}

TEST_F(QueryServerTest, PortInUseIsNamed) {
  const auto second = testing::RunProgram(
      "grouser-server", {"--state", dir_.path(), "--grpc", server_->address(), "--no-lcm"},
      dir_.path());
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.err, AllOf(HasSubstr(server_->address()), HasSubstr("in use")));
  ExpectAnswers();
}

TEST_F(QueryServerTest, SigtermDrainsAndExitsZero) {
  const auto stream = client_->OpenStream();
  EvaluateWheelsResponse response;
  ASSERT_TRUE(stream->Send(Request(1)));
  ASSERT_TRUE(stream->Receive(&response));
  server_->program().Signal(SIGTERM);
  EXPECT_EQ(server_->program().Wait(), 0) << server_->program().Stderr();
  try {
    stream->Finish();
    ADD_FAILURE() << "expected UNAVAILABLE";
  } catch (const ClientError& e) {
    EXPECT_EQ(e.code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_THAT(std::string(e.what()), HasSubstr("shutting down"));
  }
}

TEST(QueryServerStart, EmptyRepositoryServesNotFoundAndIsNotServing) {
  testing::TempDir dir;
  testing::ServerProcess server(dir.path());
  const TerrainClient client(server.address(), client::Milliseconds(30000));
  EXPECT_EQ(client.ListModels().models_size(), 0);
  EXPECT_THROW(client.Evaluate(Request(1)), ClientError);
  EXPECT_FALSE(client::IsServing(server.address(), "grouser.v1alpha1.TerrainService",
                                 client::Milliseconds(30000)));
  testing::MakeStable(dir.path(), testing::PhysicsModel("sand"));
  EXPECT_TRUE(testing::Eventually([&] { return client.ListModels().models_size() == 1; }));
}

TEST(QueryServerStart, ShippedModelAnswersAtOnce) {
  testing::TempDir dir;
  const auto digest = testing::MakeStable(dir / "made", testing::PhysicsModel("sand"));
  std::filesystem::create_directories(dir / "shipped");
  std::filesystem::rename(dir / ("made/models/" + digest + ".model"), dir / "shipped/s.model");
  testing::ServerProcess server(dir / "state", {"--no-lcm", "--shipped", dir / "shipped"});
  const TerrainClient client(server.address(), client::Milliseconds(30000));
  EXPECT_EQ(client.Evaluate(Request(1)).model(), "sand@sha256:" + digest);
  EXPECT_TRUE(client.ListModels().models(0).shipped());
}

TEST(QueryServerStart, BadCommandLinesExitWithTwoAndSayWhy) {
  testing::TempDir dir;
  const auto run = [&dir](const std::vector<std::string>& arguments) {
    return testing::RunProgram("grouser-server", arguments, dir.path());
  };
  auto bad = run({"--state", dir.path(), "--grpc", "nonsense"});
  EXPECT_EQ(bad.code, 2);
  EXPECT_THAT(bad.err, AllOf(HasSubstr("nonsense"), HasSubstr("HOST:PORT")));
  EXPECT_EQ(run({"--no-such-option"}).code, 2);
  const auto help = run({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("Examples"));
}

}  // namespace
}  // namespace grouser

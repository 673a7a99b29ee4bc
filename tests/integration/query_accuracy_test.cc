// Accuracy requests through a real grouser-server that has all three kinds of model of a pair.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <sstream>

#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "clients/cpp/wheel_states.h"
#include "proto/records/model_file.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::ClientError;
using client::TerrainClient;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using v1alpha1::EvaluateWheelsRequest;
using v1alpha1::EvaluateWheelsResponse;
using v1alpha1::STATE_FLAG_INVALID;
using v1alpha1::STATE_FLAG_TOLERANCE_UNMET;

constexpr char kName[] = "cmu-smooth-62.5-8mm";

/// Driven and braked, from straight ahead to across; loads of the training runs.
EvaluateWheelsRequest Request(const std::string& model = kName) {
  EvaluateWheelsRequest request;
  request.set_model(model);
  for (int i = 0; i < 60; ++i) {
    client::AddVelocityState(0.1 * std::cos(0.025 * i), 0.1 * std::sin(0.025 * i),
                             0.02 + 0.002 * (i % 40), 8 + 0.25 * i, request.mutable_states());
  }
  return request;
}

const v1alpha1::OutputArray& ArrayOf(const v1alpha1::WheelResponses& r, int output) {
  const v1alpha1::OutputArray* arrays[] = {&r.f_x(),    &r.f_y(), &r.f_z(),
                                           &r.torque(), &r.m_z(), &r.sinkage()};
  return *arrays[output];
}

class QueryAccuracyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* kind : {"bekker", "lookup", "hybrid"}) {
      const auto model =
          records::ReadModelFile(std::string(GROUSER_PAIR) + "/" + kind + ".model").model;
      const std::string digest = testing::MakeStable(dir_.path(), model);
      messages_[model.name() + "@sha256:" + digest] = model;
    }
    testing::MakeStable(dir_.path(), testing::PhysicsModel("other-sand"));
    server_ = std::make_unique<testing::ServerProcess>(dir_.path());
    client_ = std::make_unique<TerrainClient>(server_->address(), client::Milliseconds(30000));
  }
  testing::Finished Client(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", server_->address()});
    return testing::RunProgram("grouser-client", arguments, dir_.path());
  }

  testing::TempDir dir_;
  std::map<std::string, v1alpha1::Model> messages_;  // by reference
  std::unique_ptr<testing::ServerProcess> server_;
  std::unique_ptr<TerrainClient> client_;
};

/// `all` without the arrays that `fields` does not name.
EvaluateWheelsResponse Masked(EvaluateWheelsResponse all, const std::vector<std::string>& fields) {
  const auto named = [&fields](const std::string& name) {
    return std::ranges::find(fields, name) != fields.end();
  };
  v1alpha1::WheelResponses* r = all.mutable_responses();
  for (const char* array : {"f_x", "f_y", "f_z", "torque", "m_z", "sinkage", "velocity", "slip"}) {
    const auto* field = r->GetDescriptor()->FindFieldByName(array);
    auto* message = r->GetReflection()->MutableMessage(r, field);
    for (int p = 0; p < message->GetDescriptor()->field_count() && !named(array); ++p) {
      const auto* part = message->GetDescriptor()->field(p);
      if (!named(array + ("." + part->name()))) message->GetReflection()->ClearField(message, part);
    }
  }
  return all;
}

// Of every kind of model, of both forms, with gradients and with models that are chosen by state;
// states of every flag that such models set are among them.
TEST_F(QueryAccuracyTest, FieldsAreThoseOfTheWholeAnswerBitByBit) {
  const std::vector<std::vector<std::string>> masks = {
      {"f_x"},
      {"f_x.value", "f_x.low", "sinkage.value", "sinkage.high"},
      {"torque.d_load", "m_z.sd_form", "slip"},
      {"f_y.measured_high", "velocity"},
      {"sinkage.d_v_x"},
      {"velocity", "slip", "f_x", "f_y", "f_z", "torque", "m_z", "sinkage"}};
  std::vector<EvaluateWheelsRequest> requests = {Request()};
  auto* odd = requests[0].mutable_states();
  client::AddVelocityState(std::numeric_limits<double>::quiet_NaN(), 0, 0.1, 24, odd);
  client::AddVelocityState(0, 0, 0, 24, odd);
  client::AddVelocityState(0.1, 0, 0.1, 0, odd);
  client::AddVelocityState(0.1, 0, 0.1, 1e4, odd);
  client::AddVelocityState(3, 0, 4, 24, odd);
  for (int i = 0; i < 20; ++i) {
    client::AddSlipState(0.2 * i - 2, 0.1 * i, 10 + i, requests.emplace_back().mutable_states());
  }
  for (auto request : requests) {
    for (const int with : {0, 1, 2, 3}) {
      request.set_with_gradients((with & 1) != 0);
      if ((with & 2) != 0) request.mutable_accuracy()->set_share_of_load(0.1);
      std::vector<std::string> models = {kName};
      if ((with & 2) == 0) {
        for (const auto& [reference, message] : messages_) models.push_back(reference);
      }
      for (const std::string& model : models) {
        request.set_model(model);
        request.clear_fields();
        auto all = client_->Evaluate(request);
        all.clear_latency();
        for (const auto& fields : masks) {
          request.mutable_fields()->Assign(fields.begin(), fields.end());
          auto some = client_->Evaluate(request);
          some.clear_latency();
          EXPECT_EQ(some.SerializeAsString(), Masked(all, fields).SerializeAsString())
              << model << " " << with << " " << fields[0];
        }
      }
    }
  }
}

TEST_F(QueryAccuracyTest, FieldsThatAreNotThereAreNamed) {
  for (const char* name : {"", "fx", "f_x.", "f_x.lower", "f_x.low.low", "flags", "slip.slip"}) {
    auto request = Request();
    request.add_fields("f_x.low");
    request.add_fields(name);
    try {
      client_->Evaluate(request);
      ADD_FAILURE() << name;
    } catch (const ClientError& e) {
      EXPECT_EQ(e.code(), grpc::StatusCode::INVALID_ARGUMENT);
      EXPECT_THAT(std::string(e.what()),
                  AllOf(HasSubstr("fields[1]: '" + std::string(name) + "', expected"),
                        HasSubstr("f_x.low")));
    }
  }
  auto request = Request();
  for (int i = 0; i < 129; ++i) request.add_fields("f_x");
  EXPECT_THROW(client_->Evaluate(request), ClientError);
  // Cut inside a character the name would break the stream.
  for (const std::size_t before : {63, 99}) {
    const auto stream = client_->OpenStream();
    request = Request();
    request.add_fields(std::string(before, 'a') + "\u00e9 and more");
    EvaluateWheelsResponse response;
    ASSERT_TRUE(stream->Send(request) && stream->Receive(&response));
    EXPECT_TRUE(response.has_error());
    ASSERT_TRUE(stream->Send(Request()) && stream->Receive(&response));
    EXPECT_FALSE(response.has_error());
    EXPECT_NO_THROW(stream->Finish());
  }
  const std::vector<std::string> query = {
      "query", "--model", kName, "--slip", "0.2", "--load", "24", "--fields", "f_x.value,sinkage"};
  const auto some = Client(query);
  EXPECT_EQ(some.code, 0) << some.err;
  EXPECT_THAT(some.out, AllOf(HasSubstr("f_x "), HasSubstr("sinkage "), HasSubstr("load 24 N"),
                              Not(HasSubstr("torque")), Not(HasSubstr("rim"))));
  auto wrong = query;
  wrong.back() = "f_x,thrust";
  EXPECT_THAT(Client(wrong).err, HasSubstr("fields[1]: 'thrust'"));
}

// Each state has bit by bit the answer of the model that is said to have given it;
// an answer without the flag is within its tolerance by its interval.
TEST_F(QueryAccuracyTest, EveryAnswerIsThatOfTheModelItNames) {
  std::map<std::string, EvaluateWheelsResponse> alone;
  for (const auto& [reference, message] : messages_) {
    alone[reference] = client_->Evaluate(Request(reference));
    EXPECT_EQ(alone[reference].selectable_models_size() + alone[reference].answered_by_size(), 0);
  }
  int met = 0, unmet = 0;
  for (const double share : {0.05, 0.1, 0.15, 0.5}) {
    auto request = Request();
    request.mutable_accuracy()->set_share_of_load(share);
    const auto response = client_->Evaluate(request);
    const auto& r = response.responses();
    ASSERT_EQ(response.selectable_models_size(), 3);
    ASSERT_EQ(response.answered_by_size(), 60);
    for (int i = 0; i < 60; ++i) {
      const auto& own =
          alone.at(response.selectable_models(static_cast<int>(response.answered_by(i))))
              .responses();
      const bool good = (r.flags(i) & STATE_FLAG_TOLERANCE_UNMET) == 0;
      ++(good ? met : unmet);
      EXPECT_EQ(r.flags(i) & ~std::uint32_t{STATE_FLAG_TOLERANCE_UNMET}, own.flags(i));
      for (int o = 0; o < 6; ++o) {
        const auto &a = ArrayOf(r, o), &b = ArrayOf(own, o);
        EXPECT_EQ(a.value(i), b.value(i));
        EXPECT_EQ(a.high(i), b.high(i));
        EXPECT_EQ(a.sd_patch(i), b.sd_patch(i));
        EXPECT_TRUE(a.sd_form(i) == b.sd_form(i) || std::isnan(b.sd_form(i)));
        const double unit = (8 + 0.25 * i) * (o == 3 || o == 4 ? 0.0625 : 1);
        if (good && o != 5) {
          EXPECT_LE(0.5 * (a.high(i) - a.low(i)), share * unit) << i;
        }
      }
    }
  }
  EXPECT_GT(met, 0);
  EXPECT_GT(unmet, 0);
}

TEST_F(QueryAccuracyTest, AnyKindNamesThePairAndADigestStandsAlone) {
  const auto ask = [&](const std::string& model) {
    auto request = Request(model);
    request.mutable_accuracy()->set_share_of_load(0.16);
    auto response = client_->Evaluate(request);
    response.clear_latency();
    return response;
  };
  auto by_hybrid = ask(kName), by_lookup = ask(std::string(kName) + "-lookup");
  EXPECT_THAT(by_hybrid.model(), HasSubstr("8mm@sha256:"));
  EXPECT_THAT(by_lookup.model(), HasSubstr("8mm-lookup@sha256:"));
  by_hybrid.clear_model();
  by_lookup.clear_model();
  EXPECT_EQ(by_hybrid.SerializeAsString(), by_lookup.SerializeAsString());
  for (const auto& [reference, message] : messages_) {
    const auto pinned = ask(reference);
    ASSERT_EQ(pinned.selectable_models_size(), 1);
    EXPECT_EQ(pinned.selectable_models(0), reference);
  }
  EXPECT_EQ(ask("other-sand").selectable_models_size(), 1);
}

TEST_F(QueryAccuracyTest, LooseIsMetTinyIsNotAndTheHintCanBeSubmitted) {
  auto request = Request();
  request.mutable_accuracy()->set_share_of_load(2);
  const auto loose = client_->Evaluate(request);
  for (const auto flags : loose.responses().flags())
    EXPECT_FALSE(flags & STATE_FLAG_TOLERANCE_UNMET);
  EXPECT_FALSE(loose.has_refinement());

  request.mutable_accuracy()->Clear();
  request.mutable_accuracy()->set_sinkage_m(1e-5);
  request.mutable_states()->mutable_velocity()->set_v_x_m_per_s(
      0, std::numeric_limits<double>::quiet_NaN());
  const auto tiny = client_->Evaluate(request);
  EXPECT_EQ(tiny.responses().flags(0), STATE_FLAG_INVALID);
  for (int i = 1; i < 60; ++i) {
    EXPECT_TRUE(tiny.responses().flags(i) & STATE_FLAG_TOLERANCE_UNMET) << i;
  }
  ASSERT_TRUE(tiny.has_refinement());
  const auto& hint = tiny.refinement();
  const auto index = static_cast<int>(hint.index());
  EXPECT_EQ(hint.output(), "sinkage");
  EXPECT_GT(hint.excess(), 1);
  EXPECT_EQ(hint.model(), tiny.selectable_models(tiny.answered_by(index)));
  EXPECT_EQ(hint.state().load_n(), request.states().load_n(index));
  v1alpha1::SubmitRefinementRequest submit;
  submit.set_request_id("test");
  submit.set_model(hint.model());
  *submit.mutable_state() = hint.state();
  EXPECT_NO_THROW(server::CheckSubmit(submit));
  EXPECT_NO_THROW(server::BuildSpec(messages_.at(hint.model()), submit));
}

TEST_F(QueryAccuracyTest, NoAccuracyRequestAnswersAsBefore) {
  const auto same = [&](const EvaluateWheelsRequest& request) {
    auto response = client_->Evaluate(request);
    response.clear_latency();
    return response.SerializeAsString();
  };
  auto empty = Request();
  empty.mutable_accuracy();
  EXPECT_EQ(same(Request()), same(empty));
  EXPECT_EQ(client_->Evaluate(empty).selectable_models_size(), 0);
}

TEST_F(QueryAccuracyTest, BudgetAloneIsAnsweredByOneModel) {
  auto request = Request();
  request.mutable_accuracy()->set_budget_us(1e-3);  // less than anything costs
  const auto poor = client_->Evaluate(request);
  request.mutable_accuracy()->set_budget_us(1e6);
  const auto rich = client_->Evaluate(request);
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(poor.answered_by(i), 0u);
    EXPECT_EQ(rich.answered_by(i), rich.answered_by(0));
    EXPECT_FALSE((poor.responses().flags(i) | rich.responses().flags(i)) &
                 STATE_FLAG_TOLERANCE_UNMET);
  }
  EXPECT_THAT(rich.selectable_models(static_cast<int>(rich.answered_by(0))),
              Not(HasSubstr("bekker")));
}

TEST_F(QueryAccuracyTest, BadAccuracyRequestsAreRefusedAndStreamsGoOn) {
  auto bad = Request();
  bad.mutable_accuracy()->set_torque_n_m(-0.5);
  try {
    client_->Evaluate(bad);
    ADD_FAILURE() << "expected a refusal";
  } catch (const ClientError& e) {
    EXPECT_EQ(e.code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(e.what(), HasSubstr("accuracy.torque_n_m: -0.5, expected"));
  }
  auto good = Request();
  good.mutable_accuracy()->set_sinkage_m(1e-5);
  const auto stream = client_->OpenStream();
  EvaluateWheelsResponse response;
  for (int round = 0; round < 4; ++round) {  // the server reuses two answers in turn
    ASSERT_TRUE(stream->Send(good) && stream->Receive(&response));
    EXPECT_EQ(response.selectable_models_size(), 3);
    EXPECT_EQ(response.answered_by_size(), 60);
    EXPECT_TRUE(response.has_refinement());
    ASSERT_TRUE(stream->Send(round % 2 ? bad : Request()) && stream->Receive(&response));
    EXPECT_EQ(response.selectable_models_size() + response.answered_by_size(), 0);
    EXPECT_FALSE(response.has_refinement());
    EXPECT_EQ(response.has_error(), round % 2 == 1);
    if (response.has_error()) {
      EXPECT_EQ(response.error().code(), grpc::StatusCode::INVALID_ARGUMENT);
      EXPECT_THAT(response.error().message(), HasSubstr("accuracy.torque_n_m"));
    }
  }
  EXPECT_NO_THROW(stream->Finish());
}

TEST_F(QueryAccuracyTest, CommandLinePrintsWhoAnsweredAndTheCommandThatWouldHelp) {
  const auto met = Client({"query", "--model", kName, "--slip", "-0.3", "--angle-deg", "30",
                           "--load", "20", "--share", "2", "--tolerance", "f_x=50,sinkage=0.05"});
  ASSERT_EQ(met.code, 0) << met.err;
  EXPECT_THAT(met.out, AllOf(HasSubstr("answered by cmu-smooth"), HasSubstr("1 of 1 states"),
                             Not(HasSubstr("TOLERANCE_UNMET"))));
  const auto unmet = Client({"query", "--model", kName, "--slip", "-0.3", "--angle-deg", "30",
                             "--load", "20", "--tolerance", "f_x=0.001"});
  ASSERT_EQ(unmet.code, 0) << unmet.err;
  EXPECT_THAT(unmet.out, AllOf(HasSubstr("TOLERANCE_UNMET"), HasSubstr("its f_x may err by")));
  const std::size_t at = unmet.out.find("  grouser-client submit ");
  ASSERT_NE(at, std::string::npos) << unmet.out;
  // The command is one: it gets as far as a job server that is not there.
  std::istringstream words(unmet.out.substr(at, unmet.out.find('\n', at) - at));
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word);
  EXPECT_THAT(command, ::testing::Contains("20"));
  EXPECT_THAT(command, ::testing::Contains("30"));
  command.erase(command.begin());
  command.insert(command.end(), {"--jobs", "127.0.0.1:1", "--deadline-ms", "2000"});
  const auto submit = testing::RunProgram("grouser-client", command, dir_.path());
  EXPECT_EQ(submit.code, 1);
  EXPECT_THAT(submit.err, HasSubstr("127.0.0.1:1"));
  for (const char* text : {"f_x", "f_x=", "f_x=1N", "grip=1"}) {
    const auto bad = Client({"query", "--slip", "0", "--load", "20", "--tolerance", text});
    EXPECT_EQ(bad.code, 2) << text;
    EXPECT_THAT(bad.err, HasSubstr("--tolerance")) << text;
  }
  const auto bare = Client(
      {"query", "--slip", "0", "--load", "20", "--against", "measured", "--budget-us", "100"});
  EXPECT_EQ(bare.code, 2);
  EXPECT_THAT(bare.err, HasSubstr("--against: measured, expected --tolerance or --share"));
  const auto negative =
      Client({"query", "--model", kName, "--slip", "0", "--load", "20", "--budget-us", "-1"});
  EXPECT_EQ(negative.code, 1);
  EXPECT_THAT(negative.err, HasSubstr("accuracy.budget_us: -1"));
}

}  // namespace
}  // namespace grouser

// Queries that grouser-server logs, and grouser-replay evaluates again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/terrain_client.h"
#include "clients/cpp/wheel_states.h"
#include "proto/records/model_file.h"
#include "server/query/log/query_log_file.h"
#include "server/query/log/query_log_reader.h"
#include "tests/integration/http_wire.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/jobs/write_faults.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using client::TerrainClient;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using v1alpha1::EvaluateWheelsRequest;
using v1alpha1::EvaluateWheelsResponse;
using v1alpha1::LoggedQuery;

constexpr char kName[] = "cmu-smooth-62.5-8mm";

EvaluateWheelsRequest Velocities(int n = 40) {
  EvaluateWheelsRequest request;
  request.set_model(kName);
  for (int i = 0; i < n; ++i) {
    client::AddVelocityState(0.1 * std::cos(0.03 * i), 0.1 * std::sin(0.03 * i), 0.002 * (i % 40),
                             8 + 0.25 * (i % 60), request.mutable_states());
  }
  return request;
}

/// Without speeds: the model gives them. One state makes no sense.
EvaluateWheelsRequest Slips() {
  EvaluateWheelsRequest request;
  request.set_model(kName);
  for (int i = 0; i < 30; ++i) {
    request.mutable_states()->add_load_n(10 + i);
    request.mutable_states()->mutable_slip()->add_slip(i == 3 ? 7 : 0.03 * i);
    request.mutable_states()->mutable_slip()->add_attack_angle_rad(0.05 * i);
  }
  return request;
}

/// Of every form, kind of model and part of an answer.
std::vector<EvaluateWheelsRequest> AllKinds() {
  std::vector<EvaluateWheelsRequest> requests;
  for (EvaluateWheelsRequest request : {Velocities(), Slips()}) {
    auto* odd = request.mutable_states();
    odd->set_load_n(0, std::numeric_limits<double>::quiet_NaN());
    odd->set_load_n(1, 0);
    odd->set_load_n(2, 1e4);
    requests.push_back(request);
    requests.push_back(request);
    requests.back().set_with_gradients(true);
    requests.push_back(request);
    requests.back().set_values_only(true);
    requests.push_back(request);
    requests.back().add_fields("f_x.low");
    requests.back().add_fields("sinkage");
    for (const double share : {0.05, 0.3, 1.0}) {  // models are chosen by state
      requests.push_back(request);
      requests.back().mutable_accuracy()->set_share_of_load(share);
    }
    requests.push_back(request);
    requests.back().mutable_accuracy()->set_budget_us(20);
    requests.back().add_fields("torque.high");
    requests.push_back(request);
    requests.back().mutable_states()->mutable_pass_number()->Resize(request.states().load_n_size(),
                                                                    2);
  }
  for (std::size_t i = 0; i < requests.size(); ++i) requests[i].set_sequence(i + 1);
  return requests;
}

/// A log of that one query, or of several of it.
void WriteLog(const std::string& path, const v1alpha1::QueryLogHeader& header,
              const LoggedQuery& query, int times = 1) {
  server::QueryLogFile file({path}, header);
  for (int i = 0; i < times; ++i) {
    std::vector<std::uint8_t> framed(server::kFrameBytes + query.ByteSizeLong());
    query.SerializeToArray(framed.data() + server::kFrameBytes,
                           static_cast<int>(framed.size() - server::kFrameBytes));
    file.Append(framed);
  }
  file.Flush();
}

class QueryLogTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(dir_ / "log");
    for (const char* kind : {"bekker", "lookup", "hybrid"}) {
      const auto model =
          records::ReadModelFile(std::string(GROUSER_PAIR) + "/" + kind + ".model").model;
      digests_[kind] = testing::MakeStable(State(), model);
    }
  }
  std::string State() const { return dir_ / "state"; }
  std::unique_ptr<testing::ServerProcess> Start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> options = {"--no-lcm", "--query-log", log_};
    options.insert(options.end(), more.begin(), more.end());
    return std::make_unique<testing::ServerProcess>(State(), options);
  }
  testing::Finished Replay(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--state", State(), "--shipped", ""});
    return testing::RunProgram("grouser-replay", arguments, dir_.path());
  }

  testing::TempDir dir_;
  std::map<std::string, std::string> digests_;
  std::string log_ = dir_ / "log/queries";
};

TEST_F(QueryLogTest, AllQueriesOfUnaryCallsAndStreamsHaveEqualBitsAgain) {
  const auto requests = AllKinds();
  std::size_t states = 0;
  {
    const auto server = Start();
    const TerrainClient client(server->address(), client::Milliseconds(30000));
    const auto stream = client.OpenStream();
    EvaluateWheelsResponse response;
    for (const auto& request : requests) {
      client.Evaluate(request);
      ASSERT_TRUE(stream->Send(request) && stream->Receive(&response));
      EXPECT_FALSE(response.has_error()) << response.error().message();
      states += 2 * request.states().load_n_size();
    }
    EvaluateWheelsRequest unknown = Velocities();
    unknown.set_model("mud");
    ASSERT_TRUE(stream->Send(unknown) && stream->Receive(&response));
    EXPECT_TRUE(response.has_error()) << "is answered by no model, and not logged";
    stream->Finish();
    server->program().Signal(SIGTERM);
    EXPECT_EQ(server->program().Wait(), 0);
  }
  struct stat info {};
  ASSERT_EQ(::stat(log_.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0600u);
  const auto said = [&](const testing::Finished& done) {
    EXPECT_EQ(done.code, 0) << done.err << done.out;
    const json told = json::parse(done.out);
    EXPECT_EQ(told["queries"], 2 * requests.size());
    EXPECT_EQ(told["replayed"], 2 * requests.size());
    EXPECT_EQ(told["states"], states);
    EXPECT_EQ(told["equal_states"], states);
    EXPECT_EQ(told["first"], json::array());
  };
  said(Replay({log_, "--json"}));
  const auto text = Replay({log_});
  EXPECT_THAT(text.out, HasSubstr(" of equal bits, 0 differing"));
  log_ = dir_ / "log/other";
  const auto server = Start();
  said(Replay({dir_ / "log/queries", "--json", "--server", server->address()}));
}

TEST_F(QueryLogTest, WhatDiffersIsShownAndAModelThatIsGoneIsNamed) {
  {
    const auto server = Start();
    TerrainClient(server->address()).Evaluate(Velocities());
    server->program().Signal(SIGTERM);
    server->program().Wait();
  }
  // The same log, with one number of another bit.
  LoggedQuery query;
  server::QueryLogReader reader(log_);
  ASSERT_TRUE(reader.Next(&query));
  auto* value = query.mutable_response()->mutable_responses()->mutable_f_x()->mutable_value();
  value->Set(5, std::nextafter(value->Get(5), 1e9));
  const std::string changed = dir_ / "log/changed";
  WriteLog(changed, reader.header(), query);
  const auto one = Replay({log_, changed});
  EXPECT_EQ(one.code, 1);
  EXPECT_THAT(one.out, HasSubstr(changed + ", query 1 (sequence 0), state 5, f_x.value: logged "));
  EXPECT_THAT(one.out,
              HasSubstr("2 queries, 2 replayed: 80 states, 79 of equal bits, 1 differing"));

  const auto by_other = Replay({log_, "--model", digests_["bekker"].substr(0, 12)});
  EXPECT_EQ(by_other.code, 1);
  EXPECT_EQ(std::ranges::count(by_other.out, '\n'), 10 + 1) << "the first ten are shown";
  EXPECT_EQ(Replay({log_, "--model", digests_["hybrid"]}).code, 0);
  EXPECT_EQ(Replay({log_, "--model", kName}).code, 0) << "its stable is still the same";
  EXPECT_THAT(Replay({log_, "--model", "0123456789ab"}).err,
              HasSubstr("0 models have a digest that begins with 0123456789ab"));

  std::filesystem::remove(State() + "/models/" + digests_["hybrid"] + ".model");
  const auto gone = Replay({log_});
  EXPECT_EQ(gone.code, 1);
  EXPECT_THAT(gone.out, HasSubstr("1 queries, 0 replayed"));
  EXPECT_THAT(gone.out, HasSubstr("for want of a model: " + std::string(kName) +
                                  "@sha256:" + digests_["hybrid"] + " (1 queries): "));

  std::ofstream(dir_ / "foreign") << "my thesis";
  const auto foreign = Replay({dir_ / "foreign"});
  EXPECT_EQ(foreign.code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("foreign: is no query log, expected"));
  std::filesystem::resize_file(changed, std::filesystem::file_size(changed) - 1);
  EXPECT_EQ(Replay({changed, "--allow-cut-tail"}).code, 0) << "as a kill leaves it";
  const auto cut = Replay({changed});
  EXPECT_EQ(cut.code, 1) << "or a changed length, behind which nothing is checked";
  EXPECT_THAT(cut.err, AllOf(HasSubstr("the file ends in a record"), HasSubstr(" bytes not (")));
  std::fstream(log_, std::ios::in | std::ios::out | std::ios::binary).seekp(-9, std::ios::end)
      << "damaged";
  const auto damaged = Replay({log_});
  EXPECT_EQ(damaged.code, 1);
  EXPECT_THAT(damaged.err, HasSubstr("a record's checksum is wrong"));
}

// What LCM does not carry is not there, and not compared; all else is.
TEST_F(QueryLogTest, OfAQueryOverLcmWhatItCarriesIsCompared) {
  {
    const auto server = Start();
    TerrainClient(server->address()).Evaluate(Velocities());
    server->program().Signal(SIGTERM);
    server->program().Wait();
  }
  LoggedQuery query;
  server::QueryLogReader reader(log_);
  ASSERT_TRUE(reader.Next(&query));
  auto* responses = query.mutable_response()->mutable_responses();
  responses->clear_velocity();
  responses->mutable_slip()->clear_speed_m_per_s();
  responses->clear_interval_level();
  int number = 0;
  const auto replay = [&] {
    const std::string path = dir_ / ("log/lcm" + std::to_string(++number) + "q");
    WriteLog(path, reader.header(), query);
    return Replay({path});
  };
  EXPECT_EQ(replay().code, 1) << "by gRPC these were there";
  query.set_transport(v1alpha1::QUERY_TRANSPORT_LCM);
  const auto equal = replay();
  EXPECT_EQ(equal.code, 0) << equal.out;
  EXPECT_THAT(equal.out, HasSubstr("40 states, 40 of equal bits"));
  auto* low = responses->mutable_sinkage()->mutable_low();
  low->Set(7, std::nextafter(low->Get(7), 1e9));
  const auto differs = replay();
  EXPECT_EQ(differs.code, 1);
  EXPECT_THAT(differs.out, HasSubstr("state 7, sinkage.low: logged "));
}

TEST_F(QueryLogTest, WhatKeepsAQueryFromBeingReplayedIsNamed) {
  {
    const auto server = Start();
    TerrainClient(server->address()).Evaluate(Velocities());
    server->program().Signal(SIGTERM);
    server->program().Wait();
  }
  LoggedQuery query;
  server::QueryLogReader reader(log_);
  ASSERT_TRUE(reader.Next(&query));
  const auto told = [&](const LoggedQuery& logged, int times = 1) {
    static int number = 0;
    const std::string path = dir_ / ("log/made" + std::to_string(++number) + "q");
    WriteLog(path, reader.header(), logged, times);
    const auto done = Replay({path, "--json"});
    EXPECT_EQ(done.code, 1) << done.err;
    return json::parse(done.out, nullptr, false);
  };

  // Of two models that answered, the one that is not there.
  const std::string none = "mud@sha256:" + std::string(64, '0');
  LoggedQuery of_two = query;
  of_two.mutable_response()->add_selectable_models(query.response().model());
  of_two.mutable_response()->add_selectable_models(none);
  for (int i = 0; i < 40; ++i) of_two.mutable_response()->add_answered_by(i % 2);
  EXPECT_EQ(told(of_two)["missing"][none]["queries"], 1);

  // A whole file that makes no model.
  auto model = records::ReadModelFile(std::string(GROUSER_PAIR) + "/hybrid.model").model;
  model.mutable_golden(0)->set_value(0, 1e3);
  const std::string wrong = std::string(kName) + "@sha256:" + testing::MakeStable(State(), model);
  LoggedQuery of_wrong = query;
  of_wrong.mutable_response()->set_model(wrong);
  const json missing = told(of_wrong, 2)["missing"][wrong];
  EXPECT_EQ(missing["queries"], 2);
  EXPECT_THAT(missing["why"].get<std::string>(), HasSubstr("golden"));

  // What no server writes: answers to more states than were asked, each by a model of its own.
  LoggedQuery hostile = query;
  auto* response = hostile.mutable_response();
  for (int i = 0; i < 30'000; ++i) {
    response->mutable_responses()->add_flags(0);
    response->add_selectable_models("m@" + std::to_string(i));
    response->add_answered_by(i);
  }
  const json refused = told(hostile, 12);
  EXPECT_EQ(refused["refused"], 12);
  EXPECT_EQ(refused["replayed"], 0);
  ASSERT_EQ(refused["refusals"].size(), 10u);
  EXPECT_THAT(refused["refusals"][0].get<std::string>(), HasSubstr("40 states, 30040 answers"));
  response->mutable_responses()->mutable_flags()->Truncate(40);
  EXPECT_THAT(told(hostile)["refusals"][0].get<std::string>(), HasSubstr("30000 models to select"));
  hostile.mutable_request()->mutable_states()->mutable_load_n()->Resize(10'001, 1);
  response->mutable_responses()->mutable_flags()->Resize(10'001, 0);
  EXPECT_THAT(told(hostile)["refusals"][0].get<std::string>(), HasSubstr("10001 states, expected"));
}

TEST_F(QueryLogTest, AKillLeavesWholeQueriesAndTheNextStartKeepsThem) {
  std::uint64_t answered = 0;
  {
    const auto server = Start();
    const TerrainClient client(server->address());
    const auto stream = client.OpenStream();
    const EvaluateWheelsRequest request = Velocities();
    EvaluateWheelsResponse response;
    while (stream->Send(request) && stream->Receive(&response)) {
      const bool look = ++answered % 100 == 0;
      if (look && std::filesystem::file_size(log_) > 100'000) server->program().Signal(SIGKILL);
      ASSERT_LT(answered, 1'000'000u);
    }
    server->program().Wait();
  }
  const auto told = json::parse(Replay({log_, "--json", "--allow-cut-tail"}).out);
  EXPECT_GT(told["queries"], 0) << told;
  EXPECT_LE(told["queries"], answered + 2) << "those whose answers were lost on the way";
  EXPECT_EQ(told["equal_states"], told["states"]);
  EXPECT_EQ(told["damaged"], json::array());
  {
    const auto server = Start();
    TerrainClient(server->address()).Evaluate(Velocities());
    server->program().Signal(SIGTERM);
    server->program().Wait();
  }
  const auto both = Replay({log_ + ".1", log_, "--json", "--allow-cut-tail"});
  EXPECT_EQ(both.code, 0) << both.err;
  EXPECT_EQ(json::parse(both.out)["queries"], told["queries"].get<int>() + 1);
}

TEST_F(QueryLogTest, FilesAreBoundedInSizeAndNumber) {
  const auto server = Start({"--query-log-limit-mb", "1", "--query-log-files", "2"});
  const TerrainClient client(server->address(), client::Milliseconds(30000));
  const EvaluateWheelsRequest big = Velocities(1000);  // some 0.4 MB each
  for (int i = 0; i < 20; ++i) client.Evaluate(big);
  server->program().Signal(SIGTERM);
  EXPECT_EQ(server->program().Wait(), 0);
  EXPECT_TRUE(std::filesystem::exists(log_ + ".1"));
  EXPECT_FALSE(std::filesystem::exists(log_ + ".2"));
  for (const std::string& name : {log_, log_ + ".1"}) {
    EXPECT_LE(std::filesystem::file_size(name), 1'000'000u);
  }
  EXPECT_EQ(Replay({log_ + ".1", log_}).code, 0);
}

TEST_F(QueryLogTest, AFullDiskEndsTheLogInOneLineAndNotTheServer) {
  server::testing::WriteFaults faults(dir_ / "faults", dir_ / "log", "grouser-server",
                                      GROUSER_WRITE_FAULTS_LIBRARY);
  faults.Enter();
  const auto server = Start({"--http", "127.0.0.1:0"});
  server::testing::WriteFaults::Leave();
  const TerrainClient client(server->address());
  const auto metric = [&](const std::string& name) {
    const std::string page = testing::Get(server->http(), "/metrics").body;
    const auto at = page.find("\n" + name + " ");
    return at == page.npos ? -1 : std::stod(page.substr(at + name.size() + 2));
  };
  client.Evaluate(Velocities());
  ASSERT_TRUE(testing::Eventually([&] { return metric("grouser_query_log_queries_total") == 1; }));
  faults.Plan(server::testing::WriteFault::kFull, 1, server::testing::kWrite, "queries");
  client.Evaluate(Velocities());
  ASSERT_TRUE(testing::Eventually([&] { return metric("grouser_query_log_writing") == 0; }));
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(client.Evaluate(Velocities()).responses().flags_size(), 40);
  faults.Clear();
  client.Evaluate(Velocities());
  EXPECT_EQ(metric("grouser_query_log_dropped_total"), 22);
  server->program().Signal(SIGTERM);
  EXPECT_EQ(server->program().Wait(), 0);
  const std::string text = server->program().Stderr();
  const auto at = text.find("query log: ");
  EXPECT_NE(at, text.npos);
  EXPECT_EQ(text.find("query log: ", at + 1), text.npos) << "one line";
  EXPECT_THAT(text, AllOf(HasSubstr(log_), HasSubstr("No space left on device"),
                          HasSubstr("no more queries are logged until the next start")));
  const auto rest = Replay({log_});
  EXPECT_EQ(rest.code, 0) << rest.err;
  EXPECT_EQ(rest.err, "") << "cut back to whole records";
  EXPECT_THAT(rest.out, HasSubstr("1 queries, 1 replayed"));
}

TEST_F(QueryLogTest, AFullDiskAtTheStartIsALogLessAndNoServerLess) {
  server::testing::WriteFaults faults(dir_ / "faults", dir_ / "log", "grouser-server",
                                      GROUSER_WRITE_FAULTS_LIBRARY);
  faults.Enter();
  faults.Plan(server::testing::WriteFault::kFull, 1, server::testing::kWrite, "queries");
  const auto server = Start({"--http", "127.0.0.1:0"});
  server::testing::WriteFaults::Leave();
  EXPECT_TRUE(faults.happened());
  EXPECT_EQ(TerrainClient(server->address()).Evaluate(Velocities()).responses().flags_size(), 40);
  EXPECT_THAT(testing::Get(server->http(), "/metrics").body,
              AllOf(HasSubstr("\ngrouser_query_log_writing 0\n"),
                    HasSubstr("\ngrouser_query_log_dropped_total 1\n")));
  server->program().Signal(SIGTERM);
  EXPECT_EQ(server->program().Wait(), 0);
  EXPECT_THAT(server->program().Stderr(),
              AllOf(HasSubstr("query log: " + log_), HasSubstr("No space left on device")));
}

TEST_F(QueryLogTest, AFileThatIsNoLogIsRefusedAtTheStart) {
  std::ofstream(log_) << "my thesis";
  const auto refused = testing::RunProgram(
      "grouser-server",
      {"--state", State(), "--no-lcm", "--grpc", "127.0.0.1:0", "--query-log", log_}, dir_.path());
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, HasSubstr("query-log: " + log_ + ": is no query log of Grouser"));
  EXPECT_EQ(std::filesystem::file_size(log_), 9u);
  for (const auto& [option, value] :
       {std::pair{"--query-log-limit-mb", "0"}, std::pair{"--query-log-files", "1001"}}) {
    const auto bad = testing::RunProgram(
        "grouser-server", {"--state", State(), "--query-log", dir_ / "x", option, value},
        dir_.path());
    EXPECT_EQ(bad.code, 2);
    EXPECT_THAT(bad.err,
                AllOf(HasSubstr(std::string(option).substr(2)), HasSubstr("expected 1 to")));
  }
}

}  // namespace
}  // namespace grouser

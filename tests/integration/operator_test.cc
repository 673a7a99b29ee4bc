// What operators ask of both programs over HTTP, and what they find in the log.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/channel.h"
#include "clients/cpp/client_error.h"
#include "clients/cpp/terrain_client.h"
#include "grouser/v1alpha1/vehicle_service.grpc.pb.h"
#include "proto/records/message_json.h"
#include "proto/records/sha256.h"
#include "tests/integration/http_wire.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using testing::Exchange;
using testing::Get;
using ::testing::HasSubstr;
using testing::HttpResult;
using testing::kAnswerMs;
using testing::Post;
using testing::Wire;

/// A page of metrics, every line of which was understood.
struct Scraped {
  std::map<std::string, std::string> types, helps;  // by family
  std::map<std::string, double> samples;            // by "name{labels}"

  double Sum(const std::string& name, const std::string& part = "") const {
    double sum = 0;
    for (const auto& [sample, value] : samples) {
      if (sample.substr(0, sample.find('{')) == name && sample.find(part) != std::string::npos) {
        sum += value;
      }
    }
    return sum;
  }
};

Scraped Scrape(const std::string& address) {
  const HttpResult result = Get(address, "/metrics");
  EXPECT_EQ(result.status, 200) << result.body;
  EXPECT_THAT(result.head, HasSubstr("text/plain; version=0.0.4"));
  static const std::regex kHelp(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) (.*))");
  static const std::regex kType(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram))");
  static const std::regex kSample(
      R"(([a-zA-Z_:][a-zA-Z0-9_:]*(\{([a-z_]+="([^"\\]|\\.)*",?)+\})?) (NaN|[+-]?Inf|[-+0-9.eE]+))");
  Scraped page;
  std::istringstream lines(result.body);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, kHelp)) {
      page.helps[match[1]] = match[2];
    } else if (std::regex_match(line, match, kType)) {
      EXPECT_TRUE(page.types.emplace(match[1], match[2]).second) << "twice: " << line;
    } else if (std::regex_match(line, match, kSample)) {
      EXPECT_TRUE(page.samples.emplace(match[1], std::stod(match[5])).second) << "twice: " << line;
    } else {
      ADD_FAILURE() << "no line of the text format: " << line;
    }
  }
  return page;
}

v1alpha1::EvaluateWheelsRequest SomeStates(int n) {
  v1alpha1::EvaluateWheelsRequest request;
  request.set_sequence(7);
  for (int i = 0; i < n; ++i) {
    request.mutable_states()->add_load_n(24);
    request.mutable_states()->mutable_slip()->add_slip(0.9 * i / n);
    request.mutable_states()->mutable_slip()->add_attack_angle_rad(0.1);
  }
  return request;
}

class OperatorTest : public ::testing::Test {
 protected:
  testing::ServerProcess Start(std::vector<std::string> more = {},
                               const std::string& program = "grouser-server") {
    more.insert(more.end(), {"--http", "127.0.0.1:0"});
    if (program == "grouser-server") more.push_back("--no-lcm");
    return testing::ServerProcess(dir_.path(), std::move(more), program);
  }
  testing::ServerProcess StartWithModel(std::vector<std::string> more = {}) {
    digest_ = testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
    return Start(std::move(more));
  }
  testing::TempDir dir_;
  std::string digest_;
};

TEST_F(OperatorTest, MetricsCountWhatWasAsked) {
  auto server = StartWithModel();
  const client::TerrainClient client(server.address());
  client.Evaluate(SomeStates(1));
  client.Evaluate(SomeStates(100));
  auto bad = SomeStates(3);
  bad.mutable_states()->set_load_n(1, std::nan(""));
  client.Evaluate(bad);
  bad.set_model("mud");
  EXPECT_THROW(client.Evaluate(bad), client::ClientError);
  const auto stream = client.OpenStream();
  v1alpha1::EvaluateWheelsResponse response;
  for (const auto& request : {SomeStates(5), bad}) {
    ASSERT_TRUE(stream->Send(request));
    ASSERT_TRUE(stream->Receive(&response));
  }
  const auto open = Scrape(server.http());
  EXPECT_EQ(open.Sum("grouser_streams"), 1);
  EXPECT_GE(open.Sum("grouser_grpc_connections"), 1);
  stream->Finish();

  const auto page = Scrape(server.http());
  const auto& s = page.samples;
  EXPECT_EQ(s.at(R"(grouser_queries_total{transport="unary",code="OK"})"), 3);
  EXPECT_EQ(s.at(R"(grouser_queries_total{transport="unary",code="NOT_FOUND"})"), 1);
  EXPECT_EQ(s.at(R"(grouser_queries_total{transport="stream",code="OK"})"), 1);
  EXPECT_EQ(s.at(R"(grouser_queries_total{transport="stream",code="NOT_FOUND"})"), 1);
  EXPECT_EQ(s.at(R"(grouser_query_states_total{model="sand"})"), 109);
  EXPECT_EQ(s.at(R"(grouser_query_flags_total{model="sand",flag="INVALID"})"), 1);
  EXPECT_EQ(s.at(R"(grouser_query_flags_total{model="sand",flag="FORM_UNKNOWN"})"), 108);
  const std::string count = "grouser_query_duration_seconds_count";
  EXPECT_EQ(s.at(count + R"({model="sand",states="1"})"), 1);
  EXPECT_EQ(s.at(count + R"({model="sand",states="2-16"})"), 2);
  EXPECT_EQ(s.at(count + R"({model="sand",states="17-256"})"), 1);
  EXPECT_GT(page.Sum("grouser_query_duration_seconds_sum"), 0);
  EXPECT_EQ(s.at(R"(grouser_rpc_total{method="TerrainService/EvaluateWheels",code="OK"})"), 3);
  EXPECT_EQ(s.at(R"(grouser_rpc_total{method="TerrainService/EvaluateWheels",code="NOT_FOUND"})"),
            1);
  EXPECT_EQ(page.Sum("grouser_models"), 1);
  EXPECT_EQ(page.Sum("grouser_snapshot_generation"), 1);
  EXPECT_EQ(page.Sum("grouser_build_info"), 1);
  EXPECT_GT(page.Sum("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(page.Sum("grouser_heap_bytes", "in_use"), 1e4);
  const double age = static_cast<double>(::time(nullptr)) - page.Sum("process_start_time_seconds");
  EXPECT_GT(age, -10);
  EXPECT_LT(age, 3600);
  for (const auto& [name, type] : page.types) {
    EXPECT_FALSE(page.helps.at(name).empty()) << name;
    EXPECT_EQ(name.ends_with("_total"), type == "counter") << name;
  }
}

TEST_F(OperatorTest, CountsOfModelsThatAreGoneStay) {
  auto server = StartWithModel();
  const client::TerrainClient client(server.address());
  client.Evaluate(SomeStates(10));
  for (int i = 1; i <= 3; ++i) {
    const auto digest = testing::MakeStable(dir_.path(), testing::PhysicsModel("sand", 6e5 + i));
    std::filesystem::remove(dir_.path() + "/models/" + digest_ + ".model");
    digest_ = digest;
    ASSERT_TRUE(testing::Eventually(
        [&] { return client.Evaluate(SomeStates(10)).model() == "sand@sha256:" + digest; }));
  }
  const auto first = Scrape(server.http());
  client.Evaluate(SomeStates(10));
  const auto second = Scrape(server.http());
  const std::string states = R"(grouser_query_states_total{model="sand"})";
  EXPECT_GE(first.samples.at(states), 40);
  EXPECT_EQ(second.samples.at(states), first.samples.at(states) + 10);
}

/// Rows "| `name` | type | labels | what |" of docs/operating.md below a heading.
std::map<std::string, std::pair<std::string, std::string>> Documented(const std::string& heading) {
  std::ifstream file(GROUSER_OPERATING);
  static const std::regex kRow(R"(\| `([a-z_]+)` \| ([a-z]+) \|[^|]*\| (.*) \|)");
  std::map<std::string, std::pair<std::string, std::string>> rows;
  bool here = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#")) here = line.find(heading) != std::string::npos;
    std::smatch match;
    if (here && std::regex_match(line, match, kRow)) rows[match[1]] = {match[2], match[3]};
  }
  return rows;
}

void ExpectDocumented(const Scraped& page, const std::string& program) {
  auto rows = Documented("Metrics of both");
  rows.merge(Documented("Metrics of " + program));
  for (const auto& [name, type] : page.types) {
    ASSERT_TRUE(rows.contains(name)) << name << ": not in docs/operating.md";
    EXPECT_EQ(rows.at(name).first, type) << name;
    EXPECT_EQ(rows.at(name).second, page.helps.at(name)) << name;
  }
  for (const auto& [name, row] : rows) {
    // LCM's are told where LCM is served.
    EXPECT_TRUE(page.types.contains(name) || name.starts_with("grouser_lcm_")) << name;
  }
}

TEST_F(OperatorTest, TheTablesOfTheDocumentAreWhatTheServerTells) {
  ExpectDocumented(Scrape(StartWithModel({"--query-log", dir_ / "queries"}).http()),
                   "grouser-server");
  const auto without = Scrape(StartWithModel().http());
  EXPECT_FALSE(without.types.contains("grouser_query_log_writing")) << "nothing is logged unasked";
}

TEST_F(OperatorTest, TheTablesOfTheDocumentAreWhatTheJobsTell) {
  ExpectDocumented(Scrape(Start({}, "grouser-jobs").http()), "grouser-jobs");
}

TEST_F(OperatorTest, ReadyWhenStableResolves) {
  auto server = Start();
  EXPECT_EQ(Get(server.http(), "/healthz").body, "ok\n");
  auto ready = Get(server.http(), "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(json::parse(ready.body)["reasons"], json({"no model is served"}));
  EXPECT_EQ(Scrape(server.http()).Sum("grouser_ready"), 0);
  testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
  ASSERT_TRUE(testing::Eventually([&] { return Get(server.http(), "/readyz").status == 200; }));
  EXPECT_EQ(json::parse(Get(server.http(), "/readyz").body)["ready"], true);
  EXPECT_EQ(Scrape(server.http()).Sum("grouser_ready"), 1);
}

TEST_F(OperatorTest, NotReadyWhereStableNamesNoModel) {
  testing::MakeStable(dir_.path(), testing::PhysicsModel("clay"));
  const auto digest = testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
  std::filesystem::remove(dir_.path() + "/models/" + digest + ".model");
  auto server = Start();
  const auto ready = Get(server.http(), "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(json::parse(ready.body)["reasons"], json({"not answered: sand@stable"}));
  EXPECT_EQ(Get(server.http(), "/healthz").status, 200);
  EXPECT_GE(Scrape(server.http()).Sum("grouser_repository_problems"), 1);
}

TEST_F(OperatorTest, NotReadyWhereNoAliasCouldBeRead) {
  testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
  std::ofstream(dir_.path() + "/models/aliases.json") << "{";
  auto server = Start();
  const auto ready = Get(server.http(), "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_THAT(ready.body, HasSubstr("aliases.json"));
}

TEST_F(OperatorTest, NotReadyWhileDraining) {
  auto server = StartWithModel({"--drain-s", "60"});
  const client::TerrainClient client(server.address());
  const auto stream = client.OpenStream();
  const std::jthread asks([&stream](const std::stop_token& stop) {  // keeps the drain going
    v1alpha1::EvaluateWheelsResponse response;
    while (!stop.stop_requested() && stream->Send(SomeStates(1)) && stream->Receive(&response)) {
      testing::SleepMilliseconds(5);
    }
  });
  EXPECT_EQ(Get(server.http(), "/readyz").status, 200);
  server.program().Signal(SIGTERM);
  HttpResult ready;
  EXPECT_TRUE(testing::Eventually([&] {
    ready = Get(server.http(), "/readyz");
    return ready.status == 503;
  }));
  EXPECT_THAT(ready.body, HasSubstr("draining"));
  EXPECT_EQ(Get(server.http(), "/healthz").status, 200);
}

TEST_F(OperatorTest, JobsTellTheirStates) {
  auto server = Start({}, "grouser-jobs");
  EXPECT_EQ(Get(server.http(), "/readyz").status, 200);
  const auto page = Scrape(server.http());
  EXPECT_TRUE(page.types.contains("grouser_jobs"));
  EXPECT_EQ(page.Sum("grouser_ready"), 1);
  const auto listed = Post(server.http(), "/v1alpha1/JobsService/ListJobs", "{}");
  EXPECT_EQ(listed.status, 200) << listed.body;
  const auto none =
      Post(server.http(), "/v1alpha1/JobsService/GetJob", R"({"job_id": "20260101T000000-abc"})");
  EXPECT_GE(none.status, 400) << none.body;
  EXPECT_TRUE(json::parse(none.body).contains("code")) << none.body;
}

TEST_F(OperatorTest, JsonAnswersAreThoseOfGrpc) {
  auto server = StartWithModel({"--vehicles", GROUSER_VEHICLES});
  const client::TerrainClient client(server.address());
  const std::string path = "/v1alpha1/TerrainService/";
  const auto request = SomeStates(50);
  const auto answer = Post(server.http(), path + "EvaluateWheels", records::ToJson(request));
  ASSERT_EQ(answer.status, 200) << answer.body;
  v1alpha1::EvaluateWheelsResponse by_json;
  records::FromJson(answer.body, "answer", &by_json);
  auto by_grpc = client.Evaluate(request);
  by_json.clear_latency();
  by_grpc.clear_latency();
  EXPECT_EQ(by_json.responses().f_x().value_size(), 50);
  // As bytes: bit for bit, NaN too.
  EXPECT_EQ(by_json.SerializeAsString(), by_grpc.SerializeAsString());

  v1alpha1::ListModelsResponse models;
  records::FromJson(Post(server.http(), path + "ListModels", "{}").body, "answer", &models);
  EXPECT_EQ(models.SerializeAsString(), client.ListModels().SerializeAsString());
  v1alpha1::GetModelResponse model;
  records::FromJson(Post(server.http(), path + "GetModel", R"({"model": "sand@stable"})").body,
                    "answer", &model);
  EXPECT_EQ(model.model().digest(), digest_);
  v1alpha1::ExplainRequest why;
  *why.mutable_state() = SomeStates(1).states();
  v1alpha1::ExplainResponse explained;
  records::FromJson(Post(server.http(), path + "Explain", records::ToJson(why)).body, "answer",
                    &explained);
  EXPECT_EQ(explained.SerializeAsString(), client.Explain(why).SerializeAsString());

  v1alpha1::ListVehiclesResponse vehicles;
  records::FromJson(Post(server.http(), "/v1alpha1/VehicleService/ListVehicles", "{}").body,
                    "answer", &vehicles);
  EXPECT_GT(vehicles.vehicles_size(), 0);
  const std::string constants = R"({"vehicle": "husky"})";
  const auto stub = v1alpha1::VehicleService::NewStub(client::MakeChannel(server.address()));
  v1alpha1::GradesRequest grades;
  records::FromJson(constants, "request", &grades);
  grpc::ClientContext context;
  v1alpha1::GradesResponse expected, told;
  const auto status = stub->Grades(&context, grades, &expected);
  const auto graded = Post(server.http(), "/v1alpha1/VehicleService/Grades", constants);
  ASSERT_EQ(graded.status == 200, status.ok()) << graded.body << status.error_message();
  if (status.ok()) {
    records::FromJson(graded.body, "answer", &told);
    told.clear_latency();
    expected.clear_latency();
    EXPECT_EQ(told.SerializeAsString(), expected.SerializeAsString());
  }
}

TEST_F(OperatorTest, JsonErrorsHaveTheCodesOfGrpc) {
  auto server = StartWithModel();
  const std::string path = "/v1alpha1/TerrainService/EvaluateWheels";
  const auto expect = [&](const HttpResult& result, int status, const std::string& code,
                          const std::string& text) {
    EXPECT_EQ(result.status, status) << result.body;
    const auto body = json::parse(result.body);
    EXPECT_EQ(body["code"], code) << result.body;
    EXPECT_THAT(body["message"].get<std::string>(), HasSubstr(text));
  };
  expect(Post(server.http(), path, "{"), 400, "INVALID_ARGUMENT", "not a grouser.v1alpha1");
  expect(Post(server.http(), path, R"({"sequenze": 1})"), 400, "INVALID_ARGUMENT", "sequenze");
  expect(Post(server.http(), path, R"({"model": "sand"})"), 400, "INVALID_ARGUMENT",
         "states.kinematics");
  auto unknown = SomeStates(1);
  unknown.set_model("mud");
  expect(Post(server.http(), path, records::ToJson(unknown)), 404, "NOT_FOUND", "mud");
  expect(Post(server.http(), path, records::ToJson(SomeStates(10001))), 429, "RESOURCE_EXHAUSTED",
         "10001 entries");
  expect(Post(server.http(), "/v1alpha1/TerrainService/StreamWheels", "{}"), 501, "UNIMPLEMENTED",
         "stream");
  expect(Post(server.http(), "/v1alpha1/TerrainService/None", "{}"), 404, "NOT_FOUND", "path");
  expect(Get(server.http(), path), 405, "INVALID_ARGUMENT", "expected POST");
  // What a page of another site can have a browser send.
  expect(Post(server.http(), path, "{}", "Content-Type: text/plain\r\n"), 415, "INVALID_ARGUMENT",
         "application/json");
  expect(Get(server.http(), "/metrics", "Host: evil.example:80\r\n"), 403, "PERMISSION_DENIED",
         "evil.example");
  expect(Get(server.http(), "/none"), 404, "NOT_FOUND", "/metrics");
  expect(Post(server.http(), "/metrics", "{}"), 405, "INVALID_ARGUMENT", "expected GET");
}

TEST_F(OperatorTest, WhatIsTooLargeOrNoRequestIsRefusedAndHarmsNobody) {
  auto server = StartWithModel();
  const std::string line =
      "POST /v1alpha1/TerrainService/EvaluateWheels HTTP/1.1\r\n"
      "Host: localhost\r\nContent-Type: application/json\r\n";
  EXPECT_EQ(Exchange(server.http(), line + "Content-Length: 99999999999\r\n\r\n").status, 413);
  EXPECT_EQ(
      Post(server.http(), "/v1alpha1/TerrainService/ListModels", std::string(1100000, ' ')).status,
      413);
  std::string chunks = line + "Transfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 20; ++i) chunks += "10000\r\n" + std::string(0x10000, ' ') + "\r\n";
  EXPECT_EQ(Exchange(server.http(), chunks).status, 413);
  EXPECT_EQ(Get(server.http(), "/metrics", "A: " + std::string(9000, 'a') + "\r\n").status, 431);
  EXPECT_EQ(Exchange(server.http(), "\x16\x03\x01\r\n\r\n").status, 400);
  // A little deeper than any message is.
  const auto deep =
      Post(server.http(), "/v1alpha1/TerrainService/ListModels", std::string(500000, '['));
  EXPECT_EQ(deep.status, 400) << deep.body.substr(0, 200);

  std::mt19937 random(1);
  const std::string good = line + "Content-Length: 2\r\n\r\n{}";
  for (int i = 0; i < 300; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 1 + i % 8; ++k) {
      bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
    }
    const Wire wire(server.http());
    wire.Send(bytes);  // and gone: what is answered, nobody reads
  }
  EXPECT_EQ(Get(server.http(), "/healthz").body, "ok\n");
  EXPECT_GE(Scrape(server.http()).Sum("grouser_http_malformed_requests_total"), 5);
  EXPECT_TRUE(server.program().Running());
}

TEST_F(OperatorTest, ABodyOfAnotherCodingIsNotTakenForTheNextRequest) {
  auto server = StartWithModel();
  for (const std::string coding :
       {"gzip", "gzip, chunked", "identity", "chunked\r\nX: y\r\nTransfer-Encoding: gzip"}) {
    const Wire wire(server.http());
    wire.Send("POST /healthz HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: " + coding +
              "\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    const std::string all = wire.ReadToEnd();
    EXPECT_TRUE(all.starts_with("HTTP/1.1 501") || all.starts_with("HTTP/1.1 400"))
        << coding << all;
    EXPECT_EQ(all.find("HTTP/1.1 200"), std::string::npos) << all;
  }
}

TEST_F(OperatorTest, WithARightsFileEveryPageButHealthNeedsARole) {
  std::ofstream(dir_ / "rights.yaml")
      << "format: grouser-rights/1\ncallers:\n  - {name: a, role: read, token_sha256: "
      << records::Sha256OfString("secret") << "}\n";
  auto server = Start({"--rights", dir_ / "rights.yaml"});
  const std::string token = "Host: localhost\r\nAuthorization: Bearer secret\r\n";
  EXPECT_EQ(Get(server.http(), "/healthz").status, 200);
  for (const char* path : {"/metrics", "/buildinfo"}) {
    EXPECT_EQ(Get(server.http(), path).status, 401) << path;
    EXPECT_EQ(Get(server.http(), path, token).status, 200) << path;
  }
  EXPECT_EQ(Get(server.http(), "/readyz").status, 503);
  EXPECT_EQ(Get(server.http(), "/readyz").body.find("no model"), std::string::npos);
  EXPECT_THAT(Get(server.http(), "/readyz", token).body, HasSubstr("no model is served"));

  const std::string call = "/v1alpha1/TerrainService/ListModels";
  const std::string type = "Content-Type: application/json\r\n";
  EXPECT_EQ(Post(server.http(), call, "{}").status, 401);
  EXPECT_EQ(Post(server.http(), call, "{}", type + "Authorization: Bearer \x80\r\n").status, 401);
  EXPECT_EQ(Post(server.http(), call, "{}", type + token.substr(token.find("Auth"))).status, 200);
  const client::TerrainClient client(server.address());
  EXPECT_THROW(client.ListModels(), client::ClientError);
  EXPECT_THAT(Get(server.http(), "/metrics", token).body,
              HasSubstr("grouser_refusals_total{reason=\"rights\"} 5\n"));
  EXPECT_THAT(server.program().Stderr(),
              AllOf(HasSubstr("reason=rights"), HasSubstr("TerrainService/ListModels")));
}

TEST_F(OperatorTest, WhatGrpcKeepsToItsUserIsNotOpenToAllUsersOverHttp) {
  for (const std::string program : {"grouser-server", "grouser-jobs"}) {
    auto server = Start({"--grpc", "unix:" + (dir_ / program)}, program);
    const auto refused = Post(server.http(), "/v1alpha1/OperatorService/GetBuildInfo", "{}");
    EXPECT_EQ(refused.status, 403) << program;
    EXPECT_THAT(refused.body, HasSubstr("--http unix:PATH"));
    EXPECT_EQ(Get(server.http(), "/metrics").status, 200);
  }
}

TEST_F(OperatorTest, SilentAndSlowConnectionsKeepNobodyOut) {
  auto server = StartWithModel();
  std::vector<std::unique_ptr<Wire>> slow;
  for (int i = 0; i < 100; ++i) {
    slow.push_back(std::make_unique<Wire>(server.http()));
    if (i % 2 == 0) slow.back()->Send("GET /healthz HTTP/1.1\r\nHost: lo");
  }
  EXPECT_EQ(Get(server.http(), "/healthz").body, "ok\n");
  const auto page = Scrape(server.http());
  EXPECT_LE(page.Sum("grouser_http_connections"), 24);
  EXPECT_GE(page.Sum("grouser_http_connections_displaced_total"), 70);
  EXPECT_TRUE(slow.front()->IsClosed());
}

TEST_F(OperatorTest, OneConnectionTakesManyRequests) {
  auto server = StartWithModel();
  const Wire wire(server.http());
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n";
  for (int i = 0; i < 3; ++i) wire.Send(request + "\r\n");  // without waiting for answers
  wire.Send("HEAD /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  const std::string all = wire.ReadToEnd();
  std::size_t answers = 0;
  for (std::size_t at = 0; (at = all.find("HTTP/1.1 200", at)) != std::string::npos; ++at)
    ++answers;
  EXPECT_EQ(answers, 4u) << all;
  EXPECT_TRUE(all.ends_with("\r\n\r\n")) << "HEAD has no body";
}

TEST_F(OperatorTest, OnlyThisMachineUnlessSaidOtherwise) {
  for (const char* program : {"grouser-server", "grouser-jobs"}) {
    const auto refused =
        testing::RunProgram(program, {"--state", dir_.path(), "--http", "0.0.0.0:0"}, dir_.path());
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("http: '0.0.0.0:0'"), HasSubstr("--http-insecure")));
  }
  testing::ServerProcess server(dir_.path(),
                                {"--no-lcm", "--http", "0.0.0.0:0", "--http-insecure"});
  EXPECT_EQ(Get(server.http(), "/metrics", "Host: rover:80\r\n").status, 200);
  EXPECT_EQ(Post(server.http(), "/v1alpha1/TerrainService/ListModels", "{}").status, 403);
}

TEST_F(OperatorTest, BuildInfoByEveryWay) {
  auto server = StartWithModel();
  const auto told = client::GetBuildInfo({server.address(), {}}, client::Milliseconds(kAnswerMs));
  EXPECT_EQ(told.program(), "grouser-server");
  EXPECT_EQ(told.version(), GROUSER_VERSION);
  EXPECT_FALSE(told.commit().empty());
  EXPECT_FALSE(told.instruction_set().empty());
  EXPECT_GE(told.formats_size(), 1);
  for (const auto& result : {Get(server.http(), "/buildinfo"),
                             Post(server.http(), "/v1alpha1/OperatorService/GetBuildInfo", "{}")}) {
    v1alpha1::GetBuildInfoResponse again;
    records::FromJson(result.body, "buildinfo", &again);
    EXPECT_EQ(again.SerializeAsString(), told.SerializeAsString());
  }
  const auto client =
      testing::RunProgram("grouser-client", {"version", "--server", server.address()}, dir_.path());
  EXPECT_EQ(client.code, 0) << client.err;
  EXPECT_THAT(client.out, AllOf(HasSubstr("grouser-server " GROUSER_VERSION),
                                HasSubstr(told.commit()), HasSubstr("model file version")));
}

TEST_F(OperatorTest, TheLogIsJsonHasRequestIdsAndIsBounded) {
  auto server = StartWithModel({"--log-format", "json"});
  const std::string path = "/v1alpha1/TerrainService/GetModel";
  const auto refused = Post(server.http(), path, "{\"model\": \"mud\\u001b[2J\\\"\"}",
                            "Content-Type: application/json\r\nX-Request-Id: mine-17\r\n");
  EXPECT_EQ(refused.status, 404);
  EXPECT_THAT(refused.head, HasSubstr("X-Request-Id: mine-17\r\n"));

  const auto stub = v1alpha1::TerrainService::NewStub(client::MakeChannel(server.address()));
  v1alpha1::GetModelRequest request;
  request.set_model("mud");
  std::string generated;
  for (int i = 0; i < 500; ++i) {
    grpc::ClientContext context;
    v1alpha1::GetModelResponse response;
    ASSERT_EQ(stub->GetModel(&context, request, &response).error_code(),
              grpc::StatusCode::NOT_FOUND);
    const auto& trailing = context.GetServerTrailingMetadata();
    ASSERT_TRUE(trailing.contains("x-request-id"));
    const auto id = trailing.find("x-request-id")->second;
    if (i == 0) generated.assign(id.data(), id.size());
  }
  EXPECT_GT(Scrape(server.http()).Sum("grouser_log_lines_left_out_total"), 300);
  testing::SleepMilliseconds(500);  // room for a line again
  grpc::ClientContext context;
  v1alpha1::GetModelResponse response;
  stub->GetModel(&context, request, &response);
  server.program().Signal(SIGTERM);
  EXPECT_EQ(server.program().Wait(), 0);

  std::istringstream lines(server.program().Stderr());
  int about_calls = 0, left_out = 0;
  bool saw_mine = false, saw_generated = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("ready grpc=")) continue;  // for scripts, as it is in text
    const auto entry = json::parse(line, nullptr, false);
    ASSERT_TRUE(entry.is_object()) << line;
    EXPECT_EQ(entry["program"], "grouser-server");
    EXPECT_TRUE(entry.contains("time") && entry.contains("level") && entry.contains("message"));
    if (!entry.contains("method")) continue;
    ++about_calls;
    EXPECT_EQ(entry["method"], "TerrainService/GetModel");
    EXPECT_EQ(entry["code"], "NOT_FOUND");
    EXPECT_THAT(entry["message"].get<std::string>(), HasSubstr("mud"));
    saw_mine = saw_mine || entry["request_id"] == "mine-17";
    saw_generated = saw_generated || entry["request_id"] == generated;
    left_out += entry.value("lines_left_out", 0);
  }
  EXPECT_TRUE(saw_mine);
  EXPECT_TRUE(saw_generated);
  EXPECT_LT(about_calls, 200);
  EXPECT_GE(left_out, 300);
  EXPECT_LE(about_calls + left_out, 502);
}

}  // namespace
}  // namespace grouser

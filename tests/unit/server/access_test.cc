// The table of rights, the rights file, and what the policy makes of both.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "grouser/v1alpha1/terrain_service.pb.h"
#include "grouser/v1alpha1/vehicle_service.pb.h"
#include "proto/records/sha256.h"
#include "server/net/access_policy.h"
#include "server/net/address.h"
#include "server/net/grpc_status.h"
#include "server/net/http/json_calls.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using grpc::StatusCode;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kList = "/grouser.v1alpha1.TerrainService/ListModels";
constexpr const char* kSubmit = "/grouser.v1alpha1.JobsService/SubmitRefinement";

TEST(MethodRightsTest, EveryMethodOfEveryProtoHasARow) {
  // Linked in, so that the pool below has them.
  v1alpha1::ListModelsRequest::descriptor();
  v1alpha1::ListVehiclesRequest::descriptor();
  v1alpha1::ListJobsRequest::descriptor();
  std::size_t methods = 0;
  for (const auto& file : std::filesystem::directory_iterator(GROUSER_PROTO_DIR)) {
    const std::string name = "grouser/v1alpha1/" + file.path().filename().string();
    const auto* known = google::protobuf::DescriptorPool::generated_pool()->FindFileByName(name);
    std::ifstream in(file.path());
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    if (known == nullptr) {
      EXPECT_EQ(text.find("\nservice "), std::string::npos) << name << ": not linked into the test";
      continue;
    }
    for (int s = 0; s < known->service_count(); ++s) {
      EXPECT_NO_THROW(CheckTableCovers(known->service(s)->full_name()));
      for (int m = 0; m < known->service(s)->method_count(); ++m, ++methods) {
        const auto* method = known->service(s)->method(m);
        const auto role = RoleNeeded("/" + known->service(s)->full_name() + "/" + method->name());
        ASSERT_TRUE(role) << method->full_name();
        EXPECT_NE(*role, Role::kNone) << method->full_name();
      }
    }
  }
  std::size_t ours = 0;
  for (const MethodRight& right : MethodRights()) ours += right.service.starts_with("grouser.");
  EXPECT_EQ(ours, methods) << "rows of methods that are no more";
}

TEST(MethodRightsTest, OtherPathsHaveNoRole) {
  for (const char* path : {"", "/", "ListModels", "grouser.v1alpha1.TerrainService/ListModels",
                           "/grouser.v1alpha1.TerrainService/", "/x/ListModels",
                           "/grouser.v1alpha1.TerrainService/listmodels"}) {
    EXPECT_FALSE(RoleNeeded(path)) << path;
  }
  EXPECT_THROW(CheckTableCovers("grouser.v1alpha1.Other"), std::logic_error);
}

TEST(MethodRightsTest, TheDocumentedTableIsThisOne) {
  std::ifstream in(GROUSER_SECURITY_PAGE);
  std::map<std::string, std::string> written;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("| `") || line.find('/') == std::string::npos) continue;
    const std::size_t end = line.find('`', 3), bar = line.find("| ", end);
    const std::size_t stop = line.find(" |", bar);
    written[line.substr(3, end - 3)] = line.substr(bar + 2, stop - bar - 2);
  }
  std::map<std::string, std::string> real;
  for (const MethodRight& right : MethodRights()) {
    real[std::string(right.service) + "/" + std::string(right.method)] = NameOf(right.role);
  }
  EXPECT_EQ(written, real);
}

TEST(AddressTest, LocalIsWhatOnlyThisMachineReaches) {
  for (const char* text : {"127.0.0.1:1", "127.8.0.1:1", "localhost:1", "[::1]:1", "unix:/a"}) {
    EXPECT_TRUE(ParseAddress(text).is_local()) << text;
  }
  for (const char* text : {"0.0.0.0:1", "[::]:1", "192.0.2.1:1", "localhost.example:1", "127.x:1",
                           "[::ffff:127.0.0.1]:1"}) {
    EXPECT_FALSE(ParseAddress(text).is_local()) << text;
  }
}

TEST(GrpcStatusTest, TextIsBoundedWhateverARequestHadInIt) {
  std::string text = "x";
  while (text.size() < 1'000'000) text += "\u00e9";
  const std::string sent = ToGrpcStatus(Status::NotFound(text)).error_message();
  EXPECT_LE(sent.size(), kMaxStatusBytes + 3);
  EXPECT_EQ(sent.substr(sent.size() - 5), "\u00e9...") << "whole characters";
  EXPECT_EQ(ToGrpcStatus(Status::NotFound("model: 'x'")).error_message(), "model: 'x'");
}

class RightsTest : public ::testing::Test {
 protected:
  std::string File(const std::string& text) {
    std::ofstream(dir_ / "rights.yaml") << "format: grouser-rights/1\n" << text;
    return dir_ / "rights.yaml";
  }
  std::string Refusal(const std::string& text) {
    const std::string file = File(text);
    try {
      ReadRights(file);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }
  NetOptions Options(const std::string& address, const std::string& rights = "") {
    NetOptions options;
    options.grpc = address;
    options.rights = rights;
    return options;
  }
  const std::string hash_ = records::Sha256OfString("secret");
  testing::TempDir dir_;
};

TEST_F(RightsTest, BadFilesAreRefusedByName) {
  const std::string entry = "callers:\n  - {name: a, role: read, ";
  EXPECT_THAT(Refusal("anyone: reed\n"), AllOf(HasSubstr(":2"), HasSubstr("anyone"),
                                               HasSubstr("'reed'"), HasSubstr("submit")));
  EXPECT_THAT(Refusal("caller: []\n"), AllOf(HasSubstr("caller"), HasSubstr("callers")));
  EXPECT_THAT(Refusal(entry + "tokn_sha256: x}\n"), HasSubstr("token_sha256"));
  EXPECT_THAT(Refusal("callers:\n  - {name: a, role: read}\n"), HasSubstr("neither"));
  EXPECT_THAT(Refusal(entry + "certificate: x, token_sha256: " + hash_ + "}\n"), HasSubstr("both"));
  EXPECT_THAT(Refusal(entry + "token_sha256: my-own-token}\n"),
              AllOf(HasSubstr("64 hex"), ::testing::Not(HasSubstr("my-own-token"))));
  EXPECT_THAT(Refusal("callers:\n  - {name: 'a (says: b)', role: read, certificate: x}\n"),
              HasSubstr("letters"));
  EXPECT_THAT(Refusal(entry + "certificate: x}\n  - {name: b, role: admin, certificate: x}\n"),
              HasSubstr("each once"));
  EXPECT_EQ(Refusal(entry + "certificate: x}\n"), "");
}

TEST_F(RightsTest, TokensAreKnownByTheirHash) {
  const auto rights =
      ReadRights(File("callers:\n  - {name: a, role: submit, token_sha256: " + hash_ + "}\n"));
  ASSERT_NE(rights.OfToken("secret"), nullptr);
  EXPECT_EQ(rights.OfToken("secret")->name, "a");
  for (const std::string& wrong : {std::string(), std::string("Secret"), hash_}) {
    EXPECT_EQ(rights.OfToken(wrong), nullptr) << wrong;
  }
  EXPECT_EQ(rights.OfCertificate(""), nullptr);
}

TEST_F(RightsTest, ThePolicyOfEachKindOfAddress) {
  AccessPolicy here(Options("unix:/x"));
  EXPECT_FALSE(here.restricts());
  EXPECT_TRUE(here.Admit(kSubmit, {}).ok());

  EXPECT_THROW(AccessPolicy(Options("0.0.0.0:1")), std::invalid_argument);
  auto open = Options("0.0.0.0:1");
  open.insecure = true;
  AccessPolicy plain(open);
  EXPECT_TRUE(plain.Admit(kList, {}).ok());
  EXPECT_EQ(plain.Admit(kSubmit, {}).error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(plain.Admit(kList, {{}, {"Bearer secret"}}).error_code(), StatusCode::UNAUTHENTICATED);

  AccessPolicy named(Options("127.0.0.1:1", File("callers:\n  - {name: a, role: submit, "
                                                 "token_sha256: " +
                                                 hash_ + "}\n")));
  EXPECT_TRUE(named.Admit(kSubmit, {{}, {"Bearer secret"}}).ok());
  for (const Evidence& bad :
       {Evidence{}, Evidence{{}, {"secret"}}, Evidence{{}, {"Bearer "}},
        Evidence{{}, {"bearer secret"}}, Evidence{{}, {"Bearer secret", "Bearer secret"}}}) {
    EXPECT_EQ(named.Admit(kList, bad).error_code(), StatusCode::UNAUTHENTICATED);
  }
  AccessPolicy odd(
      Options("127.0.0.1:1", File("callers:\n  - {name: a, role: admin, token_sha256: " +
                                  records::Sha256OfString("\x80") + "}\n")));
  EXPECT_EQ(odd.Admit(kList, {{}, {"Bearer \x80"}}).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(named.Admit("/grpc.health.v1.Health/Check", {}).ok());
}

TEST(CallerTest, TheHostOfAPeerIsWithoutItsPort) {
  EXPECT_EQ(HostOf("ipv4:192.0.2.1:40122"), "192.0.2.1");
  EXPECT_EQ(HostOf("ipv6:%5B2001:db8::1%5D:7"), "2001:db8::1");
  EXPECT_EQ(HostOf("ipv6:[2001:db8::1]:7"), "2001:db8::1");
  for (const char* none : {"", "unix:", "unix:/a:b", "inproc", "ipv4:"})
    EXPECT_EQ(HostOf(none), "");
}

HttpRequest Json(const std::string& path, HttpReach reach,
                 const std::vector<std::string>& authorization = {}) {
  HttpRequest request;
  request.method = "POST";
  request.path = path;
  request.content_type = "application/json";
  request.authorization = authorization;
  request.body = "{}";
  request.reach = reach;
  return request;
}

TEST_F(RightsTest, OverHttpNobodyMayMoreThanOverGrpc) {
  const auto code = [](AccessPolicy& policy, const HttpRequest& request) {
    return AdmitOverHttp(policy, kList, request).error_code();
  };
  const std::string call = "/v1alpha1/TerrainService/ListModels";
  AccessPolicy socket(Options("unix:/x")), loopback(Options("127.0.0.1:1"));
  EXPECT_EQ(code(socket, Json(call, HttpReach::kUser)), StatusCode::OK);
  EXPECT_EQ(code(socket, Json(call, HttpReach::kMachine)), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(code(socket, Json("/metrics", HttpReach::kMachine)), StatusCode::OK);
  EXPECT_EQ(code(loopback, Json(call, HttpReach::kMachine, {"a", "b"})), StatusCode::OK)
      << "as gRPC, where nothing is restricted";

  AccessPolicy named(Options(
      "unix:/x", File("callers:\n  - {name: a, role: read, token_sha256: " + hash_ + "}\n")));
  const std::string token = "Bearer secret";
  EXPECT_EQ(code(named, Json(call, HttpReach::kMachine, {token})), StatusCode::OK);
  EXPECT_EQ(code(named, Json("/metrics", HttpReach::kMachine, {token})), StatusCode::OK);
  for (const HttpRequest& bad : {Json("/metrics", HttpReach::kUser), Json(call, HttpReach::kUser),
                                 Json(call, HttpReach::kUser, {token, token}),
                                 Json("/metrics", HttpReach::kNetwork, {token})}) {
    EXPECT_EQ(code(named, bad), StatusCode::UNAUTHENTICATED);
  }
}

TEST(JsonCallsTest, AnswersThatAreNotWrittenYetKeepTheirPlaces) {
  v1alpha1::ListJobsRequest::descriptor();  // linked in
  boost::asio::io_context loop;
  CallRecords records;
  JsonCalls calls(loop,
                  grpc::CreateChannel("unix:/nowhere/at/all", grpc::InsecureChannelCredentials()),
                  {"grouser.v1alpha1.JobsService"}, records,
                  [](const auto&, const auto&) { return grpc::Status::OK; });
  const auto guard = boost::asio::make_work_guard(loop);
  const auto ask = [&](std::vector<std::string> authorization = {}) {
    std::optional<HttpAnswer> answer;
    calls.Answer(Json("/v1alpha1/JobsService/ListJobs", HttpReach::kUser, authorization),
                 [&](HttpAnswer given) { answer = std::move(given); });
    while (!answer) loop.run_one();
    return *answer;
  };
  EXPECT_EQ(ask({"Bearer \x80"}).status, 401) << "gRPC would end the program";
  EXPECT_EQ(ask({"Bearer a\nb"}).status, 401);
  std::vector<HttpAnswer> kept;
  for (std::size_t i = 0; i < JsonCalls::kMostCalls; ++i) {
    kept.push_back(ask());
    EXPECT_EQ(kept.back().status, 503);
  }
  EXPECT_EQ(ask().status, 429);
  kept.pop_back();
  EXPECT_EQ(ask().status, 503);
}

}  // namespace
}  // namespace grouser::server

// Who may do what with both programs, over plaintext and TLS: every method by
// every role, certificates that change, peers that speak the other way.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "clients/cpp/channel.h"
#include "clients/cpp/client_error.h"
#include "clients/cpp/jobs_client.h"
#include "clients/cpp/terrain_client.h"
#include "proto/records/sha256.h"
#include "server/net/method_rights.h"
#include "tests/integration/query_fixture.h"
#include "tests/integration/test_certificates.h"

namespace grouser {
namespace {

using client::Access;
using client::Milliseconds;
using client::Server;
using grpc::StatusCode;
using server::MethodRight;
using server::Role;
using ::testing::AllOf;
using testing::Eventually;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr Role kRoles[] = {Role::kRead, Role::kSubmit, Role::kPromote, Role::kAdmin};
constexpr const char* kJobsService = "grouser.v1alpha1.JobsService";

void Write(const std::string& path, const std::string& text) {
  std::ofstream(path + ".new") << text;
  std::filesystem::rename(path + ".new", path);
}

std::string PathOf(const MethodRight& right) {
  return "/" + std::string(right.service) + "/" + std::string(right.method);
}

/// Sends one message to any kind of method. OK as soon as an answer comes.
grpc::Status CallRaw(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                     const std::string& bytes = "") {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(client::DeadlineAfter(Milliseconds(30000)));
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto call = stub.PrepareCall(&context, path, &queue);
  call->StartCall(nullptr);
  grpc::ByteBuffer answer;
  const grpc::Slice slice(bytes);
  bool answered = false;
  if (wait()) {
    call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
    wait();
    call->Read(&answer, nullptr);
    answered = wait();
    if (answered) context.TryCancel();  // a stream may have more
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return answered ? grpc::Status::OK : status;
}

/// A rights file with a token for each role: "a-ROLE-token".
std::string WriteRights(const testing::TempDir& dir, const std::string& more = "") {
  std::string text = "format: grouser-rights/1\n" + more + "callers:\n";
  for (const Role role : kRoles) {
    const std::string name = server::NameOf(role);
    text += "  - name: a-" + name + "er\n    role: " + name +
            "\n    token_sha256: " + records::Sha256OfString("a-" + name + "-token") + "\n";
    Write(dir / (name + ".token"), "a-" + name + "-token\n");
  }
  Write(dir / "rights.yaml", text);
  Write(dir / "unknown.token", "nobody's\n");
  return dir / "rights.yaml";
}

class AccessTest : public ::testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    certificates_ = new testing::TestCertificates;
    certificates_->Sign("server", testing::TestCertificates::kThisMachine);
    certificates_->Sign("alice");
    certificates_->Sign("bob");
  }
  static void TearDownTestSuite() { delete certificates_; }

  bool of_jobs() const { return GetParam() == std::string("grouser-jobs"); }
  std::vector<std::string> Options(std::vector<std::string> more) const {
    if (!of_jobs()) more.push_back("--no-lcm");
    return more;
  }
  testing::ServerProcess Start(const std::vector<std::string>& more) {
    return testing::ServerProcess(dir_.path(), Options(more), GetParam());
  }
  /// The program refuses to start: what it says.
  std::string RefusalOf(const std::vector<std::string>& more) {
    auto arguments = Options(more);
    arguments.insert(arguments.end(), {"--state", dir_.path()});
    const auto run = testing::RunProgram(GetParam(), arguments, dir_.path());
    EXPECT_EQ(run.code, 2) << run.err;
    return run.err;
  }
  static std::vector<std::string> Tls(const std::string& name = "server") {
    return {"--tls-cert", certificates_->Pem(name), "--tls-key", certificates_->Key(name)};
  }
  static Access Certified(const std::string& name) {
    return {certificates_->Pem("ca"), certificates_->Pem(name), certificates_->Key(name), ""};
  }
  Access Token(const std::string& name) const { return {"", "", "", dir_ / (name + ".token")}; }
  std::vector<MethodRight> Methods() const {
    std::vector<MethodRight> own;
    for (const MethodRight& right : server::MethodRights()) {
      const bool both = right.service.starts_with("grpc.");
      if (both || (right.service == kJobsService) == of_jobs()) own.push_back(right);
    }
    return own;
  }
  /// One method that `read` may call, and one that it may not if there is one.
  std::string ReadMethod() const {
    return of_jobs() ? "/grouser.v1alpha1.JobsService/ListJobs"
                     : "/grouser.v1alpha1.TerrainService/ListModels";
  }
  static grpc::Status Ask(const Server& server, const std::string& path,
                          const std::string& bytes = "") {
    return CallRaw(client::MakeChannel(server), path, bytes);
  }

  static testing::TestCertificates* certificates_;
  testing::TempDir dir_;
};
testing::TestCertificates* AccessTest::certificates_ = nullptr;
INSTANTIATE_TEST_SUITE_P(Programs, AccessTest, ::testing::Values("grouser-server", "grouser-jobs"),
                         [](const auto& info) { return std::string(info.param).substr(8); });

void ExpectAdmitted(const grpc::Status& status) {
  EXPECT_NE(status.error_code(), StatusCode::UNAUTHENTICATED) << status.error_message();
  EXPECT_NE(status.error_code(), StatusCode::PERMISSION_DENIED) << status.error_message();
  EXPECT_NE(status.error_code(), StatusCode::UNIMPLEMENTED) << status.error_message();
  EXPECT_NE(status.error_code(), StatusCode::UNAVAILABLE) << status.error_message();
}

TEST_P(AccessTest, EveryMethodByEveryRole) {
  auto server = Start({"--rights", WriteRights(dir_), "--reflection"});
  for (const Role role : kRoles) {
    const std::string name = server::NameOf(role);
    const auto channel = client::MakeChannel(Server{server.address(), Token(name)});
    for (const MethodRight& right : Methods()) {
      SCOPED_TRACE(name + " calls " + PathOf(right));
      const auto status = CallRaw(channel, PathOf(right));
      if (role >= right.role) {
        ExpectAdmitted(status);
        continue;
      }
      EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED);
      EXPECT_THAT(status.error_message(),
                  AllOf(HasSubstr(PathOf(right)), HasSubstr("'a-" + name + "er'"),
                        HasSubstr("role " + name),
                        HasSubstr(std::string("expected ") + server::NameOf(right.role))));
    }
  }
  for (const MethodRight& right : Methods()) {
    SCOPED_TRACE("nobody calls " + PathOf(right));
    const auto status = Ask({server.address(), {}}, PathOf(right));
    const auto unknown = Ask({server.address(), Token("unknown")}, PathOf(right));
    if (right.role == Role::kNone) {
      ExpectAdmitted(status);
      ExpectAdmitted(unknown);
      continue;
    }
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_THAT(status.error_message(), AllOf(HasSubstr(PathOf(right)), HasSubstr("a token")));
    EXPECT_EQ(unknown.error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_THAT(unknown.error_message(), HasSubstr("not one of"));
  }
  const auto missing = Ask({server.address(), Token("admin")}, "/grouser.v1alpha1.Other/Forgotten");
  EXPECT_EQ(missing.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(missing.error_message(), HasSubstr("not in the table"));
}

TEST_P(AccessTest, WithoutRightsFileThisMachineMayDoAllAndReflectionIsOff) {
  auto server = Start({});
  for (const MethodRight& right : Methods()) {
    SCOPED_TRACE(PathOf(right));
    const auto status = Ask({server.address(), {}}, PathOf(right));
    if (right.service.starts_with("grpc.reflection")) {
      EXPECT_EQ(status.error_code(), StatusCode::UNIMPLEMENTED);
    } else {
      ExpectAdmitted(status);
    }
  }
}

TEST_P(AccessTest, PlaintextOffTheMachineIsRefusedAtStart) {
  for (const char* address : {"0.0.0.0:0", "[::]:0", "some.host:50151", "127.evil.example:1"}) {
    EXPECT_THAT(RefusalOf({"--grpc", address}),
                AllOf(HasSubstr(address), HasSubstr("--tls-cert"), HasSubstr("--insecure")));
  }
}

TEST_P(AccessTest, InsecureIsLoggedReadsOnlyAndTakesNoToken) {
  auto server =
      Start({"--grpc", "0.0.0.0:0", "--insecure", "--rights", WriteRights(dir_, "anyone: read\n")});
  EXPECT_THAT(server.program().Stderr(), HasSubstr("plaintext"));
  const std::string here = "127.0.0.1" + server.address().substr(server.address().rfind(':'));
  for (const MethodRight& right : Methods()) {
    SCOPED_TRACE(PathOf(right));
    const auto status = Ask({here, {}}, PathOf(right));
    if (right.service.starts_with("grpc.reflection")) continue;
    if (right.role <= Role::kRead) {
      ExpectAdmitted(status);
    } else {
      EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED);
      EXPECT_THAT(status.error_message(), HasSubstr("'anonymous'"));
    }
  }
  const auto token = Ask({here, Token("admin")}, ReadMethod());
  EXPECT_EQ(token.error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(token.error_message(), HasSubstr("plaintext"));
  EXPECT_THROW(client::MakeChannel(Server{"192.0.2.1:1", Token("admin")}), std::invalid_argument);
}

TEST_P(AccessTest, WithoutRightsFileOthersReadUnderTls) {
  auto arguments = Tls();
  arguments.insert(arguments.end(), {"--grpc", "0.0.0.0:0"});
  auto server = Start(arguments);
  EXPECT_EQ(server.program().Stderr().find("nobody may submit") != std::string::npos, of_jobs());
  const Server here{"127.0.0.1" + server.address().substr(server.address().rfind(':')),
                    {certificates_->Pem("ca"), "", "", ""}};
  for (const MethodRight& right : Methods()) {
    SCOPED_TRACE(PathOf(right));
    if (right.service.starts_with("grpc.reflection")) continue;
    const auto status = Ask(here, PathOf(right));
    if (right.role <= Role::kRead) {
      ExpectAdmitted(status);
    } else {
      EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED);
    }
  }
}

TEST_P(AccessTest, CertificatesAndTokensShowWhoAsks) {
  WriteRights(dir_);
  std::ofstream(dir_ / "rights.yaml", std::ios::app)
      << "  - {name: Alice, role: read, certificate: alice}\n";
  auto arguments = Tls();
  arguments.insert(arguments.end(), {"--rights", dir_ / "rights.yaml", "--tls-client-ca",
                                     certificates_->Pem("ca"), "--probe-s", "0.05"});
  auto server = Start(arguments);
  const std::string at = server.address();
  ExpectAdmitted(Ask({at, Certified("alice")}, ReadMethod()));
  if (of_jobs()) {
    const auto submit = Ask({at, Certified("alice")}, "/grouser.v1alpha1.JobsService/CancelJob");
    EXPECT_EQ(submit.error_code(), StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(submit.error_message(), HasSubstr("'Alice' has the role read, expected submit"));
  }
  const auto bob = Ask({at, Certified("bob")}, ReadMethod());
  EXPECT_EQ(bob.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(bob.error_message(), HasSubstr("'bob' has the role none"));
  Access token = Token("read");
  token.tls_ca = certificates_->Pem("ca");
  ExpectAdmitted(Ask({at, token}, ReadMethod()));
  const Access nothing{certificates_->Pem("ca"), "", "", ""};
  EXPECT_EQ(Ask({at, nothing}, ReadMethod()).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(client::IsServing(Server{at, nothing}, "", Milliseconds(30000)));
  Access stranger = Certified("other-ca");  // signed by itself alone
  EXPECT_EQ(Ask({at, stranger}, ReadMethod()).error_code(), StatusCode::UNAVAILABLE);
  testing::SleepMilliseconds(300);  // several of its own questions
  EXPECT_THAT(server.program().Stderr(), Not(HasSubstr("cannot reach myself")));
  EXPECT_TRUE(server.program().Running());
}

/// The CN that the server shows to a new connection; throws ClientError.
std::string ShownName(const Server& server, const std::string& path) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::SslCredentialsOptions ssl;
  std::ifstream in(server.access.tls_ca);
  ssl.pem_root_certs.assign(std::istreambuf_iterator<char>(in), {});
  const auto channel =
      grpc::CreateCustomChannel(server.address, grpc::SslCredentials(ssl), arguments);
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(client::DeadlineAfter(Milliseconds(30000)));
  grpc::CompletionQueue queue;
  const grpc::Slice empty;
  const auto call = stub.PrepareUnaryCall(&context, path, grpc::ByteBuffer(&empty, 1), &queue);
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->StartCall();
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  client::ThrowUnlessOk(status, server);
  const auto names = context.auth_context()->FindPropertyValues("x509_common_name");
  return names.empty() ? "" : std::string(names[0].data(), names[0].size());
}

TEST_P(AccessTest, CertificatesRotateUnderLoadWithoutAFailedCall) {
  for (const char* name : {"first", "second", "third"}) {
    certificates_->Sign(name, testing::TestCertificates::kThisMachine);
  }
  const auto put = [&](const std::string& name) {
    for (const auto& [from, to] : {std::pair{certificates_->Pem(name), dir_ / "tls.pem"},
                                   std::pair{certificates_->Key(name), dir_ / "tls.key"}}) {
      std::filesystem::copy_file(from, to + ".new");
      std::filesystem::rename(to + ".new", to);
    }
  };
  put("first");
  auto server = Start({"--tls-cert", dir_ / "tls.pem", "--tls-key", dir_ / "tls.key"});
  const Server at{server.address(), {certificates_->Pem("ca"), "", "", ""}};
  std::atomic<int> calls = 0, failed = 0;
  std::vector<std::jthread> load;
  for (int i = 0; i < 3; ++i) {
    load.emplace_back([&, kept = client::MakeChannel(at), i](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        try {
          // New connections by one, an old one by the others.
          if (i == 0) ShownName(at, ReadMethod());
          if (i > 0) client::ThrowUnlessOk(CallRaw(kept, ReadMethod()), at);
        } catch (const client::ClientError& e) {
          ++failed;
          ADD_FAILURE() << e.what();
          return;
        }
        ++calls;
      }
    });
  }
  for (const std::string name : {"second", "third", "first"}) {
    put(name);
    EXPECT_TRUE(Eventually([&] { return ShownName(at, ReadMethod()) == name; })) << name;
  }
  Write(dir_ / "tls.pem", "rubbish");
  EXPECT_TRUE(Eventually([&] {
    ShownName(at, ReadMethod());
    return server.program().Stderr().find("no certificate in PEM") != std::string::npos;
  }));
  EXPECT_EQ(ShownName(at, ReadMethod()), "first") << "the last good one stays";
  put("second");
  EXPECT_TRUE(Eventually([&] { return ShownName(at, ReadMethod()) == "second"; }));
  for (auto& thread : load) thread.request_stop();
  load.clear();
  EXPECT_GT(calls, 20);
  EXPECT_EQ(failed, 0);
}

TEST_P(AccessTest, RightsAreReadAgainAndDamageLeavesTheOld) {
  auto server = Start({"--rights", WriteRights(dir_)});
  const Server nobody{server.address(), {}};
  EXPECT_EQ(Ask(nobody, ReadMethod()).error_code(), StatusCode::UNAUTHENTICATED);
  WriteRights(dir_, "anyone: read\n");
  EXPECT_TRUE(Eventually([&] { return Ask(nobody, ReadMethod()).ok(); }));
  WriteRights(dir_, "anyon: read\n");
  EXPECT_TRUE(Eventually([&] {
    EXPECT_TRUE(Ask(nobody, ReadMethod()).ok());
    return server.program().Stderr().find("anyon") != std::string::npos;
  }));
  EXPECT_THAT(server.program().Stderr(), HasSubstr("stays in force"));
}

TEST_P(AccessTest, BadFilesAreNamedAtStart) {
  certificates_->SignExpired("expired");
  EXPECT_THAT(RefusalOf(Tls("expired")),
              AllOf(HasSubstr("--tls-cert"), HasSubstr("expired.pem"), HasSubstr("expired on")));
  EXPECT_THAT(RefusalOf({"--tls-cert", certificates_->Pem("server"), "--tls-key",
                         certificates_->Key("alice")}),
              AllOf(HasSubstr("--tls-key"), HasSubstr("not the key of")));
  EXPECT_THAT(RefusalOf({"--tls-cert", dir_ / "none", "--tls-key", certificates_->Key("alice")}),
              AllOf(HasSubstr("none"), HasSubstr("No such file")));
  Write(dir_ / "bad.yaml", "format: grouser-rights/1\nanyonee: read\n");
  EXPECT_THAT(RefusalOf({"--rights", dir_ / "bad.yaml"}),
              AllOf(HasSubstr("bad.yaml:2"), HasSubstr("anyonee"), HasSubstr("anyone")));
}

TEST_P(AccessTest, PeersThatSpeakTheOtherWayGetErrors) {
  const Access tls{certificates_->Pem("ca"), "", "", ""};
  const auto why = [](const Server& server) -> std::string {
    try {
      client::IsServing(server, "", Milliseconds(5000));
    } catch (const client::ClientError& e) {
      return e.what();
    }
    return "";
  };
  {
    auto server = Start(Tls());
    EXPECT_THAT(why({server.address(), {}}), HasSubstr("it speaks TLS: expected --tls-ca"));
    EXPECT_THAT(why({server.address(), {certificates_->Pem("other-ca"), "", "", ""}}),
                AllOf(HasSubstr("its certificate"), HasSubstr("issuer")));
    EXPECT_EQ(why({server.address(), tls}), "") << "the server lives";
    const std::string localhost = "localhost" + server.address().substr(9);
    EXPECT_EQ(why({localhost, tls}), "");
  }
  certificates_->Sign("elsewhere", "-addext subjectAltName=DNS:elsewhere.example");
  {
    auto server = Start(Tls("elsewhere"));
    EXPECT_THAT(why({server.address(), tls}), HasSubstr("mismatch"));
  }
  auto server = Start({});
  EXPECT_THAT(why({server.address(), tls}), HasSubstr("it does not speak TLS"));
  EXPECT_EQ(why({server.address(), {}}), "") << "the server lives";
}

/// Local addresses, as the kernel's tables have them (hex), of what the process
/// listens or receives on.
std::vector<std::string> Listening(int pid) {
  std::vector<std::string> inodes, found;
  for (const auto& fd :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(fd, gone).string();
    if (target.starts_with("socket:[")) inodes.push_back(target.substr(8, target.size() - 9));
  }
  for (const std::string table : {"tcp", "tcp6", "udp", "udp6"}) {
    std::ifstream in("/proc/net/" + table);
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream words(line);
      std::string slot, local, remote, state, skip, inode;
      words >> slot >> local >> remote >> state >> skip >> skip >> skip >> skip >> skip >> inode;
      const bool open = table.starts_with("tcp") ? state == "0A" : state == "07";
      if (open && std::find(inodes.begin(), inodes.end(), inode) != inodes.end()) {
        found.push_back(table + " " + local.substr(0, local.find(':')));
      }
    }
  }
  return found;
}

TEST_P(AccessTest, NothingListensOffThisMachineByDefault) {
  auto server = Start({});
  const auto listening = Listening(server.program().pid());
  EXPECT_FALSE(listening.empty());
  for (const std::string& address : listening) EXPECT_EQ(address, "tcp 0100007F");
}

TEST_P(AccessTest, CommandLinesTakeTheOptions) {
  WriteRights(dir_);
  auto arguments = Tls();
  arguments.insert(arguments.end(), {"--rights", dir_ / "rights.yaml"});
  auto server = Start(arguments);
  const std::vector<std::string> ask =
      of_jobs() ? std::vector<std::string>{"jobs", "--jobs", server.address()}
                : std::vector<std::string>{"models", "--server", server.address()};
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), ask.begin(), ask.end());
    return testing::RunProgram("grouser-client", more, dir_.path());
  };
  const std::string ca = certificates_->Pem("ca");
  EXPECT_EQ(run({"--tls-ca", ca, "--token-file", dir_ / "read.token"}).code, 0);
  if (of_jobs()) {  // commands of models speak to it as well
    const auto history = testing::RunProgram("grouser-client",
                                             {"model", "history", "--jobs", server.address(),
                                              "--tls-ca", ca, "--token-file", dir_ / "read.token"},
                                             dir_.path());
    EXPECT_EQ(history.code, 0) << history.err;
  }
  const auto nobody = run({"--tls-ca", ca});
  EXPECT_EQ(nobody.code, 1);
  EXPECT_THAT(nobody.err, AllOf(HasSubstr("UNAUTHENTICATED"), HasSubstr("--token-file")));
  std::ofstream(dir_ / "empty.token").flush();
  const auto empty = run({"--tls-ca", ca, "--token-file", dir_ / "empty.token"});
  EXPECT_EQ(empty.code, 2);
  EXPECT_THAT(empty.err, HasSubstr("empty.token: is empty, expected a token"));
  const auto absent = run({"--tls-ca", dir_ / "absent.pem"});
  EXPECT_EQ(absent.code, 2);
  EXPECT_THAT(absent.err, HasSubstr("absent.pem"));
  ::setenv("GROUSER_TLS_CA", ca.c_str(), 1);
  ::setenv("GROUSER_TOKEN_FILE", (dir_ / "read.token").c_str(), 1);
  EXPECT_EQ(run({}).code, 0);
  if (!of_jobs()) {
    EXPECT_EQ(
        testing::RunProgram("grouser-vehicle", {"list", "--server", server.address()}, dir_.path())
            .code,
        0);
  }
  ::unsetenv("GROUSER_TLS_CA");
  ::unsetenv("GROUSER_TOKEN_FILE");
}

class OverrideTest : public AccessTest {};
INSTANTIATE_TEST_SUITE_P(Jobs, OverrideTest, ::testing::Values("grouser-jobs"));

TEST_P(OverrideTest, OverrideOfTheGateNeedsAdmin) {
  auto server = Start({"--rights", WriteRights(dir_)});
  v1alpha1::PromoteRequest request;
  request.set_job_id("job-x");
  request.set_override_gate(true);
  const auto code = [&](const std::string& token) {
    const client::JobsClient jobs(Server{server.address(), Token(token)});
    try {
      jobs.Promote(request);
    } catch (const client::ClientError& e) {
      if (e.code() == StatusCode::PERMISSION_DENIED) {
        EXPECT_THAT(std::string(e.what()),
                    HasSubstr("Promote with override_gate: 'a-promoteer' has the role promote, "
                              "expected admin"));
      }
      return e.code();
    }
    return StatusCode::OK;
  };
  EXPECT_EQ(code("promote"), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(code("admin"), StatusCode::NOT_FOUND) << "no such job";
  request.set_override_gate(false);
  EXPECT_EQ(code("promote"), StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace grouser

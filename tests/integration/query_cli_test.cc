// grouser-client, planner_loop and grouser-bench against a real server.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class QueryCliTest : public ::testing::Test {
 protected:
  void SetUp() override {
    testing::MakeStable(dir_.path(), testing::PhysicsModel("sand"));
    server_ = std::make_unique<testing::ServerProcess>(dir_.path());
  }
  testing::Finished Client(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", server_->address()});
    return testing::RunProgram("grouser-client", arguments, dir_.path());
  }

  testing::TempDir dir_;
  std::unique_ptr<testing::ServerProcess> server_;
};

TEST_F(QueryCliTest, SlipAndVelocityFormsAgree) {
  const auto by_slip =
      Client({"query", "--slip", "0.2", "--angle-deg", "30", "--load", "24", "--json"});
  ASSERT_EQ(by_slip.code, 0) << by_slip.err;
  EXPECT_EQ(by_slip.err, "");
  v1alpha1::EvaluateWheelsResponse first;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(by_slip.out, &first).ok());
  ASSERT_EQ(first.responses().f_x().value_size(), 1);
  EXPECT_NEAR(first.responses().slip().slip(0), 0.2, 1e-9);
  const auto& v = first.responses().velocity();
  const auto text = [](double x) { return std::to_string(x); };
  const auto by_velocity =
      Client({"query", "--vx", text(v.v_x_m_per_s(0)), "--vy", text(v.v_y_m_per_s(0)), "--rim",
              text(v.rim_speed_m_per_s(0)), "--load", "24", "--json"});
  ASSERT_EQ(by_velocity.code, 0) << by_velocity.err;
  v1alpha1::EvaluateWheelsResponse second;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(by_velocity.out, &second).ok());
  // The velocities travelled with six decimals.
  EXPECT_NEAR(first.responses().f_x().value(0), second.responses().f_x().value(0), 1e-2);
}

TEST_F(QueryCliTest, ListsSpreadSingleValuesAndTableSpellsFlags) {
  const auto table = Client({"query", "--slip", "0.1", "0.3", "--load", "24"});
  ASSERT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("state 1: slip 0.3"), HasSubstr("90 % interval (DEM)"),
                               HasSubstr("FORM_UNKNOWN"), HasSubstr("sinkage")));
  const auto negative = Client({"query", "--slip", "-0.5", "--load", "24"});
  EXPECT_EQ(negative.code, 0) << negative.err;
  const auto bad = Client({"query", "--slip", "0.1", "--load", "-1"});
  EXPECT_EQ(bad.code, 2);
  EXPECT_THAT(bad.out, AllOf(HasSubstr("INVALID"), HasSubstr("nan")));
  EXPECT_THAT(bad.err, HasSubstr("state 0 is INVALID: load -1 N"));
  const auto impossible = Client({"query", "--slip", "1.8", "--angle-deg", "90", "--load", "24"});
  EXPECT_EQ(impossible.code, 2);
  EXPECT_THAT(impossible.err, HasSubstr("slip 1.8 at attack angle 90 deg"));
  EXPECT_EQ(Client({"query", "--slip", "0.1", "--load", "-1", "24"}).code, 0) << "one is answered";
  const auto lifted = Client({"query", "--slip", "0.1", "--load", "0"});
  EXPECT_EQ(lifted.code, 0) << lifted.err;
  EXPECT_THAT(lifted.out, AllOf(HasSubstr("flags: AIRBORNE\n"), Not(HasSubstr("nan"))));
}

TEST_F(QueryCliTest, ShowsGradientsWhereAsked) {
  const std::vector<std::string> query = {"query", "--slip", "0.1", "--load", "24"};
  EXPECT_THAT(Client(query).out, Not(HasSubstr("d/d")));
  auto asked = query;
  asked.insert(asked.end(), {"--values-only", "--gradients"});
  const auto table = Client(asked);
  ASSERT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("d/d"), Not(HasSubstr("nan")), HasSubstr("rim")));
  asked.push_back("--json");
  v1alpha1::EvaluateWheelsResponse response;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(Client(asked).out, &response).ok());
  EXPECT_EQ(response.responses().f_z().d_load(0), 1);
}

TEST_F(QueryCliTest, ExplainsAsTheFileItselfDoes) {
  const std::vector<std::string> state = {"--slip", "-0.7", "--angle-deg", "20", "--load", "50"};
  const auto with = [&](std::vector<std::string> head, const std::vector<std::string>& tail) {
    head.insert(head.end(), state.begin(), state.end());
    head.insert(head.end(), tail.begin(), tail.end());
    return head;
  };
  const auto text = Client(with({"query", "--explain"}, {}));
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("FORM_UNKNOWN"), HasSubstr("hull distance"),
                              HasSubstr("note: no runs recorded in this model file")));
  v1alpha1::ExplainResponse told;
  v1alpha1::Explanation offline;
  const auto json = Client(with({"query", "--explain", "--runs", "3"}, {"--json"}));
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json.out, &told).ok()) << json.err;
  const std::string digest = told.explanation().model().substr(std::string("sand@sha256:").size());
  const std::string file = dir_ / ("models/" + digest + ".model");
  const auto fit =
      testing::RunProgram("grouser-fit", with({"explain", file}, {"--json"}), dir_.path());
  ASSERT_EQ(fit.code, 0) << fit.err;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(fit.out, &offline).ok());
  EXPECT_EQ(offline.SerializeAsString(), told.explanation().SerializeAsString());

  const auto invalid = Client({"query", "--explain", "--slip", "0.1", "--load", "-1"});
  EXPECT_EQ(invalid.code, 2);
  EXPECT_THAT(invalid.out, HasSubstr("load -1 N, expected a finite one, 0 or more"));
  const auto two = Client({"query", "--explain", "--slip", "0.1", "0.2", "--load", "20"});
  EXPECT_EQ(two.code, 2);
  EXPECT_THAT(two.err, HasSubstr("2 states, expected one"));
  EXPECT_EQ(Client(with({"query", "--explain", "--tolerance", "f_x=1"}, {})).code, 2);
  EXPECT_EQ(Client(with({"query", "--runs", "3"}, {})).code, 2);
  for (const std::vector<std::string>& bad : {std::vector<std::string>{"--slip", "0.1"},
                                              {"--load", "20"},
                                              {"--slip", "0.1", "--vx", "1", "--load", "20"}}) {
    auto arguments = bad;
    arguments.insert(arguments.begin(), {"explain", file});
    EXPECT_EQ(testing::RunProgram("grouser-fit", arguments, dir_.path()).code, 2);
  }
}

TEST_F(QueryCliTest, CommandsOfJobsAskNobodyElseThanWasMeant) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"jobs"},
           {"job", "a"},
           {"watch", "a"},
           {"watch"},
           {"submit", "--slip", "0.2", "--load", "24"},
           {"promote", "a", "--who", "me", "--why", "b"},
           {"cancel", "a", "--request-id", "b"},
           {"fetch", "a"},
           {"prune"},
           {"model", "history"},
           {"model", "rollback", "sand", "--who", "me", "--why", "b"},
           {"health", "jobs"},
           {"version", "jobs"}}) {
    const auto asked = Client(words);
    EXPECT_EQ(asked.code, 2) << words[0] << asked.err;
    EXPECT_THAT(asked.err, HasSubstr("expected --jobs")) << words[0];
    auto both = words;
    both.insert(both.end(), {"--jobs", "127.0.0.1:1", "--deadline-ms", "200"});
    EXPECT_EQ(Client(both).code, 1) << words[0] << ": nobody is there";
  }
}

TEST(Version, EveryProgramTellsIt) {
  testing::TempDir dir;
  for (const char* name :
       {"grouser-server", "grouser-jobs", "grouser-client", "grouser-bench", "grouser-replay",
        "grouser-dem", "grouser-fit", "grouser-calibrate", "grouser-ladder"}) {
    const auto version = testing::RunProgram(name, {"--version"}, dir.path());
    EXPECT_EQ(version.code, 0) << name;
    EXPECT_THAT(version.out, StartsWith(std::string(name) + " " GROUSER_VERSION));
  }
}

TEST_F(QueryCliTest, ModelsAndHealth) {
  EXPECT_THAT(Client({"models"}).out, AllOf(HasSubstr("sand@sha256:"), HasSubstr("stable")));
  v1alpha1::ListModelsResponse listing;
  ASSERT_TRUE(
      google::protobuf::util::JsonStringToMessage(Client({"models", "--json"}).out, &listing).ok());
  EXPECT_EQ(listing.models_size(), 1);
  EXPECT_THAT(Client({"model", "sand"}).out, AllOf(HasSubstr("sand@sha256:"), HasSubstr("rmse")));
  EXPECT_EQ(Client({"model", "mud"}).code, 1);
  const auto health = Client({"health"});
  EXPECT_EQ(health.code, 0);
  EXPECT_EQ(health.out, "SERVING\n");
}

TEST_F(QueryCliTest, ExitCodesAndTexts) {
  EXPECT_EQ(Client({"query", "--slip", "0.1"}).code, 2);  // no load
  EXPECT_EQ(Client({"query", "--slip", "0.1", "--vx", "1", "--load", "1"}).code, 2);
  EXPECT_EQ(Client({"query", "--slip", "0.1", "0.2", "--load", "1", "2", "3"}).code, 2);
  EXPECT_EQ(Client({"nonsense"}).code, 2);
  const auto unknown = Client({"query", "--slip", "0.1", "--load", "24", "--model", "clay"});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("NOT_FOUND"), HasSubstr("clay")));
  const auto nobody = testing::RunProgram(
      "grouser-client", {"models", "--server", "127.0.0.1:1", "--deadline-ms", "2000"},
      dir_.path());
  EXPECT_EQ(nobody.code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("127.0.0.1:1"));
}

TEST_F(QueryCliTest, ReachesTheLoopbackInterfaceInSpiteOfAProxy) {
  ASSERT_EQ(setenv("http_proxy", "http://127.0.0.1:9", 1), 0);  // nobody answers there
  const auto health = Client({"health"});
  unsetenv("http_proxy");
  EXPECT_EQ(health.code, 0) << health.err;
}

TEST_F(QueryCliTest, ExampleRuns) {
  const auto example = testing::RunProgram("planner_loop", {server_->address(), "3"}, dir_.path());
  EXPECT_EQ(example.code, 0) << example.err;
  EXPECT_THAT(example.out, HasSubstr("cycle 2: 400 states"));
  for (const char* cycles : {"3x", "x", "", "0", "-2", "99999999999", "1.5"}) {
    const auto bad = testing::RunProgram("planner_loop", {server_->address(), cycles}, dir_.path());
    EXPECT_EQ(bad.code, 2) << cycles;
    EXPECT_THAT(bad.err, HasSubstr(std::string("CYCLES: got '") + cycles + "', expected"));
    EXPECT_EQ(bad.out, "") << cycles;
  }
}

// The table of servers and echoes; that of jobs beside takes too long here.
TEST_F(QueryCliTest, BenchComparesEveryTransportAndSizeWithAnEcho) {
  const auto bench = testing::RunProgram(
      "grouser-bench", {"server", "--no-lcm", "--seconds", "0", "--starts", "1", "--json"},
      dir_.path());
  ASSERT_EQ(bench.code, 0) << bench.err;
  for (const char* text :
       {"\"tcp unary\", \"states\": 1,", "\"tcp stream\", \"states\": 64,",
        "\"unix unary\", \"states\": 4,", "\"unix stream\", \"states\": 10000, \"fields\": \"all\"",
        "\"states\": 10000, \"fields\": \"6 arrays\"", "\"first_message\"", "\"met\""}) {
    EXPECT_THAT(bench.out, HasSubstr(text));
  }
  const auto broken = testing::RunProgram(
      "grouser-bench", {"server", "--no-lcm", "--seconds", "0", "--program", "/bin/false"},
      dir_.path());
  EXPECT_EQ(broken.code, 1);
  EXPECT_THAT(broken.err, HasSubstr("/bin/false has ended"));
}

}  // namespace
}  // namespace grouser

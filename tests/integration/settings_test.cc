// The file of settings of both programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(SettingsTest, ComeFromTheFileUnlessTheCommandLineGivesThem) {
  testing::TempDir dir;
  const std::string file = dir / "grouser.yaml";
  const auto run = [&](const std::string& program, const std::string& text,
                       std::vector<std::string> more) {
    std::ofstream(file) << text;
    more.insert(more.end(), {"--config", file});
    return testing::RunProgram(program, more, dir.path());
  };
  const std::string text = "both: {state: " + dir.path() +
                           ", drain-s: 3, idle-s: 7}\n"
                           "server: {no-lcm: true, drain-s: 4, vehicles: [" GROUSER_VEHICLES
                           ", " GROUSER_VEHICLES
                           "/husky.vehicle.yaml]}\n"
                           "jobs: {workers: 2}\n";
  const auto server = run("grouser-server", text, {"--idle-s", "9", "--config-show"});
  EXPECT_EQ(server.code, 0) << server.err;
  for (const char* line : {"drain-s: 4  # file\n", "idle-s: 9  # command line\n",
                           "max-connections: 1000  # default\n", "no-lcm: true  # file\n"}) {
    EXPECT_THAT(server.out, HasSubstr(line));
  }
  const auto jobs = run("grouser-jobs", text, {"--config-show"});
  EXPECT_EQ(jobs.code, 0) << jobs.err;
  EXPECT_THAT(jobs.out, AllOf(HasSubstr("workers: 2  # file"), HasSubstr("drain-s: 3  # file")));
  EXPECT_EQ(run("grouser-jobs", text, {"--config-check"}).code, 0);

  const struct {
    const char *text, *says, *and_says;
  } bad[] = {{"jobs: {wokers: 2}", "wokers", "workers"},
             {"both:\n  drian-s: 2\n", "drian-s", "drain-s"},
             {"job: {workers: 2}", "job", "jobs"},
             {"jobs:\n  workers: many", "grouser.yaml:2: key 'jobs.workers': got 'many'",
              "expected a whole number"},
             {"jobs: {workers: 9999}", "grouser.yaml:1: key 'jobs.workers': got '9999'", "256"},
             {"jobs: {idle-s: long}", "'jobs.idle-s': got 'long'", "expected a number"},
             {"jobs: {insecure: maybe}", "'jobs.insecure': got 'maybe'", "true or false"},
             {"jobs: {grpc: x}", "'jobs.grpc': got 'x'", "HOST:PORT"},
             {"", "grouser.yaml: empty", "jobs"},
             {"jobs: [1]", "jobs", "mapping"},
             {"jobs: {", "grouser.yaml", ""},
             {"both: {no-lcm: true}", "no-lcm", "belongs under server:"}};
  for (const auto& b : bad) {
    const auto refused = run("grouser-jobs", b.text, {"--config-check"});
    EXPECT_EQ(refused.code, 2) << b.text;
    EXPECT_THAT(refused.err, AllOf(HasSubstr(b.says), HasSubstr(b.and_says)));
  }
  const auto missing =
      testing::RunProgram("grouser-jobs", {"--config", "/none", "--config-check"}, dir.path());
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.err, HasSubstr("/none"));
  const auto folder =
      testing::RunProgram("grouser-jobs", {"--config", dir.path(), "--config-check"}, dir.path());
  EXPECT_EQ(folder.code, 2);
  EXPECT_THAT(folder.err, HasSubstr("a folder, expected a YAML file"));
  // Of LCM the command line decides against the file, and may not contradict itself.
  const std::string url = "server: {lcm-url: 'udpm://239.255.76.67:7667?ttl=0'}\n";
  EXPECT_EQ(run("grouser-server", url, {"--no-lcm", "--config-check"}).code, 0);
  const auto both =
      run("grouser-server", url, {"--no-lcm", "--lcm-interface", "lo", "--config-check"});
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, HasSubstr("--no-lcm with --lcm-interface"));
  EXPECT_EQ(
      run("grouser-server", "server: {no-lcm: true}\n", {"--lcm-interface", "lo", "--config-check"})
          .code,
      0);
  const auto schema = json::parse(
      testing::RunProgram("grouser-server", {"--config-schema"}, dir.path()).out, nullptr, false);
  ASSERT_TRUE(schema.is_object());
  const auto& settings = schema["properties"]["server"]["properties"];
  EXPECT_EQ(settings["drain-s"]["type"], "number");
  EXPECT_EQ(settings["max-connections"]["type"], "integer");
  EXPECT_EQ(settings["no-lcm"]["type"], "boolean");
  EXPECT_EQ(settings["vehicles"]["type"], "array");
  EXPECT_FALSE(settings.contains("config-check"));
}

}  // namespace
}  // namespace grouser

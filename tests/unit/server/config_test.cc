#include "server/core/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Refusal(const ServerConfig& config) {
  try {
    config.Validate();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

class ConfigTest : public ::testing::Test {
 protected:
  ConfigTest() { config_.state_dir = dir_.path(); }
  testing::TempDir dir_;
  ServerConfig config_;
};

TEST_F(ConfigTest, DefaultsAreValid) { EXPECT_EQ(Refusal(config_), ""); }

TEST_F(ConfigTest, RefusesFoldersByName) {
  config_.state_dir = "";
  EXPECT_THAT(Refusal(config_), HasSubstr("state"));
  config_.state_dir = dir_ / "not-there-yet";
  EXPECT_EQ(Refusal(config_), "");
  config_.shipped_dir = dir_ / "missing";
  EXPECT_THAT(Refusal(config_), AllOf(HasSubstr("shipped"), HasSubstr("missing")));
}

TEST_F(ConfigTest, RefusesLimitsByName) {
  config_.poll_period = std::chrono::milliseconds(0);
  EXPECT_THAT(Refusal(config_), HasSubstr("poll_period"));
  config_.table_cache_mb = -1;
  EXPECT_THAT(Refusal(config_), AllOf(HasSubstr("table-cache-mb"), HasSubstr("0 or more")));
}

// Of two servers with logs q and q.1 each would take the other's files for its own.
TEST_F(ConfigTest, RefusesALogWithTheNameOfAnOlderFile) {
  for (const char* name : {"q.1", "log/q.0", "q.log.25"}) {
    config_.query_log = dir_ / name;
    EXPECT_THAT(Refusal(config_),
                AllOf(HasSubstr("query-log: "), HasSubstr(name), HasSubstr("expected a name")));
  }
  for (const char* name : {"q", "q.log", "q.1a", "q.1/log", "q1", "q."}) {
    config_.query_log = dir_ / name;
    EXPECT_EQ(Refusal(config_), "") << name;
  }
}

TEST_F(ConfigTest, VehicleThreadsByDefaultAreTaken) {
  for (const unsigned processors : {0u, 1u, 2u, 8u, 128u, 130u, 1024u}) {
    config_.vehicle_threads = DefaultVehicleThreads(processors);
    EXPECT_EQ(Refusal(config_), "") << processors;
  }
  EXPECT_EQ(DefaultVehicleThreads(0), 1);
  EXPECT_EQ(DefaultVehicleThreads(9), 4);
  EXPECT_EQ(DefaultVehicleThreads(1024), kMostVehicleThreads);
  for (const int threads : {0, -1, kMostVehicleThreads + 1}) {
    config_.vehicle_threads = threads;
    EXPECT_THAT(Refusal(config_), AllOf(HasSubstr("vehicle-threads"), HasSubstr("1 to 64")));
  }
}

}  // namespace
}  // namespace grouser::server

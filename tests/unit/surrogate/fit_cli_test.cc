// grouser-fit from the command line: options that would be read and ignored are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

/// What is said of bad usage, which must be the exit code.
std::string Refused(const std::string& arguments) {
  std::FILE* out = ::popen((GROUSER_FIT " " + arguments + " 2>&1").c_str(), "r");
  std::string said;
  std::array<char, 4096> some{};
  while (std::fgets(some.data(), some.size(), out) != nullptr) said += some.data();
  EXPECT_EQ(WEXITSTATUS(::pclose(out)), 2) << said;
  return said;
}

TEST(FitCli, OptionsThatWouldBeIgnoredAreRefused) {
  EXPECT_THAT(Refused("fit --runs none --name a --out b --accept-unusual"),
              HasSubstr("--accept-unusual requires --measured"));
  EXPECT_THAT(Refused("make --wheel none --ground ice --soils none.csv --out b"),
              HasSubstr("--soils: tables of soils, not of hard ground"));
  EXPECT_THAT(Refused("summarise --runs none --out b --json"), HasSubstr("--json"));
}

// As CLI11's own checks do not.
TEST(FitCli, NaNIsNoNumber) {
  for (const char* option :
       {"--load", "--slip", "--deflection", "--section-height", "--cone-index", "--gradient"}) {
    EXPECT_THAT(Refused(std::string("numerics a.model ") + option + "=nan"),
                HasSubstr(std::string(option) + ": got nan, expected a number"));
  }
  EXPECT_THAT(Refused("eval a.model --slip 0.1,nan --load 1"), HasSubstr("--slip: got nan"));
  EXPECT_THAT(Refused("eval a.model --slip 0.1 --load -NAN"), HasSubstr("--load: got -NAN"));
  EXPECT_THAT(Refused("explain a.model --vx nan --load 1"), HasSubstr("--vx: got nan"));
  EXPECT_THAT(Refused("make --wheel a --soil b --out c --gravity nan"),
              HasSubstr("--gravity: got nan"));
  EXPECT_THAT(Refused("gate --base a --candidate b --change-share nan"),
              HasSubstr("--change-share: got nan"));
  EXPECT_THAT(Refused("fit --runs a --name b --out c --profile-weight nan"),
              HasSubstr("--profile-weight: got nan"));
}

}  // namespace
}  // namespace grouser::surrogate

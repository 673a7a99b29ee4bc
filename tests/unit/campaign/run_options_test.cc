// Options of `grouser-dem run`: each is obeyed or refused by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <string>

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;

struct Ended {
  int code;
  std::string text;
};

/// The program with these options; the scene "none" does not exist, so that no run begins.
Ended RunDem(const std::string& options) {
  const std::string command = GROUSER_DEM " run --out a.run.h5 " + options + " 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  Ended ended{};
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) ended.text += static_cast<char>(c);
  const int status = pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
}

std::string Refusal(const std::string& options) {
  const Ended ended = RunDem("--scene none --load 5 " + options);
  EXPECT_NE(ended.code, 0) << options;
  return ended.text;
}

TEST(RunOptions, TakesWhatAModeNeeds) {
  for (const char* options :
       {"--slip 0.2 --angle-deg 30", "--mode towed --angle-deg 30", "--mode free --drawbar 3"}) {
    EXPECT_THAT(Refusal(options), HasSubstr("none: ")) << "for want of the scene alone";
  }
}

TEST(RunOptions, RefusesWhatAModeWouldIgnore) {
  EXPECT_THAT(Refusal("--mode free --drawbar 3 --angle-deg 30"),
              HasSubstr("--angle-deg goes with mode rim or towed, not free"));
  EXPECT_THAT(Refusal("--mode free --drawbar 3 --slip 0.2"),
              HasSubstr("--slip goes with mode rim, not free"));
  EXPECT_THAT(Refusal("--mode towed --slip 0.2"),
              HasSubstr("--slip goes with mode rim, not towed"));
  EXPECT_THAT(Refusal("--mode towed --drawbar 3"), HasSubstr("--drawbar goes with mode free"));
  EXPECT_THAT(Refusal("--slip 0.2 --drawbar 3"), HasSubstr("--drawbar goes with mode free"));
}

TEST(RunOptions, RefusesOptionsBesideASpec) {
  for (const char* option : {"--slip 0.2", "--angle-deg 30", "--load 5", "--drawbar 1",
                             "--mode rim", "--seed 2", "--max-time 1", "--scene none"}) {
    const Ended ended = RunDem(std::string("--spec none.json ") + option);
    EXPECT_NE(ended.code, 0);
    EXPECT_THAT(ended.text, HasSubstr("excludes")) << option;
  }
}

}  // namespace
}  // namespace grouser::campaign

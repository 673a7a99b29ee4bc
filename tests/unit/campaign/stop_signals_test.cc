// The first signal asks a polling command to stop, and ends one that looks at no flag.
#include "dem_offline/campaign/stop_signals.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace grouser::campaign {
namespace {

/// Exit code of a child that gets one SIGTERM; 7: it went on until it saw the flag.
int ExitAfterSigterm(bool at_once) {
  const pid_t child = fork();
  if (child == 0) {
    const StopSignals signals;
    if (at_once) signals.EndAtOnce();
    kill(getpid(), SIGTERM);
    while (at_once || !signals.stop()) usleep(1000);
    _exit(signals.exit_code() == 143 ? 7 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(StopSignals, AskAPollingCommandToStop) { EXPECT_EQ(ExitAfterSigterm(false), 7); }

TEST(StopSignals, EndACommandThatLooksAtNoFlag) { EXPECT_EQ(ExitAfterSigterm(true), 143); }

}  // namespace
}  // namespace grouser::campaign

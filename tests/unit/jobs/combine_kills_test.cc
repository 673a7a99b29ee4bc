// The jobs program is killed at the commits of refinements that end in one candidate.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <cstdio>

#include "tests/unit/jobs/combining_life.h"
#include "tests/unit/jobs/commit_faults.h"

namespace grouser::server {
namespace {

using testing::CommitFault;
using testing::Life;

class CombineKillsTest : public testing::CombiningTest {
 protected:
  CombineKillsTest() { FakeCombining(); }

  /// A fault at the commit `first` after the first refinement was offered, and at each `stride`-th
  /// after that, until a life makes fewer.
  void AtCommits(CommitFault fault, int first = 1, int stride = 1) {
    ASSERT_EQ(InProcess([this](Life& life) { ToOneOffered(life); }), 0);
    Keep();
    int lives = 0;
    for (int at = first;; at += stride, ++lives) {
      SCOPED_TRACE(at);
      BringBack();
      const int status =
          InProcess([this](Life& life) { ToBothPromoted(life); },
                    [&] { testing::PlanCommitFault(fault, at); },
                    [] { return testing::CommitFaultIsStillToCome() ? kNotReached : 0; });
      if (WIFEXITED(status) && WEXITSTATUS(status) == kNotReached) {
        std::printf("%d lives\n", lives);
        EXPECT_GT(at, kCommits);
        return;
      }
      if (fault != CommitFault::kRefuse) {
        ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
        ASSERT_EQ(WTERMSIG(status), SIGKILL);
      } else {
        ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
        ASSERT_THAT(WEXITSTATUS(status), ::testing::AnyOf(0, kRefusedAtStart));
      }
      ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsAll());
      if (HasFailure()) return;
    }
  }

  static constexpr int kNotReached = 20;
  static constexpr int kCommits = 21;
};

// B: submission, RUNNING, FITTING, VALIDATING, AWAITING_PROMOTION, alias candidate moved. A:
// promotion decided, DONE. B again: QUEUED, RUNNING, FITTING, what stable is now as its base,
// VALIDATING, AWAITING_PROMOTION, alias candidate moved, promotion decided, DONE. A again, whose
// run is known: submission, RUNNING, FITTING, DONE.
TEST_F(CombineKillsTest, AfterAKillRightAfterSomeCommits) {
  AtCommits(CommitFault::kKillAfter, 8, 7);
}

TEST_F(CombineKillsTest, SlowAfterAKillJustBeforeAnyCommit) { AtCommits(CommitFault::kKillBefore); }
TEST_F(CombineKillsTest, SlowAfterAKillRightAfterAnyCommit) { AtCommits(CommitFault::kKillAfter); }
TEST_F(CombineKillsTest, SlowAfterARefusedWrite) { AtCommits(CommitFault::kRefuse); }

}  // namespace
}  // namespace grouser::server

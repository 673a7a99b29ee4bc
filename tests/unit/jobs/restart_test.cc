// Whatever moment ends the jobs program (a stop, a kill, a store that refuses a
// write), the next start carries every job on to its end.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <functional>

#include "server/core/status.h"
#include "tests/unit/jobs/commit_faults.h"
#include "tests/unit/jobs/jobs_life.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using ::testing::HasSubstr;
using testing::Life;
using testing::Request;

using Fault = testing::CommitFault;

class RestartTest : public testing::LivesTest {
 protected:
  int InProcess(Fault fault, int at, const std::function<void(Life&)>& live) {
    return LivesTest::InProcess(
        live, [&] { testing::PlanCommitFault(fault, at); },
        [] { return testing::CommitFaultIsStillToCome() ? kNotReached : 0; });
  }

  /// A life that ends while the candidate is validated.
  void KilledWhileValidating() {
    testing::WriteText(bin_ + "/hold.gate", "");
    InProcess(Fault::kNone, 0, [&](Life& life) {
      life.Await(life.Submit(), JOB_STATE_VALIDATING);
      ::kill(::getpid(), SIGKILL);
    });
    std::filesystem::remove(bin_ + "/hold.gate");
  }

  /// A fault at the first commit, the second, ... until a life makes fewer, of
  /// which there must be `least`. `before`: an earlier life.
  void AtEveryCommit(
      Fault fault, int least, const std::function<void()>& before = [] {}) {
    for (int at = 1;; ++at) {
      SCOPED_TRACE(at);
      before();
      const int status = InProcess(fault, at, ToTheEnd);
      if (WIFEXITED(status) && WEXITSTATUS(status) == kNotReached) {
        EXPECT_GT(at, least);
        return;
      }
      if (fault != Fault::kRefuse) {
        ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
        ASSERT_EQ(WTERMSIG(status), SIGKILL);
      } else {
        ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
        ASSERT_THAT(WEXITSTATUS(status), ::testing::AnyOf(0, kRefusedAtStart));
      }
      ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsIt());
      Clear();
    }
  }

  static constexpr int kNotReached = 20;
};

// Schema, submission, RUNNING, FITTING, VALIDATING, AWAITING_PROMOTION, alias candidate moved,
// promotion decided, DONE.
constexpr int kCommits = 9;
// QUEUED again, and all from RUNNING on.
constexpr int kCommitsOfSecondLife = 8;

TEST_F(RestartTest, AfterAKillJustBeforeAnyCommit) { AtEveryCommit(Fault::kKillBefore, kCommits); }

TEST_F(RestartTest, AfterAKillRightAfterAnyCommit) { AtEveryCommit(Fault::kKillAfter, kCommits); }

TEST_F(RestartTest, AfterARefusedWrite) { AtEveryCommit(Fault::kRefuse, kCommits); }

TEST_F(RestartTest, AfterAKillAndThenAnother) {
  AtEveryCommit(Fault::kKillAfter, kCommitsOfSecondLife, [this] { KilledWhileValidating(); });
}

TEST_F(RestartTest, AfterAKillAndThenARefusedWrite) {
  AtEveryCommit(Fault::kRefuse, kCommitsOfSecondLife, [this] { KilledWhileValidating(); });
}

TEST_F(RestartTest, AfterAStopOrAKillInEveryState) {
  struct Boundary {
    JobState state;
    const char* held;  ///< file of bin_ that keeps a worker at it
  };
  for (const auto& [state, held] : {Boundary{JOB_STATE_QUEUED, ""},
                                    {JOB_STATE_RUNNING, "hold.run"},
                                    {JOB_STATE_FITTING, "hold.refit"},
                                    {JOB_STATE_VALIDATING, "hold.gate"},
                                    {JOB_STATE_AWAITING_PROMOTION, ""}}) {
    for (const bool stop : {true, false}) {
      SCOPED_TRACE(ShortName(state) + (stop ? " stopped" : " killed"));
      const std::string hold = bin_ + "/" + (*held ? held : "hold.none");
      testing::WriteText(hold, "");
      workers_ = state == JOB_STATE_QUEUED ? 0 : 1;
      const int status = InProcess(Fault::kNone, 0, [&](Life& life) {
        const std::string id = life.Submit();
        life.Await(id, state);
        if (!stop) ::kill(::getpid(), SIGKILL);
      });
      ASSERT_TRUE(stop ? WIFEXITED(status) && WEXITSTATUS(status) == 0 : WIFSIGNALED(status));
      std::filesystem::remove(hold);
      workers_ = 1;
      ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsIt());
      Clear();
    }
  }
}

// "dem.1.log" and "run.h5": the run is tried again; "lock": the job fails by name.
TEST_F(RestartTest, WhatStandsInAJobFilesPlaceStopsNoOtherJob) {
  for (const char* name : {"lock", "dem.1.log", "run.h5", "candidate.model"}) {
    for (const bool fifo : {true, false}) {
      SCOPED_TRACE(std::string(name) + (fifo ? ": a FIFO" : ": a folder"));
      workers_ = 0;
      ASSERT_EQ(InProcess(Fault::kNone, 0, [](Life& life) { life.Submit(); }), 0);
      workers_ = 1;
      const std::string id = StoredJobs().at(0).job_id();
      const std::string path = state_ + "/jobs/" + id + "/" + name;
      std::filesystem::create_directories(fifo ? state_ + "/jobs/" + id : path + "/kept");
      if (fifo) {
        ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
      }
      ASSERT_EQ(InProcess(Fault::kNone, 0,
                          [&](Life& life) {
                            const std::string other = life.Submit(Request("b", 0.2));
                            life.AwaitEnd(id);
                            life.AwaitEnd(other);
                          }),
                0);
      Job planted, other;
      for (const Job& job : StoredJobs()) (job.job_id() == id ? planted : other) = job;
      EXPECT_THAT(other.message(), HasSubstr("another spec")) << "it ran";
      if (std::string(name) == "lock") {
        EXPECT_EQ(ShortName(planted.job_state()), "FAILED");
        EXPECT_THAT(planted.message(), HasSubstr(path));
      } else {
        EXPECT_EQ(ShortName(planted.job_state()), "AWAITING_PROMOTION") << planted.message();
      }
      EXPECT_NE(std::filesystem::exists(path + ".damaged"),
                fifo ? std::filesystem::is_fifo(path) : std::filesystem::exists(path + "/kept"))
          << "nothing is deleted";
      Clear();
    }
  }
}

// What was counted stays, as a counter's must, where the job itself is pruned.
TEST_F(RestartTest, EndedJobsAreCountedFromTheStart) {
  workers_ = 0;
  Life life(Options());
  CancelJobRequest cancel;
  cancel.set_job_id(life.Submit());
  cancel.set_request_id("a");
  life.Ask([&](JobsApp& app) { return app.Cancel(cancel); });
  PruneRequest prune;
  prune.set_keep_days(1e-9);
  const auto pruned = life.Ask([&](JobsApp& app) { return app.Prune(prune); });
  EXPECT_GT(pruned.items_count(), 0u);
  std::promise<std::string> page;
  life.Ask([&](JobsApp& app) {
    app.TellMetrics([&](const MetricPage& told) { page.set_value(told.Text()); });
    return 0;
  });
  const std::string text = page.get_future().get();
  EXPECT_THAT(text, HasSubstr("\ngrouser_jobs{state=\"CANCELLED\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("\ngrouser_jobs_ended_total{state=\"CANCELLED\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("\ngrouser_jobs_ended_total{state=\"FAILED\"} 0\n"));
}

TEST_F(RestartTest, ADamagedAliasFileDelaysTheMoveAlone) {
  testing::WriteText(bin_ + "/hold.gate", "");
  ASSERT_EQ(InProcess(Fault::kNone, 0,
                      [](Life& life) { life.Await(life.Submit(), JOB_STATE_VALIDATING); }),
            0);
  std::filesystem::remove(bin_ + "/hold.gate");
  const std::string aliases = state_ + "/models/aliases.json";
  testing::WriteText(aliases, "{ no aliases");
  ASSERT_EQ(InProcess(Fault::kNone, 0,
                      [&](Life& life) {
                        SubmitRefinementRequest other = Request("b", 0.2);
                        try {
                          life.Submit(other);
                          throw std::logic_error("a name was resolved without aliases");
                        } catch (const StatusError& e) {
                          if (std::string(e.what()).find(aliases) == std::string::npos) throw;
                        }
                        other.set_model("cmu-smooth-62.5@sha256:" + base_digest_);
                        life.AwaitEnd(life.Submit(other));  // a digest needs no aliases
                        const std::string id = StoredJobs().back().job_id();
                        life.Await(id, JOB_STATE_AWAITING_PROMOTION);
                        if (testing::ReadText(aliases) != "{ no aliases")
                          throw std::logic_error("overwritten");
                        std::filesystem::remove(aliases);  // as a person does
                        const Repository repository(state_, shipped_);
                        if (!testing::Eventually([&] {
                              return repository.ReadAliases().by_model["cmu-smooth-62.5"].contains(
                                  "candidate");
                            })) {
                          throw std::logic_error("the alias was not moved");
                        }
                      }),
            0);
}

}  // namespace
}  // namespace grouser::server

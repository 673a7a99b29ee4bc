// The jobs program is killed, loses its power or finds its disk full at any call that writes.
#include <gmock/gmock.h>
#include <signal.h>

#include <cstdlib>
#include <thread>

#include "server/core/status.h"
#include "tests/unit/jobs/combining_life.h"
#include "tests/unit/jobs/write_faults.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using ::testing::HasSubstr;
using testing::Life;
using testing::Request;
using testing::WriteFault;
using testing::WriteFaults;

constexpr unsigned kMayFindNoSpace = testing::kAnyCall & ~testing::kRemove;

bool SaysFull(const std::string& text) {
  return text.find("No space left") != text.npos || text.find("disk is full") != text.npos;
}

class WritesTest : public testing::CombiningTest {
 protected:
  WritesTest() { FakeCarefully(); }

  /// GROUSER_EVERY=1: at every call; else at every 97th.
  static long Stride() {
    const char* every = std::getenv("GROUSER_EVERY");
    return every != nullptr ? std::max(1L, std::atol(every)) : 97;
  }

  int LiveWithFaults(const std::function<void(Life&)>& live) {
    return InProcess(
        live,
        [&] {
          faults_.Enter();
          testing::TakeWriteCalls();
        },
        [&] { return faults_.happened() ? 0 : kNotReached; });
  }

  void Clear() {
    LivesTest::Clear();
    for (const auto& entry : std::filesystem::directory_iterator(bin_)) {
      const std::string name = entry.path().filename();
      if (name.starts_with("pids.") || name.starts_with("run.") || name.starts_with("told.")) {
        std::filesystem::remove(entry.path());
      }
    }
    faults_.Settle();
  }

  /// What a client was told must be so.
  void ExpectWhatWasTold() {
    const std::string job_id = testing::ReadText(bin_ + "/told.job");
    if (job_id.empty()) return;
    const auto row = JobStore(state_ + "/jobs/jobs.sqlite").Find(job_id);
    ASSERT_TRUE(row.has_value()) << "an acknowledged job is lost";
    const bool promoted = std::filesystem::exists(bin_ + "/told.promoted");
    const std::string stable = Repository(state_, shipped_).Resolve("cmu-smooth-62.5").digest;
    EXPECT_TRUE(!promoted || stable == row->job.candidate_digest());
  }

  /// A power cut at each `stride`-th call of a life, then what must hold, and all back for the
  /// next.
  void PowerCutAt(WriteFaults::Left left, long stride, long least,
                  const std::function<void(Life&)>& live, const std::function<void()>& expect,
                  const std::function<void()>& back) {
    std::mt19937 random(1);
    for (long at = 1;; at += stride) {
      SCOPED_TRACE(at);
      faults_.Plan(WriteFault::kKill, at);
      const int status = LiveWithFaults(live);
      ASSERT_TRUE(AwaitNoWorkers());
      faults_.CutPower(left, random);
      ASSERT_NO_FATAL_FAILURE(expect());
      EXPECT_EQ(Wrong(), "");
      if (HasFailure()) return;
      back();
      if (WIFEXITED(status)) {
        EXPECT_EQ(WEXITSTATUS(status), kNotReached);
        std::printf("power cut at %ld of %ld calls\n", (at - 1) / stride, faults_.seen());
        EXPECT_GT(faults_.seen(), least);
        return;
      }
      ASSERT_EQ(WTERMSIG(status), SIGKILL);
    }
  }

  void PowerCutAtEveryCall(WriteFaults::Left left) {
    PowerCutAt(
        left, Stride(), kCallsOfALife,
        [this](Life& life) {
          const std::string id = life.Submit();
          testing::WriteText(bin_ + "/told.job", id);
          life.Await(id, JOB_STATE_AWAITING_PROMOTION);
          life.Promote(id);
          testing::WriteText(bin_ + "/told.promoted", "");
        },
        [this] {
          ASSERT_NO_FATAL_FAILURE(ExpectWhatWasTold());
          ExpectTheNextLifeEndsIt();
        },
        [this] { Clear(); });
  }

  void PowerCutAmongRefits(WriteFaults::Left left) {
    FakeCombining();
    ASSERT_EQ(InProcess([this](Life& life) { ToOneOffered(life); }), 0);
    Keep();
    const auto back = [this] {
      BringBack();
      faults_.Settle();
    };
    back();
    PowerCutAt(
        left, std::min(23L, Stride()), 2 * kCallsOfALife,
        [this](Life& life) { ToBothPromoted(life); }, [this] { ExpectTheNextLifeEndsAll(); }, back);
  }

  /// A client that frees space and asks again when it is told that there is none.
  void LiveOnAFullDisk(Life& life) {
    const std::jthread freeing([&](const std::stop_token& over) {  // what no client is told of
      while (!over.stop_requested() && !faults_.happened()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
      std::this_thread::sleep_for(kFullFor);
      if (faults_.happened()) faults_.Clear();
    });
    life.ask_again = [this, store = life.ask_again](const std::exception& e) {
      faults_.Clear();
      return store(e) || SaysFull(e.what());
    };
    const std::string id = life.Submit();
    life.Await(id, JOB_STATE_AWAITING_PROMOTION);  // it does not fail, but waits for space
    life.Promote(id);
  }

  void FullAtEveryCall(const std::string& path, long least) {
    const long stride = path.empty() ? Stride() : std::min(5L, Stride());
    for (long at = 1;; at += stride) {
      SCOPED_TRACE(at);
      faults_.Plan(WriteFault::kFull, at, kMayFindNoSpace, path);
      const int status = LiveWithFaults([this](Life& life) { LiveOnAFullDisk(life); });
      const long seen = faults_.seen();
      ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
      ASSERT_THAT(WEXITSTATUS(status), ::testing::AnyOf(0, kRefusedAtStart, kNotReached));
      faults_.Clear();
      ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsIt());
      EXPECT_EQ(Wrong(), "");
      if (HasFailure()) return;
      Clear();
      if (WEXITSTATUS(status) == kNotReached) {
        std::printf("full at %ld of %ld calls\n", (at - 1) / stride, seen);
        EXPECT_GT(seen, least);
        return;
      }
    }
  }

  WriteFaults faults_{dir_ / "faults", state_, program_invocation_short_name,
                      GROUSER_WRITE_FAULTS_LIBRARY};
  static constexpr int kNotReached = 20;
  static constexpr auto kFullFor = std::chrono::milliseconds(400);  // longer than a stage takes
  static constexpr long kCallsOfALife = 100;
};

TEST_F(WritesTest, PowerCutThatLeavesNothingUnsynced) {
  PowerCutAtEveryCall(WriteFaults::Left::kNothing);
}

TEST_F(WritesTest, PowerCutThatLeavesSomeOfIt) { PowerCutAtEveryCall(WriteFaults::Left::kSome); }

// Refits that are combined, from the second one on (restart: combine_kills_test.cc).
TEST_F(WritesTest, SlowPowerCutAmongRefitsThatLeavesNothingUnsynced) {
  PowerCutAmongRefits(WriteFaults::Left::kNothing);
}
TEST_F(WritesTest, SlowPowerCutAmongRefitsThatLeavesSomeOfIt) {
  PowerCutAmongRefits(WriteFaults::Left::kSome);
}

TEST_F(WritesTest, DiskFullAtAnyCall) { FullAtEveryCall("", kCallsOfALife); }

// Also where the store says that it failed, and has it all the same.
TEST_F(WritesTest, DiskFullAtAnySyncOfASubmission) {
  for (long at = 1; at <= 6; ++at) {
    SCOPED_TRACE(at);
    const int status = LiveWithFaults([&](Life& life) {
      faults_.Plan(WriteFault::kFull, at, testing::kSync, "/jobs");
      LiveOnAFullDisk(life);
    });
    ASSERT_EQ(status, 0);
    faults_.Clear();
    ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsIt());
    Clear();
  }
}

// What is small, such as the job store's rows, still finds space.
TEST_F(WritesTest, DiskFullForRunsAlone) { FullAtEveryCall("/runs/", 3); }
TEST_F(WritesTest, DiskFullForModelsAlone) { FullAtEveryCall("/models/", 10); }

// What a job waits for, others must not use: a worker's place.
TEST_F(WritesTest, WaitingForSpaceKeepsTheNumberOfWorkers) {
  testing::WriteText(bin_ + "/hold.run", "");
  faults_.Plan(WriteFault::kFull, 1, kMayFindNoSpace, "/spec.json");
  ASSERT_EQ(LiveWithFaults([this](Life& life) {
              for (const char* id : {"a", "b", "c"}) life.Submit(Request(id, 0.1 * id[0] - 9.4));
              std::this_thread::sleep_for(std::chrono::milliseconds(100));
              faults_.Clear();
              testing::Eventually([&] { return !DemStarts().empty(); });
              std::this_thread::sleep_for(std::chrono::milliseconds(300));
              if (DemStarts().size() != 1) throw std::runtime_error("more workers than one");
            }),
            0);
}

// However many workers there are, a job that the store refuses is tried once at a time.
TEST_F(WritesTest, RetriesDoNotMultiply) {
  workers_ = 2;
  testing::WriteText(bin_ + "/hold.run", "");
  ASSERT_EQ(InProcess([](Life& life) { life.Submit(); }), 0);  // ends queued
  faults_.Plan(WriteFault::kFull, 1, kMayFindNoSpace, "/jobs.sqlite");
  ::testing::internal::CaptureStdout();
  const int status =
      LiveWithFaults([](Life&) { std::this_thread::sleep_for(std::chrono::milliseconds(500)); });
  const std::string log = ::testing::internal::GetCapturedStdout();
  ASSERT_EQ(status, 0);
  int tries = 0;
  for (std::size_t at = 0; (at = log.find("next try", at)) != log.npos; ++at) ++tries;
  EXPECT_GT(tries, 1) << log;
  EXPECT_LE(tries, 60);  // one each 10 ms
  faults_.Clear();
  std::filesystem::remove(bin_ + "/hold.run");
  ExpectTheNextLifeEndsIt();
}

// However often stable moves, its candidates that cannot follow are looked at again once at a time.
TEST_F(WritesTest, CandidatesThatFollowStableAreTriedOnceAtATime) {
  constexpr int kMoves = 10;
  FakeCombining();
  ::testing::internal::CaptureStdout();
  const int status = LiveWithFaults([&](Life& life) {
    ToOneOffered(life);
    b_ = Submitted(life, Request("b", 0.2), "bbbb");
    WillFit(b_, base_digest_, {"aaaa", "bbbb"});
    life.AwaitEnd(b_);
    PromoteRequest canary;
    canary.set_job_id(a_);
    canary.set_alias("canary");
    life.Ask([&](JobsApp& app) { return app.Promote(canary, "a tester"); });
    faults_.Plan(WriteFault::kFull, 1, kMayFindNoSpace, "/jobs.sqlite");
    MoveAliasRequest move;
    move.set_model(std::string(kName) + "@canary");
    move.set_alias("stable");
    for (int i = 0; i < kMoves; ++i) {
      life.Ask([&](JobsApp& app) { return app.Move(move, "a tester"); });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
  });
  const std::string log = ::testing::internal::GetCapturedStdout();
  ASSERT_EQ(status, 0) << log;
  int tries = 0;
  for (std::size_t at = 0; (at = log.find("do not follow stable", at)) != log.npos; ++at) ++tries;
  EXPECT_GT(tries, kMoves) << log;
  EXPECT_LE(tries, 2 * kMoves + 3) << log;  // once a move, then after 10, 20, 40 ... ms
}

// A name that a killed program did not sync is there after a kill, but not after a power cut.
TEST_F(WritesTest, AKillAndThenAPowerCut) {
  std::mt19937 random(1);
  struct Second {
    const char* path;
    long at;
    const char* held;  ///< the stage of the power cut; empty: after the promotion
  };
  for (const auto& [path, at, held] : {Second{"/runs", 2, "hold.gate"}, {"/models", 6, ""}}) {
    SCOPED_TRACE(path);
    faults_.Plan(WriteFault::kKill, at, testing::kSync, path);
    ASSERT_TRUE(WIFSIGNALED(LiveWithFaults(ToTheEnd)));
    ASSERT_TRUE(AwaitNoWorkers());
    faults_.Clear();
    if (*held != 0) testing::WriteText(bin_ + "/" + held, "");
    LiveWithFaults([held](Life& life) {
      const std::string id = life.Submit();
      life.Await(id, *held != 0 ? JOB_STATE_VALIDATING : JOB_STATE_DONE);
      ::kill(::getpid(), SIGKILL);
    });
    ASSERT_TRUE(AwaitNoWorkers());
    faults_.CutPower(WriteFaults::Left::kNothing, random);
    const Job job = StoredJobs().at(0);
    if (*held == 0) {
      EXPECT_EQ(Repository(state_, shipped_).Resolve("cmu-smooth-62.5").digest,
                job.candidate_digest());
    }
    std::filesystem::remove(bin_ + "/hold.gate");
    ASSERT_NO_FATAL_FAILURE(ExpectTheNextLifeEndsIt());
    EXPECT_EQ(Wrong(), "");
    Clear();
  }
}

// Pruning is what helps on a full disk.
TEST_F(WritesTest, PruningOnAFullDisk) {
  constexpr int kJobs = 30;
  const std::string stray = state_ + "/runs/stray.run.h5";
  // A job that nobody promotes cannot end; when all rows are removed, the store cannot shrink.
  for (const long full_at : {1L, 1L + (1 + kJobs) + 1L}) {
    SCOPED_TRACE(full_at);
    const int status = LiveWithFaults([&](Life& life) {
      life.Await(life.Submit(), JOB_STATE_AWAITING_PROMOTION);
      testing::WriteText(bin_ + "/hold.run", "");
      for (int i = 0; i < kJobs; ++i) {
        const std::string request_id = "r" + std::to_string(i);
        CancelJobRequest cancel;
        cancel.set_job_id(life.Submit(Request(request_id, 0.4 + 0.001 * i)));
        cancel.set_request_id(request_id);
        life.Ask([&](JobsApp& app) { return app.Cancel(cancel); });
      }
      testing::WriteText(stray, "a run");
      faults_.Plan(WriteFault::kFull, full_at, testing::kCreate, "jobs.sqlite-journal");
      PruneRequest prune;
      prune.set_keep_days(1e-9);
      life.ask_again = [](const std::exception&) { return false; };
      const auto pruned = life.Ask([&](JobsApp& app) { return app.Prune(prune); });
      if (pruned.items_count() == 0) throw std::runtime_error("nothing pruned");
    });
    std::filesystem::remove(bin_ + "/hold.run");
    EXPECT_EQ(status, 0);
    EXPECT_TRUE(faults_.happened());
    EXPECT_FALSE(std::filesystem::exists(stray));
    faults_.Clear();
    Clear();
  }
}

// What was promoted and could not be stored is not promoted again over a later rollback.
TEST_F(WritesTest, ARollbackAfterAPromotionThatCouldNotBeStored) {
  ASSERT_EQ(LiveWithFaults([this](Life& life) {
              const std::string id = life.Submit();
              life.Await(id, JOB_STATE_AWAITING_PROMOTION);
              // The 1st stores the decision, the 2nd that it was carried out.
              faults_.Plan(WriteFault::kFull, 2, testing::kCreate, "jobs.sqlite-journal");
              life.ask_again = [](const std::exception&) { return false; };
              std::string said;
              try {
                life.Promote(id);
              } catch (const StatusError& e) {
                said = e.what();
              }
              if (!said.starts_with("the alias has moved"))
                throw std::runtime_error("said " + said);
              faults_.Clear();
              RollbackAliasRequest back;
              back.set_model("cmu-smooth-62.5");
              life.Ask([&](JobsApp& app) { return app.Rollback(back, "a tester"); });
              life.Await(id, JOB_STATE_DONE);
              std::this_thread::sleep_for(std::chrono::milliseconds(100));
            }),
            0);
  EXPECT_EQ(Repository(state_, shipped_).Resolve("cmu-smooth-62.5").digest, base_digest_);
}

TEST_F(WritesTest, APromotionThatFindsNoSpaceSaysWhatBecomesOfIt) {
  ASSERT_EQ(LiveWithFaults([this](Life& life) {
              const std::string id = life.Submit();
              life.Await(id, JOB_STATE_AWAITING_PROMOTION);
              life.ask_again = [](const std::exception&) { return false; };
              // Counted from the decision: neither can the alias file be written nor it be undone.
              faults_.Plan(WriteFault::kFull, 2, testing::kCreate, "s");
              std::string said;
              try {
                life.Promote(id);
              } catch (const StatusError& e) {
                said = e.what();
              }
              if (!said.starts_with("alias not moved yet") || !SaysFull(said)) {
                throw std::runtime_error("said " + said);
              }
              faults_.Clear();
              life.Await(id, JOB_STATE_DONE);
            }),
            0);
}

// What was decided first comes first.
TEST_F(WritesTest, APromotionComesAfterOneThatWaitsForSpace) {
  workers_ = 2;
  retry_s_ = 60;
  ASSERT_EQ(LiveWithFaults([this](Life& life) {
              auto as_first = Request("b");
              as_first.mutable_time_limit()->set_seconds(3600);  // else it joins the first
              const std::string first = life.Submit(), other = life.Submit(as_first);
              for (const std::string& id : {first, other}) {
                life.Await(id, JOB_STATE_AWAITING_PROMOTION);
              }
              life.ask_again = [](const std::exception&) { return false; };
              faults_.Plan(WriteFault::kFull, 2, testing::kCreate, "s");
              std::string said;
              const auto promote = [&](const std::string& id) {
                try {
                  life.Promote(id);
                  said = "promoted";
                } catch (const StatusError& e) {
                  said = e.what();
                }
              };
              promote(first);
              if (!said.starts_with("alias not moved yet")) throw std::runtime_error(said);
              faults_.Clear();
              promote(other);
              if (life.Get(first).job_state() != JOB_STATE_DONE) throw std::runtime_error(said);
            }),
            0);
}

}  // namespace
}  // namespace grouser::server

// Worker processes, their logs, and the lock that tells whether they live.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <fstream>
#include <optional>
#include <thread>

#include "proto/records/os/file_lock.h"
#include "server/jobs/worker_log.h"
#include "server/jobs/worker_pool.h"
#include "tests/unit/jobs/fake_workers.h"

namespace grouser::server {
namespace {

using os::HoldersOf;
using os::LockEvicting;
using os::TryLock;
using os::UniqueFd;
using testing::Eventually;
using ::testing::HasSubstr;
using testing::IsDead;
using testing::ReadText;
using testing::TempDir;
using testing::WriteText;

WorkerCommand Sh(const TempDir& dir, const std::string& script) {
  WorkerCommand command;
  command.argv = {"/bin/sh", "-c", script};
  command.folder = dir.path();
  command.stdout_path = dir / "stdout";
  command.log_path = dir / "log";
  return command;
}

pid_t PidIn(const std::string& path) {
  const std::string text = ReadText(path);
  return text.ends_with('\n') ? std::stoi(text) : 0;
}

TEST(WorkerProcess, HasNoDescriptorAboveTwo) {
  TempDir dir;
  // Inheritable descriptors, as careless libraries leave them.
  UniqueFd careless(::open("/dev/null", O_RDONLY));
  UniqueFd high(::fcntl(careless.get(), F_DUPFD, 200));
  ASSERT_EQ(::fcntl(high.get(), F_GETFD), 0);
  // Tested one by one: listing the folder would itself open a descriptor.
  auto worker = WorkerProcess::Spawn(
      Sh(dir,
         "n=0; while [ $n -le 300 ]; do [ -e /proc/$$/fd/$n ] && echo $n; n=$((n+1)); done; "
         "exit 0"));
  EXPECT_TRUE(worker.Reap().Exited(0));
  std::istringstream lines(ReadText(dir / "stdout"));
  int count = 0;
  for (int fd; lines >> fd; ++count) EXPECT_LE(fd, 2);
  EXPECT_EQ(count, 3);
}

// A child begins with the nice value of the thread that makes it.
TEST(WorkerProcess, NiceIsAddedUpTo19) {
  for (const int more : {0, 3, 6}) {
    std::thread([more] {
      const auto thread = static_cast<id_t>(::gettid());
      const int now = ::getpriority(PRIO_PROCESS, thread) + more;
      ASSERT_EQ(::setpriority(PRIO_PROCESS, thread, now), 0);
      TempDir dir;
      auto command = Sh(dir, "cut -d' ' -f19 /proc/$$/stat");
      command.limits.nice = 10;
      auto worker = WorkerProcess::Spawn(std::move(command));
      EXPECT_TRUE(worker.Reap().Exited(0));
      EXPECT_EQ(ReadText(dir / "stdout"), std::to_string(std::min(now + 10, 19)) + "\n");
    }).join();
  }
}

// Field 41 of /proc/PID/stat: 5 is SCHED_IDLE.
TEST(WorkerProcess, RunsOnIdleTimeAlone) {
  for (const bool idle : {false, true}) {
    TempDir dir;
    auto command = Sh(dir, "cut -d' ' -f41 /proc/$$/stat");
    command.limits.idle = idle;
    EXPECT_TRUE(WorkerProcess::Spawn(std::move(command)).Reap().Exited(0));
    EXPECT_EQ(ReadText(dir / "stdout"), std::to_string(idle ? SCHED_IDLE : SCHED_OTHER) + "\n");
  }
}

TEST(WorkerProcess, LeadsItsOwnSessionWithDefaultSignalsAndLowPriority) {
  TempDir dir;
  ::signal(SIGUSR1, SIG_IGN);
  auto command = Sh(dir,
                    "cat /proc/self/status /proc/self/limits; cut -d' ' -f6,19 /proc/$$/stat; "
                    "pwd; echo oops >&2");
  command.limits.nice = 10;
  command.limits.memory_bytes = 1 << 30;
  auto worker = WorkerProcess::Spawn(std::move(command));
  const std::string pid = std::to_string(worker.pid());
  EXPECT_TRUE(worker.Reap().Exited(0));
  ::signal(SIGUSR1, SIG_DFL);
  const std::string out = ReadText(dir / "stdout");
  EXPECT_THAT(out, HasSubstr("SigIgn:\t0000000000000000"));
  EXPECT_THAT(out, HasSubstr("SigBlk:\t0000000000000000"));
  EXPECT_THAT(out, ::testing::ContainsRegex("Max address space +1073741824 +1073741824"));
  const int nice = std::min(::getpriority(PRIO_PROCESS, 0) + 10, 19);
  EXPECT_THAT(out, HasSubstr("\n" + pid + " " + std::to_string(nice) + "\n")) << "session, nice";
  EXPECT_THAT(out, HasSubstr("\n" + dir.path() + "\n"));
  EXPECT_EQ(ReadText(dir / "log"), "oops\n");
}

TEST(WorkerProcess, TellsHowItEnded) {
  TempDir dir;
  EXPECT_TRUE(WorkerProcess::Spawn(Sh(dir, "exit 3")).Reap().Exited(3));
  const WorkerEnd killed = WorkerProcess::Spawn(Sh(dir, "kill -9 $$")).Reap();
  EXPECT_EQ(killed.signal, SIGKILL);
  EXPECT_FALSE(killed.Exited(0));
  EXPECT_THAT(killed.Text(), HasSubstr("signal 9"));
}

TEST(WorkerProcess, SaysWhyItCannotStart) {
  TempDir dir;
  auto command = Sh(dir, "true");
  command.argv[0] = dir / "no-such-program";
  try {
    WorkerProcess::Spawn(std::move(command));
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("no-such-program: No such file"));
  }
  auto lost = Sh(dir, "true");
  lost.folder = dir / "no-such-folder";
  EXPECT_THROW(WorkerProcess::Spawn(std::move(lost)), std::runtime_error);
}

TEST(WorkerProcess, ItsEndTakesItsChildrenAlong) {
  TempDir dir;
  auto worker = WorkerProcess::Spawn(Sh(dir, "sleep 1000 & echo $! > child; exit 0"));
  EXPECT_TRUE(worker.Reap().Exited(0));
  const pid_t child = PidIn(dir / "child");
  ASSERT_GT(child, 0);
  EXPECT_TRUE(Eventually([&] { return IsDead(child); }));
}

TEST(WorkerProcess, DiesWithItsParent) {
  TempDir dir;
  const pid_t parent = ::fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    auto worker = WorkerProcess::Spawn(Sh(dir, "echo $$ > pid; exec sleep 1000"));
    worker.Reap();
    ::_exit(0);
  }
  ASSERT_TRUE(Eventually([&] { return PidIn(dir / "pid") > 0; }));
  const pid_t worker = PidIn(dir / "pid");
  EXPECT_FALSE(IsDead(worker));
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  EXPECT_TRUE(Eventually([&] { return IsDead(worker); }));
}

TEST(FolderLock, LastsAsLongAsTheWorkerLives) {
  TempDir dir;
  UniqueFd lock = TryLock(dir / "lock");
  ASSERT_TRUE(lock.valid());
  EXPECT_FALSE(TryLock(dir / "lock").valid());
  auto command = Sh(dir, "exec sleep 1000");
  command.lock = std::move(lock);
  auto worker = WorkerProcess::Spawn(std::move(command));
  EXPECT_FALSE(TryLock(dir / "lock").valid());
  worker.SignalGroup(SIGTERM);
  EXPECT_EQ(worker.Reap().signal, SIGTERM);
  EXPECT_TRUE(TryLock(dir / "lock").valid());
}

TEST(FolderLock, AnOrphanIsFoundAndEnded) {
  TempDir dir;
  // A process that outlived its parent: it holds the lock as standard input
  // and has no death signal.
  const pid_t orphan = ::fork();
  ASSERT_GE(orphan, 0);
  if (orphan == 0) {
    UniqueFd lock = TryLock(dir / "lock");
    ::dup2(lock.get(), 0);
    lock.Reset();
    WriteText(dir / "ready", "1");
    for (;;) ::pause();
  }
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(dir / "ready"); }));
  EXPECT_THAT(HoldersOf(dir / "lock"), ::testing::ElementsAre(orphan));
  EXPECT_TRUE(LockEvicting(dir / "lock", 30).valid());
  int status = 0;
  ::waitpid(orphan, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
}

TEST(WorkerLog, ParsesProgressLines) {
  EXPECT_EQ(ParseProgress("progress 0.25 settling the tile"),
            (ProgressLine{0.25, "settling the tile"}));
  EXPECT_EQ(ParseProgress("progress 1"), (ProgressLine{1, ""}));
  EXPECT_EQ(ParseProgress("progress 0.5 eta=90 3 of 6"), (ProgressLine{0.5, "3 of 6", 90}));
  EXPECT_EQ(ParseProgress("progress 0.5 eta=1e3"), (ProgressLine{0.5, "", 1000}));
  for (const char* bad :
       {"progress", "progress x y", "progress 1.5 a", "progress -0.1 a", "progress nan a",
        "progress 0.5x", "progress 0.5 eta=-1 a", "progress 0.5 eta=x a", "progress 0.5 eta=nan a",
        "progress 0.5 eta=1x a", " progress 0.5 a", "other"}) {
    EXPECT_FALSE(ParseProgress(bad).has_value()) << bad;
  }
  EXPECT_EQ(ParseProgress("progress 0.5 \xff\x01")->stage, "??");
}

TEST(WorkerLog, TailSeesWholeLinesOnce) {
  TempDir dir;
  ProgressTail tail(dir / "log");
  EXPECT_FALSE(tail.Poll().has_value()) << "no file yet";
  std::ofstream out(dir / "log");
  out << "hello\nprogress 0.1 a\nprogress 0.2 b\nprogress 0.3" << std::flush;
  EXPECT_EQ(tail.Poll(), (ProgressLine{0.2, "b"}));
  EXPECT_FALSE(tail.Poll().has_value());
  out << "5 c\n" << std::flush;
  EXPECT_EQ(tail.Poll(), (ProgressLine{0.35, "c"}));
  out << std::string(100000, 'x') << "\nprogress 0.4 d\n" << std::flush;
  EXPECT_EQ(tail.Poll(), (ProgressLine{0.4, "d"}));
}

TEST(WorkerLog, LastWordsArePrintableAndBounded) {
  TempDir dir;
  WriteText(dir / "log", "progress 0.5 a\nbad \xff soil\n\nprogress 0.6 b\nno space\n");
  EXPECT_EQ(LastWords(dir / "log"), "bad ? soil | no space");
  WriteText(dir / "log", std::string(5000, 'y'));
  EXPECT_EQ(LastWords(dir / "log", 100), std::string(100, 'y'));
  EXPECT_EQ(LastWords(dir / "none"), "");
}

/// A pool on a loop of its own thread.
class WorkerPoolTest : public ::testing::Test {
 protected:
  WorkerPoolTest() : guard_(loop_.get_executor()), thread_([this] { loop_.run(); }) {}
  ~WorkerPoolTest() override {
    loop_.stop();
    thread_.join();
  }

  void MakePool(double grace_s) { pool_.emplace(loop_, grace_s); }
  void Start(WorkerCommand command) {
    pool_->Start("w", std::move(command),
                 {[this](const ProgressLine& line) { stage_ = line.stage; },
                  [this](const WorkerEnd& end) {
                    end_ = end;
                    ended_ = true;
                  }});
  }
  WorkerEnd Wait() {
    EXPECT_TRUE(Eventually([&] { return ended_.load(); }));
    return end_;
  }

  TempDir dir_;
  boost::asio::io_context loop_{1};
  std::optional<WorkerPool> pool_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_;
  std::string stage_;  // read after the end only
  WorkerEnd end_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

TEST_F(WorkerPoolTest, ReportsProgressAndTheEnd) {
  MakePool(5);
  // Ends when the test has seen that progress is followed while it runs.
  Start(Sh(dir_, "echo progress 0.5 rolling >&2; sleep 1; exit 4"));
  EXPECT_TRUE(Wait().Exited(4));
  EXPECT_EQ(stage_, "rolling");
}

TEST_F(WorkerPoolTest, TerminateIsKindFirst) {
  MakePool(50);
  Start(Sh(dir_, "trap 'exit 7' TERM; echo > ready; while :; do sleep 0.01; done"));
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(dir_ / "ready"); }));
  pool_->Terminate("w");
  EXPECT_TRUE(Wait().Exited(7));
}

TEST_F(WorkerPoolTest, TerminateIsHardAfterTheGrace) {
  MakePool(0.05);
  Start(Sh(dir_, "trap '' TERM; echo > ready; while :; do sleep 0.01; done"));
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(dir_ / "ready"); }));
  pool_->Terminate("w");
  EXPECT_EQ(Wait().signal, SIGKILL);
}

TEST_F(WorkerPoolTest, TimeLimitEndsAHangingWorker) {
  MakePool(5);
  auto command = Sh(dir_, "exec sleep 1000");
  command.timeout_s = 0.05;
  Start(std::move(command));
  EXPECT_TRUE(Wait().timed_out);
}

TEST_F(WorkerPoolTest, AMissingProgramIsAnEndLikeOthers) {
  MakePool(5);
  auto command = Sh(dir_, "");
  command.argv = {dir_ / "nothing"};
  Start(std::move(command));
  EXPECT_THAT(Wait().Text(), HasSubstr("could not be started"));
}

}  // namespace
}  // namespace grouser::server

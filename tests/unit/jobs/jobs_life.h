#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <cstdio>
#include <functional>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "proto/records/os/no_space.h"
#include "server/core/status.h"
#include "server/jobs/job_state.h"
#include "server/jobs/jobs_app.h"
#include "tests/unit/jobs/fake_workers.h"

namespace grouser::server::testing {

/// grouser-jobs without gRPC: the app, its event loop, a client that asks.
class Life {
 public:
  explicit Life(const JobsOptions& options)
      : guard_(boost::asio::make_work_guard(loop_)),
        app_(options, loop_),
        thread_([this] { loop_.run(); }) {
    app_.Start();
  }

  ~Life() {
    loop_.stop();
    if (thread_.joinable()) thread_.join();
  }

  /// Whether a client asks again after an error; after one of the store if nothing else is said.
  std::function<bool(const std::exception&)> ask_again = [](const std::exception& e) {
    const auto* status = dynamic_cast<const StatusError*>(&e);
    return dynamic_cast<const SqliteError*>(&e) != nullptr ||
           (status != nullptr && status->code() == StatusCode::kUnavailable);
  };

  /// Runs `request` where requests run.
  template <typename Run>
  auto Ask(Run request) {
    for (;;) {
      std::promise<decltype(request(app_))> answer;
      app_.thread().Post([&] {
        try {
          answer.set_value(request(app_));
        } catch (...) {
          answer.set_exception(std::current_exception());
        }
      });
      try {
        return answer.get_future().get();
      } catch (const std::exception& e) {
        if (!ask_again(e)) throw;
      }
    }
  }

  std::string Submit(const v1alpha1::SubmitRefinementRequest& request = Request("a")) {
    return Ask([&](JobsApp& app) { return app.Submit(request, "a tester").job().job_id(); });
  }
  void Await(const std::string& job_id, v1alpha1::JobState state) {
    v1alpha1::Job job;
    const bool there = Eventually([&] {
      job = Get(job_id);
      return job.job_state() == state || HasEnded(job.job_state());
    });
    if (!there || (job.job_state() != state && job.job_state() != v1alpha1::JOB_STATE_DONE)) {
      throw std::runtime_error("waiting for " + ShortName(state) + ", job is " +
                               ShortName(job.job_state()) + ": " + job.message());
    }
  }
  /// Until nothing more is done at it.
  void AwaitEnd(const std::string& job_id) {
    Eventually([&] {
      const auto state = Get(job_id).job_state();
      return HasEnded(state) || state == v1alpha1::JOB_STATE_AWAITING_PROMOTION;
    });
  }
  v1alpha1::Job Get(const std::string& job_id) {
    v1alpha1::GetJobRequest request;
    request.set_job_id(job_id);
    return Ask([&](JobsApp& app) { return app.Get(request).job(); });
  }
  void Promote(const std::string& job_id, const std::string& looked_at = "") {
    v1alpha1::PromoteRequest request;
    request.set_job_id(job_id);
    request.set_candidate_digest(looked_at);
    Ask([&](JobsApp& app) { return app.Promote(request, "a tester"); });
  }
  /// As SIGTERM.
  void Stop() {
    app_.Stop([this] { loop_.stop(); });
    thread_.join();
  }

 private:
  boost::asio::io_context loop_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_;
  JobsApp app_;
  std::thread thread_;
};

/// Lives of one state folder, with fake workers.
class LivesTest : public ::testing::Test, protected FakeWorkers {
 protected:
  LivesTest() {
    Prepare(Request("a"));
    LetDemGo();
  }

  JobsOptions Options() const {
    JobsOptions options;
    options.state_dir = state_;
    options.shipped_dir = shipped_;
    options.scheduler.bin_dir = bin_;
    options.scheduler.workers = workers_;
    options.scheduler.limits.memory_bytes = 0;
    options.scheduler.limits.nice = 0;
    options.scheduler.retry_s = retry_s_;
    options.prune.settle_s = 0;
    return options;
  }

  /// One life of the program in a process of its own, so that it can be killed and what it breaks
  /// ends nothing else: `before`, `live`, a stop, and exit with what `after` says. Returns what
  /// waitpid tells.
  int InProcess(
      const std::function<void(Life&)>& live, const std::function<void()>& before = [] {},
      const std::function<int()>& after = [] { return 0; }) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      try {
        before();
        Life life(Options());
        live(life);
        life.Stop();
        ::_exit(after());
      } catch (const SqliteError&) {
        ::_exit(kRefusedAtStart);
      } catch (const os::NoSpace&) {
        ::_exit(kRefusedAtStart);
      } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        ::_exit(1);
      }
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
  }

  static void ToTheEnd(Life& life) {
    const std::string id = life.Submit();
    life.Await(id, v1alpha1::JOB_STATE_AWAITING_PROMOTION);
    life.Promote(id);
  }

  /// The next start must end the job, whatever went before.
  void ExpectTheNextLifeEndsIt() {
    const int status = InProcess(ToTheEnd);
    ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
    ASSERT_EQ(WEXITSTATUS(status), 0);
    const auto jobs = StoredJobs();
    ASSERT_EQ(jobs.size(), 1u);
    EXPECT_EQ(ShortName(jobs[0].job_state()), "DONE") << jobs[0].message();
    const Repository repository(state_, shipped_);
    EXPECT_EQ(repository.Resolve("cmu-smooth-62.5").digest, jobs[0].candidate_digest());
    int promotions = 0;
    for (const auto& move : repository.ReadAliases().history) promotions += move.alias == "stable";
    EXPECT_EQ(promotions, 1);
    EXPECT_LE(DemStarts().size(), 2u);
  }

  std::vector<v1alpha1::Job> StoredJobs() const {
    return *JobStore(state_ + "/jobs/jobs.sqlite").List(10);
  }

  /// Forgets all but the fakes.
  void Clear() {
    for (const auto& entry : std::filesystem::directory_iterator(state_)) {
      std::filesystem::remove_all(entry.path());
    }
    std::filesystem::remove(bin_ + "/dem.started");
  }

  int workers_ = 1;
  double retry_s_ = 0.01;
  static constexpr int kRefusedAtStart = 21;
};

}  // namespace grouser::server::testing

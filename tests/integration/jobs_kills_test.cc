// grouser-jobs and its workers are killed or stopped at every state of a job and of a promotion,
// half of the times with a power cut after it. GROUSER_KILLS: how many times.
#include <signal.h>

#include <array>
#include <cstdlib>
#include <map>
#include <set>

#include "server/core/alias_file.h"
#include "tests/integration/jobs_harness.h"
#include "tests/unit/jobs/write_faults.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::Eventually;
using ::testing::HasSubstr;
using testing::Request;
using testing::WriteFault;
using testing::WriteFaults;

constexpr char kName[] = "cmu-smooth-62.5";

/// What is under way when the kill comes.
enum class Asked { kNothing, kSubmit, kGoOn, kCancel, kPromote, kCanary, kRollback, kPrune };

/// A moment to be killed at: in a state, or at a call that writes while something is under way.
struct Moment {
  const char* name;
  const char* held;  ///< the stage that waits until then; empty: none
  JobState state;    ///< reached before
  Asked asked;
  unsigned calls = testing::kAnyCall;
  const char* path = "";
  long at = 0;  ///< of these calls; 0: any of the first 40, or in the state itself
};

constexpr JobState kNone = JOB_STATE_UNSPECIFIED;
constexpr JobState kAwaits = JOB_STATE_AWAITING_PROMOTION;
constexpr Moment kMoments[] = {
    {"being submitted", "", kNone, Asked::kSubmit},
    {"QUEUED", "run", JOB_STATE_QUEUED, Asked::kGoOn},
    {"RUNNING", "run", JOB_STATE_RUNNING, Asked::kGoOn},
    {"RUNNING, run on disk", "ran", JOB_STATE_RUNNING, Asked::kGoOn},
    {"FITTING", "refit", JOB_STATE_FITTING, Asked::kGoOn},
    {"VALIDATING", "gate", JOB_STATE_VALIDATING, Asked::kGoOn},
    {"candidate offered", "gate", JOB_STATE_VALIDATING, Asked::kGoOn, testing::kRename, "aliases",
     1},
    {"AWAITING_PROMOTION", "", kAwaits, Asked::kPromote},
    {"DONE", "", JOB_STATE_DONE, Asked::kNothing},
    {"FAILED", "run", JOB_STATE_FAILED, Asked::kNothing},
    {"CANCELLED", "run", JOB_STATE_RUNNING, Asked::kCancel},
    {"promotion decided", "", kAwaits, Asked::kPromote, testing::kCreate, "aliases", 1},
    {"alias written aside", "", kAwaits, Asked::kPromote, testing::kRename, "aliases", 1},
    {"alias renamed", "", kAwaits, Asked::kPromote, testing::kSync, "/models", 2},
    {"alias moved", "", kAwaits, Asked::kPromote, testing::kCreate, "-journal", 2},
    {"promotion written", "", kAwaits, Asked::kPromote, testing::kRemove, "-journal", 2},
    {"canary moved", "", kAwaits, Asked::kCanary},
    {"rolled back", "", kAwaits, Asked::kRollback},
    {"pruning", "", kAwaits, Asked::kPrune},
};
constexpr std::array<std::pair<const char*, JobState>, 4> kWorkers = {
    {{"run", JOB_STATE_RUNNING},
     {"ran", JOB_STATE_RUNNING},
     {"refit", JOB_STATE_FITTING},
     {"gate", JOB_STATE_VALIDATING}}};

class JobsKillsTest : public testing::JobsTest {
 protected:
  JobsKillsTest() {
    FakeCarefully();
    LetDemGo();
    stable_ = base_digest_;
  }

  void Start() {
    faults_.Clear();
    faults_.Enter();
    StartJobs({"--settle-s", "0", "--nice", "0"});
    WriteFaults::Leave();
  }
  void Hold(const std::string& stage) {
    if (!stage.empty()) testing::WriteText(bin_ + "/hold." + stage, "");
  }
  void Release() {
    for (const char* file : {"hold.run", "hold.ran", "hold.refit", "hold.gate", "fail.run"}) {
      std::filesystem::remove(bin_ + "/" + file);
    }
  }

  JobState StateOf(const std::string& job_id) {
    grpc::ClientContext context;
    GetJobRequest request;
    request.set_job_id(job_id);
    GetJobResponse response;
    return stub_->GetJob(&context, request, &response).ok() ? response.job().job_state() : kNone;
  }
  bool Reaches(const std::string& job_id, JobState state) {
    return Eventually([&] { return StateOf(job_id) == state; });
  }

  SubmitRefinementRequest NewRequest() {
    ++asked_;
    return Request("request" + std::to_string(asked_), 0.3 + 1e-4 * asked_);
  }
  /// Submits until it is answered; what was told before must hold. Its workers' results are then
  /// there.
  Job Told(const SubmitRefinementRequest& request) {
    const Job job = Submitted(request);
    const auto [known, added] = told_.try_emplace(request.request_id(), job.job_id());
    EXPECT_EQ(known->second, job.job_id()) << "an acknowledged job is lost";
    const std::string own = bin_ + "/prepared." + job.job_id();
    if (std::filesystem::exists(own + ".model")) return job;
    base_digest_ = job.model().substr(job.model().find(':') + 1);
    Prepare(request, RUN_STATUS_STEADY, "run" + request.request_id());
    std::filesystem::rename(bin_ + "/prepared.run.h5", own + ".run.h5");
    std::filesystem::rename(bin_ + "/prepared.model", own + ".model");
    return job;
  }

  /// Answered or not: the program may be killed meanwhile.
  void Ask(Asked asked, const SubmitRefinementRequest& request, const std::string& job_id) {
    grpc::ClientContext context;
    if (asked == Asked::kSubmit) {
      SubmitRefinementResponse response;
      if (stub_->SubmitRefinement(&context, request, &response).ok()) {
        told_[request.request_id()] = response.job().job_id();
      }
    } else if (asked == Asked::kCancel) {
      Job job;
      if (Cancel(job_id, request.request_id(), &job).ok()) ended_[job_id] = job.job_state();
    } else if (asked == Asked::kPromote) {
      AskPromote(job_id);
    } else if (asked == Asked::kPrune) {
      PruneRequest prune;
      prune.set_max_disk_mb(1);
      PruneResponse response;
      ended_.clear();  // may go
      asked_ok_ = stub_->Prune(&context, prune, &response).ok();
    } else if (asked == Asked::kCanary || asked == Asked::kRollback) {
      MoveAliasResponse response;
      if (asked == Asked::kCanary) {
        MoveAliasRequest move;
        move.set_model(std::string(kName) + "@stable");
        move.set_alias("canary");
        asked_ok_ = stub_->MoveAlias(&context, move, &response).ok();
      } else {
        RollbackAliasRequest back;
        back.set_model(kName);
        back.set_to(before_);  // asking twice does nothing more
        may_be_stable_ = before_;
        asked_ok_ = stub_->RollbackAlias(&context, back, &response).ok();
        if (asked_ok_) stable_ = before_;
      }
    }
  }
  void AskPromote(const std::string& job_id) {
    PromoteRequest request;
    request.set_job_id(job_id);
    PromoteResponse response;
    may_be_stable_ = candidate_;
    asked_ok_ = Promote(request, &response).ok();
    if (!asked_ok_) return;
    if (stable_ != candidate_) before_ = stable_;
    stable_ = candidate_;
    ended_[job_id] = JOB_STATE_DONE;
  }

  /// Kills the program at the moment, or right after where it never came.
  void KillAt(const Moment& moment, int signal) {
    const SubmitRefinementRequest request = NewRequest();
    Hold(moment.held);
    std::string id, other;
    SubmitRefinementRequest first;
    if (moment.state == JOB_STATE_QUEUED) {
      first = NewRequest();
      other = Told(first).job_id();
      ASSERT_TRUE(Reaches(other, JOB_STATE_RUNNING));
    }
    if (moment.state == JOB_STATE_FAILED) testing::WriteText(bin_ + "/fail.run", "");
    const JobState before = moment.state == JOB_STATE_DONE ? kAwaits : moment.state;
    if (moment.asked != Asked::kSubmit) {
      id = Told(request).job_id();
      if (before == JOB_STATE_FAILED) std::filesystem::remove(bin_ + "/hold.run");
      ASSERT_TRUE(Reaches(id, before));
      if (std::string(moment.held) == "ran") {
        ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(bin_ + "/run." + id); }));
      }
      if (before == kAwaits) candidate_ = Get(id).candidate_digest();
      if (moment.state == JOB_STATE_FAILED) ended_[id] = JOB_STATE_FAILED;
      if (moment.state == JOB_STATE_DONE || moment.asked == Asked::kRollback) AskPromote(id);
    }
    const bool in_state = moment.at == 0 && moment.asked != Asked::kSubmit && random_() % 2 == 0;
    if (!in_state && moment.asked != Asked::kNothing) {
      faults_.Plan(signal == SIGKILL ? WriteFault::kKill : WriteFault::kTerm,
                   moment.at != 0 ? moment.at : 1 + static_cast<long>(random_() % 40), moment.calls,
                   moment.path);
      if (moment.asked == Asked::kGoOn) {
        Release();
        Eventually([&] { return faults_.happened() || StateOf(id) == kAwaits; });
      } else {
        Ask(moment.asked, request, id);
      }
    }
    const bool came = !in_state && moment.asked != Asked::kNothing && faults_.happened();
    if (!came) faults_.Clear();
    EXPECT_TRUE(came || moment.at == 0) << "the moment never came";
    const WorkerEnd end = StopJobs(came ? 0 : signal);
    EXPECT_TRUE(signal == SIGKILL ? end.signal == SIGKILL : end.Exited(0)) << end.Text();
    ASSERT_TRUE(AwaitNoWorkers());
    Release();
    const bool power_cut = random_() % 2 == 0;
    ++kills_[moment.name][(signal == SIGKILL ? 1 : 0)];
    if (power_cut) {
      ++kills_[moment.name][2];
      faults_.CutPower(random_() % 2 == 0 ? WriteFaults::Left::kNothing : WriteFaults::Left::kSome,
                       random_);
    }
    CheckAliases();
    ASSERT_NO_FATAL_FAILURE(Start());
    if (!other.empty()) {
      Told(first);
      Ask(Asked::kCancel, first, other);
    }
    ASSERT_NO_FATAL_FAILURE(End(moment, request));
  }

  /// What was asked is brought to its end, and what was told before is so.
  void End(const Moment& moment, const SubmitRefinementRequest& request) {
    if (moment.state == JOB_STATE_FAILED) testing::WriteText(bin_ + "/fail.run", "");
    const std::string id = Told(request).job_id();
    const bool promotes = moment.asked == Asked::kPromote || moment.state == JOB_STATE_DONE ||
                          moment.asked == Asked::kRollback;
    if (moment.state == JOB_STATE_FAILED) {
      EXPECT_TRUE(Reaches(id, JOB_STATE_FAILED));
    } else if (!ended_.contains(id)) {
      if (promotes) {
        ASSERT_TRUE(
            Eventually([&] { return StateOf(id) == kAwaits || StateOf(id) == JOB_STATE_DONE; }));
        AskPromote(id);
        EXPECT_TRUE(asked_ok_);
      } else if (moment.asked != Asked::kCancel) {
        ASSERT_TRUE(Reaches(id, kAwaits)) << StateOf(id);
      }
    }
    if (moment.asked == Asked::kRollback || moment.asked == Asked::kCanary ||
        moment.asked == Asked::kPrune) {
      Ask(moment.asked, request, id);
      EXPECT_TRUE(asked_ok_);
    }
    if (!promotes && moment.state != JOB_STATE_FAILED) {
      Ask(Asked::kCancel, request, id);
      EXPECT_EQ(ended_[id], JOB_STATE_CANCELLED);
    }
    Release();
    may_be_stable_ = stable_;
    CheckAliases();
    CheckEnded();
    EXPECT_EQ(Wrong(), "");
    ForgetWorkers();
  }
  /// Their numbers are used again.
  void ForgetWorkers() {
    EXPECT_TRUE(AwaitNoWorkers());
    for (const auto& entry : std::filesystem::directory_iterator(bin_)) {
      if (entry.path().filename().string().starts_with("pids.")) {
        std::filesystem::remove(entry.path());
      }
    }
  }

  void CheckAliases() {
    const auto aliases = repository().ReadStateAliases();
    std::uint64_t last = 0;
    for (const AliasMove& move : aliases.history) {
      EXPECT_GT(move.generation, last);
      last = move.generation;
    }
    EXPECT_EQ(aliases.generation, last);
    const std::string stable = repository().Resolve(kName).digest;  // reads it whole
    EXPECT_TRUE(stable == stable_ || stable == may_be_stable_)
        << stable << ", told was " << stable_ << ", asked for " << may_be_stable_;
    stable_ = stable;
  }
  void CheckEnded() {
    std::map<std::string, JobState> known;
    ListJobsRequest list;
    list.set_page_size(500);
    ListJobsResponse page;
    do {
      grpc::ClientContext context;
      ASSERT_TRUE(stub_->ListJobs(&context, list, &page).ok());
      for (const Job& job : page.jobs()) {
        EXPECT_TRUE(known.emplace(job.job_id(), job.job_state()).second);
      }
      list.set_page_token(page.next_page_token());
    } while (!page.next_page_token().empty());
    for (const auto& [id, state] : ended_) {
      EXPECT_TRUE(known.contains(id)) << id << ": an acknowledged job is lost";
      EXPECT_EQ(known[id], state) << id;
    }
  }

  /// Kills a worker; the program goes on and the job comes to its end.
  void KillWorkerAt(const std::string& stage, JobState state, int signal) {
    const SubmitRefinementRequest request = NewRequest();
    Hold(stage);
    const std::string id = Told(request).job_id();
    ASSERT_TRUE(Reaches(id, state));
    ASSERT_TRUE(
        Eventually([&] { return stage != "ran" || std::filesystem::exists(bin_ + "/run." + id); }));
    pid_t worker = 0;
    ASSERT_TRUE(Eventually([&] {  // of this stage: those before have ended
      std::istringstream in(testing::ReadText(bin_ + "/pids." + id));
      for (pid_t pid; in >> pid;) worker = pid;
      return worker != 0 && !testing::IsDead(worker);
    }));
    ::kill(worker, signal);
    ASSERT_TRUE(Eventually([&] { return testing::IsDead(worker); }));
    ++kills_["worker at " + stage][signal == SIGKILL ? 1 : 0];
    Release();
    ASSERT_TRUE(Reaches(id, kAwaits));
    Ask(Asked::kCancel, request, id);
    EXPECT_EQ(Wrong(), "");
    ForgetWorkers();
  }

  void Print() const {
    std::printf("%-24s %8s %8s %20s\n", "killed at", "SIGTERM", "SIGKILL", "of them power cuts");
    std::array<int, 3> sum{};
    for (const auto& [name, of] : kills_) {
      std::printf("%-24s %8d %8d %20d\n", name.c_str(), of[0], of[1], of[2]);
      for (std::size_t i = 0; i < 3; ++i) sum[i] += of[i];
    }
    std::printf("%-24s %8d %8d %20d\n", "all", sum[0], sum[1], sum[2]);
  }

  WriteFaults faults_{dir_ / "faults", state_, "grouser-jobs", GROUSER_WRITE_FAULTS_LIBRARY};
  std::mt19937 random_{19};
  int asked_ = 0;
  bool asked_ok_ = false;
  std::map<std::string, std::string> told_;  ///< job by request
  std::map<std::string, JobState> ended_;    ///< as a client was told
  std::string stable_, before_, candidate_, may_be_stable_;
  std::map<std::string, std::array<int, 3>> kills_;  ///< SIGTERM, SIGKILL; of them power cuts
};

TEST_F(JobsKillsTest, NothingIsLostOrDoneTwice) {
  const char* asked = std::getenv("GROUSER_KILLS");
  constexpr std::size_t kAll = std::size(kMoments) + kWorkers.size();
  const std::size_t kills = asked != nullptr ? std::stoul(asked) : kAll;
  ASSERT_NO_FATAL_FAILURE(Start());
  for (std::size_t i = 0; i < kills && !HasFailure(); ++i) {
    const std::size_t n = i % kAll;
    const int signal = (n + i / kAll) % 2 == 0 ? SIGTERM : SIGKILL;  // each moment by both in turn
    if (n < std::size(kMoments)) {
      SCOPED_TRACE(std::to_string(i) + ": " + kMoments[n].name);
      KillAt(kMoments[n], signal);
    } else {
      const auto& [stage, state] = kWorkers[n - std::size(kMoments)];
      SCOPED_TRACE(std::to_string(i) + ": worker at " + stage);
      KillWorkerAt(stage, state, signal);
    }
  }
  Print();
}

// By gRPC a full disk is RESOURCE_EXHAUSTED, and says so.
TEST_F(JobsKillsTest, AFullDiskIsToldAndOver) {
  ASSERT_NO_FATAL_FAILURE(Start());
  const SubmitRefinementRequest request = NewRequest();
  SubmitRefinementResponse response;
  faults_.Plan(WriteFault::kFull, 1, testing::kWrite, "jobs.sqlite");
  auto status = Submit(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(),
              HasSubstr("nothing was changed: job store: database or disk is full"));
  faults_.Clear();
  const std::string id = Told(request).job_id();
  ASSERT_TRUE(Reaches(id, kAwaits));
  PromoteRequest promote;
  promote.set_job_id(id);
  PromoteResponse promoted;
  faults_.Plan(WriteFault::kFull, 1, testing::kWrite, "aliases");
  status = Promote(promote, &promoted);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("aliases.json: cannot write: No space left"));
  faults_.Clear();
  EXPECT_TRUE(Promote(promote, &promoted).ok());
}

}  // namespace
}  // namespace grouser::server

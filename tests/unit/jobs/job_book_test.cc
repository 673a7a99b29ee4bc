#include "server/jobs/job_book.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "server/core/status.h"
#include "server/jobs/job_state.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::BaseModel;
using testing::Request;

constexpr char kModel[] = "cmu-smooth-62.5@sha256:aa";

class JobBookTest : public ::testing::Test {
 protected:
  JobBookTest() { Reopen(); }

  void Reopen(std::size_t max_queued = 8) {
    book_.reset();
    store_.reset();
    store_ = std::make_unique<JobStore>(dir_ / "jobs.sqlite");
    book_ = std::make_unique<JobBook>(
        *store_, max_queued, [this] { return now_; },
        [this](const Job& job) { heard_.push_back(job); });
  }

  SubmitJobResponse Submit(const SubmitRefinementRequest& request,
                           const std::string& client = "someone") {
    const auto spec = BuildSpec(BaseModel(), request);
    return book_->Submit(request.request_id(), ContentOf(request),
                         RowOf(request, "cmu-smooth-62.5", "aa", spec), client);
  }

  std::optional<SubmitJobResponse> Replayed(const SubmitRefinementRequest& request) {
    return book_->Replay(request.request_id(), ContentOf(request));
  }

  bool MoveTo(const std::string& id, std::uint64_t epoch, JobState state) {
    const auto edit = [&](JobRow& row) { row.job.set_job_state(state); };
    return book_->Change(id, epoch, edit).has_value();
  }

  template <typename Run>
  static StatusCode CodeOf(Run run) {
    try {
      run();
    } catch (const StatusError& e) {
      return e.code();
    }
    ADD_FAILURE() << "no StatusError";
    return StatusCode::kInternal;
  }

  testing::TempDir dir_;
  double now_ = 1000;
  std::vector<Job> heard_;
  std::unique_ptr<JobStore> store_;
  std::unique_ptr<JobBook> book_;
};

TEST_F(JobBookTest, SubmissionIsIdempotentAlsoAfterARestart) {
  const auto first = Submit(Request("a"));
  EXPECT_FALSE(first.joined());
  EXPECT_EQ(first.job().job_state(), JOB_STATE_QUEUED);
  EXPECT_EQ(first.job().subscribers(), 1u);
  EXPECT_EQ(first.job().lease_epoch(), 1u);
  EXPECT_EQ(first.job().seed(), 7u);

  Reopen();
  const auto again = Submit(Request("a"));
  EXPECT_EQ(again.job().job_id(), first.job().job_id());
  EXPECT_FALSE(again.joined());
  EXPECT_EQ(again.job().subscribers(), 1u);
  EXPECT_EQ(book_->List({}).jobs_size(), 1);
}

TEST_F(JobBookTest, SameRequestIdWithOtherContentIsRefused) {
  Submit(Request("a", 0.35));
  EXPECT_EQ(CodeOf([&] { Submit(Request("a", 0.36)); }), StatusCode::kAlreadyExists);
  EXPECT_EQ(book_->List({}).jobs_size(), 1);
}

TEST_F(JobBookTest, EqualWorkIsJoinedAndCancelledWhenNoneIsLeft) {
  const auto first = Submit(Request("a"));
  const auto second = Submit(Request("b"));
  EXPECT_TRUE(second.joined());
  EXPECT_EQ(second.job().job_id(), first.job().job_id());
  EXPECT_EQ(second.job().subscribers(), 2u);
  EXPECT_NE(Submit(Request("c", 0.1)).job().job_id(), first.job().job_id());

  const std::string& id = first.job().job_id();
  EXPECT_EQ(book_->Cancel(id, "a").job_state(), JOB_STATE_QUEUED);
  EXPECT_EQ(book_->Cancel(id, "a").subscribers(), 1u) << "a subscription is withdrawn once";
  Reopen();
  const Job gone = book_->Cancel(id, "b");
  EXPECT_EQ(gone.job_state(), JOB_STATE_CANCELLED);
  EXPECT_EQ(gone.lease_epoch(), 2u) << "a worker's late result must be stale";
  EXPECT_FALSE(book_->FindOpen(id).has_value());
  EXPECT_EQ(book_->Cancel(id, "b").job_state(), JOB_STATE_CANCELLED);
  EXPECT_FALSE(Submit(Request("d")).joined()) << "an ended job is not joined";
}

TEST_F(JobBookTest, CancelKnowsWhoseSubscriptionItIs) {
  const auto first = Submit(Request("a", 0.1));
  Submit(Request("b", 0.2));
  const std::string id = first.job().job_id();
  EXPECT_EQ(CodeOf([&] { book_->Cancel(id, "b"); }), StatusCode::kNotFound);
  EXPECT_EQ(CodeOf([&] { book_->Cancel(id, "nobody"); }), StatusCode::kNotFound);
  EXPECT_EQ(CodeOf([&] { book_->Cancel("job-0", "a"); }), StatusCode::kNotFound);
  EXPECT_EQ(CodeOf([&] { book_->Get("job-0"); }), StatusCode::kNotFound);
  EXPECT_EQ(book_->Get(id).subscribers(), 1u);
}

TEST_F(JobBookTest, FullQueueRefusesNewWorkButNotJoiningOrReplay) {
  Reopen(2);
  Submit(Request("a", 0.1));
  Submit(Request("b", 0.2));
  EXPECT_EQ(CodeOf([&] { Submit(Request("c", 0.3)); }), StatusCode::kResourceExhausted);
  EXPECT_TRUE(Submit(Request("d", 0.1)).joined());
  EXPECT_NO_THROW(Submit(Request("a", 0.1)));
  // What was refused has left nothing behind.
  EXPECT_FALSE(Replayed(Request("c", 0.3)).has_value());
}

TEST_F(JobBookTest, OneClientsJobsNeverRefuseAnothers) {
  Reopen(2);
  double slip = 0.01;
  const auto fill = [&](const std::string& client, int jobs) {
    for (int i = 0; i < jobs; ++i) {
      Submit(Request(client + std::to_string(i), slip += 0.01), client);
    }
  };
  fill("greedy", 2);
  EXPECT_EQ(CodeOf([&] { Submit(Request("g", 0.9), "greedy"); }), StatusCode::kResourceExhausted);
  EXPECT_NO_THROW(fill("modest", 2));
  for (std::size_t i = 2; i < JobBook::kMostClients; ++i) fill("client" + std::to_string(i), 2);
  EXPECT_NO_THROW(fill("late", 1)) << "the whole queue is full of others' jobs";
  EXPECT_EQ(CodeOf([&] { Submit(Request("l", 0.9), "late"); }), StatusCode::kResourceExhausted);
  Reopen(2);
  EXPECT_EQ(CodeOf([&] { Submit(Request("m", 0.9), "modest"); }), StatusCode::kResourceExhausted)
      << "whose a job is outlasts a restart";
}

TEST_F(JobBookTest, ClientsTakeTurnsAndPriorityOrdersAClientsOwn) {
  const auto submit = [&](const std::string& id, double slip, const std::string& client,
                          int priority) {
    auto request = Request(id, slip);
    request.set_priority(priority);
    return Submit(request, client).job().job_id();
  };
  const std::string a1 = submit("a1", 0.1, "a", 0), a2 = submit("a2", 0.2, "a", 5),
                    a3 = submit("a3", 0.3, "a", 5), b1 = submit("b1", 0.4, "b", -10);
  std::vector<std::string> order;
  while (const auto next = book_->NextQueued()) {
    order.push_back(next->job.job_id());
    MoveTo(order.back(), 1, JOB_STATE_RUNNING);
    MoveTo(order.back(), 1, JOB_STATE_FAILED);
  }
  EXPECT_THAT(order, ::testing::ElementsAre(a2, b1, a3, a1));
  // While one of a's runs, b's go first, however long they waited.
  const std::string busy = submit("a4", 0.5, "a", 0), a5 = submit("a5", 0.6, "a", 10);
  MoveTo(busy, 1, JOB_STATE_RUNNING);
  const std::string b2 = submit("b2", 0.7, "b", 0), b3 = submit("b3", 0.8, "b", 0);
  EXPECT_EQ(book_->NextQueued()->job.job_id(), b2);
  MoveTo(b2, 1, JOB_STATE_RUNNING);
  EXPECT_EQ(book_->NextQueued({a5})->job.job_id(), b3);
  EXPECT_EQ(book_->NextQueued()->job.job_id(), a5) << "one each runs: a waited longer for a turn";
}

TEST_F(JobBookTest, WalksTheStateMachineAndSurvivesReopening) {
  const std::string id = Submit(Request("a")).job().job_id();
  std::uint64_t revision = 0;
  for (const JobState state : {JOB_STATE_RUNNING, JOB_STATE_FITTING, JOB_STATE_VALIDATING,
                               JOB_STATE_AWAITING_PROMOTION, JOB_STATE_DONE}) {
    ASSERT_TRUE(MoveTo(id, 1, state));
    EXPECT_EQ(heard_.back().job_state(), state);
    EXPECT_GT(heard_.back().revision(), revision);
    revision = heard_.back().revision();
    Reopen();
    EXPECT_EQ(book_->Get(id).job_state(), state);
  }
  EXPECT_FALSE(MoveTo(id, 1, JOB_STATE_RUNNING)) << "an ended job changes no more";
}

TEST_F(JobBookTest, RefusesMovesThatTheStateMachineLacks) {
  const std::string id = Submit(Request("a")).job().job_id();
  EXPECT_THROW(MoveTo(id, 1, JOB_STATE_FITTING), std::logic_error);
  EXPECT_THROW(MoveTo(id, 1, JOB_STATE_DONE), std::logic_error);
  EXPECT_EQ(book_->Get(id).job_state(), JOB_STATE_QUEUED);
}

TEST_F(JobBookTest, StaleLeaseIsRefused) {
  const std::string id = Submit(Request("a")).job().job_id();
  ASSERT_TRUE(MoveTo(id, 1, JOB_STATE_RUNNING));
  ASSERT_TRUE(book_->Requeue(id, 1, "restart", Retries::kKeep));
  EXPECT_EQ(book_->Get(id).lease_epoch(), 2u);
  ASSERT_TRUE(MoveTo(id, 2, JOB_STATE_RUNNING));
  const std::size_t heard = heard_.size();
  EXPECT_FALSE(MoveTo(id, 1, JOB_STATE_FITTING));
  EXPECT_FALSE(book_->Progress(id, 1, 0.5, 1, "late"));
  EXPECT_EQ(heard_.size(), heard);
  EXPECT_EQ(book_->Get(id).job_state(), JOB_STATE_RUNNING);
}

TEST_F(JobBookTest, TheStoreItselfRefusesAStaleLease) {
  const std::string id = Submit(Request("a")).job().job_id();
  JobRow row = *book_->FindOpen(id);
  row.job.set_message("written by a worker of another epoch");
  EXPECT_FALSE(store_->Save(row, 9));
  EXPECT_FALSE(store_->Withdraw(row, 9, "a"));
  EXPECT_EQ(store_->Find(id)->job.message(), "waiting for a worker");
  EXPECT_EQ(store_->CountSubscribers(id), 1u);
}

TEST_F(JobBookTest, RevisionsNeverGoBackOverARestart) {
  const std::string id = Submit(Request("a")).job().job_id();
  MoveTo(id, 1, JOB_STATE_RUNNING);
  for (int i = 0; i < 100; ++i) book_->Progress(id, 1, i / 100.0, 1, "rolling");
  const auto seen = heard_.back().revision();
  EXPECT_EQ(heard_.back().message(), "rolling");
  Reopen();
  book_->Requeue(id, 1, "queued again after a restart", Retries::kKeep);
  EXPECT_GT(heard_.back().revision(), seen);
}

TEST_F(JobBookTest, TakesTheOldestQueuedJobFirst) {
  const std::string a = Submit(Request("a", 0.1)).job().job_id();
  const std::string b = Submit(Request("b", 0.2)).job().job_id();
  EXPECT_EQ(book_->NextQueued()->job.job_id(), a);
  MoveTo(a, 1, JOB_STATE_RUNNING);
  EXPECT_EQ(book_->NextQueued()->job.job_id(), b);
  book_->Requeue(a, 1, "again", Retries::kOneMore);
  EXPECT_EQ(book_->NextQueued()->job.job_id(), a);
  EXPECT_EQ(book_->FindOpen(a)->retries, 1);
  Reopen();
  EXPECT_EQ(book_->NextQueued()->job.job_id(), a);
  EXPECT_EQ(book_->FindOpen(a)->retries, 1);
  MoveTo(a, 2, JOB_STATE_RUNNING);
  book_->Requeue(a, 2, "for another fit", Retries::kNone);
  EXPECT_EQ(book_->FindOpen(a)->retries, 0);
}

TEST_F(JobBookTest, JobsThatRanAndAreFittedAgainKeepNobodyOut) {
  Reopen(1);
  const std::string a = Submit(Request("a", 0.1)).job().job_id();
  EXPECT_EQ(CodeOf([&] { Submit(Request("b", 0.2)); }), StatusCode::kResourceExhausted);
  MoveTo(a, 1, JOB_STATE_RUNNING);
  book_->Change(a, 1, [](JobRow& row) { row.job.set_run_sha256("00"); });
  book_->Requeue(a, 1, "for another fit", Retries::kNone);
  EXPECT_NO_THROW(Submit(Request("b", 0.2)));
}

TEST_F(JobBookTest, ListsNewestFirstWithoutProfiles) {
  const std::string a = Submit(Request("a", 0.1)).job().job_id();
  const std::string b = Submit(Request("b", 0.2)).job().job_id();
  MoveTo(a, 1, JOB_STATE_RUNNING);
  book_->Change(a, 1, [](JobRow& row) {
    row.job.mutable_run()->set_run_id("r");
    row.job.mutable_run()->mutable_surface()->add_height_m(1);
    row.job.mutable_run()->mutable_stress()->add_normal_pa(1);
  });
  const auto page = book_->List({});
  ASSERT_EQ(page.jobs_size(), 2);
  EXPECT_EQ(page.next_page_token(), "");
  EXPECT_EQ(page.jobs(0).job_id(), b);
  EXPECT_EQ(page.jobs(1).run().run_id(), "r");
  EXPECT_FALSE(page.jobs(1).run().has_surface());
  EXPECT_FALSE(page.jobs(1).run().has_stress());
  EXPECT_TRUE(book_->Get(a).run().has_surface());
}

TEST_F(JobBookTest, PagesGoOnWhereTheOneBeforeEnded) {
  std::vector<std::string> ids;
  for (const char* name : {"a", "b", "c"})
    ids.push_back(Submit(Request(name, ids.size() * 0.1)).job().job_id());
  ListJobsRequest request;
  request.set_page_size(2);
  const auto first = book_->List(request);
  ASSERT_EQ(first.jobs_size(), 2);
  EXPECT_EQ(first.jobs(0).job_id(), ids[2]);
  Submit(Request("d", 0.7));  // newer ones move no page
  request.set_page_token(first.next_page_token());
  const auto second = book_->List(request);
  ASSERT_EQ(second.jobs_size(), 1);
  EXPECT_EQ(second.jobs(0).job_id(), ids[0]);
  EXPECT_EQ(second.next_page_token(), "");
  request.set_page_token("job-nowhere");
  EXPECT_EQ(CodeOf([&] { book_->List(request); }), StatusCode::kInvalidArgument);
  request.Clear();
  request.set_page_size(-1);
  EXPECT_EQ(CodeOf([&] { book_->List(request); }), StatusCode::kInvalidArgument);
}

TEST_F(JobBookTest, PagesStayBelowAMegabyte) {
  constexpr int kJobs = 24;
  for (int i = 0; i < kJobs; ++i) {
    const std::string request_id = std::to_string(i);
    const std::string id = Submit(Request(request_id, 0.01 * i)).job().job_id();
    book_->Cancel(id, request_id);  // so that it does not wait in the queue
    book_->Change(id, 1, [](JobRow& row) {
      row.job.add_gate()->set_detail(std::string(100'000, 'd'));  // 2.4 MB in all
    });
  }
  std::set<std::string> seen;
  ListJobsRequest request;
  do {
    const auto page = book_->List(request);
    EXPECT_LT(page.ByteSizeLong(), 1'000'000u);
    for (const Job& job : page.jobs()) EXPECT_TRUE(seen.insert(job.job_id()).second);
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(seen.size(), std::size_t{kJobs});
}

// tests/data/earlier/jobs.sqlite: left by grouser-jobs 0.1.0, killed with one job RUNNING, one
// QUEUED (asked with a time limit) and one CANCELLED.
TEST_F(JobBookTest, ABookOfVersion01GoesOn) {
  book_.reset();
  store_.reset();
  std::filesystem::copy_file(GROUSER_EARLIER "/jobs.sqlite", dir_ / "jobs.sqlite",
                             std::filesystem::copy_options::overwrite_existing);
  Reopen();
  const auto page = book_->List({});
  ASSERT_EQ(page.jobs_size(), 3);
  EXPECT_EQ(page.jobs(0).job_state(), JOB_STATE_CANCELLED);
  EXPECT_EQ(page.jobs(1).job_state(), JOB_STATE_QUEUED);
  const Job& running = page.jobs(2);
  EXPECT_EQ(running.job_state(), JOB_STATE_RUNNING);
  EXPECT_EQ(running.submit_time().seconds(), 1795899550);
  EXPECT_NEAR(running.submit_time().nanos(), 304588300, 1000);
  EXPECT_NEAR(running.update_time().nanos(), 330094800, 1000);
  EXPECT_FALSE(running.has_eta()) << "it was NaN";

  // As `grouser-client submit --slip 0.2 --angle-deg 5 --load 24 --max-time 1.5` asked it.
  SubmitRefinementRequest again;
  again.set_request_id("queued");
  again.mutable_state()->set_mode(RIG_MODE_RIM_SPEED);
  again.mutable_state()->set_slip(0.2);
  again.mutable_state()->set_attack_angle_rad(5 * std::numbers::pi / 180.0);
  again.mutable_state()->set_load_n(24);
  again.set_max_time_s(1.5);
  const auto known = Replayed(again);
  ASSERT_TRUE(known.has_value());
  EXPECT_EQ(known->job().job_id(), page.jobs(1).job_id());

  ASSERT_TRUE(book_->Requeue(running.job_id(), 1, "queued again after a restart", Retries::kKeep));
  Reopen();
  EXPECT_EQ(book_->Get(running.job_id()).lease_epoch(), 2u);
  EXPECT_EQ(book_->Get(running.job_id()).submit_time().seconds(), 1795899550);
}

TEST_F(JobBookTest, ARowOfVersion01WithoutASensibleTimeIsPassedOver) {
  for (const double bad : {-1.0, 1e300, std::nan("")}) {
    const std::string id = Submit(Request(std::to_string(bad))).job().job_id();
    JobRow row = *store_->Find(id);
    row.job.set_submitted_unix_s(bad);
    ASSERT_TRUE(store_->Save(row, row.job.lease_epoch()));
    ASSERT_NO_THROW(Reopen()) << bad;
    EXPECT_FALSE(book_->FindOpen(id).has_value());
    EXPECT_THAT([&] { book_->Get(id); },
                ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr(id)));
  }
}

// Rows of version 0.1 keep their times in seconds.
TEST_F(JobBookTest, RowsOfEarlierVersionsAreRead) {
  const std::string id = Submit(Request("a")).job().job_id();
  JobRow row = *store_->Find(id);
  row.job.clear_submit_time();
  row.job.clear_update_time();
  row.job.set_submitted_unix_s(1000.25);
  row.job.set_changed_unix_s(1001.5);
  ASSERT_TRUE(store_->Save(row, row.job.lease_epoch()));
  Reopen();
  const Job read = book_->Get(id);
  EXPECT_EQ(read.submit_time().seconds(), 1000);
  EXPECT_EQ(read.submit_time().nanos(), 250'000'000);
  EXPECT_EQ(read.update_time().seconds(), 1001);
  EXPECT_EQ(read.submitted_unix_s(), 0);
  row.job.set_submitted_unix_s(1e300);  // no time at all: this row is passed over, not the start
  ASSERT_TRUE(store_->Save(row, row.job.lease_epoch()));
  Reopen();
  EXPECT_TRUE(book_->Open().empty());
}

TEST_F(JobBookTest, AFailedStoreChangesNothing) {
  const std::string id = Submit(Request("a")).job().job_id();
  // A second connection that holds the database makes every write fail, as a
  // full disk does.
  SQLite::Database other(dir_ / "jobs.sqlite", SQLite::OPEN_READWRITE);
  other.exec("BEGIN EXCLUSIVE");
  const std::size_t heard = heard_.size();
  EXPECT_THROW(MoveTo(id, 1, JOB_STATE_RUNNING), SqliteError);
  EXPECT_EQ(book_->FindOpen(id)->job.job_state(), JOB_STATE_QUEUED);
  EXPECT_EQ(heard_.size(), heard);
  other.exec("ROLLBACK");
  EXPECT_TRUE(MoveTo(id, 1, JOB_STATE_RUNNING));
}

TEST_F(JobBookTest, OneDamagedRowIsPassedOverAndKept) {
  const std::string damages[] = {"job=x'00ff'",     "job=x''", "spec=x'00ff'",
                                 "pending=x'00ff'", "state=4", "lease_epoch=9"};
  for (std::size_t i = 0; i <= std::size(damages); ++i) {
    const std::string name = std::to_string(i);
    const std::string id = Submit(Request(name, 0.1 * static_cast<double>(i))).job().job_id();
    if (i == std::size(damages)) break;  // the last one stays whole
    SQLite::Database(dir_ / "jobs.sqlite", SQLite::OPEN_READWRITE)
        .exec("UPDATE jobs SET " + damages[i] + " WHERE job_id='" + id + "'");
    Reopen();
    EXPECT_FALSE(book_->FindOpen(id).has_value()) << damages[i];
    EXPECT_THAT([&] { book_->Get(id); },
                ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr(id)));
  }
  Reopen();
  EXPECT_EQ(book_->Open().size(), 1u);
  EXPECT_EQ(book_->List({}).jobs_size(), 1);
  SQLite::Database db(dir_ / "jobs.sqlite");
  EXPECT_EQ(db.execAndGet("SELECT COUNT(*) FROM jobs").getInt(), 1 + int(std::size(damages)));
}

TEST(JobStoreTest, RefusesAForeignSchemaAndAForeignFile) {
  testing::TempDir dir;
  { os::OpenDatabase(dir / "newer.sqlite").exec("PRAGMA user_version=99"); }
  EXPECT_THROW(JobStore(dir / "newer.sqlite"), std::runtime_error);
  testing::WriteText(dir / "text.sqlite", std::string(4096, 'x'));
  EXPECT_THROW(JobStore(dir / "text.sqlite"), SqliteError);
}

TEST(JobStoreTest, CommitsWithRollbackJournalAndExtraSync) {
  testing::TempDir dir;
  auto db = os::OpenDatabase(dir / "a.sqlite");
  EXPECT_EQ(db.execAndGet("PRAGMA synchronous").getInt(), 3);  // EXTRA
  EXPECT_EQ(db.execAndGet("PRAGMA journal_mode").getString(), "delete");
}

TEST(JobStateTest, OnlyTheDrawnMovesExist) {
  int moves = 0;
  for (int from = JOB_STATE_UNSPECIFIED; from <= JOB_STATE_CANCELLED; ++from) {
    for (int to = JOB_STATE_UNSPECIFIED; to <= JOB_STATE_CANCELLED; ++to) {
      moves += MayMove(static_cast<JobState>(from), static_cast<JobState>(to));
    }
  }
  // 5 forward, RUNNING to DONE of campaigns and calibrations, FITTING to DONE of a run that the
  // model has, 4 requeues, and FAILED and CANCELLED from each of 5 open states.
  EXPECT_EQ(moves, 5 + 1 + 1 + 4 + 2 * 5);
  EXPECT_TRUE(MayMove(JOB_STATE_RUNNING, JOB_STATE_DONE));
  EXPECT_TRUE(HasEnded(JOB_STATE_FAILED));
  EXPECT_FALSE(HasEnded(JOB_STATE_AWAITING_PROMOTION));
  EXPECT_EQ(ShortName(JOB_STATE_RUNNING), "RUNNING");
}

}  // namespace
}  // namespace grouser::server

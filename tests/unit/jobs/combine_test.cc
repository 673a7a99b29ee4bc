// Several refinements of one model end in one candidate; no run is repeated.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include "server/core/status.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "tests/unit/jobs/combining_life.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Life;
using ::testing::Not;
using testing::Request;

class CombineTest : public testing::CombiningTest {
 protected:
  CombineTest() { FakeCombining(); }

  /// The job, awaiting promotion with that candidate.
  static Job Offered(Life& life, const std::string& id, const std::string& digest) {
    EXPECT_TRUE(testing::Eventually([&] {
      const Job job = life.Get(id);
      return HasEnded(job.job_state()) ||
             (job.job_state() == JOB_STATE_AWAITING_PROMOTION && job.candidate_digest() == digest);
    }));
    const Job job = life.Get(id);
    EXPECT_EQ(ShortName(job.job_state()), "AWAITING_PROMOTION") << job.message();
    return job;
  }

  void ExpectDone(Life& life, const std::string& id, const std::string& digest) {
    EXPECT_TRUE(testing::Eventually([&] { return HasEnded(life.Get(id).job_state()); }));
    const Job job = life.Get(id);
    EXPECT_EQ(ShortName(job.job_state()), "DONE") << job.message();
    EXPECT_EQ(job.candidate_digest(), digest) << job.message();
  }

  /// Of the job's latest worker of that kind.
  std::string Args(const std::string& id, const std::string& verb) const {
    std::istringstream in(testing::ReadText(bin_ + "/args." + id));
    std::string last;
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with(verb)) last = line;
    }
    return last;
  }

  std::string Stable() const { return Repository(state_, shipped_).Resolve(kName).digest; }
  std::string FileOf(const std::string& digest) const {
    return state_ + "/models/" + digest + ".model";
  }

  /// Two jobs of the shipped model that await promotion: the second has the run of the first.
  void Two(Life& life) {
    a_ = Submitted(life, Request("a"), "aaaa");
    in_a_ = WillFit(a_, base_digest_, {"aaaa"});
    Offered(life, a_, in_a_);
    b_ = Submitted(life, Request("b", 0.2), "bbbb");
    in_b_ = WillFit(b_, base_digest_, {"aaaa", "bbbb"});
    Offered(life, b_, in_b_);
  }
};

TEST_F(CombineTest, TheLaterCandidateHasTheRunsOfTheEarlierAndItsPromotionEndsBoth) {
  Life life(Options());
  Two(life);
  EXPECT_THAT(Args(a_, "refit"), Not(HasSubstr("--with")));
  EXPECT_THAT(Args(b_, "refit"), HasSubstr("--with " + FileOf(in_a_)));
  const std::string c = Submitted(life, Request("c", 0.1), "cccc");
  const std::string in_c = WillFit(c, base_digest_, {"aaaa", "bbbb", "cccc"});
  Offered(life, c, in_c);
  EXPECT_THAT(Args(c, "refit"), AllOf(HasSubstr("--with " + FileOf(in_b_)), Not(HasSubstr(in_a_))))
      << "the later has the run of the earlier";
  life.Promote(c);
  ExpectDone(life, b_, in_c);
  ExpectDone(life, a_, in_c);
  EXPECT_THAT(life.Get(a_).message(), HasSubstr(in_c + " is fitted to its run"));
  life.Promote(a_);  // is what was asked for already
  EXPECT_EQ(Stable(), in_c);
  EXPECT_EQ(DemStarts().size(), 3u);
  EXPECT_EQ(Wrong(), "");
}

TEST_F(CombineTest, WhatStableHasLeftIsFittedAgainAndNotRunAgain) {
  Life life(Options());
  Two(life);
  const std::string again = WillFit(b_, in_a_, {"aaaa", "bbbb"});
  life.Promote(a_);
  const Job job = Offered(life, b_, again);
  EXPECT_EQ(job.model(), ReferenceOf(kName, in_a_));
  EXPECT_EQ(job.gate_size(), 1);
  EXPECT_THAT(Args(b_, "refit"), HasSubstr("--base " + FileOf(in_a_)));
  EXPECT_THAT(Args(b_, "gate"), HasSubstr("--base " + FileOf(in_a_)));
  life.Promote(b_);
  EXPECT_EQ(Stable(), again);
  // Back to where both began: a job of the model that was left is fitted from there.
  const std::string c = Submitted(life, Request("c", 0.1), "cccc");
  Offered(life, c, WillFit(c, again, {"aaaa", "bbbb", "cccc"}));
  const std::string back = WillFit(c, in_a_, {"aaaa", "cccc"});
  RollbackAliasRequest request;
  request.set_model(kName);
  life.Ask([&](JobsApp& app) { return app.Rollback(request, "a tester"); });
  Offered(life, c, back);
  EXPECT_EQ(DemStarts().size(), 3u);
  EXPECT_EQ(Wrong(), "");
}

TEST_F(CombineTest, APromotionOfACandidateThatARefitHasReplacedIsRefused) {
  Life life(Options());
  Two(life);
  const std::string again = WillFit(b_, in_a_, {"aaaa", "bbbb"});
  life.Promote(a_, in_a_.substr(0, 12));
  Offered(life, b_, again);
  const auto refusal = [&](const std::string& looked_at) {
    try {
      life.Promote(b_, looked_at);
    } catch (const StatusError& e) {
      EXPECT_EQ(e.code(), StatusCode::kFailedPrecondition);
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(in_b_), AllOf(HasSubstr("candidate_digest: job '" + b_ + "'"),
                                    HasSubstr(again), HasSubstr(in_b_)));
  EXPECT_EQ(Stable(), in_a_);
  life.Promote(b_, again);
  EXPECT_EQ(Stable(), again);
  life.Promote(b_, again);  // asked again after a lost answer
  EXPECT_THAT(refusal(in_b_), HasSubstr(in_b_)) << "not what was promoted";
  EXPECT_EQ(Wrong(), "");
}

TEST_F(CombineTest, CandidatesThatAreFittedAtOnceEndInOneOfBoth) {
  workers_ = 2;
  testing::WriteText(bin_ + "/hold.gate", "");
  Life life(Options());
  a_ = Submitted(life, Request("a"), "aaaa");
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  WillFit(a_, base_digest_, {"aaaa"});
  WillFit(b_, base_digest_, {"bbbb"});
  for (const auto& id : {a_, b_}) life.Await(id, JOB_STATE_VALIDATING);
  const std::string both_a = WillFit(a_, base_digest_, {"aaaa", "bbbb"});
  const std::string both_b = WillFit(b_, base_digest_, {"aaaa", "bbbb"});
  std::filesystem::remove(bin_ + "/hold.gate");
  for (const auto& id : {a_, b_}) life.Await(id, JOB_STATE_AWAITING_PROMOTION);
  const std::string of_a = life.Get(a_).candidate_digest(), of_b = life.Get(b_).candidate_digest();
  EXPECT_EQ((of_a == both_a) + (of_b == both_b), 1) << "the later one";
  const std::string later = of_a == both_a ? a_ : b_, earlier = later == a_ ? b_ : a_;
  EXPECT_THAT(Args(later, "refit"),
              HasSubstr("--with " + FileOf(life.Get(earlier).candidate_digest())));
  life.Promote(later);
  ExpectDone(life, earlier, life.Get(later).candidate_digest());
  EXPECT_EQ(DemStarts().size(), 2u);
}

TEST_F(CombineTest, StableMovedWhileAJobRunsAndWhileTheProgramWasNotThere) {
  std::string c;
  {
    workers_ = 2;
    Life life(Options());
    Two(life);
    testing::WriteText(bin_ + "/hold.refit", "");
    c = Submitted(life, Request("c", 0.1), "cccc");
    life.Await(c, JOB_STATE_FITTING);
    life.Promote(b_);
    ExpectDone(life, a_, in_b_);
    WillFit(c, base_digest_, {"aaaa", "bbbb", "cccc"});  // as its first fitter will have it
    std::filesystem::remove(bin_ + "/hold.refit");
    ASSERT_TRUE(testing::Eventually([&] { return life.Get(c).lease_epoch() == 2; }));
    Offered(life, c, WillFit(c, in_b_, {"aaaa", "bbbb", "cccc"}));
    life.Stop();
  }
  Repository(state_, shipped_).SetAlias(kName, "stable", base_digest_, "someone", "test");
  const std::string again = WillFit(c, base_digest_, {"cccc"});
  Life life(Options());
  Offered(life, c, again);
  EXPECT_EQ(DemStarts().size(), 3u);
  EXPECT_EQ(Wrong(), "");
}

TEST_F(CombineTest, ACanarysRunsGoIntoTheNextCandidate) {
  auto options = Options();
  options.scheduler.auto_promote = "canary";
  options.scheduler.gate.rmse_factor = 1.05;
  Life life(options);
  a_ = Submitted(life, Request("a"), "aaaa");
  in_a_ = WillFit(a_, base_digest_, {"aaaa"});
  ExpectDone(life, a_, in_a_);
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  in_b_ = WillFit(b_, base_digest_, {"aaaa", "bbbb"});
  ExpectDone(life, b_, in_b_);
  EXPECT_THAT(Args(b_, "refit"), HasSubstr("--with " + FileOf(in_a_)));
  EXPECT_THAT(Args(b_, "gate"), HasSubstr("--rmse-factor 1.05 "));
  EXPECT_EQ(Stable(), base_digest_);
}

TEST_F(CombineTest, RunsThatFailTheGateStayOutAndADigestStaysWhatItIs) {
  testing::WriteText(bin_ + "/gate.exit", "3");
  testing::WriteText(bin_ + "/gate.json",
                     R"([{"name":"held_out","passed":false,"value":1.3,"limit":1.1,
                          "detail":"1.3, at most 1.1: times the base's rmse"}])");
  Life life(Options());
  a_ = Submitted(life, Request("a"), "aaaa");
  in_a_ = WillFit(a_, base_digest_, {"aaaa"});
  EXPECT_THAT(Offered(life, a_, in_a_).message(), HasSubstr("held_out (1.3, at most 1.1)"));
  testing::WriteText(bin_ + "/gate.exit", "0");
  testing::WriteText(bin_ + "/gate.json", R"([{"name":"held_out","passed":true,"detail":"x"}])");
  auto pinned = Request("p", 0.3);
  pinned.set_model(ReferenceOf(kName, base_digest_));
  const std::string p = Submitted(life, pinned, "dddd");
  const std::string in_p = WillFit(p, base_digest_, {"dddd"});
  Offered(life, p, in_p);
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  in_b_ = WillFit(b_, base_digest_, {"bbbb"});
  Offered(life, b_, in_b_);
  EXPECT_THAT(Args(b_, "refit"), Not(HasSubstr("--with")));
  const std::string again = WillFit(a_, in_b_, {"aaaa", "bbbb"});
  life.Promote(b_);
  Offered(life, a_, again);
  Offered(life, p, in_p);
  EXPECT_THROW(life.Promote(p), StatusError) << "asked for a digest that stable has left";
}

TEST_F(CombineTest, WhatFailsTheGateWithOthersIsFittedAlone) {
  Life life(Options());
  a_ = Submitted(life, Request("a"), "aaaa");
  in_a_ = WillFit(a_, base_digest_, {"aaaa"});
  Offered(life, a_, in_a_);
  testing::WriteText(bin_ + "/hold.gate", "");
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  WillFit(b_, base_digest_, {"aaaa", "bbbb"});
  life.Await(b_, JOB_STATE_VALIDATING);
  EXPECT_THAT(Args(b_, "refit"), HasSubstr("--with " + FileOf(in_a_)));
  testing::WriteText(bin_ + "/gate.exit", "3");
  testing::WriteText(bin_ + "/gate.json",
                     R"([{"name":"held_out","passed":false,"detail":"2: x"}])");
  in_b_ = WillFit(b_, base_digest_, {"bbbb"});
  std::filesystem::remove(bin_ + "/hold.gate");
  EXPECT_THAT(Offered(life, b_, in_b_).message(), HasSubstr("fails the gate"));
  EXPECT_THAT(Args(b_, "refit"), Not(HasSubstr("--with")));
  EXPECT_EQ(life.Get(b_).lease_epoch(), 2) << "once, though it fails alone as well";
  EXPECT_EQ(DemStarts().size(), 2u);
}

TEST_F(CombineTest, AStateWhoseRunTheModelHasEndsWithoutAFit) {
  Life life(Options());
  a_ = Submitted(life, Request("a"), "aaaa");
  in_a_ = WillFit(a_, base_digest_, {"aaaa"});
  Offered(life, a_, in_a_);
  life.Promote(a_);
  const std::string again = Submitted(life, Request("again"), "aaaa");
  ASSERT_NE(again, a_);
  ExpectDone(life, again, in_a_);
  EXPECT_EQ(life.Get(again).run_sha256(), hashes_.at("aaaa"));
  EXPECT_EQ(Args(again, "refit"), "");
  EXPECT_THAT(Args(again, "run"), HasSubstr("--known " + state_ + "/runs"));
}

TEST_F(CombineTest, AFitterThatLeavesRunsOutIsNotBelieved) {
  Life life(Options());
  a_ = Submitted(life, Request("a"), "aaaa");
  Offered(life, a_, WillFit(a_, base_digest_, {"aaaa"}));
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  WillFit(b_, base_digest_, {"bbbb"});
  ASSERT_TRUE(testing::Eventually([&] { return HasEnded(life.Get(b_).job_state()); }));
  EXPECT_EQ(ShortName(life.Get(b_).job_state()), "FAILED");
  EXPECT_THAT(life.Get(b_).message(), HasSubstr("does not name the runs aaaa"));
}

TEST_F(CombineTest, AFitThatHasPassedCandidatesOverIsNotMadeAgainForThem) {
  hashes_ = {{"old", std::string(64, '0')}, {"new", std::string(64, '1')}};
  {  // Of an earlier life: one more than planning a fit reads, the oldest with a run of its own.
    const JobFiles files(state_);
    JobStore store(files.Database());
    double now = 1;
    JobBook book(
        store, 64, [&] { return now++; }, [](const Job&) {});
    Repository repository(state_, shipped_);
    for (std::size_t i = 0; i <= kMostCombined; ++i) {
      const auto request =
          Request(fmt::format("earlier{}", i), 0.2 + 0.01 * static_cast<double>(i));
      const auto row =
          RowOf(request, kName, base_digest_, BuildSpec(testing::BaseModel(), request));
      const std::string id =
          book.Submit(request.request_id(), ContentOf(request), row, "a tester").job().job_id();
      for (const auto state : {JOB_STATE_RUNNING, JOB_STATE_FITTING, JOB_STATE_VALIDATING}) {
        book.Change(id, 1, [&](JobRow& changed) { changed.job.set_job_state(state); });
      }
      WillFit(id, base_digest_, {i == 0 ? "old" : "new"});
      const std::string digest = repository.Publish(bin_ + "/fit." + id + ".base.model");
      book.Change(id, 1, [&](JobRow& changed) {
        changed.job.add_gate()->set_passed(true);
        changed.job.set_candidate_digest(digest);
        changed.job.set_job_state(JOB_STATE_AWAITING_PROMOTION);
      });
    }
  }
  Life life(Options());
  const std::string id = Submitted(life, Request("c", 0.1), "cccc");
  Offered(life, id, WillFit(id, base_digest_, {"cccc", "new"}));
  EXPECT_EQ(life.Get(id).lease_epoch(), 1);
}

}  // namespace
}  // namespace grouser::server

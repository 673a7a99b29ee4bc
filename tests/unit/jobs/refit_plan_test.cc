// What a fit takes from other candidates, and what planning it reads.
#include "server/jobs/refit_plan.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <sstream>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "server/jobs/job_files.h"
#include "server/jobs/refinement_spec.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::SizeIs;

class RefitPlanTest : public ::testing::Test {
 protected:
  RefitPlanTest() {
    base_ = Publish(testing::BaseModel());
    repository_.SetAlias(testing::BaseModel().name(), "stable", base_, "test", "");
    row_ = RowOf("the job's own");
  }

  std::string Publish(const v1alpha1::Model& model) {
    records::WriteModelFile(dir_ / "made.model", model);
    return repository_.Publish(dir_ / "made.model");
  }
  /// A refit of the base with these runs.
  std::string Candidate(const std::vector<std::string>& run_ids) {
    v1alpha1::Model model = testing::BaseModel();
    model.mutable_provenance()->set_base_digest(base_);
    for (const std::string& id : run_ids) {
      auto* run = model.mutable_provenance()->add_runs();
      run->set_role(v1alpha1::RUN_ROLE_TRAIN);
      run->set_run_id(id);
    }
    return Publish(model);
  }

  JobRow RowOf(const std::string& job_id) const {
    JobRow row;
    row.job.set_job_id(job_id);
    row.job.set_model(ReferenceOf(testing::BaseModel().name(), base_));
    row.join_key = StableKeyOf(testing::BaseModel().name()) + job_id;
    row.spec = BuildSpec(testing::BaseModel(), testing::Request("a"));
    return row;
  }
  /// Adds a job whose candidate passes the gate.
  void Offer(const std::string& digest) {
    JobRow row = RowOf(fmt::format("job-{}", open_.size()));
    row.job.set_candidate_digest(digest);
    row.job.add_gate()->set_passed(true);
    open_.push_back(std::move(row));
  }

  std::size_t CandidatesKnown() const {
    return std::ranges::count_if(
        open_, [this](const JobRow& row) { return models_.Has(row.job.candidate_digest()); });
  }
  void SetCanary(const std::string& digest) {
    repository_.SetAlias(testing::BaseModel().name(), "canary", digest, "test", "");
  }
  /// A model with this run, refitted from `from`, which becomes the base that the job is of.
  std::string Next(const std::string& from, const std::string& run_id) {
    base_ = from;
    base_ = Candidate({run_id});
    row_.job.set_model(ReferenceOf(testing::BaseModel().name(), base_));
    return base_;
  }

  Companions Plan() { return CompanionsOf(repository_, models_, open_, row_); }
  std::string FileOf(const std::string& digest) const {
    return dir_ / ("models/" + digest + ".model");
  }

  static constexpr std::size_t kMany = 2 * kMostCombined + 8;
  testing::TempDir dir_;
  Repository repository_{dir_.path(), ""};
  KnownModels models_{repository_};
  std::string base_;
  JobRow row_;
  std::vector<JobRow> open_;  ///< oldest first
};

TEST_F(RefitPlanTest, TakesTheLatestThatHasAllAndReadsTheOthersInTurn) {
  std::vector<std::string> runs;
  for (std::size_t i = 0; i < kMany; ++i) {
    runs.push_back(fmt::format("run{}", i));
    Offer(Candidate(runs));
  }
  const std::string latest = FileOf(open_.back().job.candidate_digest());
  std::vector<std::size_t> known;
  for (int fit = 0; fit < 4; ++fit) {
    const Companions found = Plan();
    EXPECT_THAT(found.models, ElementsAre(latest));
    EXPECT_THAT(found.run_ids, SizeIs(kMany));
    known.push_back(CandidatesKnown());
  }
  EXPECT_THAT(known, ElementsAre(kMostCombined, 2 * kMostCombined, kMany, kMany));
  const std::string ended = open_.back().job.candidate_digest();
  EXPECT_TRUE(models_.Has(ended));
  open_.resize(3);
  EXPECT_THAT(Plan().run_ids, SizeIs(3));
  EXPECT_FALSE(models_.Has(ended)) << "what no open job names is forgotten";
}

TEST_F(RefitPlanTest, WhatAFitHasPassedOverIsNoReasonToFitItAgain) {
  const std::string old = Candidate({"old"});
  Offer(old);
  std::vector<std::string> runs;
  for (std::size_t i = 0; i < kMostCombined; ++i) {
    runs.push_back(fmt::format("run{}", i));
    Offer(Candidate(runs));
  }
  const Companions fit = Plan();
  EXPECT_THAT(fit.run_ids, SizeIs(kMostCombined));
  EXPECT_THAT(fit.passed_over, ElementsAre(old));
  const auto after = [&] {
    return CompanionsOf(repository_, models_, open_, row_, fit.passed_over);
  };
  EXPECT_EQ(after().run_ids, fit.run_ids);
  Offer(Candidate({"offered meanwhile"}));
  EXPECT_THAT(after().run_ids, Contains("offered meanwhile"));
  EXPECT_THAT(Plan().run_ids, IsSupersetOf({"old", "offered meanwhile"})) << "of the next fit";
}

TEST_F(RefitPlanTest, WhatIsTooManyForOneFitComesWithTheNext) {
  std::set<std::string> missing;
  for (std::size_t i = 0; i < kMany; ++i) {
    Offer(Candidate({*missing.insert(fmt::format("run{}", i)).first}));
  }
  for (int fit = 0; !missing.empty(); ++fit) {
    ASSERT_LT(fit, 4);
    const Companions found = Plan();
    EXPECT_LE(found.models.size(), kMostCombined);
    // The fit's own candidate has them, and is the latest then.
    const std::vector<std::string> runs(found.run_ids.begin(), found.run_ids.end());
    for (const std::string& run : runs) missing.erase(run);
    Offer(Candidate(runs));
  }
}

TEST_F(RefitPlanTest, ADamagedOrRemovedCandidateIsLeftOut) {
  const std::string gone = Candidate({"gone"});
  Offer(gone);
  Offer(Candidate({"there"}));
  std::filesystem::remove(FileOf(gone));
  EXPECT_THAT(Plan().run_ids, ElementsAre("there"));
}

TEST_F(RefitPlanTest, ADamagedCandidateIsToldOfOnce) {
  const std::string damaged = Candidate({"damaged"});
  const std::string whole = records::ReadFileBytes(FileOf(damaged));
  Offer(damaged);
  Offer(Candidate({"there"}));
  std::filesystem::resize_file(FileOf(damaged), 100);
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  const auto told = [&] {
    const std::string text = log.str();
    return std::ranges::count(text, '\n');
  };
  for (int plan = 0; plan < 3; ++plan) EXPECT_THAT(Plan().run_ids, ElementsAre("there"));
  EXPECT_EQ(told(), 1) << log.str();
  EXPECT_THAT(log.str(), HasSubstr(damaged));
  std::ofstream(FileOf(damaged), std::ios::binary) << whole;
  EXPECT_THAT(Plan().run_ids, SizeIs(2));
  std::filesystem::resize_file(FileOf(damaged), 100);
  for (int plan = 0; plan < 3; ++plan) Plan();
  EXPECT_EQ(told(), 2) << "it was mended in between";
  spdlog::set_default_logger(before);
}

TEST_F(RefitPlanTest, DamagedCandidatesHideNoOthers) {
  Offer(Candidate({"there"}));
  for (std::size_t i = 0; i <= kMostCombined; ++i) {
    Offer(Candidate({fmt::format("run{}", i)}));
    std::filesystem::resize_file(FileOf(open_.back().job.candidate_digest()), 100);
  }
  EXPECT_THAT(Plan().run_ids, ElementsAre("there"));
}

TEST_F(RefitPlanTest, AncestorsAreReadOnceAndOnlyForACanaryThatWasRefitted) {
  const std::string zeroth = base_, first = Next(zeroth, "1"), second = Next(first, "2");
  base_ = "";
  SetCanary(Candidate({"of no refit"}));
  base_ = second;
  EXPECT_THAT(Plan().run_ids, IsEmpty());
  EXPECT_FALSE(models_.Has(first)) << "none can be what it was fitted from";
  base_ = "elsewhere";
  SetCanary(Candidate({"of another line"}));
  base_ = second;
  Offer(Candidate({"2", "of a job"}));
  EXPECT_THAT(Plan().run_ids, ElementsAre("of a job"));
  for (const std::string& ancestor : {zeroth, first}) {
    EXPECT_TRUE(models_.Has(ancestor));
    std::filesystem::remove(FileOf(ancestor));
  }
  base_ = zeroth;
  SetCanary(Candidate({"of the first base"}));
  base_ = second;
  EXPECT_THAT(Plan().run_ids, ElementsAre("of a job", "of the first base"));
}

TEST_F(RefitPlanTest, APrunedAncestorEndsTheLineWithoutAWarning) {
  const std::string zeroth = base_, first = Next(zeroth, "1"), second = Next(first, "2");
  base_ = zeroth;
  SetCanary(Candidate({"of canary"}));
  base_ = second;
  std::filesystem::remove(FileOf(first));
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  EXPECT_THAT(Plan().run_ids, IsEmpty());
  EXPECT_EQ(log.str(), "");
  std::filesystem::remove(
      FileOf(repository_.ReadAliases().Find(testing::BaseModel().name(), "canary")));
  Plan();
  EXPECT_THAT(log.str(), HasSubstr("its runs are left out")) << "of a candidate it is said";
  spdlog::set_default_logger(before);
}

TEST_F(RefitPlanTest, TheCanaryOfWhatStableComesFromCountsAndOfWhatItWasRolledBackFromNot) {
  const std::string first = base_, canary = Candidate({"of canary"}), second = Candidate({"new"});
  const std::string name = testing::BaseModel().name();
  SetCanary(canary);
  row_.job.set_model(ReferenceOf(name, second));
  EXPECT_THAT(Plan().run_ids, ElementsAre("of canary"));
  base_ = second;
  SetCanary(Candidate({"new", "newer"}));
  EXPECT_THAT(Plan().run_ids, ElementsAre("newer"));
  row_.job.set_model(ReferenceOf(name, first));
  EXPECT_THAT(Plan().run_ids, IsEmpty()) << "would bring back what was rolled back";
}

}  // namespace
}  // namespace grouser::server

// What a fit takes from other candidates, and what planning it reads.
#include "server/jobs/refit_plan.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include "proto/records/model_file.h"
#include "server/jobs/job_files.h"
#include "server/jobs/refinement_spec.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
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
  std::vector<std::size_t> kept;
  for (int fit = 0; fit < 4; ++fit) {
    const Companions found = Plan();
    EXPECT_THAT(found.models, ElementsAre(latest));
    EXPECT_THAT(found.run_ids, SizeIs(kMany));
    kept.push_back(models_.size());
  }
  EXPECT_THAT(kept, ElementsAre(1 + kMostCombined, 1 + 2 * kMostCombined, 1 + kMany, 1 + kMany))
      << "with the base, which is read once as well";
  open_.resize(3);
  EXPECT_THAT(Plan().run_ids, SizeIs(3));
  EXPECT_EQ(models_.size(), 4u) << "what no open job names is forgotten";
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

TEST_F(RefitPlanTest, TheCanaryOfWhatStableComesFromCountsAndOfWhatItWasRolledBackFromNot) {
  const std::string name = testing::BaseModel().name();
  const std::string first = base_, canary = Candidate({"of canary"}), second = Candidate({"new"});
  repository_.SetAlias(name, "canary", canary, "test", "");
  row_.job.set_model(ReferenceOf(name, second));
  EXPECT_THAT(Plan().run_ids, ElementsAre("of canary"));
  base_ = second;
  repository_.SetAlias(name, "canary", Candidate({"new", "newer"}), "test", "");
  EXPECT_THAT(Plan().run_ids, ElementsAre("newer"));
  row_.job.set_model(ReferenceOf(name, first));
  EXPECT_THAT(Plan().run_ids, IsEmpty()) << "would bring back what was rolled back";
}

}  // namespace
}  // namespace grouser::server

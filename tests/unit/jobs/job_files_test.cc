// Finished runs, candidates and gate output: what is believed and what not.
#include "server/jobs/job_files.h"

#include <gmock/gmock.h>

#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "proto/records/run_file.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/scheduler_steps.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server {
namespace {

using testing::BaseModel;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Request;
using ::testing::UnorderedElementsAre;

class JobFilesTest : public ::testing::Test {
 protected:
  JobFilesTest() {
    row_.job.set_job_id("job-1");
    row_.job.set_model("cmu-smooth-62.5@sha256:abc");
    row_.spec = BuildSpec(BaseModel(), Request("a"));
  }

  /// What a DEM worker leaves in the job's folder.
  void WriteRun(v1alpha1::RunStatus status, double load_n = 24, double wall_s = 1) {
    records::RunFile run;
    *run.record.mutable_spec() = row_.spec;
    run.record.mutable_spec()->mutable_state()->set_load_n(load_n);
    run.record.set_run_id("0123456789abcdef");
    run.record.set_status(status);
    run.record.mutable_numerics()->set_wall_s(wall_s);
    std::filesystem::create_directories(files_.Folder("job-1"));
    records::WriteRunFile(files_.WorkerRun("job-1"), run);
  }

  v1alpha1::Model Candidate() {
    auto model = BaseModel();
    model.mutable_provenance()->set_base_digest("abc");
    auto* run = model.mutable_provenance()->add_runs();
    run->set_sha256(row_.job.run_sha256());
    return model;
  }

  std::vector<std::string> NamesInRuns() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(files_.Run(""))) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

  bool CandidateAccepted(const v1alpha1::Model& model) {
    std::filesystem::create_directories(files_.Folder("job-1"));
    records::WriteModelFile(files_.Candidate("job-1"), model);
    return CandidateIsThere(files_, row_);
  }

  testing::TempDir dir_;
  JobFiles files_{dir_.path()};
  JobRow row_;
};

TEST_F(JobFilesTest, AdoptsAFinishedRunOfTheSameSpec) {
  EXPECT_FALSE(AdoptableRun(files_, row_).has_value());
  WriteRun(v1alpha1::RUN_STATUS_STEADY);
  const auto run = AdoptableRun(files_, row_);
  ASSERT_TRUE(run.has_value());
  EXPECT_EQ(run->record.status(), v1alpha1::RUN_STATUS_STEADY);
  EXPECT_EQ(run->file, "0123456789abcdef.run.h5");
  EXPECT_EQ(run->sha256, records::Sha256OfFile(files_.Run(run->file)));
  row_.job.set_run_file(run->file);
  row_.job.set_run_sha256(run->sha256);
  EXPECT_TRUE(AdoptableRun(files_, row_).has_value());
  row_.job.set_run_sha256(std::string(64, '0'));
  EXPECT_FALSE(AdoptableRun(files_, row_).has_value()) << "not the file of the row";
}

TEST_F(JobFilesTest, DoesNotAdoptOtherDamagedOrFailedRuns) {
  WriteRun(v1alpha1::RUN_STATUS_STEADY, 25);
  EXPECT_FALSE(AdoptableRun(files_, row_).has_value());
  WriteRun(v1alpha1::RUN_STATUS_STEADY);
  std::filesystem::resize_file(files_.WorkerRun("job-1"), 100);
  EXPECT_FALSE(AdoptableRun(files_, row_).has_value());
  WriteRun(v1alpha1::RUN_STATUS_FAILED);
  EXPECT_FALSE(AdoptableRun(files_, row_).has_value());
}

TEST_F(JobFilesTest, PublishedRunsAreImmutableButDamagedOnesAreReplaced) {
  WriteRun(v1alpha1::RUN_STATUS_STEADY);
  const auto first = PublishRun(files_, row_);
  WriteRun(v1alpha1::RUN_STATUS_STEADY, 24, 2);  // the same run by another job
  EXPECT_EQ(PublishRun(files_, row_).sha256, first.sha256) << "models name it by this hash";
  std::filesystem::resize_file(files_.Run(first.file), 100);
  EXPECT_EQ(PublishRun(files_, row_).record.numerics().wall_s(), 2);
}

TEST_F(JobFilesTest, AFailedRunThatIsRunAgainAnswersNoMore) {
  WriteRun(v1alpha1::RUN_STATUS_FAILED);
  const std::string file = PublishRun(files_, row_).file;
  EXPECT_EQ(PublishRun(files_, row_).file, file) << "the next start finds it published";
  EXPECT_THAT(NamesInRuns(), ElementsAre(file));
  for (const double wall_s : {2, 3, 4}) {
    WriteRun(v1alpha1::RUN_STATUS_FAILED, 24, wall_s);  // of another reason, it may be
    EXPECT_EQ(PublishRun(files_, row_).record.numerics().wall_s(), wall_s);
  }
  EXPECT_THAT(NamesInRuns(), UnorderedElementsAre(file, file + ".failed")) << "one, as it is whole";
  WriteRun(v1alpha1::RUN_STATUS_STEADY, 24, 5);
  EXPECT_EQ(PublishRun(files_, row_).record.status(), v1alpha1::RUN_STATUS_STEADY);
  const auto kept = records::ReadRunFile(files_.Run(file + ".failed")).record;
  EXPECT_EQ(kept.numerics().wall_s(), 4) << "the latest";
  WriteRun(v1alpha1::RUN_STATUS_FAILED, 24, 6);
  EXPECT_EQ(PublishRun(files_, row_).record.status(), v1alpha1::RUN_STATUS_STEADY) << "stays";
}

TEST_F(JobFilesTest, AFailedRunThatCannotBeKeptStopsNoOther) {
  WriteRun(v1alpha1::RUN_STATUS_FAILED);
  const std::string file = PublishRun(files_, row_).file;
  std::filesystem::create_directory(files_.Run(file + ".failed"));
  WriteRun(v1alpha1::RUN_STATUS_STEADY, 24, 2);
  EXPECT_EQ(PublishRun(files_, row_).record.status(), v1alpha1::RUN_STATUS_STEADY);
  EXPECT_TRUE(std::filesystem::is_directory(files_.Run(file + ".failed")));
}

TEST_F(JobFilesTest, ARunIdThatIsNoFileNameIsRefused) {
  WriteRun(v1alpha1::RUN_STATUS_STEADY);
  auto run = records::ReadRunFile(files_.WorkerRun("job-1"));
  run.record.set_run_id("../../etc/x");
  records::WriteRunFile(files_.WorkerRun("job-1"), run);
  EXPECT_THROW(PublishRun(files_, row_), std::runtime_error);
}

TEST_F(JobFilesTest, CandidateMustNameBaseAndRunByHash) {
  row_.job.set_run_sha256(std::string(64, 'f'));
  EXPECT_FALSE(CandidateIsThere(files_, row_));
  EXPECT_TRUE(CandidateAccepted(Candidate()));
  auto other = Candidate();
  other.mutable_provenance()->set_base_digest("abd");
  EXPECT_FALSE(CandidateAccepted(other));
  other = Candidate();
  other.set_name("another wheel");
  EXPECT_FALSE(CandidateAccepted(other));
  other = Candidate();
  other.mutable_provenance()->mutable_runs()->RemoveLast();
  EXPECT_FALSE(CandidateAccepted(other));
  testing::WriteText(files_.Candidate("job-1"), "no model");
  EXPECT_FALSE(CandidateIsThere(files_, row_));
}

TEST_F(JobFilesTest, OutputsAreNamedByStageAndLease) {
  row_.job.set_lease_epoch(3);
  EXPECT_THAT(files_.Output(row_.job, "dem", "log"), ::testing::EndsWith("/job-1/dem.3.log"));
}

TEST(GateOutput, IsParsedStrictly) {
  v1alpha1::Job job;
  ParseGate(R"([{"name": "no_worse", "passed": true, "detail": "ok", "extra": 1},
                {"name": "symmetry", "passed": false}])",
            &job);
  ASSERT_EQ(job.gate_size(), 2);
  EXPECT_EQ(job.gate(0).detail(), "ok");
  EXPECT_FALSE(GatePassed(job));
  EXPECT_THAT(GateMessage(job), HasSubstr("symmetry"));
  for (const char* bad : {"", "[]", "{}", "[", "hello", "[{\"passed\": \"maybe\"}]"}) {
    EXPECT_THROW(ParseGate(bad, &job), std::runtime_error) << bad;
  }
  EXPECT_FALSE(GatePassed(v1alpha1::Job())) << "no check is no pass";
}

TEST(SpecJson, NamesFieldsAsTheProtoDoes) {
  const std::string json = records::ToJson(BuildSpec(BaseModel(), Request("a")), true);
  EXPECT_THAT(json, HasSubstr("\"attack_angle_rad\": 0.3"));
  EXPECT_THAT(json, HasSubstr("\"drawbar_n\": 0"));
}

}  // namespace
}  // namespace grouser::server

// The table of ./grouser jobs watch.
#include "clients/cli/job_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace grouser::cli {
namespace {

v1alpha1::Job Running() {
  v1alpha1::Job job;
  job.set_job_id("job-0123456789abcdef");
  job.set_job_state(v1alpha1::JOB_STATE_RUNNING);
  job.set_progress(0.456);
  job.mutable_eta()->set_seconds(3725);
  job.set_model("sand@sha256:00");
  job.set_message("DEM");
  return job;
}

TEST(JobTable, ALineTellsStageAndTime) {
  EXPECT_EQ(JobLine(Running(), 200),
            "job-0123456789abcdef RUNNING            ####......  46 %  1:02:05  refines sand: DEM");
  v1alpha1::Job job = Running();
  job.mutable_eta()->set_seconds(65);
  EXPECT_NE(JobLine(job, 200).find("     1:05  "), std::string::npos);
  job.set_job_state(v1alpha1::JOB_STATE_QUEUED);
  job.clear_eta();
  EXPECT_EQ(JobLine(job, 200).find('%'), std::string::npos) << "no stage yet";
  job.set_job_state(v1alpha1::JOB_STATE_RUNNING);
  for (const double share : {-1.0, 7.0, std::numeric_limits<double>::quiet_NaN()}) {
    job.set_progress(share);
    EXPECT_LE(JobLine(job, 200).size(), 90u) << share;
  }
}

TEST(JobTable, ColumnsStandBelowEachOther) {
  v1alpha1::ListJobsResponse jobs;
  *jobs.add_jobs() = Running();
  *jobs.add_jobs() = Running();
  jobs.mutable_jobs(1)->set_job_state(v1alpha1::JOB_STATE_AWAITING_PROMOTION);
  const std::string table = JobTable(jobs, 200, 10);
  const std::size_t first = table.find('\n') + 1, second = table.find('\n', first) + 1;
  const std::size_t what = table.find("what");
  EXPECT_EQ(table.find("refines", first) - first, what);
  EXPECT_EQ(table.find("refines", second) - second, what) << table;
}

TEST(JobTable, KeepsToTheTerminal) {
  v1alpha1::ListJobsResponse jobs;
  for (int i = 0; i < 30; ++i) *jobs.add_jobs() = Running();
  for (const int rows : {2, 5, 31, 40}) {
    const std::string table = JobTable(jobs, 80, rows);
    EXPECT_LE(std::count(table.begin(), table.end(), '\n'), rows) << rows;
    EXPECT_EQ(table.find(std::to_string(30 - (rows - 2)) + " more") != std::string::npos,
              rows < 31);
  }
  v1alpha1::Job job = Running();
  job.set_message(std::string(300, 'x') + "\xc3\xa4");
  for (int columns = 20; columns < 420; ++columns) {
    const std::string line = JobLine(job, columns);
    EXPECT_LE(line.size(), static_cast<std::size_t>(columns));
    EXPECT_NE(static_cast<unsigned char>(line.back()), 0xc3) << "half a letter";
  }
}

TEST(JobTable, TextsDoNotControlTheTerminal) {
  v1alpha1::Job job = Running();
  job.set_message(
      "a\x1b[2Jb\r\nc\x7f\xc2\x9b"
      "2Jd\xc2\xa9");
  const std::string line = JobLine(job, 200);
  EXPECT_NE(line.find("a [2Jb  c   2Jd\xc2\xa9"), std::string::npos) << line;
}

}  // namespace
}  // namespace grouser::cli

// What a thousand jobs leave behind. Slow: run by itself (jobs_thousand, label "slow").
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "server/jobs/job_files.h"
#include "tests/integration/jobs_harness.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::Request;

class JobsThousandTest : public testing::JobsTest {};

TEST_F(JobsThousandTest, DISABLED_AThousandJobsStayBelowTheDiskLimit) {
  const char* fewer = std::getenv("GROUSER_JOBS_OF_TEST");  // for a trial
  const int jobs = fewer != nullptr ? std::atoi(fewer) : 1000;
  const int prune_after = std::max(1, jobs / 10);
  constexpr int kPromoteEach = 10;
  constexpr std::uint64_t kLimitMb = 2;
  const std::vector<std::string> options = {"--max-disk-mb", std::to_string(kLimitMb), "--settle-s",
                                            "0"};
  LetDemGo();
  StartJobs(options);
  const auto prune = [&] {
    grpc::ClientContext context;
    PruneResponse response;
    const auto status = stub_->Prune(&context, PruneRequest(), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  std::uint64_t most = 0;
  for (int i = 0; i < jobs; ++i) {
    const std::string id = "job" + std::to_string(i);
    const auto request = Request(id, 0.3 + 1e-4 * i);
    Prepare(request, RUN_STATUS_STEADY, "run" + std::to_string(i));
    const Job job = Await(Submitted(request).job_id(), JOB_STATE_AWAITING_PROMOTION);
    ASSERT_FALSE(HasFailure()) << i;
    if (i % kPromoteEach == 0) {
      PromoteRequest promote;
      promote.set_job_id(job.job_id());
      PromoteResponse promoted;
      const auto status = Promote(promote, &promoted);
      ASSERT_TRUE(status.ok()) << status.error_message();
      base_digest_ = job.candidate_digest();
    } else {
      Job gone;
      ASSERT_TRUE(Cancel(job.job_id(), id, &gone).ok());
    }
    if (i % prune_after == prune_after - 1) {
      most = std::max(most, BytesBelow(state_));
      prune();
      EXPECT_LE(BytesBelow(state_), kLimitMb * 1'000'000) << i;
    }
  }
  ListJobsRequest list;
  list.set_page_size(500);
  ListJobsResponse page;
  do {
    grpc::ClientContext context;
    ASSERT_TRUE(stub_->ListJobs(&context, list, &page).ok());
    EXPECT_LT(page.ByteSizeLong(), 1'000'000u);
    list.set_page_token(page.next_page_token());
  } while (!page.next_page_token().empty());
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, base_digest_);
  StopJobs(SIGTERM);
  const auto begin = std::chrono::steady_clock::now();
  StartJobs(options);
  const std::chrono::duration<double> start = std::chrono::steady_clock::now() - begin;
  std::printf("%d jobs: at most %.1f MB, then %.1f MB of %d; start %.2f s\n", jobs, most / 1e6,
              BytesBelow(state_) / 1e6, static_cast<int>(kLimitMb), start.count());
}

}  // namespace
}  // namespace grouser::server

#include "tests/unit/jobs/combining_life.h"

#include <algorithm>
#include <filesystem>

#include "proto/records/model_file.h"
#include "proto/records/run_file.h"
#include "server/jobs/refinement_spec.h"

namespace grouser::server::testing {

namespace fs = std::filesystem;
using v1alpha1::JOB_STATE_AWAITING_PROMOTION;
using v1alpha1::JOB_STATE_DONE;

std::string CombiningTest::Submitted(Life& life, const v1alpha1::SubmitRefinementRequest& request,
                                     const std::string& run_id) {
  const std::string id = life.Submit(request);
  const std::string made = bin_ + "/made." + run_id + ".h5";
  const auto put = [&](const std::string& name, const auto& write) {
    write(bin_ + "/aside");
    fs::rename(bin_ + "/aside", bin_ + "/" + name);
  };
  if (!fs::exists(made)) {
    records::RunFile run;
    *run.record.mutable_spec() = BuildSpec(BaseModel(), request);
    run.record.set_run_id(run_id);
    run.record.set_status(v1alpha1::RUN_STATUS_STEADY);
    records::WriteRunFile(made, run);
  }
  hashes_[run_id] = records::Sha256OfFile(made);
  put("prepared." + id + ".run.h5", [&](const std::string& path) { fs::copy_file(made, path); });
  put("id." + id, [&](const std::string& path) { WriteText(path, run_id); });
  return id;
}

std::string CombiningTest::WillFit(const std::string& id, const std::string& base,
                                   const std::vector<std::string>& run_ids) {
  v1alpha1::Model candidate = BaseModel();
  candidate.mutable_provenance()->set_base_digest(base);
  candidate.mutable_provenance()->set_reason(id);
  for (const std::string& run_id : run_ids) {
    v1alpha1::RunSummary* run = candidate.mutable_provenance()->add_runs();
    run->set_role(v1alpha1::RUN_ROLE_TRAIN);
    run->set_run_id(run_id);
    run->set_seed(7);  // the base's, which later jobs are to have as well
    run->set_sha256(hashes_.at(run_id));
  }
  const std::string digest = records::WriteModelFile(bin_ + "/made.model", candidate);
  const std::string of_base = base == base_digest_ ? "base" : base;
  fs::rename(bin_ + "/made.model", bin_ + "/fit." + id + "." + of_base + ".model");
  return digest;
}

void CombiningTest::PromoteOnce(Life& life, const std::string& id) {
  if (life.Get(id).job_state() != JOB_STATE_DONE) life.Promote(id);
}

void CombiningTest::ToOneOffered(Life& life) {
  a_ = Submitted(life, Request("a"), "aaaa");
  in_a_ = WillFit(a_, base_digest_, {"aaaa"});
  life.AwaitEnd(a_);
}

void CombiningTest::ToBothPromoted(Life& life) {
  ToOneOffered(life);
  b_ = Submitted(life, Request("b", 0.2), "bbbb");
  WillFit(b_, base_digest_, {"aaaa", "bbbb"});
  in_b_ = WillFit(b_, in_a_, {"aaaa", "bbbb"});
  life.AwaitEnd(b_);
  PromoteOnce(life, a_);
  Eventually([&] {
    const v1alpha1::Job job = life.Get(b_);
    return HasEnded(job.job_state()) ||
           (job.job_state() == JOB_STATE_AWAITING_PROMOTION && job.candidate_digest() == in_b_);
  });
  PromoteOnce(life, b_);
  const std::string again = Submitted(life, Request("again"), "aaaa");
  Eventually([&] { return HasEnded(life.Get(again).job_state()); });
  for (const std::string& id : {a_, b_, again}) {
    const v1alpha1::Job job = life.Get(id);
    if (job.job_state() == JOB_STATE_DONE) continue;
    throw std::runtime_error(id + ": " + ShortName(job.job_state()) + ": " + job.message());
  }
}

void CombiningTest::Keep() { fs::copy(state_, kept_, fs::copy_options::recursive); }

void CombiningTest::BringBack() {
  Clear();
  fs::copy(kept_, state_, fs::copy_options::recursive);
  for (const auto& entry : fs::directory_iterator(bin_)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("pids.") || name == "run.bbbb") fs::remove(entry.path());
  }
}

void CombiningTest::ExpectTheNextLifeEndsAll() {
  const int status = InProcess([this](Life& life) { ToBothPromoted(life); });
  ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
  ASSERT_EQ(WEXITSTATUS(status), 0);
  const auto jobs = StoredJobs();  // newest first: A again, B, A
  ASSERT_EQ(jobs.size(), 3u);
  const Repository repository(state_, shipped_);
  const auto stable = repository.Resolve(kName);
  EXPECT_EQ(jobs[0].candidate_digest(), stable.digest);
  EXPECT_EQ(jobs[1].candidate_digest(), stable.digest);
  const v1alpha1::Model model = records::ReadModelFile(stable.path).model;
  const auto& provenance = model.provenance();
  EXPECT_EQ(jobs[2].candidate_digest(), provenance.base_digest());
  for (const char* run : {"aaaa", "bbbb"}) {
    EXPECT_TRUE(std::ranges::any_of(provenance.runs(),
                                    [&](const auto& one) { return one.run_id() == run; }));
  }
  int promotions = 0;
  for (const auto& move : repository.ReadAliases().history) promotions += move.alias == "stable";
  EXPECT_EQ(promotions, 2);
  EXPECT_EQ(Wrong(), "");
}

}  // namespace grouser::server::testing

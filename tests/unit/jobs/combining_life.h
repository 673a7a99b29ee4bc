#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/unit/jobs/jobs_life.h"

namespace grouser::server::testing {

/// Lives with several refinements of one model. The fakes of FakeCombining hand out what is
/// prepared here, the same files in every life.
class CombiningTest : public LivesTest {
 protected:
  static constexpr char kName[] = "cmu-smooth-62.5";

  /// Submits; the fakes will hand out the job's run. Equal ids: the very same file.
  std::string Submitted(Life& life, const v1alpha1::SubmitRefinementRequest& request,
                        const std::string& run_id);
  /// What the fakes fit for a job from a base from now on; returns its digest.
  std::string WillFit(const std::string& id, const std::string& base,
                      const std::vector<std::string>& run_ids);

  /// Until a first refinement, of state A, awaits its promotion.
  void ToOneOffered(Life& life);
  /// From there on, or from wherever an earlier life has come: a second one, of state B, is fitted
  /// with the run of the first; the first is promoted, so that stable moves and the second is
  /// fitted again; it is promoted; state A is asked for again, whose run is known, and which stable
  /// has. Throws std::runtime_error where that does not come about.
  void ToBothPromoted(Life& life);
  /// Keeps the state folder; brings it back as it was, and forgets what later lives did.
  void Keep();
  void BringBack();
  /// The next life must end all three, whatever went before: each promoted once, no run made twice.
  void ExpectTheNextLifeEndsAll();

  std::map<std::string, std::string> hashes_;  ///< of run files, by run id
  std::string a_, b_, in_a_, in_b_;            ///< jobs A and B, digests of their candidates

 private:
  static void PromoteOnce(Life& life, const std::string& id);
  std::string kept_ = dir_ / "kept";
};

}  // namespace grouser::server::testing

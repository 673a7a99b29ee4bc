// What the gate asks of a candidate's intervals. (The other checks: fit_test.cc.)
#include "surrogate/fit/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "surrogate/fit/error_table.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

struct BaseAndCandidate {
  v1alpha1::Model base, candidate;
};

/// Models that differ in the width of their intervals alone, and `n` runs held out, of which these
/// cover so many of every output.
BaseAndCandidate Covering(int n, int by_base, int by_candidate) {
  const v1alpha1::Model wide = ReadModel(GROUSER_DENSE_PAIR "/hybrid.model").model;
  const auto made = MakeScalar(wide);
  const std::vector<Sample> samples = SamplesOf(wide, v1alpha1::RUN_ROLE_TEST);
  const auto rows = CompareRows(*made, samples);
  v1alpha1::Model with_runs = wide;
  auto* runs = with_runs.mutable_provenance()->mutable_runs();
  std::map<std::string, const Comparison*> kept;
  for (int i = 0; i < n; ++i) kept[rows.at(i).row->source->run_id()] = &rows[i];
  int k = 0;
  for (auto run = runs->begin(); run != runs->end();) {
    const auto row = kept.find(run->run_id());
    if (run->role() == v1alpha1::RUN_ROLE_TEST && row == kept.end()) {
      run = runs->erase(run);
      continue;
    }
    if (row != kept.end()) {
      const auto [fewer, more] = std::minmax(by_base, by_candidate);
      const double off = k < fewer ? 0 : k < more ? 0.75 : 10;  // half-widths
      for (const Output o : kPredicted) {
        run->set_mean(o, row->second->value[o] + off * row->second->half_width[o]);
      }
      ++k;
    }
    ++run;
  }
  BaseAndCandidate both{with_runs, with_runs};
  v1alpha1::Model& narrow = by_base < by_candidate ? both.base : both.candidate;
  for (double& factor : *narrow.mutable_interval_factor()) factor *= 0.5;
  return both;
}

GateResult Coverage(int n, int by_base, int by_candidate, const GateLimits& limits = {}) {
  const auto [base, candidate] = Covering(n, by_base, by_candidate);
  for (const GateResult& check : GateChecks(base, candidate, limits)) {
    if (check.name == "coverage") return check;
  }
  throw std::logic_error("no check 'coverage'");
}

// Of 50 runs a model whose intervals hold what they promise covers 41 or more, 98 times in 100.
TEST(GateCoverage, IsJudgedByWhatIntervalsPromiseAndNotByALuckyBase) {
  const GateResult fewer = Coverage(50, 50, 45);
  EXPECT_TRUE(fewer.passed) << fewer.detail;
  EXPECT_THAT(fewer.detail, HasSubstr("50 runs held out; f_x 45 (base 50), at least 41"));
  EXPECT_TRUE(Coverage(50, 50, 41).passed);
  EXPECT_TRUE(Coverage(50, 45, 50).passed) << "more is no fault";

  const GateResult few = Coverage(50, 50, 40);
  EXPECT_FALSE(few.passed) << few.detail;
  EXPECT_EQ(few.value, 1);
  GateLimits lenient;
  lenient.coverage_short = 1;
  EXPECT_TRUE(Coverage(50, 50, 40, lenient).passed);
}

TEST(GateCoverage, ABaseBelowTheBandIsNotToBeMadeWorse) {
  EXPECT_TRUE(Coverage(50, 35, 35).passed);
  EXPECT_TRUE(Coverage(50, 35, 38).passed) << "better, though not good";
  const GateResult worse = Coverage(50, 35, 34);
  EXPECT_FALSE(worse.passed);
  EXPECT_THAT(worse.detail, HasSubstr("34 (base 35), at least 35"));
}

TEST(GateCoverage, FewRunsTellLess) {
  EXPECT_TRUE(Coverage(10, 10, 7).passed);
  EXPECT_FALSE(Coverage(10, 10, 6).passed);
}

}  // namespace
}  // namespace grouser::surrogate

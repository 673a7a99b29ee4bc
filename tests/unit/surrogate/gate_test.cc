// What the gate asks of a candidate's intervals, and of its changes over the domain. (The other
// checks: fit_test.cc.)
#include "surrogate/fit/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "surrogate/fit/error_table.h"
#include "surrogate/fit/gate_parts.h"
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

GateResult Check(const std::string& name, const BaseAndCandidate& models,
                 const GateLimits& limits = {}) {
  for (const GateResult& check : GateChecks(models.base, models.candidate, limits)) {
    if (check.name == name) return check;
  }
  throw std::logic_error("no check '" + name + "'");
}

GateResult Coverage(int n, int by_base, int by_candidate, const GateLimits& limits = {}) {
  return Check("coverage", Covering(n, by_base, by_candidate), limits);
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

/// The pair's hybrid, and the same with intervals so many times as wide.
BaseAndCandidate Wider(double factor) {
  BaseAndCandidate both = Covering(50, 45, 45);
  both.candidate = both.base;
  for (double& of : *both.candidate.mutable_interval_factor()) of *= factor;
  return both;
}

TEST(GateWidth, StopsIntervalsThatGrowMoreThanChanceLeaves) {
  const GateResult wider = Check("interval_width", Wider(1.3));
  EXPECT_FALSE(wider.passed) << wider.detail;
  EXPECT_NEAR(wider.value, 1.3, 1e-9);
  EXPECT_THAT(wider.detail, HasSubstr("training runs leave that much; f_x 1.3 (median 1.3), 1.3 at "
                                      "the runs; "));
  // All other checks pass: nothing else looks at it.
  const auto [base, candidate] = Wider(1.3);
  for (const GateResult& check : GateChecks(base, candidate)) {
    EXPECT_EQ(check.passed, check.name != "interval_width") << check.name << ": " << check.detail;
  }
  for (const double honest : {0.7, 1.0, 1.1}) {
    const GateResult check = Check("interval_width", Wider(honest));
    EXPECT_TRUE(check.passed) << check.detail;
  }
  GateLimits limits;
  limits.width_factor = 1.35;
  EXPECT_TRUE(Check("interval_width", Wider(1.3), limits).passed);
  limits.width_factor = 1.05;
  EXPECT_FALSE(Check("interval_width", Wider(1.1), limits).passed);
}

TEST(GateWidth, LooksAtEveryOutputAndAtPartsOfTheDomain) {
  BaseAndCandidate one = Wider(1);
  one.candidate.set_interval_factor(kSinkage, 1.3 * one.base.interval_factor(kSinkage));
  EXPECT_FALSE(Check("interval_width", one).passed);
  // The more it bulldozes the wider, and no wider where it rolls straight.
  BaseAndCandidate sideways = Wider(1);
  sideways.candidate.set_sd_bulldozing(kFx, 4 + 5 * sideways.base.sd_bulldozing(kFx));
  const GateResult check = Check("interval_width", sideways);
  EXPECT_FALSE(check.passed) << check.detail;
}

TEST(GateWidth, IntervalsThatCoverTooLittleMayGrow) {
  const BaseAndCandidate models = Covering(50, 35, 50);  // twice as wide
  const GateResult check = Check("interval_width", models);
  EXPECT_TRUE(check.passed) << check.detail;
  EXPECT_THAT(check.detail, HasSubstr("not judged, as the base's cover too few"));
  EXPECT_FALSE(Check("interval_width", Covering(50, 41, 50)).passed) << "these are as promised";
}

// By numerical integration of the beta density, and Python's statistics.NormalDist.
TEST(GateWidth, ChanceLeavesLessToMoreRuns) {
  EXPECT_NEAR(WidthByChance(30), 1.3859, 1e-4);
  EXPECT_NEAR(WidthByChance(79), 1.2202, 1e-4);
  EXPECT_LT(WidthByChance(1000), 1.06);
  for (int runs = 1; runs <= 2000; ++runs) {
    EXPECT_LE(WidthByChance(runs), WidthByChance(runs - 1)) << runs;
  }
}

// An honest refit moves how much of a load that is too large the soil carries, by much more than
// the interval of f_z, which is how closely a DEM run holds its load.
TEST(GateDomainChange, WhatAnOverloadedSoilCarriesIsNotMeasuredByHowRunsHoldTheirLoad) {
  const v1alpha1::Model base = ReadModel(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/bekker.model").model;
  v1alpha1::Model stiffer = base;
  auto* bekker = stiffer.mutable_bekker();
  bekker->set_k_phi_n_per_m_n_plus_2(1.02 * bekker->k_phi_n_per_m_n_plus_2());
  bekker->set_k_c_n_per_m_n_plus_1(1.02 * bekker->k_c_n_per_m_n_plus_1());
  const auto before = MakeScalar(base), after = MakeScalar(stiffer);
  int overloaded = 0, beyond = 0;
  const std::vector<ScanState> states = Drawn(base.domain());
  for (const ScanState& s : states) {
    const WheelAnswer a = At(*before, s.v, s.load), b = At(*after, s.v, s.load);
    if (((a.flags | b.flags) & kNoEquilibrium) == 0) continue;
    ++overloaded;
    beyond += std::abs(b.value[kFz] - a.value[kFz]) > a.half_width[kFz];
  }
  EXPECT_GT(beyond, 0.01 * static_cast<double>(states.size())) << overloaded << " overloaded";
  const GateResult check = Check("domain_change", {base, stiffer});
  EXPECT_GE(check.value, 0.995) << check.detail;
  EXPECT_TRUE(check.passed);
}

TEST(GateDomainChange, StopsChangesBeyondTheIntervalsOfCarriedLoadsToo) {
  WheelAnswer before{}, after{};
  before.half_width.fill(2);
  after.value[kFz] = 10;
  EXPECT_EQ(MovedAt(before, after).half_widths, 5) << "f_z of a load that is carried";
  after.flags = kNoEquilibrium;
  EXPECT_EQ(MovedAt(before, after).half_widths, 0);
  after.value[kFx] = 6;
  EXPECT_EQ(MovedAt(before, after).half_widths, 3) << "the other outputs count";
  EXPECT_EQ(MovedAt(before, after).output, kFx);

  const v1alpha1::Model base = ReadModel(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model").model;
  v1alpha1::Model shifted = base;
  for (double& c : *shifted.mutable_residual()->mutable_coefficients(kSinkage)->mutable_values()) {
    c += 0.2;  // of the radius
  }
  const GateResult check = Check("domain_change", {base, shifted});
  EXPECT_FALSE(check.passed) << check.detail;
}

}  // namespace
}  // namespace grouser::surrogate

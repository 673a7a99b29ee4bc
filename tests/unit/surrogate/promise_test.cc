// The promise of a tolerance, kept on the test states of the committed pair.
#include "surrogate/accuracy_benchmark/promise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <stdexcept>

#include "proto/records/model_file.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/pair_folder.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/selectable_model.h"
#include "surrogate/models/model_selector.h"
#include "surrogate/models/state_batch.h"
#include "tests/unit/records/throws.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

constexpr char kPair[] = GROUSER_DENSE_PAIR;

int Sum(const std::vector<int>& counts) {
  int sum = 0;
  for (const int c : counts) sum += c;
  return sum;
}

const PromiseRow& RowOf(const Promise& promise, const std::string& tolerance) {
  for (const PromiseRow& row : promise.rows) {
    if (row.tolerance == tolerance) return row;
  }
  throw std::out_of_range(tolerance);
}

/// Of the states answered as good enough, as many are as 90 % allows: per output
/// (what is promised) and on all of them at once (which is not, but holds).
void ExpectKept(const Promise& promise, int fewest_met = 60) {
  int met = 0;
  for (const PromiseRow& row : promise.rows) {
    SCOPED_TRACE(row.tolerance);
    EXPECT_EQ(Sum(row.by_model), row.met);
    met += row.met;
    const int fewest = FewestWithin(row.met);
    for (int o = 0; o < kOutputs; ++o) {
      if (!row.compared[o]) continue;
      EXPECT_GE(row.within[o], fewest) << kOutputFields[o].name << " of " << row.met;
    }
    EXPECT_GE(row.all_within, fewest);
  }
  EXPECT_GT(met, fewest_met) << "too few answers to say that a promise was kept";
}

// Costs as if each kind took longer than the one before; measured ones depend on the machine.
const PromiseOptions kModelByModel = {{10, 20, 40}, false};
const PromiseOptions kTrainingOnly = {{10, 20, 40}, true};
const PromiseOptions kBackwards = {{40, 20, 10}, false};

TEST(Promise, IsKeptOnTheTestStates) { ExpectKept(MeasurePromise(kPair, kModelByModel)); }

// These have fewer test states.
TEST(Promise, IsKeptByTheShippedPairs) {
  for (const PairFolder& pair : FindPairs(GROUSER_PAIRS)) {
    SCOPED_TRACE(pair.name);
    ExpectKept(MeasurePromise(pair.path, kModelByModel), 20);
  }
}

// The test states then test a choice that they had no part in.
TEST(Promise, IsKeptByWhatTrainingAloneSays) { ExpectKept(MeasurePromise(kPair, kTrainingOnly)); }

TEST(Promise, IsKeptWhateverTheRungsCost) {
  ExpectKept(MeasurePromise(kPair));
  ExpectKept(MeasurePromise(kPair, kBackwards));
}

TEST(Promise, TheCheapestIsUsedWhereItSuffices) {
  const Promise promise = MeasurePromise(kPair, kModelByModel);
  EXPECT_EQ(promise.models, (std::vector<std::string>{"bekker", "lookup", "hybrid"}));
  const PromiseRow& loose = RowOf(promise, "30 %");
  EXPECT_EQ(loose.met, loose.n);  // a loose tolerance is met at every state
  EXPECT_EQ(loose.by_model[0], loose.n);
  const PromiseRow& close = RowOf(promise, "15 %");
  EXPECT_LT(close.by_model[0], close.met);  // a closer one takes a dearer kind
  EXPECT_GT(close.by_model[1] + close.by_model[2], 0);
  const PromiseRow& sinkage = RowOf(promise, "sinkage 4 mm");
  EXPECT_GT(sinkage.by_model[1], 0);
  EXPECT_GT(sinkage.by_model[2], 0);  // the second suffices at some states, not at all
  int before = 0;
  for (const char* tolerance : {"3 %", "6 %", "10 %", "15 %", "20 %", "30 %"}) {
    EXPECT_GE(RowOf(promise, tolerance).met, before) << tolerance;
    before = RowOf(promise, tolerance).met;
  }
  EXPECT_EQ(RowOf(promise, "3 %").met, 0);  // one placement scatters by more
}

/// The pair's models as a model selector, without a clock.
struct Pair {
  Pair() {
    std::vector<SelectableModel> choices;
    double cost = 10;
    for (const char* name : {"bekker", "lookup", "hybrid"}) {
      messages.push_back(
          records::ReadModelFile(kPair + ("/" + std::string(name)) + ".model").model);
      models.push_back(MakeModel(messages.back()));
      choices.push_back(MakeSelectableModel(messages.back(), *models.back()));
      choices.back().cost_ns = cost *= 2;
    }
    selector = std::make_unique<const ModelSelector>(choices);
  }
  std::vector<v1alpha1::Model> messages;
  std::vector<std::unique_ptr<const WheelModel>> models;
  std::unique_ptr<const ModelSelector> selector;
};

/// n states inside the hull, where slips are possible, and who answered them.
struct States : StateBatch {
  explicit States(std::size_t n, const TrainingDomain& box) : StateBatch(n, {}), answered_by(n) {
    part[kFx][kValue].resize(n);
    std::mt19937_64 random(5);
    const auto draw = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    for (std::size_t i = 0; i < n;) {
      const VelocityState v =
          FromSlip(draw(-1, box.slip_max), draw(0, box.attack_angle_max_rad), 0.1);
      if (!std::isnan(v.v_x)) Set(i++, v, draw(box.load_min_n, box.load_max_n));
    }
  }
  void Ask(const ModelSelector& selector, const AccuracyRequest& accuracy, std::size_t first,
           std::size_t n) {
    selector.Evaluate(In(first, n), accuracy, Out(first, n),
                      std::span(answered_by).subspan(first, n), nullptr);
  }
  std::vector<std::uint32_t> answered_by;
};

TEST(PromiseOfThePair, LooseIsNeverUnmetInsideTheHullAndTinyAlwaysIs) {
  const Pair pair;
  States states(2000, HullOf(pair.messages[2]));
  AccuracyRequest accuracy;
  accuracy.share_of_load = 1;
  states.Ask(*pair.selector, accuracy, 0, 2000);
  int inside = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    if ((states.flags[i] & (kExtrapolated | kNoEquilibrium)) != 0) continue;
    ++inside;
    EXPECT_FALSE(states.flags[i] & kToleranceUnmet) << i;
  }
  EXPECT_GT(inside, 500);
  accuracy.share_of_load = 1e-6;
  states.Ask(*pair.selector, accuracy, 0, 2000);
  for (std::size_t i = 0; i < 2000; ++i) EXPECT_TRUE(states.flags[i] & kToleranceUnmet) << i;
}

TEST(PromiseOfThePair, AnswersDoNotDependOnTheBatch) {
  const Pair pair;
  States all(1000, HullOf(pair.messages[2]));
  AccuracyRequest accuracy;
  accuracy.share_of_load = 0.13;
  all.Ask(*pair.selector, accuracy, 0, 1000);
  States one = all;
  std::vector<int> used(3, 0);
  for (const std::size_t size : {1, 3, 40}) {
    for (std::size_t first = 0; first + size <= 1000; first += size) {
      one.Ask(*pair.selector, accuracy, first, size);
    }
    for (std::size_t i = 0; i < 1000 / size * size; ++i) {
      ASSERT_EQ(one.answered_by[i], all.answered_by[i]) << i;
      ASSERT_EQ(one.flags[i], all.flags[i]) << i;
      ASSERT_EQ(one.part[kFx][kValue][i], all.part[kFx][kValue][i]) << i;
      ++used[all.answered_by[i]];
    }
  }
  EXPECT_GT(used[1], 0);
  EXPECT_GT(used[2], 0);
}

TEST(SelectableModelOfAModel, RegionsAreTheFitters) {
  constexpr v1alpha1::Region kRegions[] = {v1alpha1::REGION_BRAKING, v1alpha1::REGION_TOWED,
                                           v1alpha1::REGION_DRIVING, v1alpha1::REGION_LATERAL};
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> slip(-1, 1), angle(0, 0.6);
  int seen = 0;
  for (int i = 0; i < 20000; ++i) {
    const double s = i % 2 ? slip(random) : 0.1 * slip(random), a = angle(random);
    const VelocityState v = FromSlip(s, a, 0.2);
    if (std::isnan(v.v_x)) continue;
    ++seen;
    const auto k = static_cast<std::size_t>(ErrorRegionAt(v.v_x, v.v_y, v.rim_speed));
    ASSERT_EQ(kRegions[k], RegionOf(s, a)) << s << " " << a;
  }
  EXPECT_GT(seen, 10000);
}

void AddError(const char* set, v1alpha1::Region region, unsigned n, double rmse,
              v1alpha1::Model* model) {
  auto* row = model->add_errors();
  row->set_set(set);
  row->set_region(region);
  row->set_output("f_x");
  row->set_n(n);
  row->set_rmse(rmse);
}

TEST(SelectableModelOfAModel, TakesTheErrorRowsWithEnoughRuns) {
  const Pair pair;
  v1alpha1::Model message = pair.messages[2];
  message.clear_errors();
  message.mutable_provenance()->clear_runs();
  const double load = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
  const auto rms = [&](ErrorRegion region) {
    return load * MakeSelectableModel(message, *pair.models[2])
                      .rms_error[static_cast<std::size_t>(region)][kFx];
  };
  EXPECT_EQ(rms(ErrorRegion::kTowed), 0);
  AddError("leave_one_out", v1alpha1::REGION_ALL, 50, 1.0, &message);
  EXPECT_NEAR(rms(ErrorRegion::kTowed), 1, 1e-9);
  AddError("held_out", v1alpha1::REGION_ALL, kEnoughRuns - 1, 2.0, &message);
  EXPECT_NEAR(rms(ErrorRegion::kTowed), 1, 1e-9);
  message.mutable_errors(1)->set_n(kEnoughRuns);
  EXPECT_NEAR(rms(ErrorRegion::kTowed), 2, 1e-9);
  AddError("held_out", v1alpha1::REGION_TOWED, 3, 5.0, &message);
  AddError("held_out", v1alpha1::REGION_LATERAL, 30, 3.0, &message);
  EXPECT_NEAR(rms(ErrorRegion::kTowed), 2, 1e-9);
  EXPECT_NEAR(rms(ErrorRegion::kLateral), 3, 1e-9);
  auto* run = message.mutable_provenance()->add_runs();  // the load behind the row
  run->set_role(v1alpha1::RUN_ROLE_TEST);
  run->set_status(v1alpha1::RUN_STATUS_STEADY);
  run->set_load_n(2 * load);
  EXPECT_NEAR(rms(ErrorRegion::kTowed), 1, 1e-9);
}

TEST(SelectableModelOfAModel, PairsAreOneWheelOnOneSoil) {
  const Pair pair;
  v1alpha1::Model a = pair.messages[0], b = pair.messages[2];
  EXPECT_EQ(PairKey(a), PairKey(b));
  b.mutable_wheel()->set_name("else");
  b.mutable_soil()->set_source("somewhere");
  EXPECT_EQ(PairKey(a), PairKey(b));
  b.mutable_wheel()->add_treads()->set_count(12);
  EXPECT_NE(PairKey(a), PairKey(b));
  b = a;
  b.mutable_wheel()->set_width_m(0.06);
  EXPECT_NE(PairKey(a), PairKey(b));
  b = a;
  b.mutable_soil()->mutable_grains()->set_friction(0.9);
  EXPECT_NE(PairKey(a), PairKey(b));
}

TEST(Promise, SaysWhatIsMissing) {
  EXPECT_THROW(MeasurePromise("/nowhere"), std::invalid_argument);
  EXPECT_THAT(MessageOf([] { MeasurePromise(kPair, {{1, 2}, false}); }), HasSubstr("2 numbers"));
  const std::string text = PromiseText(MeasurePromise(kPair, kModelByModel));
  EXPECT_THAT(text, HasSubstr("| 30 % | "));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("broken")));
}

}  // namespace
}  // namespace grouser::surrogate

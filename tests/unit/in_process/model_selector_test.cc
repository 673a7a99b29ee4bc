// grouser::ModelSelector on the committed pair: the choice, its guarantees, its refusals.
#include "grouser/model_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/count_allocations.h"
#include "tests/unit/in_process/batch.h"
#include "tests/unit/records/throws.h"

namespace grouser {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

std::filesystem::path File(const char* model) {
  return std::string(GROUSER_PAIR) + "/" + model + ".model";
}

class ModelSelectorTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    selector_ =
        new ModelSelector(ModelSelector::Open({File("hybrid"), File("bekker"), File("lookup")}));
  }
  static void TearDownTestSuite() { delete std::exchange(selector_, nullptr); }
  static ModelSelector* selector_;
};
ModelSelector* ModelSelectorTest::selector_ = nullptr;

AccuracyRequest Share(double share) {
  AccuracyRequest accuracy;
  accuracy.share_of_load = share;
  return accuracy;
}

TEST_F(ModelSelectorTest, HoldsItsModelsTheCheapestFirst) {
  ASSERT_EQ(selector_->size(), 3u);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < 3; ++k) {
    names.push_back(selector_->model(k).kind());
    EXPECT_GT(selector_->cost_ns(k), 0);
    // Costs within a factor of 1.5 count as equal.
    if (k > 0) {
      EXPECT_GT(1.5 * selector_->cost_ns(k), selector_->cost_ns(k - 1));
    }
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("bekker", "hybrid", "lookup"));
}

// Every answer is bit by bit that of the model that is said to have given it, and
// none before it would have sufficed by its interval alone.
TEST_F(ModelSelectorTest, AnswersAreThoseOfTheRungThatSuffices) {
  constexpr std::size_t n = 400;
  constexpr double kShare = 0.2;
  Batch batch = MakeBatch(n);
  std::vector<std::uint32_t> model(n, 9);
  ASSERT_TRUE(selector_->Evaluate(batch.states(), Share(kShare), batch.answers(), model));
  std::array<Batch, 3> each = {MakeBatch(n), MakeBatch(n), MakeBatch(n)};
  for (std::size_t k = 0; k < 3; ++k) {
    ASSERT_TRUE(selector_->model(k).Evaluate(each[k].states(), each[k].answers()));
  }
  std::array<int, 3> used{};
  int met = 0, unmet = 0;
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_LT(model[i], 3u);
    const bool good = (batch.flags[i] & (kToleranceUnmet | kInvalid)) == 0;
    met += good;
    unmet += (batch.flags[i] & kToleranceUnmet) != 0;
    ++used[model[i]];
    const Batch& own = each[model[i]];
    EXPECT_EQ(batch.flags[i] & ~std::uint32_t{kToleranceUnmet}, own.flags[i]);
    for (std::size_t o = 0; o < kOutputs; ++o) {
      for (std::size_t f = 0; f < kFields; ++f) {
        ASSERT_TRUE(SameBits({batch.out[o][f][i]}, {own.out[o][f][i]}))
            << i << " " << o << " " << f;
      }
      const double half = 0.5 * (batch.out[o][4][i] - batch.out[o][3][i]);
      const double unit = batch.in[3][i] * (o == kTorque || o == kMz ? 0.0625 : 1);
      if (good && o != kSinkage) {
        EXPECT_LE(half, kShare * unit) << i << " " << o;
      }
    }
  }
  EXPECT_GT(met, 0);
  EXPECT_GT(unmet, 0);
  EXPECT_EQ(batch.flags[n - 1], kInvalid);
}

TEST_F(ModelSelectorTest, BudgetsAndNothingAtAll) {
  Batch batch = MakeBatch(64);
  std::vector<std::uint32_t> model(64, 9);
  AccuracyRequest accuracy;
  accuracy.budget_us = 1e-6;
  ASSERT_TRUE(selector_->Evaluate(batch.states(), accuracy, batch.answers(), model));
  EXPECT_THAT(model, testing::Each(0u));
  ASSERT_TRUE(selector_->Evaluate(batch.states(), {}, batch.answers(), model));
  EXPECT_NE(selector_->model(model[0]).kind(), "bekker");  // surer ones are there
  for (const std::uint32_t flags : batch.flags) EXPECT_FALSE(flags & kToleranceUnmet);
}

TEST_F(ModelSelectorTest, AllocatesNothingWhileItAnswers) {
  Batch batch = MakeBatch(300);
  const States in = batch.states();
  const Answers out = batch.answers();
  std::vector<std::uint32_t> model(300);
  AccuracyRequest accuracy = Share(0.12);
  const long before = g_allocations;
  bool done = selector_->Evaluate(in, accuracy, out, model);
  accuracy.budget_us = 20;
  done &= selector_->Evaluate(in, accuracy, out);
  const bool refused = !selector_->Evaluate(in, Share(-1), out);
  const long after = g_allocations;
  EXPECT_EQ(after, before);
  EXPECT_TRUE(done && refused);
  const Batch more(1);
  EXPECT_GT(g_allocations, after) << "allocations are not counted";
}

TEST_F(ModelSelectorTest, RefusesWrongSizesAndNumbersAndTouchesNothing) {
  Batch batch = MakeBatch(8);
  std::vector<std::uint32_t> model(9, 9);
  const auto refused = [&](const States& in, const AccuracyRequest& accuracy, std::size_t models,
                           const char* what) {
    const std::span<std::uint32_t> answered_by(model.data(), models);
    EXPECT_FALSE(selector_->Evaluate(in, accuracy, batch.answers(), answered_by)) << what;
    EXPECT_THAT(ModelSelector::Problem(in, accuracy, batch.answers(), answered_by),
                StartsWith(what));
    EXPECT_TRUE(batch.Untouched()) << what;
    EXPECT_THAT(model, testing::Each(9u));
  };
  States short_load = batch.states();
  short_load.v_x = short_load.v_x.first(7);
  refused(short_load, Share(0.1), 8, "v_x: ");
  refused(batch.states(), Share(0.1), 9, "answered_by: 9 entries, expected 8");
  refused(batch.states(), Share(0.1), 7, "answered_by: ");
  refused(batch.states(), Share(-0.1), 8, "share_of_load: ");
  refused(batch.states(), Share(kNaN), 8, "share_of_load: ");
  AccuracyRequest accuracy;
  accuracy.tolerance[kMz] = std::numeric_limits<double>::infinity();
  refused(batch.states(), accuracy, 8, "tolerance[4]: ");
  accuracy = {};
  accuracy.budget_us = -1;
  refused(batch.states(), accuracy, 0, "budget_us: ");
  EXPECT_EQ(ModelSelector::Problem(batch.states(), Share(0.1), batch.answers()), "");
}

TEST_F(ModelSelectorTest, OpensOneWheelOnOneSoilAlone) {
  EXPECT_THROW(ModelSelector::Open({}), std::invalid_argument);
  EXPECT_THAT(MessageOf([] {
                ModelSelector::Open({File("hybrid"), kSmall});
              }),
              AllOf(StartsWith(kSmall), HasSubstr("another wheel or soil")));
  EXPECT_THAT(MessageOf([] { ModelSelector::Open({File("none")}); }), HasSubstr("none.model"));
  ModelSelector first = ModelSelector::Open({File("hybrid")});
  const ModelSelector second = std::move(first);
  Batch batch = MakeBatch(4);
  // NOLINTNEXTLINE(bugprone-use-after-move,clang-analyzer-cplusplus.Move): what is tested
  EXPECT_FALSE(first.Evaluate(batch.states(), Share(0.3), batch.answers()));
  EXPECT_TRUE(batch.Untouched());
  EXPECT_TRUE(second.Evaluate(batch.states(), Share(0.3), batch.answers()));
}

}  // namespace
}  // namespace grouser

// grouser::Ladder on the committed pair: the choice, its guarantees, its refusals.
#include "grouser/ladder.h"

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

std::filesystem::path File(const char* rung) {
  return std::string(GROUSER_PAIR) + "/" + rung + ".model";
}

class LadderTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ladder_ = new Ladder(Ladder::Open({File("hybrid"), File("bekker"), File("lookup")}));
  }
  static void TearDownTestSuite() { delete std::exchange(ladder_, nullptr); }
  static Ladder* ladder_;
};
Ladder* LadderTest::ladder_ = nullptr;

Demand Share(double share) {
  Demand demand;
  demand.share_of_load = share;
  return demand;
}

TEST_F(LadderTest, HoldsItsModelsTheCheapestFirst) {
  ASSERT_EQ(ladder_->size(), 3u);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < 3; ++k) {
    names.push_back(ladder_->rung(k).rung());
    EXPECT_GT(ladder_->cost_ns(k), 0);
    // Costs within a factor of 1.5 count as equal.
    if (k > 0) {
      EXPECT_GT(1.5 * ladder_->cost_ns(k), ladder_->cost_ns(k - 1));
    }
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("bekker", "hybrid", "lookup"));
}

// Every answer is bit by bit that of the rung that is said to have given it, and
// none before it would have sufficed by its interval alone.
TEST_F(LadderTest, AnswersAreThoseOfTheRungThatSuffices) {
  constexpr std::size_t n = 400;
  constexpr double kShare = 0.2;
  Batch batch = MakeBatch(n);
  std::vector<std::uint32_t> rung(n, 9);
  ASSERT_TRUE(ladder_->Evaluate(batch.states(), Share(kShare), batch.answers(), rung));
  std::array<Batch, 3> each = {MakeBatch(n), MakeBatch(n), MakeBatch(n)};
  for (std::size_t k = 0; k < 3; ++k) {
    ASSERT_TRUE(ladder_->rung(k).Evaluate(each[k].states(), each[k].answers()));
  }
  std::array<int, 3> used{};
  int met = 0, unmet = 0;
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_LT(rung[i], 3u);
    const bool good = (batch.flags[i] & (kToleranceUnmet | kInvalid)) == 0;
    met += good;
    unmet += (batch.flags[i] & kToleranceUnmet) != 0;
    ++used[rung[i]];
    const Batch& own = each[rung[i]];
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

TEST_F(LadderTest, BudgetsAndNothingAtAll) {
  Batch batch = MakeBatch(64);
  std::vector<std::uint32_t> rung(64, 9);
  Demand demand;
  demand.budget_us = 1e-6;
  ASSERT_TRUE(ladder_->Evaluate(batch.states(), demand, batch.answers(), rung));
  EXPECT_THAT(rung, testing::Each(0u));
  ASSERT_TRUE(ladder_->Evaluate(batch.states(), {}, batch.answers(), rung));
  EXPECT_NE(ladder_->rung(rung[0]).rung(), "bekker");  // surer ones are there
  for (const std::uint32_t flags : batch.flags) EXPECT_FALSE(flags & kToleranceUnmet);
}

TEST_F(LadderTest, AllocatesNothingWhileItAnswers) {
  Batch batch = MakeBatch(300);
  const States in = batch.states();
  const Answers out = batch.answers();
  std::vector<std::uint32_t> rung(300);
  Demand demand = Share(0.12);
  const long before = g_allocations;
  bool done = ladder_->Evaluate(in, demand, out, rung);
  demand.budget_us = 20;
  done &= ladder_->Evaluate(in, demand, out);
  const bool refused = !ladder_->Evaluate(in, Share(-1), out);
  const long after = g_allocations;
  EXPECT_EQ(after, before);
  EXPECT_TRUE(done && refused);
  const Batch more(1);
  EXPECT_GT(g_allocations, after) << "allocations are not counted";
}

TEST_F(LadderTest, RefusesWrongSizesAndNumbersAndTouchesNothing) {
  Batch batch = MakeBatch(8);
  std::vector<std::uint32_t> rung(9, 9);
  const auto refused = [&](const States& in, const Demand& demand, std::size_t rungs,
                           const char* what) {
    const std::span<std::uint32_t> rung_of(rung.data(), rungs);
    EXPECT_FALSE(ladder_->Evaluate(in, demand, batch.answers(), rung_of)) << what;
    EXPECT_THAT(Ladder::Problem(in, demand, batch.answers(), rung_of), StartsWith(what));
    EXPECT_TRUE(batch.Untouched()) << what;
    EXPECT_THAT(rung, testing::Each(9u));
  };
  States short_load = batch.states();
  short_load.v_x = short_load.v_x.first(7);
  refused(short_load, Share(0.1), 8, "v_x: ");
  refused(batch.states(), Share(0.1), 9, "rung_of: 9 entries, expected 8");
  refused(batch.states(), Share(0.1), 7, "rung_of: ");
  refused(batch.states(), Share(-0.1), 8, "share_of_load: ");
  refused(batch.states(), Share(kNaN), 8, "share_of_load: ");
  Demand demand;
  demand.tolerance[kMz] = std::numeric_limits<double>::infinity();
  refused(batch.states(), demand, 8, "tolerance[4]: ");
  demand = {};
  demand.budget_us = -1;
  refused(batch.states(), demand, 0, "budget_us: ");
  EXPECT_EQ(Ladder::Problem(batch.states(), Share(0.1), batch.answers()), "");
}

TEST_F(LadderTest, OpensOneWheelOnOneSoilAlone) {
  EXPECT_THROW(Ladder::Open({}), std::invalid_argument);
  EXPECT_THAT(MessageOf([] {
                Ladder::Open({File("hybrid"), kShipped});
              }),
              AllOf(StartsWith(kShipped), HasSubstr("another wheel or soil")));
  EXPECT_THAT(MessageOf([] { Ladder::Open({File("none")}); }), HasSubstr("none.model"));
  Ladder first = Ladder::Open({File("hybrid")});
  const Ladder second = std::move(first);
  Batch batch = MakeBatch(4);
  // NOLINTNEXTLINE(bugprone-use-after-move,clang-analyzer-cplusplus.Move): what is tested
  EXPECT_FALSE(first.Evaluate(batch.states(), Share(0.3), batch.answers()));
  EXPECT_TRUE(batch.Untouched());
  EXPECT_TRUE(second.Evaluate(batch.states(), Share(0.3), batch.answers()));
}

}  // namespace
}  // namespace grouser

// The choice between models, on models whose claims a test can work out by hand.
#include "surrogate/models/model_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <stdexcept>
#include <vector>

#include "surrogate/models/state_batch.h"
#include "tests/unit/count_allocations.h"

namespace grouser::surrogate {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kRadius = 0.1;

/// Every output is value + rim speed, its interval +- half (1 + |v_y|). Flags of its
/// own where v_x > 10.
class Flat final : public WheelModel {
 public:
  Flat(double value, double half, std::uint32_t fast_flags = 0)
      : value_(value), half_(half), fast_flags_(fast_flags) {}

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override {
    evaluated += in.load.size();
    for (std::size_t i = 0; i < in.load.size(); ++i) {
      const bool bad = !(in.load[i] >= 0);
      out.flags[i] = bad ? kInvalid : in.v_x[i] > 10 ? fast_flags_ : 0;
      if (!in.slope_pitch.empty() && in.slope_pitch[i] != 0 && !bad) out.flags[i] |= kSlope;
      if (!in.pass_number.empty() && in.pass_number[i] > 1 && !bad) out.flags[i] |= kVirginAssumed;
      for (int o = 0; o < kOutputs; ++o) {
        const double half = half_ * (1 + std::fabs(in.v_y[i]));
        const OutputView& to = out.output[o];
        const double value = bad ? std::nan("") : value_ + in.rim_speed[i];
        if (!to.value.empty()) to.value[i] = value;
        if (!to.low.empty()) to.low[i] = value - half;
        if (!to.high.empty()) to.high[i] = value + half;
        if (!to.d_load.empty()) to.d_load[i] = value_;
      }
      if (!out.slip.empty()) out.slip[i] = value_;
      if (in.load[i] == 0) WriteAirborne(out, i);
    }
  }
  mutable std::size_t evaluated = 0;

 private:
  double value_, half_;
  std::uint32_t fast_flags_;
};

SelectableModel Selectable(const WheelModel& model, double cost_ns) {
  SelectableModel choice;
  choice.model = &model;
  choice.hull = {-1, 1, 1, 10, 40, 0, 9.81};
  choice.radius_m = kRadius;
  choice.cost_ns = cost_ns;
  return choice;
}

/// Towed wheels, and who answered each.
struct Batch : StateBatch {
  explicit Batch(std::size_t n) : StateBatch(n, {kValue, kLow, kHigh, kDLoad}), answered_by(n, 99) {
    for (std::size_t i = 0; i < n; ++i) Set(i, 0.1, 0, 0.1, 20);
  }
  std::vector<std::uint32_t> answered_by;
};

AccuracyRequest Force(double tolerance) {
  AccuracyRequest accuracy;
  accuracy.tolerance[kFx] = tolerance;
  return accuracy;
}

class ModelSelectorTest : public ::testing::Test {
 protected:
  Flat rough_{1, 4, kNoEquilibrium}, fair_{2, 2, kNoEquilibrium}, fine_{3, 1, kNoEquilibrium};
  ModelSelector selector_{{Selectable(fine_, 400), Selectable(rough_, 10), Selectable(fair_, 100)}};

  void Run(const AccuracyRequest& accuracy, Batch* batch, Shortfall* worst = nullptr) {
    selector_.Evaluate(batch->In(), accuracy, batch->Out(), batch->answered_by, worst);
  }
};

TEST_F(ModelSelectorTest, CheapestThatSufficesAnswersEachState) {
  Batch batch(4);
  batch.v_y = {0, 0.5, 1.2, 4};  // halves of the fair one: 2, 3, 4.4, 10; of the fine one half that
  Shortfall worst;
  Run(Force(4.5), &batch, &worst);
  EXPECT_THAT(batch.answered_by, ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(batch.flags, ElementsAre(0, 0, 0, kToleranceUnmet));
  EXPECT_NEAR(batch.part[kFx][kValue][0], 1.1, 1e-12);
  EXPECT_NEAR(batch.part[kFx][kValue][2], 2.1, 1e-12);
  EXPECT_NEAR(batch.part[kMz][kValue][3], 3.1, 1e-12);
  EXPECT_EQ(batch.part[kFx][kDLoad][3], 3);  // gradients are of who answered
  EXPECT_EQ(worst.index, 3u);
  EXPECT_EQ(worst.output, kFx);
  EXPECT_NEAR(worst.excess, 5 / 4.5, 1e-12);
  EXPECT_EQ(worst.load, 20);
}

TEST_F(ModelSelectorTest, AgainstMeasurementsSdFormCountsAndUnknownNeverSuffices) {
  SelectableModel rough = Selectable(rough_, 10), fair = Selectable(fair_, 100);
  fair.form.region[0].sd[kFx] = 1.5;
  fair.form.region[0].factor[kFx] = 1;  // hypot(2, 1.5) = 2.5
  const ModelSelector selector({rough, fair, Selectable(fine_, 400)});
  AccuracyRequest accuracy = Force(5);
  accuracy.target = IntervalTarget::kMeasured;
  Batch batch(2);
  batch.rim_speed[1] = 0;  // locked: unknown by all
  Shortfall worst;
  std::vector<double> high(2);
  FormView form;
  form.output[kFx].high = high;
  const long before = g_allocations;
  selector.Evaluate(batch.In(), accuracy, batch.Out(), batch.answered_by, &worst, form);
  EXPECT_EQ(g_allocations, before);
  EXPECT_EQ(batch.answered_by[0], 1u);
  EXPECT_NEAR(high[0], 2.1 + 2.5, 1e-12);
  EXPECT_EQ(batch.flags[0] & kToleranceUnmet, 0u);
  EXPECT_TRUE(batch.flags[1] & kToleranceUnmet);
  EXPECT_TRUE(std::isnan(high[1]));
  EXPECT_EQ(worst.excess, 0);  // no DEM run would help
}

// f_z is the load, m_z is measured by nobody: a share can be met without them.
TEST_F(ModelSelectorTest, AgainstMeasurementsAShareIsOfWhatIsMeasured) {
  SelectableModel fair = Selectable(fair_, 100);
  for (const Output o : kMeasurable) {
    fair.form.region[0].sd[o] = o == kTorque ? 0 : 1.5;
    fair.form.region[0].factor[o] = 1;
  }
  const ModelSelector selector({fair});
  AccuracyRequest accuracy;
  accuracy.target = IntervalTarget::kMeasured;
  const auto flags = [&](double share) {
    Batch batch(1);
    accuracy.share_of_load = share;
    selector.Evaluate(batch.In(), accuracy, batch.Out(), batch.answered_by, nullptr);
    return batch.flags[0];
  };
  EXPECT_EQ(flags(1.01), 0u);  // torque 2 of 20 N 0.1 m
  EXPECT_EQ(flags(0.99), kToleranceUnmet);
  accuracy.tolerance[kMz] = 1e6;
  EXPECT_EQ(flags(1.01), kToleranceUnmet);
}

// Where nothing is known of measurements, the one that is surest against DEM answers.
TEST_F(ModelSelectorTest, AgainstMeasurementsUnknownToAllTheSurestAnswers) {
  AccuracyRequest accuracy = Force(1);
  accuracy.target = IntervalTarget::kMeasured;
  Batch batch(3);
  batch.rim_speed[2] = batch.v_x[2] = 0;  // at rest
  Run(accuracy, &batch);
  EXPECT_THAT(batch.answered_by, Each(2u));
  EXPECT_THAT(batch.flags, Each(kToleranceUnmet));
}

// Blocks of one answerer and mixed ones say the same of measurements.
TEST_F(ModelSelectorTest, FormIsThatOfWhoAnsweredAlsoInOneBlock) {
  SelectableModel fair = Selectable(fair_, 100), fine = Selectable(fine_, 400);
  for (SelectableModel* model : {&fair, &fine}) {
    model->form.region[0].sd.fill(model == &fair ? 1 : 2);
    model->form.region[0].factor.fill(1);
  }
  const ModelSelector selector({fair, fine});
  for (const std::size_t mixed : {0, 1}) {
    Batch batch(3);
    if (mixed == 1) batch.v_y = {0, 0.008, 0};
    std::vector<double> sd(3);
    FormView form;
    form.output[kFx].sd = sd;
    selector.Evaluate(batch.In(), Force(2.01), batch.Out(), batch.answered_by, nullptr, form);
    EXPECT_THAT(batch.answered_by, ElementsAre(0, mixed, 0));
    EXPECT_THAT(sd, ElementsAre(1, mixed + 1.0, 1));
    EXPECT_THAT(batch.flags, Each(0u));
  }
}

TEST_F(ModelSelectorTest, DearerRungsSeeOnlyWhatIsLeft) {
  Batch batch(300);
  batch.v_y[7] = batch.v_y[200] = 1;
  rough_.evaluated = fair_.evaluated = fine_.evaluated = 0;
  Run(Force(4.5), &batch);
  EXPECT_EQ(rough_.evaluated, 300u);
  EXPECT_EQ(fair_.evaluated, 2u);
  EXPECT_EQ(fine_.evaluated, 0u);
}

TEST_F(ModelSelectorTest, UnmetStatesGetTheRungThatExceedsLeast) {
  Batch batch(2);
  Run(Force(0.01), &batch);
  EXPECT_THAT(batch.answered_by, Each(2u));
  EXPECT_THAT(batch.flags, Each(kToleranceUnmet));
  // Least by the worst output: a cheaper model that is better there keeps the answer.
  const Flat cheap(7, 0.5);
  const ModelSelector other({Selectable(cheap, 1), Selectable(fine_, 10)});
  other.Evaluate(batch.In(), Force(0.01), batch.Out(), batch.answered_by, nullptr);
  EXPECT_THAT(batch.answered_by, Each(0u));
  EXPECT_NEAR(batch.part[kFx][kValue][1], 7.1, 1e-12);
}

TEST_F(ModelSelectorTest, SharesScaleWithLoadAndRadiusAndLeaveSinkageAlone) {
  AccuracyRequest accuracy;
  accuracy.share_of_load = 0.5;
  accuracy.tolerance[kTorque] = 0.8;
  accuracy.tolerance[kSinkage] = 0.25;
  const auto at = accuracy.At(20, kRadius);
  EXPECT_DOUBLE_EQ(at[kFx], 10);
  EXPECT_DOUBLE_EQ(at[kFz], 10);
  EXPECT_DOUBLE_EQ(at[kTorque], 0.8);  // the smaller one
  EXPECT_DOUBLE_EQ(at[kMz], 1);
  EXPECT_DOUBLE_EQ(at[kSinkage], 0.25);
  EXPECT_TRUE(std::isinf(Force(1).At(20, kRadius)[kFy]));
}

TEST_F(ModelSelectorTest, AnErrorTableWorseThanTheIntervalCounts) {
  SelectableModel boaster = Selectable(fine_, 1);
  const auto driving = static_cast<std::size_t>(ErrorRegion::kDriving);
  boaster.rms_error[driving][kFx] = 0.2;  // of the load: claims 1.645 x 4 N
  const ModelSelector selector({boaster, Selectable(fair_, 100)});
  Batch batch(2);
  batch.rim_speed = {0.3, 0.1};  // driving, towed
  selector.Evaluate(batch.In(), Force(2.5), batch.Out(), batch.answered_by, nullptr);
  EXPECT_THAT(batch.answered_by, ElementsAre(1, 0));
  EXPECT_THAT(batch.flags, Each(0u));
  EXPECT_NEAR(ClaimedError(boaster, ErrorRegion::kDriving, kFx, -1, 1, 20), 1.6449 * 0.2 * 20,
              1e-3);
  EXPECT_EQ(ClaimedError(boaster, ErrorRegion::kTowed, kFx, -1, 1, 20), 1);
}

TEST_F(ModelSelectorTest, WithoutIntervalAndTableNothingSuffices) {
  const Flat silent(5, 0);
  const ModelSelector selector({Selectable(silent, 1)});
  Batch batch(1);
  selector.Evaluate(batch.In(), Force(1e9), batch.Out(), batch.answered_by, nullptr);
  EXPECT_EQ(batch.flags[0], kToleranceUnmet);
}

TEST_F(ModelSelectorTest, InvalidStatesStayInvalidAndHarmNoOther) {
  Batch batch(3);
  batch.load[1] = -1;
  Shortfall worst;
  Run(Force(1e-3), &batch, &worst);
  EXPECT_THAT(batch.flags, ElementsAre(kToleranceUnmet, kInvalid, kToleranceUnmet));
  EXPECT_TRUE(std::isnan(batch.part[kFx][kValue][1]));
  EXPECT_EQ(batch.answered_by[1], 0u);
  EXPECT_NE(worst.index, 1u);
}

TEST_F(ModelSelectorTest, AnswersThatLeaveSomethingOutPromiseNothing) {
  Batch batch(5);
  batch.v_x[3] = 11;  // NO_EQUILIBRIUM
  const std::vector<double> pitch = {0.1, 0, 0, 0, 0}, yaw = {0, 0.1, 0, 0, 0};
  const std::vector<std::uint32_t> pass = {1, 1, 2, 1, 1};
  WheelStatesView in = batch.In();
  in.slope_pitch = pitch;
  in.yaw_rate = yaw;
  in.pass_number = pass;
  Shortfall worst;
  selector_.Evaluate(in, Force(1e9), batch.Out(), batch.answered_by, &worst);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(batch.flags[i] & kToleranceUnmet) << i;
    EXPECT_EQ(batch.answered_by[i], 2u) << i;  // the one that is surest
  }
  EXPECT_TRUE(batch.flags[2] & kVirginAssumed);  // the context went along to the last model
  EXPECT_EQ(batch.flags[4], 0u);
  EXPECT_EQ(worst.excess, 0);  // no DEM run would help
}

TEST_F(ModelSelectorTest, CostsThatTimingCannotTellApartAreOrderedByClaim) {
  const ModelSelector near({Selectable(rough_, 10), Selectable(fine_, 14), Selectable(fair_, 16)});
  EXPECT_EQ(near.models()[0].model, &fine_);
  EXPECT_EQ(near.models()[1].model, &rough_);
  EXPECT_EQ(near.models()[2].model, &fair_);
  EXPECT_EQ(near.most_accurate(), 0u);
  EXPECT_EQ(selector_.models()[0].model, &rough_);
  EXPECT_EQ(selector_.most_accurate(), 2u);
}

TEST_F(ModelSelectorTest, BudgetAloneBuysTheMostAccurateRungThatFits) {
  Batch batch(10);
  const auto bought = [&](double ns) {
    AccuracyRequest accuracy;
    accuracy.budget_ns = ns;
    Run(accuracy, &batch);
    EXPECT_THAT(batch.flags, Each(0u));
    EXPECT_THAT(batch.answered_by, Each(batch.answered_by[0]));
    return batch.answered_by[0];
  };
  EXPECT_EQ(bought(1), 0u);  // the cheapest always answers
  EXPECT_EQ(bought(999), 0u);
  EXPECT_EQ(bought(1000), 1u);
  EXPECT_EQ(bought(4000), 2u);
  EXPECT_EQ(bought(0), 2u);  // no budget, no tolerance: the most accurate
}

TEST_F(ModelSelectorTest, BudgetEndsTheClimbAndTheFlagSaysSo) {
  Batch batch(10);
  AccuracyRequest accuracy = Force(1.5);  // the fine one
  accuracy.budget_ns = 100 + 10 * 100 + 3 * 400;
  Run(accuracy, &batch);
  EXPECT_THAT(batch.answered_by, ElementsAre(2, 2, 2, 1, 1, 1, 1, 1, 1, 1));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(batch.flags[i], i < 3 ? 0u : kToleranceUnmet) << i;
  accuracy.budget_ns = 50;  // less than the cheapest costs
  Run(accuracy, &batch);
  EXPECT_THAT(batch.answered_by, Each(0u));
  EXPECT_THAT(batch.flags, Each(kToleranceUnmet));
}

TEST_F(ModelSelectorTest, ARungThatTheBudgetCannotPayIsPassedOver) {
  // Equally dear by the rule, so that the finer one comes first; only the other fits.
  const ModelSelector near(
      {Selectable(rough_, 10), Selectable(fine_, 140), Selectable(fair_, 100)});
  Batch batch(1);
  AccuracyRequest accuracy = Force(2.5);
  accuracy.budget_ns = 120;
  near.Evaluate(batch.In(), accuracy, batch.Out(), batch.answered_by, nullptr);
  ASSERT_EQ(near.models()[2].model, &fair_);
  EXPECT_EQ(batch.answered_by[0], 2u);
  EXPECT_EQ(batch.flags[0], 0u);
}

TEST_F(ModelSelectorTest, BudgetIsSpentInProportionAlongTheCall) {
  const std::size_t n = 4 * ModelSelector::kBlock;
  Batch batch(n);
  AccuracyRequest accuracy = Force(2.5);  // the fair one
  accuracy.budget_ns = 10.0 * n + 100.0 * n / 2;
  rough_.evaluated = fair_.evaluated = fine_.evaluated = 0;
  Run(accuracy, &batch);
  const double cost = 10.0 * rough_.evaluated + 100.0 * fair_.evaluated + 400.0 * fine_.evaluated;
  EXPECT_LE(cost, accuracy.budget_ns);
  EXPECT_GE(cost, accuracy.budget_ns - 100);
  for (std::size_t block = 0; block < 4; ++block) {
    const auto begin = batch.answered_by.begin() + block * ModelSelector::kBlock;
    EXPECT_EQ(std::count(begin, begin + ModelSelector::kBlock, 1u), ModelSelector::kBlock / 2)
        << block;
  }
}

Batch RandomBatch(std::size_t n) {
  Batch batch(n);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> speed(-1, 1);
  for (std::size_t i = 0; i < n; ++i) {
    batch.v_x[i] = speed(random);
    batch.v_y[i] = 3 * speed(random);
    batch.rim_speed[i] = speed(random);
  }
  return batch;
}

TEST_F(ModelSelectorTest, FlagIsMonotoneInTheTolerance) {
  Batch batch = RandomBatch(200);
  std::vector<bool> met(200, false);
  std::size_t before = 0;
  for (const double tolerance : {0.1, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 20.0}) {
    Run(Force(tolerance), &batch);
    std::size_t count = 0;
    for (std::size_t i = 0; i < 200; ++i) {
      const bool now = (batch.flags[i] & kToleranceUnmet) == 0;
      EXPECT_TRUE(now || !met[i]) << tolerance << " " << i;
      met[i] = now;
      count += now;
    }
    if (tolerance == 0.1) {
      EXPECT_EQ(count, 0u);
    }
    EXPECT_GE(count, before);
    before = count;
  }
  EXPECT_EQ(before, 200u);
}

TEST_F(ModelSelectorTest, AnAnswerDoesNotDependOnItsBatchMates) {
  Batch all = RandomBatch(500);
  Run(Force(3), &all);
  for (const std::size_t size : {1, 7, 129}) {
    for (std::size_t first = 0; first + size <= 500; first += size) {
      Batch some(size);
      for (std::size_t i = 0; i < size; ++i) {
        some.v_x[i] = all.v_x[first + i];
        some.v_y[i] = all.v_y[first + i];
        some.rim_speed[i] = all.rim_speed[first + i];
      }
      Run(Force(3), &some);
      for (std::size_t i = 0; i < size; ++i) {
        ASSERT_EQ(some.answered_by[i], all.answered_by[first + i]);
        ASSERT_EQ(some.flags[i], all.flags[first + i]);
        for (const Part p : {kValue, kLow, kHigh, kDLoad})
          ASSERT_EQ(some.part[kFx][p][i], all.part[kFx][p][first + i]);
      }
    }
  }
}

TEST_F(ModelSelectorTest, WithoutSpansForIntervalsTheChoiceIsTheSame) {
  Batch all = RandomBatch(300), few = RandomBatch(300);
  Run(Force(3), &all);
  ResponsesView out;
  out.flags = few.flags;
  out.output[kFy].value = few.part[kFy][kValue];
  selector_.Evaluate(few.In(), Force(3), out, few.answered_by, nullptr);
  EXPECT_EQ(few.answered_by, all.answered_by);
  EXPECT_EQ(few.flags, all.flags);
  EXPECT_EQ(few.part[kFy][kValue], all.part[kFy][kValue]);
  EXPECT_THAT(few.part[kFx][kValue], Each(::testing::IsNan()));
}

TEST_F(ModelSelectorTest, AllocatesNothingAndTakesAnEmptyBatch) {
  Batch batch = RandomBatch(300), none(0);
  const ResponsesView out = batch.Out(), nothing = none.Out();
  AccuracyRequest accuracy = Force(3);
  Shortfall worst;
  const long before = g_allocations;
  selector_.Evaluate(batch.In(), accuracy, out, batch.answered_by, &worst);
  accuracy.budget_ns = 1e4;
  selector_.Evaluate(batch.In(), accuracy, out, batch.answered_by, &worst);
  selector_.Evaluate(batch.In(), {}, out, {}, nullptr);
  selector_.Evaluate(none.In(), accuracy, nothing, {}, &worst);
  EXPECT_EQ(g_allocations, before);
  EXPECT_EQ(worst.excess, 0);
  const Batch more(1);
  EXPECT_GT(g_allocations, before) << "allocations are not counted";
}

// Zeros are exact: they meet any tolerance, and no DEM run is proposed for them.
TEST_F(ModelSelectorTest, AWheelOffTheGroundMeetsEveryTolerance) {
  Batch batch(3);
  batch.load[1] = 0;
  AccuracyRequest accuracy = Force(1e-9);
  accuracy.share_of_load = 1e-9;
  Shortfall worst;
  Run(accuracy, &batch, &worst);
  EXPECT_THAT(batch.flags, ElementsAre(kToleranceUnmet, kAirborne, kToleranceUnmet));
  EXPECT_EQ(batch.answered_by[1], 0u);
  EXPECT_NE(worst.index, 1u);
  for (const auto& output : batch.part) EXPECT_EQ(output[kHigh][1], 0);
}

TEST_F(ModelSelectorTest, RegionsHaveBothMirrors) {
  EXPECT_EQ(ErrorRegionAt(0.1, 0, 0.2), ErrorRegion::kDriving);
  EXPECT_EQ(ErrorRegionAt(-0.1, 0, -0.2), ErrorRegion::kDriving);
  EXPECT_EQ(ErrorRegionAt(0.1, 0, 0.05), ErrorRegion::kBraking);
  EXPECT_EQ(ErrorRegionAt(0.1, 0, 0.102), ErrorRegion::kTowed);
  EXPECT_EQ(ErrorRegionAt(0, 0.1, 0), ErrorRegion::kLateral);
  EXPECT_EQ(ErrorRegionAt(-0.1, -0.03, -0.1), ErrorRegion::kLateral);
  EXPECT_EQ(ErrorRegionAt(0, 0, 0.1), ErrorRegion::kDriving);
}

TEST_F(ModelSelectorTest, MeasuredCostsTellADearModelFromACheapOne) {
  class Slow final : public WheelModel {
   public:
    void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override {
      volatile double work = 0;
      for (std::size_t i = 0; i < 2000 * in.load.size(); ++i) work = work + 1;
      Flat(1, 1).Evaluate(in, out);
    }
  };
  const Slow slow;
  const double cheap = MeasureCost(Selectable(rough_, 0)), dear = MeasureCost(Selectable(slow, 0));
  EXPECT_GT(cheap, 0);
  EXPECT_GT(dear, ModelSelector::kSameCost * cheap);
}

TEST_F(ModelSelectorTest, RefusesWhatMakesNoSelector) {
  const auto complaint = [](std::vector<SelectableModel> models) -> std::string {
    try {
      const ModelSelector selector(std::move(models));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(complaint({}), HasSubstr("no model"));
  EXPECT_THAT(complaint({Selectable(fine_, 1), {}}), HasSubstr("model 1: no model"));
  EXPECT_THAT(complaint({Selectable(fine_, 0)}), HasSubstr("cost_ns"));
  SelectableModel other = Selectable(fine_, 1);
  other.radius_m = 0.2;
  EXPECT_THAT(complaint({Selectable(fine_, 1), other}), HasSubstr("one wheel"));
}

}  // namespace
}  // namespace grouser::surrogate

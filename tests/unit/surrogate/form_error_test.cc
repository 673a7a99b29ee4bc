// DEM minus measurement beside an answer: regions, what is unknown, intervals.
#include "surrogate/models/form_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

MeasuredRegion At(double rim_over_hub, double angle) {
  return MeasuredRegionAt(std::cos(angle), std::sin(angle), rim_over_hub);
}

TEST(MeasuredRegion, ToldByTheRimOverTheHubAndTheAngle) {
  for (const double degrees : {0.0, 4.9, 5.1, 30.0, 60.0, 89.0}) {
    const auto gentle = degrees < 5 ? MeasuredRegion::kStraight : MeasuredRegion::kAngled;
    for (const double over : {0.7995, 0.8, 1.0, 1.3, 100.0}) {
      EXPECT_EQ(At(over, degrees * kDegree), gentle) << over << " at " << degrees;
    }
    for (const double over : {-1.5, -0.3, 0.002, 0.3, 0.798}) {
      EXPECT_EQ(At(over, degrees * kDegree), MeasuredRegion::kBraking) << over << " at " << degrees;
    }
    for (const double over : {-0.0009, 0.0, 0.0009}) {
      EXPECT_EQ(At(over, degrees * kDegree), MeasuredRegion::kLocked) << over << " at " << degrees;
    }
  }
  EXPECT_EQ(MeasuredRegionAt(0, 0, 0.1), MeasuredRegion::kStraight);  // spins on the spot
}

TEST(MeasuredRegion, MirrorsChangeNothing) {
  for (const double rim : {-0.1, 0.0, 0.03, 0.09, 0.2}) {
    for (const double y : {0.0, 0.002, 0.05}) {
      for (const double x : {0.0, 0.02, 0.1}) {
        if (x == 0 && y == 0 && rim == 0) continue;
        const MeasuredRegion one = MeasuredRegionAt(x, y, rim);
        EXPECT_EQ(one, MeasuredRegionAt(x, -y, rim));
        if (x != 0) {
          EXPECT_EQ(one, MeasuredRegionAt(-x, y, -rim));
        }
      }
    }
  }
}

/// f_x = 10 +- 3, the others 0 +- 1; says itself that nothing is known.
class Constant final : public WheelModel {
 public:
  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override {
    for (std::size_t i = 0; i < in.load.size(); ++i) {
      out.flags[i] = in.load[i] >= 0 ? kFormUnknown : kInvalid;
      for (int o = 0; o < kOutputs; ++o) {
        const double value = o == kFx ? 10 : 0, half = o == kFx ? 3 : 1;
        const OutputView& to = out.output[o];
        if (!to.value.empty()) to.value[i] = value;
        if (!to.low.empty()) to.low[i] = value - half;
        if (!to.high.empty()) to.high[i] = value + half;
      }
      if (in.load[i] == 0) WriteAirborne(out, i);
    }
  }
};

FormErrors::OfRegion& Of(FormErrors& form, MeasuredRegion region) {
  return form.region[static_cast<std::size_t>(region)];
}

/// Straight: f_x and sinkage; angled: everything; elsewhere nothing.
FormErrors SomeForm() {
  FormErrors form;
  form.middle_load_n = 20;
  Of(form, MeasuredRegion::kStraight).sd[kFx] = Of(form, MeasuredRegion::kStraight).sd[kSinkage] =
      2;
  Of(form, MeasuredRegion::kStraight).factor.fill(2);
  Of(form, MeasuredRegion::kAngled).sd.fill(1);
  Of(form, MeasuredRegion::kAngled).factor.fill(4);
  return form;
}

struct FormBatch : StateBatch {
  FormBatch(std::size_t n, std::initializer_list<Part> parts) : StateBatch(n, parts) {
    for (auto& output : form) {
      for (auto& part : output) part.assign(n, -99);
    }
    for (std::size_t i = 0; i < n; ++i) Set(i, 0.1, 0, 0.1, 20);
  }
  FormView View() {
    FormView view;
    for (int o = 0; o < kOutputs; ++o) view.output[o] = {form[o][0], form[o][1], form[o][2]};
    return view;
  }
  std::array<std::array<std::vector<double>, 3>, kOutputs> form;
};

TEST(FormErrors, AddsInSquaresByRegionAndLoad) {
  FormBatch batch(4, {kValue});  // low and high: nobody's
  batch.Set(1, 0.1, 0, 0.1, 40);
  batch.Set(2, 0.05, 0.05, 0.1, 20);
  batch.Set(3, 0.1, 0, 0.02, 20);
  EvaluateWithForm(Constant(), SomeForm(), batch.In(), batch.Out(), batch.View());
  EXPECT_DOUBLE_EQ(batch.form[kFx][0][0], 2);
  EXPECT_DOUBLE_EQ(batch.form[kFx][1][0], 10 - 5);  // hypot(3, 2 2)
  EXPECT_DOUBLE_EQ(batch.form[kFx][2][0], 10 + 5);
  EXPECT_DOUBLE_EQ(batch.form[kFx][0][1], 4);  // twice the middle load
  EXPECT_DOUBLE_EQ(batch.form[kFx][2][1], 10 + std::hypot(3, 8));
  EXPECT_DOUBLE_EQ(batch.form[kSinkage][0][1], 2);  // not by load
  EXPECT_DOUBLE_EQ(batch.form[kTorque][2][2], std::hypot(1, 4));
  for (const int part : {0, 1, 2}) {
    EXPECT_TRUE(std::isnan(batch.form[kTorque][part][0]));  // not measured, never 0
    EXPECT_TRUE(std::isnan(batch.form[kFx][part][3]));      // no row in the region
  }
  EXPECT_EQ(batch.flags[0], kFormUnknown);
  EXPECT_EQ(batch.flags[2], 0u);
  EXPECT_EQ(batch.flags[3], kFormUnknown);
}

TEST(FormErrors, AtRestUnknownInvalidNanAirborneZero) {
  FormBatch batch(3, {kValue, kLow, kHigh});
  batch.Set(0, 0, 0, 0, 20);
  batch.Set(1, 0.05, 0.05, 0.1, -1);
  batch.Set(2, 0.05, 0.05, 0.1, 0);
  EvaluateWithForm(Constant(), SomeForm(), batch.In(), batch.Out(), batch.View());
  for (const auto& output : batch.form) {
    for (const auto& part : output) {
      EXPECT_TRUE(std::isnan(part[0]));
      EXPECT_TRUE(std::isnan(part[1]));
      EXPECT_EQ(part[2], 0);
    }
  }
  EXPECT_EQ(batch.flags[0], kFormUnknown);
  EXPECT_EQ(batch.flags[1], kInvalid);
  EXPECT_EQ(batch.flags[2], kAirborne);
}

TEST(FormErrors, BlocksAndWhatNobodyWantsChangeNothing) {
  constexpr std::size_t kMany = 300;  // more than a block
  FormBatch all(kMany, {kValue, kLow, kHigh}), less(kMany, {});
  for (FormBatch* batch : {&all, &less}) {
    for (std::size_t i = 0; i < kMany; ++i) {
      batch->Set(i, 0.1, 1e-3 * static_cast<double>(i % 50), 1e-3 * static_cast<double>(i), 20);
    }
  }
  FormView high;
  high.output[kFx].high = less.form[kFx][2];
  EvaluateWithForm(Constant(), SomeForm(), all.In(), all.Out(), all.View());
  EvaluateWithForm(Constant(), SomeForm(), less.In(), less.Out(), high);
  for (std::size_t i = 0; i < kMany; ++i) {
    const double a = all.form[kFx][2][i], b = less.form[kFx][2][i];
    EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << i;
    EXPECT_EQ(all.flags[i], less.flags[i]) << i;
  }
  EXPECT_EQ(less.form[kFx][1][0], -99);
  FormBatch alone(kMany, {kValue});
  EvaluateWithForm(Constant(), FormErrors(), alone.In(), alone.Out(), {});
  EXPECT_EQ(alone.flags[7], kFormUnknown);
}

TEST(FormErrors, WithoutAFactorNothingIsKnown) {
  FormErrors form = SomeForm();
  EXPECT_TRUE(form.ClearsFlags());
  Of(form, MeasuredRegion::kAngled).factor[kMz] = std::nan("");
  EXPECT_FALSE(form.ClearsFlags());
  FormBatch batch(1, {kValue});
  batch.Set(0, 0.05, 0.05, 0.1, 20);
  EvaluateWithForm(Constant(), form, batch.In(), batch.Out(), batch.View());
  EXPECT_EQ(batch.flags[0], kFormUnknown);
  EXPECT_TRUE(std::isnan(batch.form[kMz][1][0]));
  EXPECT_FALSE(std::isnan(batch.form[kFx][1][0]));
  Of(form, MeasuredRegion::kAngled).factor[kMz] = 1;
  Of(form, MeasuredRegion::kAngled).factor[kFz] = std::nan("");  // the load is not counted
  EXPECT_TRUE(form.ClearsFlags());
}

TEST(FormErrors, OneAnswerIsThatOfABatch) {
  WheelAnswer answer = AnswerOf(Constant(), {0.05, 0.05, 0.1}, 20);
  const FormAnswer form = FormOf(SomeForm(), {0.05, 0.05, 0.1}, 20, &answer);
  EXPECT_DOUBLE_EQ(form.sd[kFx], 1);
  EXPECT_DOUBLE_EQ(form.half_width[kFx], 5);
  EXPECT_EQ(answer.flags, 0u);
}

}  // namespace
}  // namespace grouser::surrogate

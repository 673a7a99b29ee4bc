#include "surrogate/fit/untuned_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surrogate/model_io/self_test.h"
#include "surrogate/soils/soil_library.h"

namespace grouser::surrogate {
namespace {

class UntunedModel : public ::testing::Test {
 protected:
  static SoilLibrary Library() {
    SoilLibrary library;
    library.Add(GROUSER_SOILS);
    return library;
  }
  static v1alpha1::Model Make(double radius, double width) {
    UntunedRequest request;
    request.name = "mine";
    request.wheel.set_name("wheel");
    request.wheel.set_radius_m(radius);
    request.wheel.set_width_m(width);
    request.soil = Library().Find("lete SAND").soil;
    return MakeUntuned(request, ErrorsOfUntuned(FindPairs(GROUSER_PAIRS, GROUSER_SOILS)));
  }
};

TEST_F(UntunedModel, IsServedWithItsFlagAndAnIntervalThatGoesWithTheLoad) {
  const v1alpha1::Model message = Make(0.13, 0.1);
  EXPECT_TRUE(message.untuned());
  const auto model = MakeTestedModel(message);  // what a server does first
  const double middle = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
  const WheelAnswer at = AnswerOf(*model, FromSlip(0.2, 0, 0.2), middle);
  EXPECT_EQ(at.flags, kUntuned | kFormUnknown);
  const WheelAnswer twice = AnswerOf(*model, FromSlip(0.2, 0, 0.2), 2 * middle);
  EXPECT_NEAR(twice.half_width[kFx], 2 * at.half_width[kFx], 1e-3 * at.half_width[kFx]);
  EXPECT_NEAR(twice.half_width[kSinkage], at.half_width[kSinkage], 1e-6);
  EXPECT_GT(at.half_width[kFx], 0.1 * middle);  // nothing was fitted: it is wide
  // Sideways wheels were off by more.
  const WheelAnswer aside = AnswerOf(*model, FromSlip(0, 1.5, 0.2), middle);
  EXPECT_GT(aside.half_width[kFy], 2 * at.half_width[kFy]);
  // A load of 0 is no answer of the model.
  EXPECT_EQ(AnswerOf(*model, FromSlip(0.2, 0, 0.2), 0).flags, kAirborne);
}

TEST_F(UntunedModel, IntervalsHoldTheOtherPair) {
  const ErrorSpread spread = SpreadOf(ErrorsOfUntuned(FindPairs(GROUSER_PAIRS, GROUSER_SOILS)));
  for (const Output o : kPredicted) {
    EXPECT_GE(spread.other_pairs[o], 0.8) << kOutputFields[o].name;
  }
}

double MeanError(const PairErrors& errors, int o) {
  double sum = 0;
  for (const LeftOut& l : errors.rows) {
    sum +=
        std::fabs(l.row->mean[o] - l.prediction.value[o]) / static_cast<double>(errors.rows.size());
  }
  return sum;
}

TEST_F(UntunedModel, FittedModelsOfThePairsAreLessOff) {
  const auto pairs = FindPairs(GROUSER_PAIRS, GROUSER_SOILS);
  const PairErrors untuned = ErrorsOfUntuned(pairs), fitted = ErrorsOfFitted(pairs);
  for (const Output o : {kFx, kFy, kTorque, kSinkage}) {
    EXPECT_LT(MeanError(fitted, o), 0.7 * MeanError(untuned, o)) << kOutputFields[o].name;
  }
}

TEST_F(UntunedModel, RefusesLoadsThatAreNone) {
  UntunedRequest request;
  request.name = "mine";
  request.wheel.set_radius_m(0.1);
  request.wheel.set_width_m(0.1);
  request.soil = Library().Find("LETE sand").soil;
  request.load_min_n = 50;
  request.load_max_n = 20;
  const PairErrors errors = ErrorsOfUntuned(FindPairs(GROUSER_PAIRS, GROUSER_SOILS));
  EXPECT_THROW(MakeUntuned(request, errors), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::surrogate

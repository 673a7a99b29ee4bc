#include "surrogate/fit/untuned_model.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "proto/records/yaml/message_yaml.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/soils/soil_library.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

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
  // What is said of a wheel file.
  std::string Said(const std::string& yaml) {
    const std::string path = folder_ / "w.yaml";
    std::ofstream(path) << yaml;
    try {
      return "name " + records::LoadWheel(path).name();
    } catch (const records::InputError& error) {
      return error.what();
    }
  }

  const records::TempFolder folder_;
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

TEST_F(UntunedModel, FittedModelsOfThePairsAreLessOff) {
  const auto pairs = FindPairs(GROUSER_PAIRS, GROUSER_SOILS);
  const ErrorSpread untuned = SpreadOf(ErrorsOfUntuned(pairs)),
                    fitted = SpreadOf(ErrorsOfFitted(pairs));
  for (const Output o : {kFx, kTorque, kSinkage}) {
    EXPECT_LT(fitted.inside[o], untuned.inside[o]) << kOutputFields[o].name;
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

TEST_F(UntunedModel, WheelFilesAreReadAloneOrInAScene) {
  EXPECT_EQ(Said("radius_m: 0.1\nwidth_m: 0.05\n"), "name w");
  EXPECT_EQ(Said("name: a\nsoil: {}\nwheel:\n  name: b\n  radius_m: 0.1\n  width_m: 0.05\n"),
            "name b");
  EXPECT_THAT(Said("radius_m: 100\nwidth_m: 0.05\n"),
              HasSubstr("w.yaml:1: key 'radius_m': got '100', expected a number in [0.005, 5]"));
  EXPECT_THAT(Said("radius_m: 0.1\nwidth_m: 0.05\nwidht: 1\n"),
              HasSubstr("w.yaml:3: key 'widht': got an unknown key"));
  EXPECT_THAT(Said("radius_m: 0.1\n"), HasSubstr("width_m"));
}

TEST_F(UntunedModel, UnknownSoilsGetTheNearestNames) {
  const auto said = [](const std::string& name) -> std::string {
    try {
      return Library().Find(name).soil.name;
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  EXPECT_THAT(said("sandi loam 20"), HasSubstr("the nearest: Sandy loam 15 %; Sandy loam 22 %;"));
  EXPECT_THAT(said("FJS1"), HasSubstr("the nearest: FJS-1"));
  EXPECT_THAT(said("no-such.csv"), HasSubstr("no-such.csv"));
  // A file of one soil is that soil, whatever the ranges of published ones.
  const std::string path = folder_ / "soil.csv";
  Soil own = Library().Find("LETE sand").soil;
  own.name = "mine";
  own.k_c = -3e5;
  std::ofstream(path) << "# by somebody\n" << WriteSoils({own});
  EXPECT_EQ(said(path), "mine");
  EXPECT_THAT(Library().Find(path).unusual, HasSubstr("k_c_kN_per_m_n_plus_1: -300, expected"));
  std::ofstream(path) << WriteSoils({own, Library().Find("GRC-1").soil});
  EXPECT_THAT(said(path), HasSubstr("2 soils (mine; GRC-1), expected one"));
}

TEST_F(UntunedModel, SuggestsByWordsThenByMoisture) {
  const SoilLibrary library = Library();
  const auto found = SuggestSoils(library, "sandy loam", 15.0);
  ASSERT_GE(found.size(), 3u);
  EXPECT_EQ(found[0].entry->soil.name, "Sandy loam 15 %");
  EXPECT_EQ(found[1].entry->soil.name, "Sandy loam, Michigan 11 %");
  EXPECT_EQ(SuggestSoils(library, "sandy loam", 30.0)[0].entry->soil.name,
            "Sandy loam, Hanamoto 32 %");
  EXPECT_TRUE(SuggestSoils(library, "xyzzy", {}).empty());
}

}  // namespace
}  // namespace grouser::surrogate

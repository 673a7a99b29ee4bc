// Beds that cannot be made are refused before any work, and every stage of one that
// can be made may be interrupted.
#include "dem_offline/engine/rig/bed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem {
namespace {

using ::testing::HasSubstr;

BedSpec SmallBed() { return BedOf(Small()); }

/// What is said of a spec; empty: accepted.
template <class Spec, class Check>
std::string Complaint(const Spec& spec, Check&& check) {
  try {
    check(spec);
  } catch (const SpecError& error) {
    EXPECT_THAT(error.what(), HasSubstr(error.field() + ": " + error.got() + ", expected "));
    return error.what();
  }
  return "";
}
std::string OfBed(const BedSpec& bed, const WorkLimits& limits = {}) {
  return Complaint(bed, [&](const BedSpec& b) { ValidateBed(b, limits); });
}
std::string OfTest(const WheelTestSpec& spec) {
  return Complaint(spec, [](const WheelTestSpec& s) { ValidateSpec(s); });
}

TEST(ValidateBed, AcceptsTheSmallOneAndLooseFillings) {
  BedSpec bed = SmallBed();
  EXPECT_EQ(OfBed(bed), "");
  bed.soil.solid_fraction = 0.48;
  EXPECT_EQ(OfBed(bed), "");
}

TEST(ValidateBed, RefusesSidesOfFewGrainsWithBothLengths) {
  for (const auto side : {&BedSpec::length_m, &BedSpec::width_m}) {
    BedSpec bed = SmallBed();
    bed.*side = 0.0119;  // narrower than a grain of 12 mm: it was poured for ever
    EXPECT_THAT(OfBed(bed), HasSubstr(": 0.0119 m, expected at least 0.048 m, 4 of the largest "
                                      "grains of 0.012 m"));
    EXPECT_THROW(PrepareBed(bed, nullptr), SpecError);
  }
  BedSpec bed = SmallBed();
  bed.depth_m = 0.03;
  EXPECT_THAT(OfBed(bed), HasSubstr("rig.bed_depth_m: 0.03 m, expected at least 0.036 m"));
}

TEST(ValidateBed, RefusesMillimetresGivenForMetres) {
  BedSpec bed = SmallBed();
  for (SizeBin& bin : bed.soil.sizes) bin.diameter_m *= 1e3;
  EXPECT_THAT(OfBed(bed), HasSubstr("soil.grains.sizes[0].diameter_m: 10 m, expected metres"));
  bed = SmallBed();
  for (double* length : {&bed.length_m, &bed.width_m, &bed.depth_m}) *length *= 1e3;
  EXPECT_THAT(OfBed(bed), HasSubstr("e+11 grains, expected at most 1e+08"));
}

TEST(ValidateBed, RefusesMoreMemoryOrStepsThanAreAccepted) {
  BedSpec bed = SmallBed();
  EXPECT_THAT(OfBed(bed, {.bytes = 1e6}), HasSubstr("expected at most 0.000931323 GiB of memory"));
  EXPECT_EQ(OfBed(bed, {.bytes = kBytesPerGrain * 1e4}), "");
  EXPECT_THAT(OfBed(bed, {.steps = 1000}), HasSubstr("time steps, expected at most 1000"));
  EXPECT_THAT(OfBed(bed, {.grain_steps = 1e6}), HasSubstr("grain-steps, expected at most 1e+06"));
  bed.soil.youngs_modulus_pa = 1e22;
  EXPECT_THAT(OfBed(bed), HasSubstr("time steps, expected at most 1e+09"));
  bed.soil.youngs_modulus_pa = 1;
  EXPECT_THAT(OfBed(bed), HasSubstr("soil.grains.youngs_modulus_pa: 1 (time step "));
}

TEST(ValidateBed, RefusesASandPouredHigherThanTheFrame) {
  BedSpec bed = SmallBed();
  bed.soil.sizes = {{0.001, 0.9}, {0.012, 0.1}};
  EXPECT_THAT(OfBed(bed), HasSubstr("m above the bed, expected sizes nearer to each other"));
}

TEST(ValidateBed, KnowsTheGrainsThatArePoured) {
  const LooseLattice lattice = LatticesOf(SmallBed())[0];
  const Work work = WorkOf(SmallBed());
  EXPECT_EQ(work.grains, lattice.nx * lattice.ny * lattice.layers);
  const auto left = static_cast<double>(SmallTile().radius_m.size());
  EXPECT_GT(work.grains, left);
  EXPECT_LT(work.grains, 2 * left);
}

TEST(ValidateSpec, RefusesRunsThatNeverEnd) {
  WheelTestSpec s = Small();
  EXPECT_EQ(OfTest(s), "");
  s.rig.max_time_s = 1e12;
  EXPECT_THAT(OfTest(s), HasSubstr("rig.max_time_s, rig.scene: "));
  s = Small();
  s.rig.scene.bed = SceneBed::kFull;  // as many tiles as 1e7 s of travel take
  s.rig.max_time_s = 3e4;
  s.rig.speed_m_per_s = 1;
  EXPECT_THAT(OfTest(s), HasSubstr("grains, expected at most 1e+08"));
  s = Small();
  s.rig.scene.bed = SceneBed::kWindow;
  s.rig.scene.window_length_m = 1000;
  EXPECT_THROW(ValidateSpec(s, {.bytes = 1e9}), SpecError);
}

TEST(ValidateSpec, RefusesLengthsThatDoNotFitTheWheel) {
  WheelTestSpec s = Small();
  s.rig.bed_length_m = 0.1;
  EXPECT_THAT(OfTest(s), HasSubstr("rig.bed_length_m: 0.1 m, expected more than 0.12 m"));
  s = Small();
  s.rig.bed_width_m = 0.07;
  EXPECT_EQ(OfTest(s), "");
  s.state.attack_angle_rad = M_PI / 2;  // now its diameter lies across
  s.state.slip = 0;
  EXPECT_THAT(OfTest(s), HasSubstr("rig.bed_width_m: 0.07 m, expected more than 0.08 m"));
  s = Small();
  s.rig.speed_m_per_s = 100;
  EXPECT_THAT(OfTest(s), HasSubstr("rig.speed_m_per_s: 100 ("));
}

class Interrupted : public testing::TestWithParam<const char*> {};

TEST_P(Interrupted, PreparationStopsWhenAsked) {
  int asked = 0;
  const auto progress = [&](double fraction, const std::string& stage) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    asked += stage == GetParam();
    return asked == 0;
  };
  try {
    PrepareBed(SmallBed(), progress);
    FAIL() << "nobody asked in stage " << GetParam();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "stopped by caller");
  }
  EXPECT_EQ(asked, 1);
}

INSTANTIATE_TEST_SUITE_P(Stages, Interrupted, testing::Values("pour", "settle", "relax", "rest"),
                         [](const auto& info) { return std::string(info.param); });

TEST(PollSteps, AreFewOfManyGrains) {
  EXPECT_EQ(PollSteps(1), 500);
  EXPECT_EQ(PollSteps(20000), 100);
  EXPECT_EQ(PollSteps(100000000), 1);
}

}  // namespace
}  // namespace grouser::dem

#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "surrogate/calibrate/calibration.h"
#include "tests/unit/surrogate/calibrate_testing.h"

namespace grouser::surrogate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Measuring;
using testing::PlatesAndShear;

const FittedParameter& Find(const std::vector<FittedParameter>& parameters,
                            const std::string& name) {
  for (const FittedParameter& p : parameters) {
    if (p.what.name == name) return p;
  }
  throw std::runtime_error("no parameter " + name);
}

TEST(Calibrate, EveryPublishedSoilComesBack) {
  for (const Soil& soil : testing::Known().soils) {
    const BekkerParameters truth = FromSoil(soil);
    Measuring measuring(truth, soil.kind, 0, 1);
    PlatesAndShear(&measuring);
    const SoilFit fit = FitSoil(measuring.soil(), testing::Known(), kBekkerForm);
    const BekkerParameters p = fit.Parameters();
    EXPECT_NEAR(p.n, truth.n, 0.005) << soil.name;
    EXPECT_NEAR(p.friction_angle, truth.friction_angle, 0.005) << soil.name;
    EXPECT_NEAR(p.cohesion, truth.cohesion, 30 + 0.02 * truth.cohesion) << soil.name;
    EXPECT_NEAR(p.shear_modulus / truth.shear_modulus, 1, 0.01) << soil.name;
    for (const double width : {0.03, 0.06}) {
      const double modulus = truth.k_c / width + truth.k_phi;
      EXPECT_NEAR((p.k_c / width + p.k_phi) / modulus, 1, 0.02) << soil.name;
    }
    EXPECT_LT(DistanceOf(fit, truth), RegionOf(fit)) << soil.name;
  }
}

TEST(Calibrate, ProfileIntervalsHoldTheTruthAndAgreeWithTheJacobianWhereTheLawIsNearlyLinear) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  const BekkerParameters truth = FromSoil(soil);
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Measuring measuring(truth, soil.kind, 0.03, seed);
    PlatesAndShear(&measuring);
    const SoilFit fit = FitSoil(measuring.soil(), testing::Known(), kBekkerForm);
    for (const FittedParameter& p : ParametersOf(fit)) {
      const double of_truth = truth.*p.what.member;
      inside += of_truth >= p.low && of_truth <= p.high ? 1 : 0;
      ++all;
      EXPECT_LE(p.low, p.value) << p.what.name;
      EXPECT_GE(p.high, p.value) << p.what.name;
      if (std::string(p.what.name) == "n" || std::string(p.what.name) == "friction_angle") {
        EXPECT_NEAR((p.high - p.low) / (2 * kTwoSided90 * p.sd), 1, 0.1) << p.what.name;
      }
    }
  }
  EXPECT_EQ(all, 60);
  EXPECT_GE(inside, 47);  // of 60 at 90 %: 54 +- 2.3, correlated
}

TEST(Calibrate, PlatesOfOneWidthDoNotTellTheModuliApart) {
  const Soil soil = testing::PublishedSoil("LETE sand");
  Measuring measuring(FromSoil(soil), soil.kind, 0.03, 1);
  measuring.Plate(0.05, 0.04);
  const SoilCalibration c = CalibrateSoil(measuring.soil(), testing::Known(), "auto");
  EXPECT_THAT(c.why_form, HasSubstr("one width cannot tell it from Reece's"));
  EXPECT_TRUE(c.reece_parameters.empty());
  EXPECT_FALSE(Find(c.parameters, "k_c").identified);
  EXPECT_FALSE(Find(c.parameters, "k_phi").identified);
  EXPECT_TRUE(Find(c.parameters, "n").identified);
  // What nothing was measured about stays where it was.
  const FittedParameter& phi = Find(c.parameters, "friction_angle");
  EXPECT_NEAR(phi.value, phi.typical, 1e-6);
  EXPECT_NEAR(phi.share_left, 1, 1e-6);
  std::string said;
  for (const Direction& d : c.directions) said += d.text + "\n";
  EXPECT_THAT(said,
              HasSubstr("plates of one width (b = 50 mm) cannot tell k_c from k_phi; a plate of "
                        "width b ="));
  EXPECT_THAT(said, HasSubstr("friction angle; a shear ring at"));
  // A plate of another width does tell: what is advised works.
  measuring.Plate(0.1, 0.04);
  const SoilFit fit = FitSoil(measuring.soil(), testing::Known(), kBekkerForm);
  EXPECT_TRUE(Find(ParametersOf(fit), "k_c").identified);
}

TEST(Calibrate, ShearAtOnePressureDoesNotTellCohesionFromFriction) {
  const Soil soil = testing::PublishedSoil("Grenville loam 24 %");
  Measuring measuring(FromSoil(soil), soil.kind, 0.02, 1);
  measuring.Plate(0.03, 0.04);
  measuring.Plate(0.06, 0.04);
  measuring.Shear(2e4);
  const SoilFit one = FitSoil(measuring.soil(), testing::Known(), kBekkerForm);
  ASSERT_FALSE(UnidentifiedDirections(one).empty());
  EXPECT_THAT(UnidentifiedDirections(one)[0].text,
              AllOf(HasSubstr("shear tests at one pressure (20 kPa)"), HasSubstr("cohesion"),
                    HasSubstr("a shear ring at")));
  ASSERT_FALSE(NextTests(one).empty());
  EXPECT_THAT(NextTests(one)[0].text, HasSubstr("a shear ring at"));
  EXPECT_LT(NextTests(one)[0].share_left, UnidentifiedDirections(one)[0].share_left);
  measuring.Shear(8e4);
  EXPECT_TRUE(
      UnidentifiedDirections(FitSoil(measuring.soil(), testing::Known(), kBekkerForm)).empty());
}

TEST(Calibrate, WheelsPlatesAndShearTogetherGiveTheSoilBack) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  const BekkerParameters truth = FromSoil(soil);
  Measuring measuring(truth, soil.kind, 0.02, 3);
  PlatesAndShear(&measuring);
  measuring.Wheel({0.15, 0.1}, 80, {-0.6, -0.3, 0, 0.1, 0.2, 0.4, 0.7}, 0);
  measuring.Wheel({0.15, 0.1}, 80, {-0.3, 0, 0.3}, 0.5);
  const SoilFit fit = FitSoil(measuring.soil(), testing::Known(), kBekkerForm);
  EXPECT_LE(DistanceOf(fit, truth), RegionOf(fit));
  for (const Misfit& m : fit.misfits) EXPECT_FALSE(m.estimated) << NameOf(m.kind) << m.output;
  for (std::size_t i = 0; i < fit.predicted.size(); ++i) {
    EXPECT_NEAR(fit.predicted[i].value, measuring.soil().observations[i].value,
                5 * fit.predicted[i].sd_total);
  }
}

TEST(Calibrate, HeldOutRowsDoNotReachTheFit) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  Measuring measuring(FromSoil(soil), soil.kind, 0.05, 5);
  PlatesAndShear(&measuring);
  for (Observation& at : measuring.soil().observations) at.held_out = at.line % 3 == 0;
  const SoilCalibration before = CalibrateSoil(measuring.soil(), testing::Known(), "bekker");
  for (Observation& at : measuring.soil().observations) at.value *= at.held_out ? 10 : 1;
  const SoilCalibration after = CalibrateSoil(measuring.soil(), testing::Known(), "bekker");
  ASSERT_EQ(before.parameters.size(), after.parameters.size());
  for (std::size_t i = 0; i < before.parameters.size(); ++i) {
    EXPECT_EQ(before.parameters[i].value, after.parameters[i].value);
    EXPECT_EQ(before.parameters[i].high, after.parameters[i].high);
  }
  for (std::size_t i = 0; i < before.errors.size(); ++i) {
    EXPECT_EQ(before.errors[i].fitted_rms, after.errors[i].fitted_rms);
    EXPECT_GT(after.errors[i].held_out_rms, before.errors[i].held_out_rms);
    EXPECT_EQ(before.errors[i].fitted + before.errors[i].held_out, 12);
  }
}

// Nothing fitted says how a wheel goes, nor what a plate meets four times as deep.
TEST(Calibrate, PredictionsBeyondWhatWasFittedAreLessCertain) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  Measuring measuring(FromSoil(soil), soil.kind, 0.05, 5);
  PlatesAndShear(&measuring);
  std::vector<Observation>& rows = measuring.soil().observations;
  for (Observation& at : rows) at.sd = std::nan("");
  const std::size_t curves = rows.size();
  measuring.Wheel({0.15, 0.1}, 80, {-0.4, 0.1, 0.4}, 0);
  const std::size_t wheels = rows.size();
  measuring.Plate(0.06, 0.16);
  for (std::size_t i = curves; i < rows.size(); ++i) {
    rows[i].held_out = true;
    rows[i].sd = std::nan("");
  }
  const Typical known = testing::Known();
  const SoilFit fit = FitSoil(measuring.soil(), known, kBekkerForm);
  for (std::size_t i = curves; i < wheels; ++i) {
    const double scale = OutputScale(rows[i].output, rows[i].load, 0.15);
    EXPECT_GE(fit.predicted[i].sd_total, known.wheel_error[rows[i].output] * scale);
    if (rows[i].output == kSinkage && rows[i].slip != 0.1) {
      EXPECT_GT(fit.predicted[i].sd_soil, 0.02 * scale);
    }
  }
  const auto share = [&](std::size_t i) {
    return fit.predicted[i].sd_total / fit.predicted[i].value;
  };
  EXPECT_GT(share(rows.size() - 1), 2 * share(wheels + 2));  // at 0.16 and 0.04 m
}

TEST(Calibrate, ReecesFormIsChosenWhereItIsTheBetterOne) {
  // p = gamma b k_phi' (z/b)^n: pressure at equal sinkage grows with b^(1 - n), n < 1.
  BekkerParameters truth = FromSoil(testing::PublishedSoil("Ding 2011 simulant"));
  Measuring measuring(truth, SoilKind::kSand, 0.02, 7);
  for (const double width : {0.02, 0.05, 0.15}) measuring.Plate(width, 0.04);
  for (Observation& at : measuring.soil().observations) {
    const double bekker = (truth.k_c / at.width + truth.k_phi) * std::pow(at.sinkage, truth.n);
    const double reece = truth.unit_weight * at.width * 60 * std::pow(at.sinkage / at.width, 0.6);
    at.value *= reece / bekker;
    at.sd = 0.02 * reece;
  }
  const SoilCalibration c = CalibrateSoil(measuring.soil(), testing::Known(), "auto");
  EXPECT_THAT(c.why_form, HasSubstr("Reece's form: the deviance of Bekker's is"));
  EXPECT_NEAR(Find(c.parameters, "reece_k_phi").value, 60, 6);
  EXPECT_NEAR(Find(c.parameters, "n").value, 0.6, 0.03);
}

TEST(Calibrate, ReecesParametersAreKeptBesideBekkers) {
  const BekkerParameters truth = FromSoil(testing::PublishedSoil("LETE sand"));
  Measuring measuring(truth, SoilKind::kSand, 0, 1);
  PlatesAndShear(&measuring);
  const SoilCalibration c = CalibrateSoil(measuring.soil(), testing::Known(), "auto");
  EXPECT_THAT(c.why_form, HasSubstr("Bekker's form"));
  const auto reece = [&](const char* name) { return Find(c.reece_parameters, name).value; };
  for (const double width : {0.03, 0.06}) {  // two widths, two moduli: both forms say the same
    const double ours = (reece("cohesion") * reece("reece_k_c") +
                         truth.unit_weight * width * reece("reece_k_phi")) *
                        std::pow(0.02 / width, reece("n"));
    const double bekker = (truth.k_c / width + truth.k_phi) * std::pow(0.02, truth.n);
    EXPECT_NEAR(ours / bekker, 1, 0.02) << width;
  }
  for (const FittedParameter& p : c.reece_parameters) {
    EXPECT_LE(p.low, p.value) << p.what.name;
    EXPECT_GE(p.high, p.value) << p.what.name;
  }
  EXPECT_THAT(CalibrationJson(c, ""), HasSubstr("\"name\": \"reece_k_phi\""));
}

TEST(Calibrate, TheSoilFileIsReadByWhatReadsSoils) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  Measuring measuring(FromSoil(soil), soil.kind, 0.02, 5);
  PlatesAndShear(&measuring);
  measuring.soil().name = "my sand, dry";
  measuring.soil().files = {{"plates.csv", "0123abcd"}};
  const SoilCalibration c = CalibrateSoil(measuring.soil(), testing::Known(), "bekker");
  std::istringstream file(SoilFileText(c, "a command"));
  EXPECT_THAT(file.str(),
              AllOf(HasSubstr("# Made by: a command"), HasSubstr("# plates.csv sha256:0123abcd")));
  const std::vector<Soil> read = ReadSoils(file, "soil.csv");
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].name, "my sand, dry");
  EXPECT_NEAR(read[0].k_phi, c.bekker->Parameters().k_phi, 1e-5 * read[0].k_phi);
  EXPECT_NEAR(read[0].shear_modulus_m.value(), 0.011, 0.001);
  EXPECT_THAT(read[0].source, HasSubstr("60 measured numbers (plate, shear)"));
  EXPECT_NO_THROW(BekkerModel(FromSoil(read[0]), {0.1, 0.05}));
}

}  // namespace
}  // namespace grouser::surrogate

// Cone indices of soils: the table, the soils of shipped models, and the numeric laws of traction.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "surrogate/fit/numerics_report.h"
#include "surrogate/fit/pair_folder.h"
#include "surrogate/fit/soil_card.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/soils/csv_cells.h"
#include "tests/unit/refusal.h"

namespace grouser::surrogate {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

constexpr char kHeader[] =
    "soil,soil_sha256,cone_index_kPa,cone_index_se_kPa,gradient_kPa_per_m,gradient_se_kPa_per_m,"
    "beds,to_depth_mm,cone_diameter_mm,cone_angle_deg,speed_mm_per_s,grain_mm,bevameter_sha256,"
    "source\n";
const std::string kHash(64, 'a');

std::string TableLine(const std::string& numbers) {
  return fmt::format("sand,{0},{1},{0},\"a test, of one\"\n", kHash, numbers);
}
std::vector<ConeIndex> Read(const std::string& text) {
  std::istringstream table(text);
  return ReadConeIndices(table, "t.csv");
}
v1alpha1::Model Shipped(const std::string& pair) {
  return ReadModel(GROUSER_PAIRS "/" + pair + "/hybrid.model").model;
}

TEST(ConeTable, IsReadInSi) {
  const auto cones =
      Read(std::string("# a comment\n") + kHeader + TableLine("18,0.4,400,12,2,49,32,60,50,8"));
  ASSERT_EQ(cones.size(), 1u);
  const ConeIndex& c = cones[0];
  EXPECT_EQ(c.index_pa, 18e3);
  EXPECT_EQ(*c.index_se_pa, 400);
  EXPECT_EQ(c.gradient_pa_per_m, 4e5);
  EXPECT_EQ(*c.gradient_se_pa_per_m, 12e3);
  EXPECT_DOUBLE_EQ(c.to_depth_m, 0.049);
  EXPECT_DOUBLE_EQ(c.diameter_m, 0.032);
  EXPECT_EQ(c.source, "a test, of one");
  EXPECT_EQ(FindByName(cones, "Sand, DEM"), cones.data());
  EXPECT_EQ(FindByName(cones, "sandy"), nullptr);
  EXPECT_THAT(ConeText(c), HasSubstr("cone index 18 kPa (0.4), mean over 0 to 49 mm; gradient 400 "
                                     "kPa/m (12); standard errors of 2 beds"));
  // One bed; a gradient may be negative, as of a crust.
  const ConeIndex one = Read(kHeader + TableLine("18,,-40,,1,49,32,60,50,8"))[0];
  EXPECT_FALSE(one.index_se_pa || one.gradient_se_pa_per_m);
  EXPECT_EQ(one.gradient_pa_per_m, -4e4);
  EXPECT_THAT(ConeText(one), HasSubstr("gradient -40 kPa/m, one bed"));
}

TEST(ConeTable, OfANameTheLastRowHolds) {
  const std::string other(64, 'b'), numbers = "18,,400,,1,49,32,60,50,8";
  const auto cones =
      Read(kHeader + TableLine(numbers) + "Sand," + other + "," + numbers + "," + other + ",x\n");
  ASSERT_EQ(cones.size(), 2u);
  EXPECT_EQ(FindByName(cones, "sand")->soil_sha256, other);
}

TEST(ConeTable, NamesMayHoldWhatCsvMeans) {
  for (const std::string name : {"#1 \"sharp\"", "a, \"b\"", "\"", "plain", "\"\","}) {
    const std::string line = CsvCell(name) + "," + kHash + ",18,,400,,1,49,32,60,50,8," + kHash;
    const auto cones = Read(kHeader + line + "," + CsvCell(name) + "\n");
    ASSERT_EQ(cones.size(), 1u) << name;
    EXPECT_EQ(cones[0].soil, name);
    EXPECT_EQ(cones[0].source, name);
  }
  EXPECT_EQ(CsvCell("two\nlines"), "two lines");
}

TEST(ConeTable, BadTablesAreRefused) {
  const auto said = [](const std::string& text) { return Refusal([&] { Read(text); }); };
  const std::string good = "18,0.4,400,4,2,49,32,60,50,8";
  EXPECT_THAT(said(""), HasSubstr("t.csv: no header"));
  EXPECT_THAT(said("soil,sand\n"), HasSubstr("t.csv:1: 2 columns, expected 14"));
  EXPECT_THAT(said(std::string(kHeader) + "\"sand\n"), HasSubstr("t.csv:2: a quote is not closed"));
  EXPECT_THAT(
      said(kHeader + TableLine("18000000,,1,,1,49,32,60,50,8")),
      HasSubstr("t.csv:2: cone_index_kPa: 18000000, expected a number from 0.001 to 100000"));
  EXPECT_THAT(said(kHeader + TableLine(",,1,,1,49,32,60,50,8")),
              HasSubstr("cone_index_kPa: empty"));
  EXPECT_THAT(said(kHeader + TableLine("18,,1,,1.5,49,32,60,50,8")), HasSubstr("a whole number"));
  EXPECT_THAT(said(kHeader + TableLine("18,0.4,1,,1,49,32,60,50,8")),
              HasSubstr("t.csv:2: cone_index_se_kPa: 0.4, expected none of one bed"));
  EXPECT_THAT(said(kHeader + TableLine("18,,1,4,1,49,32,60,50,8")),
              HasSubstr("gradient_se_kPa_per_m: 4, expected none of one bed"));
  EXPECT_THAT(said(kHeader + TableLine("18,,1,4,2,49,32,60,50,8")),
              HasSubstr("cone_index_se_kPa: empty, expected a standard error over the beds"));
  EXPECT_THAT(said(kHeader + TableLine("18,0.4,1,,2,49,32,60,50,8")),
              HasSubstr("gradient_se_kPa_per_m: empty, expected a standard error over the beds"));
  EXPECT_THAT(said(kHeader + TableLine(good) + TableLine(good)),
              HasSubstr("t.csv:3: soil_sha256: " + kHash + ", expected each soil once"));
  EXPECT_THAT(said(std::string(kHeader) + "sand,12," + good + "," + kHash + ",x\n"),
              HasSubstr("soil_sha256: 12, expected 64 hex digits"));
}

TEST(ConeTable, PairsHaveTheConeIndexOfTheirSoil) {
  for (const PairFolder& pair : FindPairs(GROUSER_PAIRS)) {
    const v1alpha1::Model model = Shipped(pair.name);
    const auto cone = LineOfSoil(model, ConeIndices());
    ASSERT_TRUE(cone) << pair.name << ": " << SoilIdentity(model.soil());
    EXPECT_EQ(cone->soil, model.soil().name());
    EXPECT_GE(cone->beds, 2);
    EXPECT_GT(cone->gradient_pa_per_m, 0);
  }
}

TEST(ConeTable, AnotherSoilIsAnother) {
  v1alpha1::Model model = Shipped("cmu-smooth-62.5-8mm");
  const std::string before = SoilIdentity(model.soil());
  model.mutable_soil()->set_name("another name");
  model.mutable_soil()->set_source("and source");
  EXPECT_EQ(SoilIdentity(model.soil()), before);
  model.mutable_soil()->mutable_grains()->set_friction(0.365);
  EXPECT_NE(SoilIdentity(model.soil()), before);
  EXPECT_FALSE(LineOfSoil(model, ConeIndices()));
}

// Worked by hand: Cn = 50e3 * 0.2 * 0.5/500 = 10, Bn = 10 * 2/(1 + 1.2) = 100/11,
// Ns = 1e6 * 0.1^1.5/500 * 0.2 = 12.649110640673518. Mason's and Williams' numbers were worked out
// in Python from the formulas of docs/calibration.md: q = 0.140439, T = 0.484085, A = 0.859687, C =
// 1.403349.
TEST(TractionNumerics, ByHand) {
  const NumericWheel wheel{0.5, 0.2, 500, 0.2, 0.1};
  const ConeStrength cone{50e3, 1e6};
  EXPECT_DOUBLE_EQ(WheelNumeric(wheel, cone), 10);
  EXPECT_DOUBLE_EQ(BrixiusNumeric(wheel, cone), 100.0 / 11);
  EXPECT_NEAR(SandNumeric(wheel, cone), 12.649110640673518, 1e-12);
  // a = 0.02 + 0.013, 2 b sqrt(d a - a^2) (b/h)^0.52 = 0.4 sqrt(0.0165 - 0.001089) 2^0.52
  EXPECT_NEAR(PressureOverCone(wheel, cone),
              500 / (0.4 * std::sqrt(0.015411) * std::pow(2, 0.52)) / 50e3, 1e-12);
  const TractionRatios wl = WismerLuth(wheel, cone, 0.2);
  EXPECT_NEAR(wl.gross, 0.75 * (1 - std::exp(-0.6)), 1e-12);
  EXPECT_NEAR(wl.net(), 0.75 * (1 - std::exp(-0.6)) - 0.16, 1e-12);
  const TractionRatios br = Brixius(wheel, cone, 0.2);
  EXPECT_NEAR(br.gross, 0.88 * (1 - std::exp(-10.0 / 11)) * (1 - std::exp(-1.5)) + 0.04, 1e-12);
  EXPECT_NEAR(br.resistance, 0.11 + 0.04 + 0.1 / std::sqrt(100.0 / 11), 1e-12);
  EXPECT_NEAR(SandByNumeric(wheel, cone, 0.2).gross,
              0.66 - 0.66 * 13.31 / (12.649110640673518 + 23.31), 1e-12);
  EXPECT_NEAR(MasonSand(wheel, cone, 0.2).gross, 0.358086339966871, 1e-12);
  EXPECT_NEAR(MasonSand(wheel, cone, 0.2).resistance, 0.146175764572003, 1e-12);
  EXPECT_NEAR(MasonSand(wheel, cone, -0.3).gross, -0.276786112469291, 1e-12);
  EXPECT_NEAR(MasonSand(wheel, cone, -0.3).resistance, 0.294492276400302, 1e-12);
}

TEST(TractionNumerics, LimitsAndWhatLawsDoNotSay) {
  const ConeStrength cone{50e3, 1e6};
  const NumericWheel rigid{0.5, 0.2, 500, 0, 0.2};
  EXPECT_TRUE(std::isnan(SandByNumeric(rigid, cone, 0.2).gross));  // Ns = 0
  EXPECT_DOUBLE_EQ(BrixiusNumeric(rigid, cone), 10 / 2.2);
  EXPECT_TRUE(std::isnan(WismerLuth(rigid, cone, -0.1).gross));
  EXPECT_EQ(WismerLuth(rigid, cone, 0).gross, 0);
  EXPECT_LT(MasonSand(rigid, cone, -1).gross, -0.45);                // locked: to its least, -0.5
  EXPECT_TRUE(std::isnan(MasonSand(rigid, {1e8, 1e9}, 0.2).gross));  // C < 0
  const NumericWheel tyre{0.5, 0.2, 500, 0.2, 0.1};
  EXPECT_TRUE(std::isnan(SandByNumeric(tyre, {50e3, -1e6}, 0.2).gross));
  // Stronger soil: more traction, less resistance.
  for (const NumericLaw& law : kNumericLaws) {
    const TractionRatios weak = law.ratios(tyre, cone, 0.3);
    const TractionRatios strong = law.ratios(tyre, {1e5, 2e6}, 0.3);
    EXPECT_GT(strong.gross, weak.gross) << law.name;
    if (law.ratios == SandByNumeric) {
      EXPECT_TRUE(std::isnan(strong.resistance) && std::isnan(weak.resistance));
    } else {
      EXPECT_LT(strong.resistance, weak.resistance) << law.name;
    }
    for (const double beyond : {-1.2, 1.2, static_cast<double>(NAN)}) {
      EXPECT_TRUE(std::isnan(law.ratios(tyre, cone, beyond).gross)) << law.name << beyond;
      EXPECT_TRUE(std::isnan(law.ratios(tyre, cone, beyond).resistance)) << law.name << beyond;
    }
  }
}

// The formula gives -0.48 at slip 0.05 and q 0.016, 0.17 at q 0.05.
TEST(TractionNumerics, MasonDoesNotSayWhereItsFormulaBrakesAWheelOfSlip0) {
  const NumericWheel tyre{0.5, 0.2, 500, 0.2, 0.1};
  const auto at = [&](double q, double slip) {
    return MasonSand(tyre, {PressureOverCone(tyre, {1, 0}) / q, 1e6}, slip);
  };
  for (const double slip : {-1.0, 0.0, 0.05, 1.0}) {
    EXPECT_TRUE(std::isnan(at(0.016, slip).gross)) << slip;
    EXPECT_TRUE(std::isnan(at(0.0332, slip).gross)) << slip;
    EXPECT_FALSE(std::isnan(at(0.0334, slip).gross)) << slip;
  }
  EXPECT_NEAR(at(0.03327015, 0).gross, 0, 1e-6);
  // No resistance that pulls: 0.4 q + 0.6 s - 0.03.
  EXPECT_TRUE(std::isnan(at(0.05, 0).resistance));
  EXPECT_NEAR(at(0.05, 0.05).resistance, 0.02, 1e-12);
}

TEST(TractionNumerics, StandBesideAModel) {
  const v1alpha1::Model model = Shipped("atv-20x10-lugged-20mm");
  NumericsRequest request;
  request.load_n = 600;
  request.slips = {-0.2, 0.2};
  ConeIndex cone = Read(kHeader + TableLine("50,0.5,400,4,2,150,80,60,79,20"))[0];
  request.cone = cone;
  const NumericsReport r = CompareWithNumerics(model, request);
  EXPECT_DOUBLE_EQ(r.wheel.diameter_m, 0.508);
  // Standard error 1 % of two beds: t of one degree of freedom.
  EXPECT_NEAR(r.cone_share, 0.0631375, 1e-6);
  ASSERT_EQ(r.rows.size(), 2u);
  const auto& mason = r.rows[1].laws[3];
  EXPECT_LT(mason.low[1], mason.at.net());
  EXPECT_GT(mason.high[1], mason.at.net());
  EXPECT_TRUE(std::isnan(r.rows[0].laws[0].at.gross));
  EXPECT_FALSE(r.rows[0].laws[0].apart[0]);
  // The tyre's gross is far above what any law has; over a cone index so uncertain that Wismer-Luth
  // reaches from next to nothing to 0.75 its pull is not apart.
  for (const std::size_t law : {0, 1, 3}) EXPECT_TRUE(r.rows[1].laws[law].apart[0]) << law;
  EXPECT_FALSE(r.rows[1].laws[2].apart[0]);  // it does not say
  EXPECT_TRUE(r.rows[1].laws[1].apart[1]);
  request.cone->index_se_pa = 1e4;
  EXPECT_FALSE(CompareWithNumerics(model, request).rows[1].laws[0].apart[1]);
  EXPECT_THAT(NumericsText(r, model, "ref"), HasSubstr("bars of 22 mm"));
  EXPECT_THAT(NumericsJson(r, "ref"), HasSubstr("\"wismer_luth\""));
  request.cone.reset();
  EXPECT_THAT(Refusal([&] { CompareWithNumerics(model, request); }),
              HasSubstr("--cone-index: got none"));
  request.cone = cone, request.slips = {1.5};
  EXPECT_THAT(Refusal([&] { CompareWithNumerics(model, request); }),
              HasSubstr("--slip: got 1.5, expected -2 to 1"));
  request.slips = {-2, 1};
  EXPECT_EQ(CompareWithNumerics(model, request).rows.size(), 2u);
  v1alpha1::Model still = model;
  still.mutable_domain()->set_speed_m_per_s(0);
  EXPECT_THAT(Refusal([&] { CompareWithNumerics(still, request); }),
              HasSubstr("training speed: got 0, expected more than 0 m/s"));
}

// At slip 0.1 Mason's gross has its peak over q at 0.08, and at neither end of 0.04 to 0.32.
TEST(TractionNumerics, BoundsHoldWhatIsBetweenTheEnds) {
  NumericsRequest request;
  request.load_n = 600;
  request.slips = {0.1};
  request.cone = Read(kHeader + TableLine("100,9,400,4,2,150,80,60,79,20"))[0];
  request.deflection = 0.2;
  request.section_height_m = 0.152;
  const NumericsReport r = CompareWithNumerics(Shipped("atv-20x10-lugged-20mm"), request);
  const double half = r.cone_share;
  ASSERT_NEAR(half, 0.568, 1e-3);
  const auto gross = [&](double index) { return MasonSand(r.wheel, {index, 4e5}, 0.1).gross; };
  const auto& mason = r.rows[0].laws[3];
  EXPECT_NEAR(mason.low[0], gross(1e5 * (1 + half)), 1e-12);
  EXPECT_GT(mason.high[0], gross(1e5 * (1 - half)) + 1e-3);
  EXPECT_GT(mason.high[0], mason.low[0] + 1e-3);
  // Where the strong end has q below 0.033, no bound is known: neither inside nor apart.
  request.cone->index_se_pa = 4e4;
  const auto unknown = CompareWithNumerics(Shipped("atv-20x10-lugged-20mm"), request);
  EXPECT_FALSE(std::isnan(unknown.rows[0].laws[3].at.gross));
  EXPECT_TRUE(std::isnan(unknown.rows[0].laws[3].low[0]));
  EXPECT_TRUE(std::isnan(unknown.rows[0].laws[3].high[0]));
  EXPECT_FALSE(unknown.rows[0].laws[3].apart[0]);
  EXPECT_THAT(NumericsText(unknown, Shipped("atv-20x10-lugged-20mm"), "ref"),
              ContainsRegex("0[.]1 .* -?[0-9.]+ [?]\n"));
}

TEST(TractionNumerics, RefusesWhatNoWheelHas) {
  const v1alpha1::Model model = Shipped("atv-20x10-lugged-20mm");
  const auto said = [&](auto change) {
    NumericsRequest request;
    request.cone = Read(kHeader + TableLine("50,0.5,400,4,2,150,80,60,79,20"))[0];
    change(&request);
    return Refusal([&] { CompareWithNumerics(model, request); });
  };
  EXPECT_EQ(said([](auto*) {}), "");
  EXPECT_EQ(said([](auto* r) { r->cone->gradient_pa_per_m = -4e5; }), "");
  const double nan = NAN;
  EXPECT_THAT(said([&](auto* r) { r->load_n = nan; }), HasSubstr("--load: got nan"));
  EXPECT_THAT(said([&](auto* r) { r->load_n = 0; }), HasSubstr("--load: got 0"));
  EXPECT_THAT(said([&](auto* r) { r->deflection = nan; }), HasSubstr("--deflection: got nan"));
  EXPECT_THAT(said([&](auto* r) { r->section_height_m = nan; }),
              HasSubstr("--section-height: got nan"));
  EXPECT_THAT(said([&](auto* r) { r->section_height_m = 0.3; }),
              HasSubstr("at most the radius, 0.254 m"));
  EXPECT_THAT(said([&](auto* r) { r->cone->index_pa = nan; }), HasSubstr("--cone-index: got nan"));
  EXPECT_THAT(said([&](auto* r) { r->cone->gradient_pa_per_m = nan; }),
              HasSubstr("--gradient: got nan"));
}

}  // namespace
}  // namespace grouser::surrogate

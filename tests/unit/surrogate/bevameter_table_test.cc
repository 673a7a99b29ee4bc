// What bevameters find of soils of grains: the table, and cards of models whose runs had such a
// soil.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <numbers>
#include <sstream>

#include "surrogate/fit/soil_card.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/soils/soil_library.h"
#include "tests/unit/refusal.h"

namespace grouser::surrogate {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

std::string MadeUpText() {
  std::ifstream file(GROUSER_MADE_UP_BEVAMETER);
  return {std::istreambuf_iterator<char>(file), {}};
}
std::vector<BevameterSoil> ReadBevameters(const std::string& text) {
  std::istringstream table(text);
  return ReadBevameterSoils(table, "b.csv");
}
/// What is said of the made-up table with one text replaced.
std::string SaidOf(const std::string& from, const std::string& to) {
  std::string text = MadeUpText();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return Refusal([&] { ReadBevameters(text); });
}
v1alpha1::Model SandTyre() {
  return ReadModel(GROUSER_PAIRS "/atv-20x10-lugged-20mm/hybrid.model").model;
}

TEST(BevameterTable, IsReadInSi) {
  const auto soils = ReadBevameters(MadeUpText());
  ASSERT_EQ(soils.size(), 1u);
  const BevameterSoil& s = soils[0];
  const auto& p = s.parameters;
  EXPECT_EQ(p[0]->value, 0.9);
  EXPECT_DOUBLE_EQ(p[1]->value, -4.6e3);
  EXPECT_DOUBLE_EQ(*p[1]->low, -9.9e3);
  EXPECT_FALSE(p[1]->identified);
  EXPECT_DOUBLE_EQ(*p[2]->high, 965e3);
  EXPECT_TRUE(p[2]->identified);
  EXPECT_DOUBLE_EQ(p[3]->value, 240);
  EXPECT_DOUBLE_EQ(p[4]->value, 25.5 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(p[5]->value, 4e-3);
  EXPECT_FALSE(p[5]->high);
  EXPECT_DOUBLE_EQ(p[6]->value, 0.91);
  EXPECT_DOUBLE_EQ(p[9]->value, 250);
  EXPECT_EQ(s.beds, 3);
  EXPECT_DOUBLE_EQ(s.grain_m, 0.02);
  EXPECT_EQ(s.density_kg_per_m3, 1340);
  EXPECT_EQ(s.source, "made up, for a test");
}

TEST(BevameterTable, SaysItsIntervalsAndWhatIsNotIdentified) {
  const std::string text = BevameterText(ReadBevameters(MadeUpText())[0]);
  EXPECT_THAT(text, AllOf(HasSubstr("they belong to grains of 20 mm"),
                          HasSubstr("by Bekker's form (taken)"), HasSubstr("by Reece's form:\n"),
                          ContainsRegex("K +4 +3.1 to inf +mm\n"),
                          HasSubstr("3 beds; made up, for a test; bevameter.json bbbbbbbbbbbb")));
  const auto line = text.substr(text.find("  k_c "), 90);
  EXPECT_THAT(line.substr(0, line.find('\n')),
              AllOf(HasSubstr("-4.6"), HasSubstr("-9.9 to 0.5"), HasSubstr("not identified")));
}

TEST(BevameterTable, DamagedTablesAreRefusedWithFileAndLine) {
  EXPECT_EQ(SaidOf("20,bbb", "20,bbb"), "");
  EXPECT_THAT(Refusal([] { ReadBevameters(""); }), HasSubstr("b.csv: no header"));
  EXPECT_THAT(SaidOf("n_low90", "n_low"), HasSubstr("b.csv:2: column n_low, expected n_low90"));
  EXPECT_THAT(SaidOf("for a test\"", "for a test"), HasSubstr("b.csv:3: a quote is not closed"));
  EXPECT_THAT(SaidOf(",0.84,0.96", ",0.84"), HasSubstr("b.csv:3: 38 columns, expected 39"));
  EXPECT_THAT(SaidOf(",0.9,", ",,"), HasSubstr("b.csv:3: n: empty, expected a number"));
  EXPECT_THAT(SaidOf(",0.9,", ",x,"), HasSubstr("b.csv:3: n: x, expected a number"));
  EXPECT_THAT(SaidOf(",0.84,", ",0.95,"), HasSubstr("b.csv:3: n_low90: 0.95, expected a number"));
  EXPECT_THAT(SaidOf("25.5,22.6", "125.5,22.6"), HasSubstr("friction_angle_deg: 125.5"));
  EXPECT_THAT(SaidOf(",-12,-30,6,", ",,,,"),
              HasSubstr("reece_k_c: empty, expected all of Reece's"));
  EXPECT_THAT(SaidOf(",-12,-30,6,", ",,-30,,"),
              HasSubstr("reece_k_c_low90: -30, expected nothing"));
  EXPECT_THAT(SaidOf(",-12,-30,6,", ",,30,,"), HasSubstr("reece_k_c_low90: 30, expected nothing"));
  EXPECT_THAT(SaidOf(",bekker,", ",wong,"), HasSubstr("form: wong, expected bekker or reece"));
  EXPECT_THAT(SaidOf("reece_k_c,3", "k_d,3"), HasSubstr("not_identified: k_c cohesion k_d"));
  EXPECT_THAT(SaidOf(",3,20,", ",2.5,20,"), HasSubstr("beds: 2.5, expected a whole number"));
  EXPECT_THAT(SaidOf("14b8", "14B8"), HasSubstr("soil_sha256: 14B8"));
  const std::string twice = MadeUpText() + MadeUpText().substr(MadeUpText().find("cmu-dry-sand"));
  EXPECT_THAT(Refusal([&] { ReadBevameters(twice); }), HasSubstr("b.csv:4: soil_sha256: 14b8"));
}

TEST(BevameterTable, IsInTheCardOfModelsWhoseRunsHadTheSoil) {
  const v1alpha1::Model model = SandTyre();
  const auto soils = ReadBevameters(MadeUpText());
  const SoilCard card{LineOfSoil(model, soils), std::nullopt};
  ASSERT_TRUE(card.bevameter) << SoilIdentity(model.soil());
  EXPECT_THAT(SoilCardText(card), AllOf(HasSubstr("they belong to grains of 20 mm"),
                                        HasSubstr("cone index: not known of this soil")));
  const Json json = SoilCardJson(card);
  EXPECT_EQ(json["bevameter"]["parameters"]["k_c"]["low90"], -9900.0);
  EXPECT_EQ(json["bevameter"]["parameters"]["shear_modulus"]["high90"], Json());
  EXPECT_EQ(json["bevameter"]["parameters"]["cohesion"]["identified"], false);
  EXPECT_EQ(json["cone_index"], Json());
  const SoilCard of_file = SoilCardOf(model, {GROUSER_MADE_UP_BEVAMETER}, {});
  EXPECT_EQ(of_file.bevameter->source, "made up, for a test");
  EXPECT_TRUE(of_file.cone);
}

TEST(BevameterTable, IsNotInTheCardOfAnotherSoil) {
  const auto soils = ReadBevameters(MadeUpText());
  v1alpha1::Model model = SandTyre();
  model.mutable_soil()->mutable_grains()->set_rolling_friction(0.5);
  EXPECT_FALSE(LineOfSoil(model, soils));
  EXPECT_THAT(SoilCardText({}), HasSubstr("soil parameters by a bevameter: not known"));
  model = SandTyre();
  model.set_kind(v1alpha1::MODEL_KIND_HARD);
  EXPECT_FALSE(LineOfSoil(model, soils));
}

TEST(BevameterTable, BelongsToUntunedModelsByName) {
  const auto soils = ReadBevameters(MadeUpText());
  v1alpha1::Model model = SandTyre();
  model.mutable_soil()->clear_grains();
  model.mutable_soil()->set_name("CMU-dry-sand-20mm, DEM");  // as calibrated/soil.csv has it
  EXPECT_TRUE(LineOfSoil(model, soils));
  model.mutable_soil()->set_name("cmu-dry-sand");
  EXPECT_FALSE(LineOfSoil(model, soils));
}

TEST(BevameterTable, IsShownByNameOfTheSoil) {
  const SoilsOfGrains grains{ReadBevameters(MadeUpText()), {}};
  EXPECT_TRUE(grains.Has("cmu-dry-sand-20mm"));
  EXPECT_FALSE(grains.Has("LETE sand"));
  EXPECT_THAT(GrainsText("cmu-dry-sand-20mm", grains), HasSubstr("grains of 20 mm"));
  EXPECT_EQ(GrainsText("LETE sand", grains), "");
  const Json json = Json::parse(GrainsJson("cmu-dry-sand-20mm", grains))[0];
  EXPECT_EQ(json["bevameter"]["beds"], 3);
  EXPECT_EQ(json["cone_index"], Json());
}

TEST(BevameterTable, TheShippedOneIsRead) {
  ASSERT_FALSE(BevameterSoils().empty());
  for (const BevameterSoil& soil : BevameterSoils()) {
    EXPECT_GE(soil.beds, 1) << soil.soil;
    EXPECT_THAT(BevameterText(soil), Not(HasSubstr("nan")));
  }
}

}  // namespace
}  // namespace grouser::surrogate

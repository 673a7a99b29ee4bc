// Wheel files, and soils by name or file.
#include "surrogate/soils/soil_library.h"

#include <gmock/gmock.h>

#include <fstream>
#include <stdexcept>

#include "proto/records/yaml/message_yaml.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

class WheelAndSoil : public ::testing::Test {
 protected:
  static SoilLibrary Library() {
    SoilLibrary library;
    library.Add(GROUSER_SOILS);
    return library;
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

TEST_F(WheelAndSoil, WheelFilesAreReadAloneOrInAScene) {
  EXPECT_EQ(Said("radius_m: 0.1\nwidth_m: 0.05\n"), "name w");
  EXPECT_EQ(Said("name: a\nsoil: {}\nwheel:\n  name: b\n  radius_m: 0.1\n  width_m: 0.05\n"),
            "name b");
  EXPECT_THAT(Said("radius_m: 100\nwidth_m: 0.05\n"),
              HasSubstr("w.yaml:1: key 'radius_m': got '100', expected a number in [0.005, 5]"));
  EXPECT_THAT(Said("radius_m: 0.1\nwidth_m: 0.05\nwidht: 1\n"),
              HasSubstr("w.yaml:3: key 'widht': got an unknown key"));
  EXPECT_THAT(Said("radius_m: 0.1\n"), HasSubstr("width_m"));
}

TEST_F(WheelAndSoil, UnknownSoilsGetTheNearestNames) {
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

TEST_F(WheelAndSoil, SuggestsByWordsThenByMoisture) {
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

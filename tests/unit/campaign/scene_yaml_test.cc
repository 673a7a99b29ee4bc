#include "dem_offline/scenes/scene_yaml.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "dem_offline/scenes/engine_convert.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::campaign {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kScenes = GROUSER_CAMPAIGNS;

TEST(SceneYaml, ReadsAShippedScene) {
  const auto scene = LoadScene(kScenes + "/cmu_smooth_demo.scene.yaml");
  EXPECT_EQ(scene.soil().bulk_density_kg_per_m3(), 1330);
  EXPECT_EQ(scene.wheel().radius_m(), 0.0625);
  EXPECT_EQ(scene.soil().grains().sizes_size(), 3);
  EXPECT_DOUBLE_EQ(scene.rig().stress_bin_rad(), 5 * std::numbers::pi / 180);
}

TEST(SceneYaml, TakesASoilFromAFileOfItsOwn) {
  const auto scene = LoadScene(kScenes + "/cmu_validate.scene.yaml");  // its soil is a file's name
  EXPECT_EQ(scene.soil().name(), "cmu-dry-sand-loose-8mm");
  EXPECT_EQ(scene.soil().grains().solid_fraction(), 0.533);
  EXPECT_EQ(scene.rig().max_time_s(), 0);  // by rule
  EXPECT_EQ(scene.rig().travel().least_hub_m(), 0.3);
  const auto other =
      LoadScene(kScenes + "/cmu_smooth_8mm.scene.yaml", kScenes + "/cmu_loose.soil.yaml");
  EXPECT_EQ(other.soil().name(), "cmu-dry-sand-loose-8mm");
  EXPECT_EQ(other.wheel().name(), "smooth-62.5");
  EXPECT_THROW(LoadScene(kScenes + "/cmu_smooth_8mm.scene.yaml", kScenes + "/none.soil.yaml"),
               InputError);
}

TEST(SceneYaml, ReadsPreparationTopLayerAndTravel) {
  const records::TempFolder folder;
  std::string text = records::ReadFileBytes(kScenes + "/smoke.scene.yaml");
  const auto put = [&](const std::string& after, const std::string& more) {
    text.insert(text.find(after) + after.size(), more);
  };
  put("solid_fraction: 0.58\n",
      "    preparation: {friction: 0.3, rolling_friction: 0.1}\n"
      "    top_layer: {thickness_m: 0.035, solid_fraction: 0.55, preparation: {friction: 0.7}}\n");
  put("width_bins: 5\n",
      "  most_sinkage_m: 0.03\n"
      "  travel: {least_hub_m: 0.05, compare_from_hub_m: 0.02, compare_to_hub_m: 0.04}\n");
  text.replace(text.find("bed_depth_m: 0.05"), 17, "bed_depth_m: 0.09");
  records::WriteFileDurably(folder / "s.scene.yaml", text);
  const auto scene = LoadScene(folder / "s.scene.yaml");
  EXPECT_EQ(scene.soil().grains().preparation().friction(), 0.3);
  EXPECT_EQ(scene.soil().grains().preparation().rolling_friction(), 0.1);
  EXPECT_EQ(scene.soil().grains().top_layer().thickness_m(), 0.035);
  EXPECT_EQ(scene.soil().grains().top_layer().solid_fraction(), 0.55);
  const auto& top = scene.soil().grains().top_layer().preparation();
  EXPECT_EQ(top.friction(), 0.7);
  EXPECT_FALSE(top.has_rolling_friction());
  EXPECT_EQ(scene.rig().most_sinkage_m(), 0.03);
  EXPECT_EQ(scene.rig().travel().compare_from_hub_m(), 0.02);
  EXPECT_EQ(scene.rig().travel().compare_to_hub_m(), 0.04);
}

// One edit of the good file each: line to replace, by what, and the complaint.
struct Edit {
  const char* name;
  const char* line;
  const char* by;
  const char* complaint;
};

class BadScene : public testing::TestWithParam<Edit> {};

TEST_P(BadScene, IsRefusedWithFileLineKeyAndExpectation) {
  const records::TempFolder folder;
  std::string text = records::ReadFileBytes(kScenes + "/smoke.scene.yaml");
  const std::size_t at = text.find(GetParam().line);
  ASSERT_NE(at, std::string::npos);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
  text.replace(at, std::string(GetParam().line).size(), GetParam().by);
  const std::string path = folder / "bad.scene.yaml";
  records::WriteFileDurably(path, text);
  std::string complaint = GetParam().complaint;
  if (const auto mark = complaint.find("LINE"); mark != std::string::npos) {
    complaint.replace(mark, 4, std::to_string(line));
  }
  EXPECT_THAT(MessageOf([&] { LoadScene(path); }), StartsWith(path + ":" + complaint));
  EXPECT_THROW(LoadScene(path), InputError);
}

INSTANTIATE_TEST_SUITE_P(
    Edits, BadScene,
    testing::Values(
        Edit{"UnknownKey", "name: smoke-wheel", "name: w\n  colour: red",
             "23: key 'wheel.colour': got an unknown key, expected one of: friction, name"},
        Edit{"MissingKey", "  width_m: 0.02\n", "", "22: key 'wheel.width_m': got no such key"},
        Edit{"WrongType", "radius_m: 0.025", "radius_m: wide",
             "LINE: key 'wheel.radius_m': got 'wide', expected a finite number"},
        Edit{"List", "radius_m: 0.025", "radius_m: [1, 2]",
             "LINE: key 'wheel.radius_m': got a list of 2, expected a finite number"},
        Edit{"Unit", "radius_m: 0.025", "radius_m: 25 mm",
             "LINE: key 'wheel.radius_m': got '25 mm', expected a finite number"},
        Edit{"Nan", "radius_m: 0.025", "radius_m: nan", "LINE: key 'wheel.radius_m': got 'nan'"},
        Edit{"Infinite", "radius_m: 0.025", "radius_m: inf",
             "LINE: key 'wheel.radius_m': got 'inf'"},
        Edit{"Negative", "max_time_s: 0.6", "max_time_s: -1",
             "LINE: key 'rig.max_time_s': got '-1', expected a number > 0"},
        Edit{"OutOfRange", "poisson_ratio: 0.3", "poisson_ratio: 0.7",
             "LINE: key 'soil.grains.poisson_ratio': got '0.7', expected a number in [0, 0.5]"},
        Edit{"Fraction", "width_bins: 5", "width_bins: 5.5",
             "LINE: key 'rig.width_bins': got '5.5', expected a whole number in [0, 1000000000]"},
        Edit{"UnknownBed", "width_bins: 5", "width_bins: 5\n  scene: endless",
             "39: key 'rig.scene': got 'endless', expected one of: periodic, full, window"},
        Edit{"SceneWithoutBed", "width_bins: 5", "width_bins: 5\n  scene: {freeze: on}",
             "39: key 'rig.scene.bed': got no such key"},
        Edit{"BadSwitch", "width_bins: 5", "width_bins: 5\n  scene: {bed: full, freeze: maybe}",
             "39: key 'rig.scene.freeze': got 'maybe', expected on or off"},
        Edit{"BoxWithoutFreezing", "width_bins: 5",
             "width_bins: 5\n  scene: {bed: full, freeze_box: 2}",
             "39: key 'rig.scene.freeze_box': got it without its use, expected freeze: on"},
        Edit{"LooksAtNothing", "width_bins: 5",
             "width_bins: 5\n  scene: {bed: full, look_steps: 50}",
             "39: key 'rig.scene.look_steps': got it without its use"},
        Edit{"DampingOfNoRolling", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {rolling: none, rolling_damping: 0.3}",
             "16: key 'soil.grains.contact.rolling_damping': got it with rolling: none"},
        Edit{"SmallBox", "width_bins: 5",
             "width_bins: 5\n  scene: {bed: full, freeze: on, freeze_box: 0.5}",
             "39: key 'rig.scene.freeze_box': got '0.5', expected a number in [1, 100]"},
        Edit{"WindowOfNoWindow", "width_bins: 5",
             "width_bins: 5\n  scene: {bed: full, window_length_m: 1}",
             "39: key 'rig.scene.window_length_m': got an unknown key"},
        Edit{"Twice", "radius_m: 0.025", "radius_m: 0.025\n  radius_m: 0.030",
             "24: key 'wheel.radius_m': got it twice"},
        Edit{"SizesSum", "mass_fraction: 0.50", "mass_fraction: 0.60",
             "18: key 'soil.grains.sizes': got mass fractions that sum to 1.1"},
        Edit{"SizesKey", "diameter_m: 0.010", "diameter: 0.010",
             "19: key 'soil.grains.sizes[1].diameter_m': got no such key"},
        Edit{"BulkDensity", "grain_density_kg_per_m3: 2293.1", "grain_density_kg_per_m3: 2650",
             "LINE: key 'soil.grains.grain_density_kg_per_m3': got 2650"},
        Edit{"UnknownLaw", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {normal: hooke}",
             "16: key 'soil.grains.contact': got normal law: 'hooke', expected one of "},
        Edit{"IllegalLaws", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {normal: linear_spring, cohesion: jkr}",
             "16: key 'soil.grains.contact': got laws: "},
        Edit{"UnknownSetting", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {cohesion: capillary, capillary: {colour: 1}}",
             "16: key 'soil.grains.contact.capillary.colour': got an unknown key"},
        Edit{"NewLawOfAnOldName", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {normal: hertz_oden_martins}",
             "16: key 'soil.grains.contact.normal': got hertz_oden_martins without its "
             "damping_kg_per_m_s, expected a given beta >= 0: since engine version 5"},
        Edit{"NewLawWithOldSettings", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {normal: hertz_oden_martins, "
             "hertz_oden_martins: {critical_damping_share: 0.2}}",
             "16: key 'soil.grains.contact.normal': got hertz_oden_martins without its "
             "damping_kg_per_m_s, expected a given beta >= 0: since engine version 5"},
        Edit{"DampingTwice", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {normal: hertz_dashpot, "
             "hertz_dashpot: {damping_n_s_per_m: 2, critical_damping_share: 0.1}}",
             "16: key 'soil.grains.contact': got hertz_dashpot.damping_n_s_per_m and "
             "hertz_dashpot.critical_damping_share: got both, expected one of them"},
        Edit{"Friction", "friction: 0.5", "friction: 11",
             "LINE: key 'soil.grains.friction': got '11', expected a number in [0, 10]"},
        Edit{"SolidFraction", "solid_fraction: 0.58", "solid_fraction: 0.95",
             "10: key 'soil.grains.grain_density_kg_per_m3': got 2293.1 (times"},
        Edit{"Step", "rayleigh_fraction: 0.2", "rayleigh_fraction: 0.45",
             "LINE: key 'rig.rayleigh_fraction': got '0.45', expected a number in [0.001, 0.4]"},
        Edit{"Degrees", "stress_bin_deg: 5", "stress_bin_deg: 90",
             "LINE: key 'rig.stress_bin_deg': got '90', expected in radians, a number in "},
        Edit{"SizeOfTheList", "diameter_m: 0.010", "diameter_m: 10",
             "19: key 'soil.grains.sizes[1].diameter_m': got 10 m, expected metres"},
        Edit{"NarrowBed", "bed_width_m: 0.09", "bed_width_m: 0.010",
             "LINE: key 'rig.bed_width_m': got 0.01 m, expected at least 0.044 m"},
        Edit{"BedOfAWheel", "bed_length_m: 0.12", "bed_length_m: 0.07",
             "LINE: key 'rig.bed_length_m': got 0.07 m, expected more than 0.075 m"},
        Edit{"BadTread", "radius_m: 0.025",
             "radius_m: 0.025\n  treads: [{count: 0, height_m: 0.004, root_thickness_m: 0.003}]",
             "24: key 'wheel.treads': got tread.count: got 0, expected 1 to 1000 bars"},
        Edit{"DampingOfNoRollingAtTheFloor", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {rolling: none, floor: {rolling_damping: 0.3}}",
             "16: key 'soil.grains.contact.floor.rolling_damping': got '0.3', expected none unless "
             "rolling is epsd"},
        Edit{"RangeAtTheWheel", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {wheel: {rolling_damping: -1}}",
             "16: key 'soil.grains.contact.wheel.rolling_damping': got '-1', expected a number in "
             "[0, 10]"},
        Edit{"AnotherLawsSettingAtTheWheel", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {wheel: {linear_spring: {stiffness_n_per_m: 1}}}",
             "16: key 'soil.grains.contact.wheel.linear_spring.stiffness_n_per_m': got '1', "
             "expected "
             "settings of the chosen laws alone"},
        Edit{"UnknownSettingAtTheFloor", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {floor: {hertz_restitution: {colour: 1}}}",
             "16: key 'soil.grains.contact.floor.hertz_restitution.colour': got an unknown key"},
        Edit{"UnknownKeyAtTheWheel", "rolling_friction: 0.2",
             "rolling_friction: 0.2\n    contact: {wheel: {friction: 1}}",
             "16: key 'soil.grains.contact.wheel.friction': got an unknown key"},
        Edit{"Malformed", "rig:\n", "rig: {\n", "31: malformed YAML"},
        Edit{"NotAMapping", "# A toy", "- a\n#", "1: key ''"}),
    [](const auto& info) { return info.param.name; });

TEST(SceneYaml, LawsAndTreadsReachTheEngine) {
  const records::TempFolder folder;
  std::string text = records::ReadFileBytes(kScenes + "/smoke.scene.yaml");
  const auto after = [&](const std::string& line, const std::string& more) {
    text.insert(text.find(line) + line.size(), "\n" + more);
  };
  after("    poisson_ratio: 0.3",
        "    contact: {tangential: linear_history, cohesion: jkr, surface_energy_j_per_m2: 0.1, "
        "hertz_restitution: {critical_damping_share: 0.2}, "
        "wheel: {hertz_restitution: {critical_damping_share: 0.9}, surface_energy_j_per_m2: 0}, "
        "floor: {rolling_damping: 0.4}}");
  after("  radius_m: 0.025",
        "  treads: [{count: 8, height_m: 0.004, root_thickness_m: 0.003, lean_deg: 30}]");
  const std::string path = folder / "a.scene.yaml";
  records::WriteFileDurably(path, text);
  v1alpha1::WheelTestSpec spec;
  const auto scene = LoadScene(path);
  *spec.mutable_soil() = scene.soil();
  *spec.mutable_wheel() = scene.wheel();
  const dem::WheelTestSpec engine = ToEngine(spec);
  EXPECT_EQ(engine.soil.contact.normal, "hertz_restitution");
  EXPECT_EQ(engine.soil.contact.tangential, "linear_history");
  EXPECT_EQ(engine.soil.contact.rolling, "epsd");
  EXPECT_EQ(engine.soil.contact.cohesion, "jkr");
  EXPECT_EQ(engine.soil.contact.surface_energy_j_per_m2, 0.1);
  ASSERT_EQ(engine.soil.contact.settings.size(), 1u);
  EXPECT_EQ(engine.soil.contact.settings[0].value, 0.2);
  const dem::InterfaceChoice &at_wheel = engine.soil.contact.wheel,
                             &at_floor = engine.soil.contact.floor;
  ASSERT_EQ(at_wheel.settings.size(), 1u);
  EXPECT_EQ(at_wheel.settings[0].value, 0.9);
  EXPECT_EQ(at_wheel.surface_energy_j_per_m2, 0.0);
  EXPECT_FALSE(at_wheel.rolling_damping.has_value());
  EXPECT_EQ(at_floor.rolling_damping, 0.4);
  EXPECT_TRUE(at_floor.settings.empty());
  ASSERT_EQ(engine.wheel.treads.size(), 1u);
  EXPECT_EQ(engine.wheel.treads[0].count, 8);
  EXPECT_NEAR(engine.wheel.treads[0].lean_rad, std::numbers::pi / 6, 1e-12);
}

TEST(SceneYaml, SceneChoiceReachesTheEngine) {
  const records::TempFolder folder;
  const auto read = [&](const std::string& scene) {
    std::string text = records::ReadFileBytes(kScenes + "/smoke.scene.yaml");
    text += scene;
    records::WriteFileDurably(folder / "a.scene.yaml", text);
    v1alpha1::WheelTestSpec spec;
    *spec.mutable_rig() = LoadScene(folder / "a.scene.yaml").rig();
    return ToEngine(spec).rig.scene;
  };
  EXPECT_EQ(read("").bed, dem::SceneBed::kPeriodic);
  const dem::SceneSettings usual, full = read("  scene: full\n");
  EXPECT_EQ(full.bed, dem::SceneBed::kFull);
  EXPECT_FALSE(full.freeze);
  EXPECT_EQ(full.look_steps, usual.look_steps);
  const dem::SceneSettings reduced = read(
      "  scene: {bed: window, window_length_m: 0.1, freeze: on, freeze_box: 2, largest_step: "
      "on}\n");
  EXPECT_EQ(reduced.bed, dem::SceneBed::kWindow);
  EXPECT_EQ(reduced.window_length_m, 0.1);
  EXPECT_EQ(reduced.window_ahead, usual.window_ahead);
  EXPECT_EQ(reduced.freeze_box, 2);
  EXPECT_TRUE(reduced.freeze && reduced.largest_step);
}

TEST(SceneYaml, MissingFileAndFolderAreInputErrors) {
  const records::TempFolder folder;
  EXPECT_THROW(LoadScene(folder / "none.yaml"), InputError);
  EXPECT_THROW(LoadScene(folder / "."), InputError);
  records::WriteFileDurably(folder / "empty.yaml", "");
  EXPECT_THAT(MessageOf([&] { LoadScene(folder / "empty.yaml"); }),
              HasSubstr("empty.yaml:1: key '': got nothing, expected a mapping"));
}

}  // namespace
}  // namespace grouser::campaign

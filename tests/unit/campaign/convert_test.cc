#include <gtest/gtest.h>

#include "dem_offline/campaign/progress.h"
#include "dem_offline/scenes/engine_convert.h"
#include "tests/unit/campaign/fake_backend.h"
#include "tests/unit/records/throws.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;

dem::Tile SomeTile() {
  FakeLog log;
  dem::Tile tile =
      FakeBackend(&log).prepare_bed({}, [](double, const std::string&) { return true; });
  tile.surface_m = -0.004;
  tile.top_solid_fraction = 0.53;
  tile.preparation_friction = {1.5, 2.5};
  tile.preparation_rolling_friction = {0.3, 0.7};
  return tile;
}

TEST(TileConvert, RoundTrip) {
  const dem::Tile tile = SomeTile();
  const dem::Tile back = ToTile(ToTileFile(tile, "key"), "key", "p");
  EXPECT_EQ(back.length_m, tile.length_m);
  EXPECT_EQ(back.solid_fraction, tile.solid_fraction);
  EXPECT_EQ(back.top_solid_fraction, tile.top_solid_fraction);
  EXPECT_EQ(back.surface_m, tile.surface_m);
  EXPECT_EQ(back.preparation_friction, tile.preparation_friction);
  EXPECT_EQ(back.preparation_rolling_friction, tile.preparation_rolling_friction);
  EXPECT_EQ(back.radius_m, tile.radius_m);
  EXPECT_EQ(back.position, tile.position);
  EXPECT_EQ(back.velocity, tile.velocity);
  EXPECT_EQ(back.spin, tile.spin);
  EXPECT_EQ(back.contact_first, tile.contact_first);
  EXPECT_EQ(back.contact_partner, tile.contact_partner);
  EXPECT_EQ(back.contact_history, tile.contact_history);
}

TEST(TileConvert, WrongKeyAndBadShapesAreRefused) {
  const records::TileFile good = ToTileFile(SomeTile(), "key");
  const auto complaint = [](const records::TileFile& file, const std::string& key) {
    return MessageOf([&] { ToTile(file, key, "p"); });
  };
  EXPECT_THAT(complaint(good, "other"), HasSubstr("p: holds another tile"));
  records::TileFile bad = good;
  bad.ints["position"].pop_back();
  EXPECT_THAT(complaint(bad, "key"), HasSubstr("'position' has 5 entries, expected 6"));
  bad = good;
  bad.ints["contact_partner"][0] = 2;
  EXPECT_THAT(complaint(bad, "key"), HasSubstr("grain that does not exist"));
  bad = good;
  bad.ints["contact_first"] = {0, 3, 2};
  EXPECT_THAT(complaint(bad, "key"), HasSubstr("decreases"));
  bad = good;
  bad.floats.erase("spin");
  EXPECT_THAT(complaint(bad, "key"), HasSubstr("without array 'spin'"));
  bad = good;
  bad.floats["contact_history"].pop_back();
  EXPECT_THAT(complaint(bad, "key"), HasSubstr("whole number of words"));
}

TEST(SpecConvert, EveryFieldArrives) {
  v1alpha1::WheelTestSpec spec;
  auto* grains = spec.mutable_soil()->mutable_grains();
  spec.mutable_soil()->set_gravity_m_per_s2(1);
  grains->set_grain_density_kg_per_m3(2);
  grains->set_youngs_modulus_pa(3);
  grains->set_poisson_ratio(4);
  grains->set_restitution(5);
  grains->set_friction(6);
  grains->set_rolling_friction(7);
  grains->set_solid_fraction(8);
  auto* bin = grains->add_sizes();
  bin->set_diameter_m(9);
  bin->set_mass_fraction(10);
  auto* wheel = spec.mutable_wheel();
  wheel->set_radius_m(11);
  wheel->set_width_m(12);
  wheel->set_restitution(13);
  wheel->set_friction(14);
  wheel->set_rolling_friction(15);
  auto* rig = spec.mutable_rig();
  rig->set_bed_length_m(16);
  rig->set_bed_width_m(17);
  rig->set_bed_depth_m(18);
  rig->set_speed_m_per_s(19);
  rig->set_max_time_s(20);
  rig->set_rayleigh_fraction(21);
  rig->set_target_relative_error(22);
  rig->set_stress_bin_rad(23);
  rig->set_width_bins(24);
  auto* scene = rig->mutable_scene();
  scene->set_bed(v1alpha1::SCENE_BED_WINDOW);
  scene->set_freeze(true);
  scene->set_largest_step(true);
  scene->set_window_length_m(30);
  scene->set_window_ahead(31);
  scene->set_freeze_box(32);
  scene->set_freeze_speed(33);
  scene->set_look_steps(34);
  auto* state = spec.mutable_state();
  state->set_mode(v1alpha1::RIG_MODE_FREE_SLIP);
  state->set_slip(25);
  state->set_attack_angle_rad(26);
  state->set_load_n(27);
  state->set_drawbar_n(28);
  spec.set_seed(29);
  auto* preparation = grains->mutable_preparation();
  preparation->set_friction(35);
  preparation->set_rolling_friction(36);
  grains->mutable_top_layer()->set_thickness_m(37);
  grains->mutable_top_layer()->set_solid_fraction(38);
  rig->set_most_sinkage_m(39);
  rig->mutable_travel()->set_least_hub_m(40);
  rig->mutable_travel()->set_compare_from_hub_m(41);
  rig->mutable_travel()->set_compare_to_hub_m(42);
  grains->mutable_top_layer()->mutable_preparation()->set_friction(43);
  grains->mutable_top_layer()->mutable_preparation()->set_rolling_friction(44);
  const dem::WheelTestSpec out = ToEngine(spec);
  ASSERT_EQ(out.soil.sizes.size(), 1u);
  const std::vector<double> got = {out.soil.gravity_m_per_s2,
                                   out.soil.density_kg_per_m3,
                                   out.soil.youngs_modulus_pa,
                                   out.soil.poisson_ratio,
                                   out.soil.restitution,
                                   out.soil.friction,
                                   out.soil.rolling_friction,
                                   out.soil.solid_fraction,
                                   out.soil.sizes[0].diameter_m,
                                   out.soil.sizes[0].mass_fraction,
                                   out.wheel.radius_m,
                                   out.wheel.width_m,
                                   out.wheel.restitution,
                                   out.wheel.friction,
                                   out.wheel.rolling_friction,
                                   out.rig.bed_length_m,
                                   out.rig.bed_width_m,
                                   out.rig.bed_depth_m,
                                   out.rig.speed_m_per_s,
                                   out.rig.max_time_s,
                                   out.rig.rayleigh_fraction,
                                   out.rig.target_relative_error,
                                   out.rig.stress_bin_rad,
                                   static_cast<double>(out.rig.width_bins),
                                   out.state.slip,
                                   out.state.attack_angle_rad,
                                   out.state.load_n,
                                   out.state.drawbar_n,
                                   static_cast<double>(out.seed),
                                   out.rig.scene.window_length_m,
                                   out.rig.scene.window_ahead,
                                   out.rig.scene.freeze_box,
                                   out.rig.scene.freeze_speed,
                                   static_cast<double>(out.rig.scene.look_steps),
                                   out.soil.preparation.friction.value_or(0),
                                   out.soil.preparation.rolling_friction.value_or(0),
                                   out.soil.top.thickness_m,
                                   out.soil.top.solid_fraction,
                                   out.rig.most_sinkage_m,
                                   out.rig.travel.least_hub_m,
                                   out.rig.travel.compare_from_hub_m,
                                   out.rig.travel.compare_to_hub_m,
                                   out.soil.top.preparation.friction.value_or(0),
                                   out.soil.top.preparation.rolling_friction.value_or(0)};
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i], static_cast<double>(i + 1));
  EXPECT_EQ(out.state.mode, dem::RigMode::kFreeSlip);
  EXPECT_EQ(out.rig.scene.bed, dem::SceneBed::kWindow);
  EXPECT_TRUE(out.rig.scene.freeze);
  EXPECT_TRUE(out.rig.scene.largest_step);
}

TEST(SpecConvert, NoSceneMeansTheEnginesOwnDefaults) {
  const dem::SceneSettings usual, got = ToEngine(v1alpha1::WheelTestSpec()).rig.scene;
  EXPECT_EQ(got.bed, usual.bed);
  EXPECT_EQ(got.freeze, usual.freeze);
  EXPECT_EQ(got.freeze_box, usual.freeze_box);
  EXPECT_EQ(got.look_steps, usual.look_steps);
}

TEST(RecordConvert, EveryOutcomeHasItsStatus) {
  using Status = dem::RunStatus;
  for (const auto& [status, name] : {std::pair{Status::kSteady, v1alpha1::RUN_STATUS_STEADY},
                                     {Status::kUnsteady, v1alpha1::RUN_STATUS_UNSTEADY},
                                     {Status::kOverload, v1alpha1::RUN_STATUS_OVERLOAD},
                                     {Status::kFailed, v1alpha1::RUN_STATUS_FAILED},
                                     {Status::kLost, v1alpha1::RUN_STATUS_LOST}}) {
    dem::WheelTestResult result;
    result.status = status;
    result.means_of_no_state = status == Status::kUnsteady;
    const auto record = ToRunFile({}, SomeTile(), result).record;
    EXPECT_EQ(record.status(), name);
    EXPECT_EQ(record.means_of_no_state(), result.means_of_no_state);
    v1alpha1::CampaignStatus counts;
    CountRun(name, &counts);
    EXPECT_EQ(counts.done(), 1u);
    EXPECT_EQ(
        counts.steady() + counts.unsteady() + counts.overload() + counts.failed() + counts.lost(),
        1u);
    EXPECT_EQ(counts.lost(), status == Status::kLost ? 1u : 0u);
  }
}

TEST(RecordConvert, ResultAndContextArrive) {
  dem::WheelTestResult result;
  result.status = dem::RunStatus::kOverload;
  result.reason = "too deep";
  result.outputs = {{"f_x", 1, 2, 3, 4}};
  result.rules = {{"depth", 1, 2, true}};
  result.blocks = 9;
  result.travel_m = 0.3;
  result.energy.residual_j = 0.01;
  result.series.time_s = {0, 1};
  result.stress.normal_pa = {5, 6};
  result.stress.width_bins = 2;
  result.surface.height_m = {7};
  result.surface.nx = 1;
  result.wall_s = 12;
  result.stopped = dem::StopCause::kPrecise;
  result.use.active_particle_steps = 5e6;
  result.use.deep_particle_steps = 2e6;
  result.energy.frozen_j = 0.02;
  result.hub_travel_m = 0.4;
  result.equal_travel = {0.2, 0.3, {{"f_y", 5, 6, 7, 8}}};
  result.series.hub_travel_m = {0, 0.1};
  RunContext context;
  context.spec.set_seed(4);
  context.run_id = "id";
  context.tile_sha256 = "hash";
  context.engine_version = "7";
  const auto file = ToRunFile(context, SomeTile(), result);
  const auto& record = file.record;
  EXPECT_EQ(record.status(), v1alpha1::RUN_STATUS_OVERLOAD);
  EXPECT_EQ(record.reason(), "too deep");
  EXPECT_EQ(record.outputs(0).fluctuation(), 4);
  EXPECT_TRUE(record.rules(0).kept());
  EXPECT_EQ(record.blocks(), 9u);
  EXPECT_EQ(record.energy().residual_j(), 0.01);
  EXPECT_EQ(record.bed().solid_fraction(), 0.58);
  EXPECT_EQ(record.bed().tile_sha256(), "hash");
  EXPECT_EQ(record.numerics().engine_version(), "7");
  EXPECT_EQ(record.numerics().wall_s(), 12);
  EXPECT_EQ(record.stopped_by(), "precise enough");
  EXPECT_EQ(record.numerics().awake_particle_steps(), 5e6);
  EXPECT_EQ(record.numerics().deep_particle_steps(), 2e6);
  EXPECT_EQ(record.energy().frozen_j(), 0.02);
  EXPECT_EQ(record.stress().normal_pa(1), 6);
  EXPECT_EQ(record.surface().height_m(0), 7);
  EXPECT_EQ(record.hub_travel_m(), 0.4);
  EXPECT_EQ(record.equal_travel().from_hub_m(), 0.2);
  EXPECT_EQ(record.equal_travel().to_hub_m(), 0.3);
  EXPECT_EQ(record.equal_travel().outputs(0).name(), "f_y");
  EXPECT_EQ(record.equal_travel().outputs(0).mean(), 5);
  EXPECT_EQ(record.bed().surface_m(), -0.004);
  EXPECT_EQ(record.bed().top_solid_fraction(), 0.53);
  EXPECT_EQ(record.bed().top_preparation_friction(), 2.5);
  EXPECT_EQ(record.bed().preparation_rolling_friction(), 0.3);
  EXPECT_EQ(record.bed().top_preparation_rolling_friction(), 0.7);
  EXPECT_EQ(file.series.at("time_s").size(), 2u);
  EXPECT_EQ(file.series.at("hub_travel_m").size(), 2u);
  EXPECT_EQ(file.series.size(), 11u);
}

}  // namespace
}  // namespace grouser::campaign

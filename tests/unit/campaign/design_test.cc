#include "dem_offline/campaign/design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "dem_offline/campaign/draw.h"
#include "dem_offline/campaign/schedule.h"
#include "dem_offline/scenes/run_identity.h"
#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;

const std::string kCampaigns = GROUSER_CAMPAIGNS;

std::map<v1alpha1::RunRole, int> Roles(const v1alpha1::Campaign& campaign) {
  std::map<v1alpha1::RunRole, int> roles;
  for (const auto& run : campaign.runs()) ++roles[run.role()];
  return roles;
}

class Design : public testing::Test {
 protected:
  v1alpha1::Campaign Load(const std::string& text) {
    records::WriteFileDurably(folder_ / "c.yaml",
                              "name: c\nscene: smoke.scene.yaml\nseeds: [1, 2]\n" + text);
    return LoadCampaign(folder_ / "c.yaml", "e");
  }
  std::string Complaint(const std::string& text) {
    return MessageOf([&] { Load(text); });
  }
  void SetUp() override {
    std::filesystem::copy_file(kCampaigns + "/smoke.scene.yaml", folder_ / "smoke.scene.yaml");
  }
  records::TempFolder folder_;
};

TEST_F(Design, GridIsTheProductWithSeeds) {
  const auto campaign =
      Load("grid: {slip: [-0.2, 0.2, 0.5], attack_angle_deg: [0, 90], load_n: [1, 2]}\n");
  EXPECT_EQ(campaign.runs_size(), 3 * 2 * 2 * 2);
  std::set<std::string> ids;
  for (const auto& run : campaign.runs()) {
    ids.insert(run.run_id());
    EXPECT_EQ(run.run_id().size(), 16u);
    EXPECT_EQ(run.role(), v1alpha1::RUN_ROLE_TRAIN);
    EXPECT_EQ(run.run_id(), RunId(SpecOf(campaign, run), "e"));
  }
  EXPECT_EQ(ids.size(), 24u);
}

TEST_F(Design, RolesSeedsAndModes) {
  const auto campaign = Load(
      "grid:\n"
      "  - {slip: [0.2], attack_angle_deg: [30], load_n: [1]}\n"
      "  - {mode: towed, attack_angle_deg: [0], load_n: [1]}\n"
      "extra:\n  - {slip: 0.9, attack_angle_deg: 0, load_n: 1, seed: 7}\n"
      "held_out:\n  - {mode: free, drawbar_n: 0.5, load_n: 1, seed: 1}\n"
      "patch:\n  - {slip: 0.2, attack_angle_deg: 30, load_n: 1, seeds: [3, 4, 5]}\n");
  const auto roles = Roles(campaign);
  EXPECT_EQ(roles.at(v1alpha1::RUN_ROLE_TRAIN), 5);
  EXPECT_EQ(roles.at(v1alpha1::RUN_ROLE_TEST), 1);
  EXPECT_EQ(roles.at(v1alpha1::RUN_ROLE_PATCH), 3);
  EXPECT_DOUBLE_EQ(campaign.runs(0).state().attack_angle_rad(), std::numbers::pi / 6);
  EXPECT_EQ(campaign.runs(2).state().mode(), v1alpha1::RIG_MODE_TOWED);
  EXPECT_EQ(campaign.runs(4).seed(), 7u);
  EXPECT_EQ(campaign.runs(5).state().drawbar_n(), 0.5);
}

TEST_F(Design, ErrorsNameLineAndKey) {
  EXPECT_THAT(Complaint("grid: {slip: [3], attack_angle_deg: [0], load_n: [1]}\n"),
              HasSubstr("c.yaml:4: key 'grid.slip': got '3', expected a number in [-2, 2]"));
  EXPECT_THAT(Complaint("grid: {slip: [0], load_n: [1]}\n"),
              HasSubstr(":4: key 'grid.attack_angle_deg': got no such key"));
  EXPECT_THAT(Complaint("grid: {slip: [0, 0], attack_angle_deg: [0], load_n: [1]}\n"),
              HasSubstr("got '0' twice"));
  EXPECT_THAT(Complaint("grid: {slip: [], attack_angle_deg: [0], load_n: [1]}\n"),
              HasSubstr("got a list of 0, expected a non-empty list"));
  EXPECT_THAT(Complaint("extra:\n  - {slip: 0, attack_angle_deg: 0, load_n: -1}\n"),
              HasSubstr(":5: key 'extra[0].load_n': got '-1', expected a number > 0"));
  EXPECT_THAT(Complaint("extra:\n  - {slip: 0, attack_angle_deg: 0, load_n: 1, sede: 1}\n"),
              HasSubstr("key 'extra[0].sede': got an unknown key, expected one of"));
  EXPECT_THAT(Complaint("mode: pushed\n"), HasSubstr(":4: key 'mode': got 'pushed'"));
  EXPECT_THAT(Complaint("mode: towed\ngrid: {slip: [0], attack_angle_deg: [0], load_n: [1]}\n"),
              HasSubstr("key 'grid.slip': got an unknown key"));
  EXPECT_THAT(Complaint("gird: {}\n"), HasSubstr("c.yaml:4: key 'gird': got an unknown key"));
  EXPECT_THAT(Complaint(""), HasSubstr("got no run"));
}

TEST_F(Design, RepeatedRunsAndLeakedTestStatesAreRefused) {
  const std::string state = "{slip: 0.1, attack_angle_deg: 0, load_n: 1, seed: ";
  EXPECT_THAT(Complaint("extra:\n  - " + state + "1}\n  - " + state + "1}\n"),
              HasSubstr(":6: key 'extra[1]': got the run"));
  EXPECT_THAT(Complaint("extra:\n  - " + state + "1}\nheld_out:\n  - " + state + "2}\n"),
              HasSubstr("both held out and not"));
}

TEST_F(Design, SceneErrorsNameTheSceneFile) {
  records::WriteFileDurably(folder_ / "smoke.scene.yaml", "name: x\n");
  EXPECT_THAT(Complaint(""), HasSubstr("smoke.scene.yaml:1: key 'soil': got no such key"));
}

TEST(RunIdentity, NamesDoNotCountPhysicsDoes) {
  v1alpha1::WheelTestSpec spec;
  spec.set_seed(1);
  spec.mutable_state()->set_load_n(24);
  const std::string id = RunId(spec, "1");
  v1alpha1::WheelTestSpec named = spec;
  named.set_scene("other");
  named.mutable_soil()->set_source("elsewhere");
  named.mutable_wheel()->set_name("round");
  named.mutable_state()->set_mode(v1alpha1::RIG_MODE_RIM_SPEED);  // as unspecified
  EXPECT_EQ(RunId(named, "1"), id);
  EXPECT_NE(RunId(spec, "2"), id);
  v1alpha1::WheelTestSpec changed = spec;
  changed.mutable_soil()->mutable_grains()->set_friction(0.5);
  EXPECT_NE(RunId(changed, "1"), id);
  EXPECT_NE(TileKey(changed, "1"), TileKey(spec, "1"));
  changed = spec;
  changed.mutable_state()->set_load_n(25);
  changed.mutable_wheel()->set_radius_m(1);
  EXPECT_NE(RunId(changed, "1"), id);
  EXPECT_EQ(TileKey(changed, "1"), TileKey(spec, "1"));
}

TEST(Schedule, EveryRunOnceAndOthersNotLast) {
  for (const char* name : {"demo", "small_model", "smoke"}) {
    const auto campaign = LoadCampaign(kCampaigns + "/" + name + ".campaign.yaml", "1");
    const auto order = ScheduleOrder(campaign);
    EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(),
              static_cast<std::size_t>(campaign.runs_size()));
    EXPECT_EQ(order.size(), static_cast<std::size_t>(campaign.runs_size()));
    EXPECT_EQ(campaign.runs(order.back()).role(), v1alpha1::RUN_ROLE_TRAIN) << name;
  }
}

// What the demo is promised to be: at least 12 runs over three attack angles,
// at least 3 held out.
TEST(ShippedCampaigns, Sizes) {
  const auto demo = LoadCampaign(kCampaigns + "/demo.campaign.yaml", "1");
  EXPECT_GE(Roles(demo).at(v1alpha1::RUN_ROLE_TRAIN), 12);
  EXPECT_GE(Roles(demo).at(v1alpha1::RUN_ROLE_TEST), 3);
  std::set<double> angles;
  for (const auto& run : demo.runs()) {
    if (run.role() == v1alpha1::RUN_ROLE_TRAIN) angles.insert(run.state().attack_angle_rad());
  }
  EXPECT_EQ(angles.size(), 3u);
  const auto small = LoadCampaign(kCampaigns + "/small_model.campaign.yaml", "1");
  EXPECT_EQ(small.runs_size(), 51);  // as many as its README says
  EXPECT_GE(Roles(small).at(v1alpha1::RUN_ROLE_TEST), 10);
}

TEST_F(Design, SceneAndSoilMayNotLeaveAFolder) {
  std::filesystem::create_directory(folder_ / "in");
  std::filesystem::copy_file(kCampaigns + "/smoke.scene.yaml", folder_ / "in/in.scene.yaml");
  const auto complaint = [&](const std::string& names) {
    records::WriteFileDurably(folder_ / "in/c.yaml",
                              "name: c\nseeds: [1]\nextra: [{slip: 0.2, attack_angle_deg: 0, "
                              "load_n: 1}]\n" +
                                  names + "\n");
    return MessageOf([&] { LoadCampaign(folder_ / "in/c.yaml", "e", folder_ / "in"); });
  };
  EXPECT_EQ(complaint("scene: in.scene.yaml"), "");
  EXPECT_THAT(complaint("scene: ../smoke.scene.yaml"), HasSubstr("c.yaml:4: key 'scene'"));
  EXPECT_THAT(complaint("scene: in.scene.yaml\nsoil: /etc/passwd"), HasSubstr("key 'soil'"));
  const std::string scene = records::ReadFileBytes(folder_ / "in/in.scene.yaml");
  records::WriteFileDurably(folder_ / "in/out.scene.yaml",
                            "soil: ../x.soil.yaml\n" + scene.substr(0, scene.find("soil:")));
  EXPECT_THAT(complaint("scene: out.scene.yaml"),
              HasSubstr("key 'soil': got '../x.soil.yaml', expected a file that does not leave"));
}

TEST_F(Design, SpeedIsAnAxisOfItsOwn) {
  const auto campaign = Load(
      "extra:\n"
      "  - {slip: 0.1, attack_angle_deg: 0, load_n: 1, seed: 1}\n"
      "  - {slip: 0.1, attack_angle_deg: 0, load_n: 1, seed: 1, speed_m_per_s: 0.5}\n"
      "held_out:\n  - {mode: towed, attack_angle_deg: 9, load_n: 1, seed: 1, speed_m_per_s: 2}\n");
  ASSERT_EQ(campaign.runs_size(), 3);
  const double rig = campaign.scene().rig().speed_m_per_s();
  EXPECT_EQ(SpecOf(campaign, campaign.runs(0)).rig().speed_m_per_s(), rig);
  EXPECT_EQ(SpecOf(campaign, campaign.runs(1)).rig().speed_m_per_s(), 0.5);
  EXPECT_EQ(SpecOf(campaign, campaign.runs(1)).state().speed_m_per_s(), 0);
  EXPECT_EQ(SpecOf(campaign, campaign.runs(2)).rig().speed_m_per_s(), 2);
  EXPECT_NE(campaign.runs(0).run_id(), campaign.runs(1).run_id());
  EXPECT_THAT(Describe(campaign.runs(1).state(), 1), HasSubstr("0.5 m/s"));
  EXPECT_THAT(
      Complaint("extra:\n  - {slip: 0, attack_angle_deg: 0, load_n: 1, speed_m_per_s: 0}\n"),
      HasSubstr("expected a number > 0"));
}

// The states of the campaign that surrogates learn from are those that the
// command beside them prints.
TEST(Draw, GivesTheStatesOfTheCmuCampaign) {
  const std::string file = records::ReadFileBytes(kCampaigns + "/cmu.campaign.yaml");
  DrawRequest test;
  test.seed = 20261130;
  test.states = 20;
  test.slip = {-1.1, 0.9};
  test.load_n = {7.5, 31};
  test.tiles = {5, 6};
  EXPECT_THAT(file, HasSubstr("held_out:\n" + DrawStates(test)));
  DrawRequest along;  // and of the regions that hold few of these
  along.seed = 20261201;
  along.states = 11;
  along.slip = {0.06, 0.75};
  along.angle_deg = {0, 9.5};
  along.load_n = {7.5, 31};
  along.tiles = {5, 6};
  EXPECT_THAT(file, HasSubstr(DrawStates(along)));
  along.seed = 20261202;
  along.slip = {-0.95, -0.06};
  EXPECT_THAT(file, HasSubstr(DrawStates(along)));
  DrawRequest sobol;
  sobol.sobol = true;
  sobol.states = 48;
  sobol.slip = {-1.1, 0.9};
  sobol.load_n = {7.5, 31};
  sobol.tiles = {1, 4};
  EXPECT_THAT(file, HasSubstr(DrawStates(sobol)));
}

TEST(Draw, KeepsToItsRangesAndToWhatMoves) {
  DrawRequest r;
  r.states = 400;
  r.slip = {-2, 0.9};
  r.speed = {0.5, 2.2};
  const std::string text = DrawStates(r);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 400);
  std::istringstream lines(text);
  double slowest = 9, fastest = 0;
  for (std::string line; std::getline(lines, line);) {
    double slip = 0, angle = 0, load = 0, speed = 0;
    unsigned long tile = 0;
    ASSERT_EQ(std::sscanf(line.c_str(),
                          "  - {slip: %lf, attack_angle_deg: %lf, load_n: %lf, speed_m_per_s: %lf, "
                          "seed: %lu}",
                          &slip, &angle, &load, &speed, &tile),
              5)
        << line;
    EXPECT_GE(slip, -1 - std::cos(angle * std::numbers::pi / 180) - 1e-3) << line;
    EXPECT_EQ(tile, 1u);
    slowest = std::min(slowest, speed);
    fastest = std::max(fastest, speed);
  }
  EXPECT_GE(slowest, 0.5);
  EXPECT_LT(slowest, 0.52);
  EXPECT_LE(fastest, 2.2);
  r.load_n = {5, 4};
  EXPECT_THROW(DrawStates(r), InputError);
}

}  // namespace
}  // namespace grouser::campaign

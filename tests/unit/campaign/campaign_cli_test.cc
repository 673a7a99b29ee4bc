// `grouser-dem campaign estimate`, `design`, `check` and `run` from the command line.
#include <gmock/gmock.h>

#include "tests/unit/campaign/dem_cli.h"

namespace grouser::campaign {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

using CampaignCli = DemCli;

TEST_F(CampaignCli, EstimateSaysWhatACampaignTakes) {
  ASSERT_EQ(Run("campaign estimate " GROUSER_CAMPAIGNS "/smoke.campaign.yaml --seconds 0.2"), 0)
      << said_;
  EXPECT_THAT(said_, AllOf(HasSubstr("campaign     smoke"), HasSubstr("1 of them held out"),
                           HasSubstr("grain-steps/s, a tile in"), HasSubstr("at most")));
  EXPECT_EQ(Run("campaign estimate " + In("none.campaign.yaml")), 2);
}

TEST_F(CampaignCli, ChecksThenRunsForAProgramThatFollows) {
  Write("c.campaign.yaml",
        "name: c\nscene: " GROUSER_CAMPAIGNS
        "/smoke.scene.yaml\nseeds: [1]\nextra: [{slip: 0.2, attack_angle_deg: 0, load_n: 1}]\n");
  const std::string file = In("c.campaign.yaml");
  ASSERT_EQ(Run("campaign check " + file), 0) << said_;
  EXPECT_THAT(said_, HasSubstr("\"total\":1,"));
  ASSERT_EQ(Run("campaign check --lengths " + file), 0) << said_;
  EXPECT_THAT(said_, HasSubstr("{\"lengths_m\": [0.12]}")) << "one tile of the scene";
  EXPECT_EQ(Run("campaign check " + file + " --within " + In("")), 2);
  EXPECT_THAT(said_, HasSubstr("key 'scene'"));
  ASSERT_EQ(Run("campaign run " + file + " --out " + In("c") + " --progress-lines --runs-json " +
                In("runs.json")),
            0)
      << said_;
  EXPECT_THAT(said_, HasSubstr("progress 1.0000 eta=0 1 of 1 runs"));
  EXPECT_THAT(Read("runs.json"), AllOf(HasSubstr("RUN_ROLE_TRAIN"), HasSubstr("run_id")));
  ASSERT_EQ(Run("campaign list " + In("c")), 0);
  EXPECT_THAT(said_, HasSubstr("TRAIN"));

  // The same state by itself: not run again, unless the file is damaged.
  const auto known = std::filesystem::directory_iterator(In("c/runs"))->path();
  const std::string again = "run --scene " GROUSER_CAMPAIGNS
                            "/smoke.scene.yaml --slip 0.2 --load 1 --json --out " +
                            In("a.run.h5") + " --known " + In("c/runs");
  ASSERT_EQ(Run(again), 0) << said_;
  EXPECT_THAT(said_, HasSubstr(known.string() + ": run before"));
  EXPECT_TRUE(Read("a.run.h5") == Read("c/runs/" + known.filename().string()));
  std::filesystem::resize_file(known, 1000);
  ASSERT_EQ(Run(again), 0) << said_;
  EXPECT_THAT(said_, AllOf(HasSubstr("it is run"), Not(HasSubstr("run before"))));
  EXPECT_GT(Read("a.run.h5").size(), 1000u);
  EXPECT_EQ(Run(again + "-gone"), 2);
  EXPECT_THAT(said_, HasSubstr("runs-gone: no folder"));
  EXPECT_EQ(Run("run " + In("any.yaml") + " --out " + In("b.run.h5") + " --known " + In("c/runs")),
            2);
  EXPECT_THAT(said_, HasSubstr("--known: not with an experiment file"));
}

TEST_F(CampaignCli, DesignRefusesBeforeItMeasures) {
  Write("wheel.yaml", "radius_m: 0.06\nwidth_m: 0.06\n");
  const std::string asked = "campaign design --wheel " + In("wheel.yaml") +
                            " --soil " GROUSER_CAMPAIGNS "/cmu_loose.soil.yaml --out " + In("out");
  EXPECT_EQ(Run(asked + " --load 1 3 --budget 2"), 2);  // hours, minutes?
  EXPECT_THAT(said_, HasSubstr("--budget"));
  EXPECT_EQ(Run(asked + " --load 3 1 --budget 2h"), 2);
  EXPECT_THAT(said_, HasSubstr("load: got 3 to 1 N, expected a range above 0"));
  std::filesystem::create_directories(In("out"));
  Write("out/wheel-cmu-dry-sand-loose-8mm.campaign.yaml", "mine");
  EXPECT_EQ(Run(asked + " --load 1 3 --budget 2h"), 2);
  EXPECT_THAT(said_, HasSubstr(".campaign.yaml: stands there, expected another --out or --name"));
  EXPECT_EQ(Read("out/wheel-cmu-dry-sand-loose-8mm.campaign.yaml"), "mine");
  EXPECT_FALSE(std::filesystem::exists(In("out/wheel-cmu-dry-sand-loose-8mm.soil.yaml")));
}

}  // namespace
}  // namespace grouser::campaign

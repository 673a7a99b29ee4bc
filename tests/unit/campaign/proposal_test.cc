#include "dem_offline/campaign/proposal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/tile_store.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/yaml_section.h"
#include "tests/unit/campaign/fake_backend.h"
#include "tests/unit/records/temp_folder.h"

namespace grouser::campaign {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Le;

class Proposals : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = folder_ / name;
    std::ofstream(path) << text;
    return path;
  }
  ProposalRequest Request(const std::string& wheel) {
    ProposalRequest request;
    request.wheel_file = Write("mine.yaml", wheel);
    request.soil_file = GROUSER_CAMPAIGNS "/cmu_loose.soil.yaml";
    request.name = "mine";
    request.load_n = {15, 30};
    return request;
  }
  static Pace Measured(const v1alpha1::WheelTestSpec&) { return {60, 1e7}; }
  v1alpha1::Campaign Written(const Proposal& p) {
    Write("mine.soil.yaml", p.soil);
    Write("mine.scene.yaml", p.scene);
    return LoadCampaign(Write("mine.campaign.yaml", p.campaign), "fake-1");
  }
  static std::string Refused(const ProposalRequest& request) {
    try {
      Propose(request, Measured);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  const records::TempFolder folder_;
};

constexpr char kWheel[] = "radius_m: 0.0625\nwidth_m: 0.05\nfriction: 0.5\n";

TEST_F(Proposals, KeepTheSizeRulesAndTheBudget) {
  ProposalRequest request = Request(kWheel);
  request.budget_s = 12 * 3600;
  request.cores = 2;
  const Proposal p = Propose(request, Measured);
  EXPECT_THAT(p.notes, IsEmpty());
  EXPECT_NEAR(p.diameter_m, 0.00796, 1e-4);  // as the soil has it
  const v1alpha1::Campaign campaign = Written(p);
  const CampaignCost cost = CostOf(campaign);
  EXPECT_EQ(cost.runs, p.runs);
  EXPECT_EQ(cost.held_out, p.runs / 4);
  EXPECT_THAT(cost.Seconds({60, 1e7}, 2),
              AllOf(Le(1.03 * request.budget_s), Ge(0.9 * request.budget_s)));
  const dem::WheelTestSpec spec = ToEngine(SpecOf(campaign, campaign.runs(0)));
  const double d = dem::MeanDiameter(spec.soil);
  EXPECT_GE(spec.wheel.width_m / d, 6);
  EXPECT_GE(spec.rig.bed_depth_m, 1.8 * spec.wheel.radius_m);
  EXPECT_GE(dem::MostSinkage(spec), spec.wheel.radius_m);
  EXPECT_NEAR(spec.rig.speed_m_per_s, 0.1, 1e-3);
  for (const auto& run : campaign.runs()) {
    EXPECT_THAT(run.state().load_n(), AllOf(Ge(15), Le(30)));
  }
}

TEST_F(Proposals, TreadsAskForFinerGrainsOfTheSameSoil) {
  ProposalRequest request = Request(std::string(kWheel) +
                                    "treads: {count: 12, height_m: 0.005, root_thickness_m: 0.002, "
                                    "lean_deg: 10}\n");
  request.budget_s = 1e7;
  const Proposal p = Propose(request, Measured);
  EXPECT_NEAR(p.diameter_m, 0.005, 1e-6);
  EXPECT_THAT(p.notes, ElementsAre(HasSubstr("grains of 5 mm for 7.")));
  const v1alpha1::Campaign campaign = Written(p);
  const auto soil = campaign.scene().soil();
  EXPECT_NEAR(soil.grains().sizes(0).diameter_m() / soil.grains().sizes(1).diameter_m(), 0.9, 1e-5);
  EXPECT_DOUBLE_EQ(soil.grains().grain_density_kg_per_m3(), 2495.3);
  EXPECT_EQ(campaign.scene().wheel().treads(0).count(), 12u);
  EXPECT_NEAR(campaign.scene().wheel().treads(0).lean_rad(), M_PI / 18, 1e-6);
}

TEST_F(Proposals, TakeCoarserGrainsBeforeTheyGiveUp) {
  ProposalRequest request = Request("radius_m: 0.125\nwidth_m: 0.1\n");
  request.budget_s = 3600;
  int measured = 0;
  const auto paced = [&](const v1alpha1::WheelTestSpec&) {
    ++measured;
    return Pace{60, 5e7};
  };
  const Proposal p = Propose(request, paced);
  EXPECT_EQ(measured, 2);  // the pace of what is proposed
  EXPECT_NEAR(p.diameter_m, 0.1 / 6, 1e-6);
  EXPECT_THAT(p.notes, ElementsAre(HasSubstr("states no friction"), HasSubstr("coarser ones"),
                                   HasSubstr("frictions belong to a grain size")));
  EXPECT_NEAR(Written(p).scene().wheel().friction(), 0.55, 1e-9);
  request.budget_s = 60;
  EXPECT_THAT(Refused(request), HasSubstr("on 1 cores pays for"));
  request.load_n = {0, 5};
  EXPECT_THAT(Refused(request), HasSubstr("load: got 0 to 5 N"));
}

TEST_F(Proposals, CostsAddUpAndThePaceIsMeasured) {
  v1alpha1::Campaign campaign;
  *campaign.mutable_scene() = SomeScene();
  for (int i = 0; i < 3; ++i) {
    auto* run = campaign.add_runs();
    run->set_role(i == 2 ? v1alpha1::RUN_ROLE_TEST : v1alpha1::RUN_ROLE_TRAIN);
    run->set_seed(i == 0 ? 1 : 2);
    run->mutable_state()->set_mode(v1alpha1::RIG_MODE_RIM_SPEED);
    run->mutable_state()->set_load_n(24);
  }
  const CampaignCost cost = CostOf(campaign);
  EXPECT_EQ(cost.runs, 3);
  EXPECT_EQ(cost.held_out, 1);
  EXPECT_EQ(cost.tiles, 2);
  const dem::Work work = dem::WorkOf(ToEngine(SpecOf(campaign, campaign.runs(0))));
  EXPECT_NEAR(cost.grain_steps, 3 * work.grains * work.steps, 1e-6 * cost.grain_steps);
  const Pace pace = {10, cost.longest};  // a run takes a second
  EXPECT_NEAR(cost.Seconds(pace, 1), 23, 1e-9);
  EXPECT_NEAR(cost.Seconds(pace, 2), 11.5, 1e-9);
  EXPECT_NEAR(cost.Seconds(pace, 100), 11, 1e-9);  // a tile, then its run

  FakeLog log;
  Backend backend = FakeBackend(&log);
  std::atomic<bool> stop{false};
  const auto spec = SpecOf(campaign, campaign.runs(0));
  EXPECT_THROW(MeasurePace(backend, spec, 1, stop), std::runtime_error);  // the fake makes no steps
  const auto run = backend.run;
  backend.run = [&](const auto& test, const auto& tile, const auto& progress) {
    auto result = run(test, tile, progress);
    result.particle_steps = 1e6;
    return result;
  };
  EXPECT_GT(MeasurePace(backend, spec, 1, stop).grain_steps_per_s, 0);
  stop = true;
  EXPECT_THROW(MeasurePace(backend, spec, 1, stop), Stopped);
  backend.prepare_bed = [](const auto&, const auto& progress) -> dem::Tile {
    throw std::runtime_error(progress(0.5, "tile") ? "a bed that cannot be packed" : "stopped");
  };
  EXPECT_THROW(MeasurePace(backend, spec, 1, stop), Stopped);
  stop = false;
  EXPECT_THROW(MeasurePace(backend, spec, 1, stop), std::runtime_error);
}

}  // namespace
}  // namespace grouser::campaign

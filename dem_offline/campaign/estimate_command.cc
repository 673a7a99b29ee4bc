// What a campaign takes, and one that fits a budget.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <thread>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/campaign/proposal.h"
#include "dem_offline/campaign/tile_store.h"
#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/model_file.h"

namespace grouser::campaign {
namespace {

constexpr char kEstimateExample[] = R"(Example:
  grouser-dem campaign estimate dem_offline/campaigns/demo.campaign.yaml)";
constexpr char kDesignExample[] = R"(Example:
  grouser-dem campaign design --wheel my-wheel.yaml --soil dem_offline/campaigns/cmu_loose.soil.yaml \
    --load 15 40 --budget 2h --out out/my-campaign
Keys of wheel and soil file: docs/scene-files.md. The speed of this machine is measured, which settles
a bed. By which rules grains, bed and states are chosen: docs/engine.md.
Exit codes: 0 done, 1 failed, 2 bad input, 130/143 stopped by a signal.)";

struct Arguments {
  std::string file, out;
  double seconds = 20;
  ProposalRequest request;
  dem::WorkLimits limits;
};

int Cores() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

int Estimate(const Arguments& arguments, const StopSignals& signals) {
  const Backend backend = EngineBackend("cpu", arguments.limits);
  const v1alpha1::Campaign campaign = LoadCampaign(arguments.file, backend.engine_version);
  const Pace pace =
      MeasurePace(backend, SpecOf(campaign, campaign.runs(0)), arguments.seconds, signals.stop());
  fmt::print("{}", CostText(campaign, pace, arguments.request.cores));
  return 0;
}

int Design(const Arguments& arguments, const StopSignals& signals) {
  const Backend backend = EngineBackend("cpu", arguments.limits);
  const std::string stem = arguments.out + "/" + NameOf(arguments.request);
  const std::string soil_file = stem + ".soil.yaml", scene_file = stem + ".scene.yaml",
                    campaign_file = stem + ".campaign.yaml";
  for (const std::string& path : {soil_file, scene_file, campaign_file}) {
    if (!std::filesystem::exists(path)) continue;
    throw InputError(path + ": stands there, expected another --out or --name");
  }
  Pace pace;
  const Proposal proposal = Propose(arguments.request, [&](const v1alpha1::WheelTestSpec& spec) {
    PutText(
        stderr,
        "measuring the speed of this machine: settling a bed and timing a wheel test on one core "
        "takes minutes, more for large wheels\n");
    pace = MeasurePace(backend, spec, arguments.seconds, signals.stop());
    return pace;
  });
  std::filesystem::create_directories(arguments.out);
  records::WriteFileDurably(soil_file, proposal.soil);
  records::WriteFileDurably(scene_file, proposal.scene);
  records::WriteFileDurably(campaign_file, proposal.campaign);
  const v1alpha1::Campaign campaign = LoadCampaign(campaign_file, backend.engine_version);
  for (const std::string& note : proposal.notes) fmt::print("note         {}\n", note);
  fmt::print("mean grain   {:.3g} mm\n", 1e3 * proposal.diameter_m);
  fmt::print("{}", CostText(campaign, pace, arguments.request.cores));
  fmt::print(
      "next         ./grouser campaign run {0} --out {1}/runs --jobs {2}\n"
      "             ./grouser fit fit --runs {1}/runs --name {3} --out {1}/{3}.model\n",
      campaign_file, arguments.out, arguments.request.cores, proposal.name);
  return 0;
}

void AddShared(CLI::App* command, Arguments* arguments) {
  command->add_option("--jobs", arguments->request.cores, "Cores that will work; default: all")
      ->check(CLI::Range(1, 4096));
  command
      ->add_option("--seconds", arguments->seconds,
                   "For which a wheel test is timed, after its bed")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  AddMemoryLimit(*command, &arguments->limits);
}

template <class Work>
void WhenChosen(CLI::App* command, Action* action, const std::shared_ptr<Arguments>& arguments,
                Work work) {
  command->callback([=] {
    *action = [=](const StopSignals& signals) {
      try {
        return work(*arguments, signals);
      } catch (const Stopped&) {
        return signals.exit_code();
      }
    };
  });
}

}  // namespace

void AddEstimateCommands(CLI::App& campaign, Action* action) {
  auto arguments = std::make_shared<Arguments>();
  arguments->request.cores = Cores();
  CLI::App* estimate =
      campaign.add_subcommand("estimate", "What it takes at most: runs, memory, time here");
  estimate->footer(kEstimateExample);
  estimate->add_option("file", arguments->file, "Campaign file (*.campaign.yaml)")->required();
  AddShared(estimate, arguments.get());
  WhenChosen(estimate, action, arguments, Estimate);

  CLI::App* design =
      campaign.add_subcommand("design", "A campaign for a wheel and a soil that fits a budget");
  design->footer(kDesignExample);
  ProposalRequest& request = arguments->request;
  design->add_option("--wheel", request.wheel_file, "Wheel file")->required();
  design->add_option("--soil", request.soil_file, "Soil file of grains (*.soil.yaml)")->required();
  design->add_option("--load", request.load_n, "Vertical loads that the model is for: from, to [N]")
      ->required();
  design->add_option("--slip", request.slip, "From, to [-]")->capture_default_str();
  design->add_option("--angle-deg", request.angle_deg, "From, to [deg]")->capture_default_str();
  design->add_option("--budget", request.budget_s, "Time that it may take: 45min, 2h")
      ->required()
      ->transform(
          CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}},
                                CLI::AsNumberWithUnit::UNIT_REQUIRED));
  design->add_option("--name", request.name, "Of the campaign; default: of wheel and soil");
  design->add_option("--out", arguments->out, "Folder for the files")->required();
  AddShared(design, arguments.get());
  WhenChosen(design, action, arguments, Design);
}

}  // namespace grouser::campaign

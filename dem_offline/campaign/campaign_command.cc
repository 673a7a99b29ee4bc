#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <thread>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/draw.h"
#include "dem_offline/campaign/executor.h"
#include "dem_offline/campaign/run_folder.h"
#include "dem_offline/campaign/run_index.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/yaml_section.h"
#include "grouser/v1alpha1/model.pb.h"
#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"

namespace grouser::campaign {
namespace {

constexpr char kCampaignExamples[] = R"(Examples:
  grouser-dem campaign run dem_offline/campaigns/demo.campaign.yaml --out out/demo
  grouser-dem campaign run demo.campaign.yaml --out out/demo --jobs 1   # goes on where it stopped
  grouser-dem campaign status out/demo --json
  grouser-dem campaign list out/demo
  grouser-dem campaign reindex out/demo
  grouser-dem campaign estimate dem_offline/campaigns/demo.campaign.yaml
  grouser-dem campaign design --wheel my-wheel.yaml --soil dem_offline/campaigns/cmu_loose.soil.yaml \
    --load 15 40 --budget 2h --out out/my-campaign
  grouser-dem campaign draw --states 60 --seed 7 --slip -1 0.95 --load 8 30 --tiles 9 12
Keys of campaign, scene and soil files: docs/scene-files.md.)";

struct CampaignArguments {
  std::string file, folder, device = "cpu", runs_json, within;
  std::vector<std::string> known;
  dem::WorkLimits limits;
  int jobs = 0;
  bool json = false, progress_lines = false, lengths = false;
};

void PrintStatus(const v1alpha1::CampaignStatus& status, bool json) {
  if (json) {
    fmt::print("{}\n", records::ToJson(status));
    return;
  }
  fmt::print(
      "campaign {}: {}/{} done; {} steady, {} unsteady, {} overload, {} lost, {} failed; ETA {}\n",
      status.name(), status.done(), status.total(), status.steady(), status.unsteady(),
      status.overload(), status.lost(), status.failed(), ForPeople(status.eta_s()));
}

// Of summaries as `grouser-fit summarise` writes them.
std::map<std::string, v1alpha1::RunStatus> KnownRuns(const std::vector<std::string>& files) {
  std::map<std::string, v1alpha1::RunStatus> known;
  for (const std::string& file : files) {
    v1alpha1::CampaignSummary summary;
    try {
      records::FromJson(records::ReadInputFile(file, "a campaign's summary"), file, &summary, true);
    } catch (const std::exception& error) {
      throw InputError(fmt::format("--known: {}", error.what()));
    }
    for (const auto& run : summary.runs()) known[run.run_id()] = run.status();
  }
  return known;
}

// The index brought up to date, unreadable files named on stderr.
std::map<std::string, IndexedRun> FreshIndex(const RunFolder& folder) {
  RunIndex index(folder);
  for (const auto& [file, why] : index.Refresh()) PutText(stderr, why + "\n");
  return index.All();
}

// Of the planned runs those that are done.
std::string RunsJson(const RunFolder& folder) {
  const auto runs = FreshIndex(folder);
  std::string json;
  const v1alpha1::Campaign campaign = folder.ReadCampaign();
  for (const auto& planned : campaign.runs()) {
    const auto found = runs.find(planned.run_id());
    if (found == runs.end()) continue;
    v1alpha1::RunSummary summary = found->second.summary;
    summary.set_role(planned.role());
    json += (json.empty() ? "" : ",\n ") + records::ToJson(summary);
  }
  return "[" + json + "]\n";
}

int Check(const CampaignArguments& arguments) {
  const Backend backend = EngineBackend("cpu", arguments.limits);
  const v1alpha1::Campaign campaign =
      LoadCampaign(arguments.file, backend.engine_version, arguments.within);
  CheckCampaign(campaign, backend);
  v1alpha1::CampaignStatus status;
  status.set_name(campaign.name());
  status.set_total(static_cast<std::uint32_t>(campaign.runs_size()));
  fmt::print("{}\n", records::ToJson(status));
  if (arguments.lengths) {
    std::vector<double> lengths;
    for (const v1alpha1::PlannedRun& run : campaign.runs()) {
      lengths.push_back(dem::SceneLength(ToEngine(SpecOf(campaign, run))));
    }
    fmt::print("{{\"lengths_m\": [{}]}}\n", fmt::join(lengths, ", "));
  }
  return 0;
}

int RunIt(const CampaignArguments& arguments, const StopSignals& signals) {
  const Backend backend = EngineBackend(arguments.device, arguments.limits);
  if (arguments.device == "auto") PutText(stderr, "device: " + backend.isa + "\n");
  const v1alpha1::Campaign campaign = LoadCampaign(arguments.file, backend.engine_version);
  if (!arguments.runs_json.empty()) records::MakeFolderFor(arguments.runs_json);
  CampaignProgress progress(stderr, isatty(STDERR_FILENO) == 1, arguments.progress_lines);
  const auto status = RunCampaign(
      campaign,
      {.folder = arguments.folder, .jobs = arguments.jobs, .known = KnownRuns(arguments.known)},
      backend, signals.stop(), progress);
  if (!arguments.runs_json.empty()) {
    records::WriteFileDurably(arguments.runs_json, RunsJson(RunFolder(arguments.folder)));
  }
  if (status.done() < status.total() && signals.stop()) {
    PutText(stderr, "stopped; the same command goes on from here\n");
    PrintStatus(status, arguments.json);
    return signals.exit_code();
  }
  PrintStatus(status, arguments.json);
  return 0;
}

int Status(const CampaignArguments& arguments) {
  const RunFolder folder(arguments.folder);
  const v1alpha1::Campaign campaign = folder.ReadCampaign();
  const auto runs = FreshIndex(folder);
  v1alpha1::CampaignStatus status;
  status.set_name(campaign.name());
  status.set_total(static_cast<std::uint32_t>(campaign.runs_size()));
  double wall_s = 0;
  for (const auto& planned : campaign.runs()) {
    const auto found = runs.find(planned.run_id());
    if (found == runs.end()) continue;
    CountRun(found->second.summary.status(), &status);
    wall_s += found->second.wall_s;
  }
  // If all cores of this machine worked on it at the pace so far.
  const double left = status.total() - status.done();
  const double cores = std::max(1u, std::thread::hardware_concurrency());
  status.set_eta_s(left == 0           ? 0.0
                   : status.done() > 0 ? left * wall_s / status.done() / cores
                                       : std::nan(""));
  PrintStatus(status, arguments.json);
  return 0;
}

void PrintRow(const v1alpha1::PlannedRun& planned, const IndexedRun* run) {
  const std::string role = v1alpha1::RunRole_Name(planned.role()).substr(sizeof("RUN_ROLE_") - 1);
  fmt::print("{} {:5} {:44} ", planned.run_id(), role, Describe(planned.state(), planned.seed()));
  if (run == nullptr) {
    fmt::print("not run\n");
    return;
  }
  const auto& summary = run->summary;
  fmt::print("{:8}", v1alpha1::RunStatus_Name(summary.status()).substr(sizeof("RUN_STATUS_") - 1));
  fmt::print(
      " f_x {:7.2f}±{:.2f} N f_y {:7.2f}±{:.2f} N torque {:6.3f}±{:.3f} N m"
      " sinkage {:5.1f}±{:.1f} mm {}\n",
      summary.mean(0), summary.standard_error(0), summary.mean(1), summary.standard_error(1),
      summary.mean(3), summary.standard_error(3), 1000 * summary.mean(5),
      1000 * summary.standard_error(5), run->reason);
}

int List(const CampaignArguments& arguments) {
  const RunFolder folder(arguments.folder);
  if (arguments.json) {
    fmt::print("{}", RunsJson(folder));
    return 0;
  }
  const auto runs = FreshIndex(folder);
  const v1alpha1::Campaign campaign = folder.ReadCampaign();
  for (const auto& planned : campaign.runs()) {
    const auto found = runs.find(planned.run_id());
    PrintRow(planned, found == runs.end() ? nullptr : &found->second);
  }
  return 0;
}

int Reindex(const CampaignArguments& arguments) {
  const RunFolder folder(arguments.folder);
  const auto unreadable = RunIndex::Rebuild(folder);
  for (const auto& [file, why] : unreadable) PutText(stderr, why + "\n");
  fmt::print("{} runs indexed, {} unreadable\n", RunIndex(folder).All().size(), unreadable.size());
  return unreadable.empty() ? 0 : 1;
}

void AddDraw(CLI::App* campaign, Action* action) {
  auto request = std::make_shared<DrawRequest>();
  CLI::App* draw =
      campaign->add_subcommand("draw", "States for a campaign file, to fix them there");
  draw->footer(kCampaignExamples);
  draw->add_flag("--sobol", request->sobol, "Sobol's sequence; else independent draws");
  draw->add_option("--states", request->states, "How many")->capture_default_str();
  draw->add_option("--seed", request->seed, "Of the draws; Sobol: points passed over")
      ->capture_default_str();
  draw->add_option("--slip", request->slip, "From, to [-]")->capture_default_str();
  draw->add_option("--angle-deg", request->angle_deg, "From, to [deg]")->capture_default_str();
  draw->add_option("--load", request->load_n, "From, to [N]")->capture_default_str();
  draw->add_option("--speed", request->speed,
                   "From, to [m/s], even in the logarithm; 0: the rig's");
  draw->add_option("--tiles", request->tiles, "Seeds, first and last, taken in turn");
  draw->callback([=] {
    *action = [request](const StopSignals& signals) {
      signals.EndAtOnce();
      fmt::print("{}", DrawStates(*request));
      return 0;
    };
  });
}

}  // namespace

void AddCampaignCommand(CLI::App& app, Action* action) {
  CLI::App* campaign = app.add_subcommand("campaign", "A designed set of wheel tests");
  campaign->require_subcommand(1);
  campaign->footer(kCampaignExamples);
  auto arguments = std::make_shared<CampaignArguments>();
  AddDraw(campaign, action);
  AddEstimateCommands(*campaign, action);

  CLI::App* run = campaign->add_subcommand("run", "Run it, or go on where it stopped");
  run->footer(kCampaignExamples);
  run->add_option("file", arguments->file, "Campaign file (*.campaign.yaml)")->required();
  run->add_option("--out", arguments->folder, "Campaign folder")->required();
  run->add_option(
      "--known", arguments->known,
      "Summaries (grouser-fit summarise) of runs that were done elsewhere: not run again");
  run->add_option("--jobs", arguments->jobs, "Runs at a time; default: all cores")
      ->check(CLI::Range(1, 4096));
  run->add_option("--device", arguments->device,
                  "cpu (default: one run a core), cuda (all runs side by side on the card), auto, "
                  "or emulated")
      ->check(CLI::IsMember({"cpu", "cuda", "auto", "emulated"}));
  AddMemoryLimit(*run, &arguments->limits);
  run->add_flag("--json", arguments->json, "The final status as JSON on stdout");
  run->add_flag("--progress-lines", arguments->progress_lines,
                "'progress FRACTION eta=SECONDS STAGE' lines on stderr");
  run->add_option("--runs-json", arguments->runs_json,
                  "File for what is done at the end, as list --json prints it");
  run->callback([=] {
    *action = [arguments](const StopSignals& signals) { return RunIt(*arguments, signals); };
  });

  CLI::App* check = campaign->add_subcommand("check", "Whether it can be run; its runs as JSON");
  check->footer(kCampaignExamples);
  check->add_option("file", arguments->file, "Campaign file (*.campaign.yaml)")->required();
  check->add_option("--within", arguments->within, "Folder that scene and soil may not leave");
  check->add_flag("--lengths", arguments->lengths,
                  "Also how long the ground of each run is that is worked on at once [m]");
  AddMemoryLimit(*check, &arguments->limits);
  check->callback([=] {
    *action = [arguments](const StopSignals& signals) {
      signals.EndAtOnce();
      return Check(*arguments);
    };
  });

  const auto add = [&](const char* name, const char* help, int (*work)(const CampaignArguments&),
                       bool json) {
    CLI::App* command = campaign->add_subcommand(name, help);
    command->footer(kCampaignExamples);
    command->add_option("folder", arguments->folder, "Campaign folder")->required();
    if (json) command->add_flag("--json", arguments->json, "JSON on stdout");
    command->callback([=] {
      *action = [arguments, work](const StopSignals& signals) {
        signals.EndAtOnce();
        return work(*arguments);
      };
    });
  };
  add("status", "Counts and expected time to go", Status, true);
  add("list", "Every planned run and its means", List, true);
  add("reindex", "Rebuild the index from the run files", Reindex, false);
}

}  // namespace grouser::campaign

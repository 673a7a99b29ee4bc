#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>
#include <numbers>
#include <set>

#include "dem_offline/campaign/backend.h"
#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/experiment_run.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/campaign/run_one.h"
#include "dem_offline/campaign/sweep_run.h"
#include "dem_offline/campaign/tile_store.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/run_identity.h"
#include "dem_offline/scenes/scene_yaml.h"
#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "proto/records/os/no_space.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

constexpr char kRunExamples[] = R"(Examples:
  grouser-dem run --scene dem_offline/campaigns/smoke.scene.yaml --slip 0.2 --angle-deg 30 \
    --load 1.5 --out a.run.h5
  grouser-dem run dem_offline/experiments/plate.yaml --out out/plate.run.h5   # any experiment
  grouser-dem run bed_friction.yaml --out out/friction   # with a sweep; goes on where it stopped
  grouser-dem run --spec spec.json --tiles tiles --out a.run.h5 --json --progress-lines
The exit code is 0 whenever a record was written, also of an UNSTEADY, OVERLOAD,
LOST or FAILED run; its status says which. Keys of scene and soil files: docs/scene-files.md.)";

struct RunArguments {
  std::string scene, soil, spec, experiment, out, tiles, known;
  double slip = 0, angle_deg = 0, load_n = 0, drawbar_n = 0, max_time_s = 0;
  std::string mode = "rim", device = "cpu";
  std::uint64_t seed = 1;
  int jobs = 0;
  bool resume = false, json = false, progress_lines = false;
  std::vector<std::string> sets;
  dem::WorkLimits limits;
};

v1alpha1::WheelTestSpec SpecFromJson(const std::string& path) {
  v1alpha1::WheelTestSpec spec;
  try {
    records::FromJson(records::ReadFileBytes(path), path, &spec);
  } catch (const std::exception& error) {
    throw InputError(error.what());
  }
  if (spec.state().speed_m_per_s() != 0) {
    throw InputError(
        fmt::format("{}: state.speed_m_per_s: {}, expected 0: it belongs to planned "
                    "runs; the speed of a test is rig.speed_m_per_s",
                    path, spec.state().speed_m_per_s()));
  }
  if (!v1alpha1::RigMode_IsValid(spec.state().mode()) ||
      !v1alpha1::SceneBed_IsValid(spec.rig().scene().bed())) {
    throw InputError(path + ": state.mode, rig.scene.bed: expected values of their enums");
  }
  return spec;
}

v1alpha1::WheelTestSpec SpecFromScene(const RunArguments& arguments) {
  const v1alpha1::Scene scene = LoadScene(arguments.scene, arguments.soil);
  v1alpha1::WheelTestSpec spec;
  spec.set_scene(scene.name());
  *spec.mutable_soil() = scene.soil();
  *spec.mutable_wheel() = scene.wheel();
  *spec.mutable_rig() = scene.rig();
  if (arguments.max_time_s > 0) spec.mutable_rig()->set_max_time_s(arguments.max_time_s);
  spec.set_seed(arguments.seed);
  auto* state = spec.mutable_state();
  v1alpha1::RigMode mode = v1alpha1::RIG_MODE_RIM_SPEED;
  ParseMode(arguments.mode, &mode);
  state->set_mode(mode);
  state->set_slip(arguments.slip);
  state->set_attack_angle_rad(arguments.angle_deg * std::numbers::pi / 180.0);
  state->set_load_n(arguments.load_n);
  state->set_drawbar_n(arguments.drawbar_n);
  return spec;
}

// Settling a tile, where there is work in it, is the first fifth of the way.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(bool lines) : lines_(lines), live_(isatty(STDERR_FILENO) == 1) {}

  void Tile(double fraction) {
    settled_ = true;
    Print(0.2 * fraction, "tile");
  }
  void Run(double fraction) { Print(settled_ ? 0.2 + 0.8 * fraction : fraction, "run"); }
  void End() {
    if (lines_) PutText(stderr, "progress 1.000 done\n");
    if (!lines_ && live_) PutText(stderr, "\n");
  }

 private:
  void Print(double fraction, const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(200)) return;
    last_ = now;
    if (lines_) {
      PutText(stderr, fmt::format("progress {:.3f} {}\n", fraction, stage));
    } else if (live_) {
      PutText(stderr, fmt::format("\r{}: {:.0f} % ", stage, 100 * fraction));
    }
  }

  bool lines_, live_, settled_ = false;
  std::chrono::steady_clock::time_point last_{};
};

// Found out now, not after minutes of work.
void PrepareOut(const std::string& out) {
  auto folder = std::filesystem::path(out).parent_path();
  if (folder.empty()) folder = ".";
  if (std::filesystem::is_directory(out)) {
    throw InputError(fmt::format("--out {}: got a folder, expected the name of a file", out));
  }
  try {
    records::MakeFolderFor(out);
  } catch (const os::NoSpace&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw InputError(fmt::format("--out {}: {}", out, error.what()));
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    throw InputError(
        fmt::format("--out {}: folder '{}': {}", out, folder.string(), std::strerror(errno)));
  }
}

int RunSweepOf(const RunArguments& arguments, const Sweep& sweep, const StopSignals& signals) {
  if (arguments.resume) {
    throw InputError("--resume: a file with a sweep goes on by itself, run by run");
  }
  CampaignProgress progress(stderr, isatty(STDERR_FILENO) == 1, arguments.progress_lines);
  const auto status =
      RunSweep(sweep, {.folder = arguments.out, .jobs = arguments.jobs, .limits = arguments.limits},
               signals.stop(), progress);
  if (arguments.json) {
    fmt::print("{}\n", records::ToJson(status));
  } else {
    fmt::print("sweep {}: {}/{} done, {} failed; {}/members.csv\n", status.name(), status.done(),
               status.total(), status.failed(), arguments.out);
  }
  if (status.done() == status.total() || !signals.stop()) return 0;
  PutText(stderr, "stopped; the same command goes on from here\n");
  return signals.exit_code();
}

int RunFileOf(const RunArguments& arguments, const StopSignals& signals) {
  if (const auto sweep = LoadSweep(arguments.experiment, arguments.sets)) {
    return RunSweepOf(arguments, *sweep, signals);
  }
  if (arguments.jobs > 0) throw InputError("--jobs: one run, expected a file with a sweep");
  const ExperimentFile file =
      LoadExperiment(arguments.experiment, arguments.limits, arguments.sets);
  PrepareOut(arguments.out);
  if (arguments.resume && !std::filesystem::exists(CheckpointOf(arguments.out))) {
    PutText(stderr, CheckpointOf(arguments.out) + ": no checkpoint; the run begins anew\n");
  }
  for (const NamedFile& other : file.others) {
    if (!other.note.empty()) PutText(stderr, Described(other) + "\n");
  }
  ProgressPrinter printer(arguments.progress_lines);
  const auto run = RunExperimentTo(arguments.out, file,
                                   {.limits = arguments.limits,
                                    .told =
                                        [&](double fraction) {
                                          printer.Run(fraction);
                                          return !signals.stop();
                                        },
                                    .resume = arguments.resume});
  if (!run) return signals.exit_code();
  printer.End();
  if (arguments.json) {
    fmt::print("{}\n", records::ToJson(run->record));
  } else {
    PrintRecord(run->record);
  }
  return 0;
}

// Whether --known has a whole run of this id; it is copied to --out then.
bool TakeKnown(const RunArguments& arguments, const std::string& id) {
  const std::string path = arguments.known + "/" + id + ".run.h5";
  if (arguments.known.empty() || !std::filesystem::exists(path)) return false;
  try {
    const v1alpha1::RunRecord record = records::ReadRunFile(path).record;
    if (record.run_id() != id || record.status() == v1alpha1::RUN_STATUS_FAILED) return false;
    records::WriteFileDurably(arguments.out, records::ReadFileBytes(path));
    PutText(stderr, path + ": run before, taken from there\n");
    if (arguments.json) {
      fmt::print("{}\n", records::ToJson(record));
    } else {
      PrintRecord(record);
    }
    return true;
  } catch (const os::NoSpace&) {
    throw;  // there would be none for a new run either
  } catch (const std::exception& error) {
    PutText(stderr, fmt::format("{}; it is run\n", error.what()));
    return false;
  }
}

int Run(const RunArguments& arguments, const StopSignals& signals) {
  if (!arguments.experiment.empty()) return RunFileOf(arguments, signals);
  const v1alpha1::WheelTestSpec spec =
      arguments.spec.empty() ? SpecFromScene(arguments) : SpecFromJson(arguments.spec);
  const Backend backend = EngineBackend(arguments.device, arguments.limits);
  if (arguments.device == "auto") PutText(stderr, "device: " + backend.isa + "\n");
  backend.validate(ToEngine(spec));
  PrepareOut(arguments.out);
  if (!arguments.known.empty() && !std::filesystem::is_directory(arguments.known)) {
    throw InputError(fmt::format("--known {}: no folder", arguments.known));
  }
  if (TakeKnown(arguments, RunId(spec, backend.engine_version))) return 0;
  ProgressPrinter printer(arguments.progress_lines);
  TileStore tiles(arguments.tiles, &backend);
  try {
    const auto tile = tiles.Get(spec, [&](double fraction, const std::string&) {
      printer.Tile(fraction);
      return !signals.stop();
    });
    const auto file = RunOnTile(backend, spec, *tile, [&](double fraction, const std::string&) {
      printer.Run(fraction);
      return !signals.stop();
    });
    if (!file) return signals.exit_code();
    records::WriteRunFile(arguments.out, *file);
    printer.End();
    if (arguments.json) {
      fmt::print("{}\n", records::ToJson(file->record));
    } else {
      PrintRecord(file->record);
    }
  } catch (const Stopped&) {
    return signals.exit_code();
  }
  return 0;
}

}  // namespace

void AddMemoryLimit(CLI::App& command, dem::WorkLimits* limits) {
  command
      .add_option_function<double>(
          "--memory-gib", [limits](const double& gib) { limits->bytes = gib * 1073741824.0; },
          "Memory that may be used [GiB]; default: 80 % of what is available")
      ->check(CLI::PositiveNumber);
}

void AddRunCommand(CLI::App& app, Action* action) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* run =
      app.add_subcommand("run", "One experiment, a wheel test or any other; writes one run file");
  run->footer(kRunExamples);
  auto* scene = run->add_option("--scene", arguments->scene, "Scene file (*.scene.yaml)");
  run->add_option("--soil", arguments->soil, "Soil file, instead of the scene's soil")
      ->needs(scene);
  auto* spec = run->add_option("--spec", arguments->spec,
                               "JSON of a grouser.v1alpha1.WheelTestSpec, instead of a scene");
  scene->excludes(spec);
  auto* experiment = run->add_option("FILE", arguments->experiment,
                                     "An experiment file (docs/experiments.md), instead of both");
  experiment->excludes(scene)->excludes(spec);
  AddSets(*run, &arguments->sets)->needs(experiment);
  auto* slip = run->add_option("--slip", arguments->slip,
                               "(r w - v_x)/max(|r w|, V) [-]; mode rim needs it");
  auto* load = run->add_option("--load", arguments->load_n, "Vertical load [N]");
  auto* drawbar = run->add_option("--drawbar", arguments->drawbar_n,
                                  "Pull to overcome [N]; mode free needs it");
  auto* angle = run->add_option("--angle-deg", arguments->angle_deg,
                                "Attack angle [deg], default 0; not of mode free");
  run->add_option("--mode", arguments->mode, "rim (default), towed or free")
      ->check(CLI::IsMember({"rim", "towed", "free"}))
      ->excludes(spec);
  run->add_option("--seed", arguments->seed, "A seed is a new tile; default 1")->excludes(spec);
  run->add_option("--max-time", arguments->max_time_s, "Instead of the scene's max_time_s [s]")
      ->check(CLI::PositiveNumber)
      ->excludes(spec);
  for (auto* option : {slip, load, drawbar, angle}) option->excludes(spec);
  run->add_option("--out", arguments->out, "Run file to write (*.run.h5); of a sweep: a folder")
      ->required();
  run->add_option("--device", arguments->device,
                  "cpu (default), cuda, auto (a card where there is one), or emulated")
      ->check(CLI::IsMember({"cpu", "cuda", "auto", "emulated"}));
  run->add_option("--jobs", arguments->jobs, "Runs of a sweep at a time; default: one per core")
      ->check(CLI::PositiveNumber)
      ->needs(experiment);
  run->add_flag("--resume", arguments->resume, "Go on from the last checkpoint, where there is one")
      ->needs(experiment);
  AddMemoryLimit(*run, &arguments->limits);
  run->add_option("--tiles", arguments->tiles, "Folder that keeps settled tiles");
  run->add_option("--known", arguments->known,
                  "Folder of runs (ID.run.h5): one of the same spec and engine there is taken");
  run->add_flag("--json", arguments->json, "The record as JSON on stdout");
  run->add_flag("--progress-lines", arguments->progress_lines,
                "'progress FRACTION STAGE' lines on stderr");
  run->callback([=] {
    if (*experiment) {
      for (const auto* option : run->get_options()) {
        const std::set<std::string> fits = {
            "FILE",         "--set", "--out", "--jobs", "--resume", "--json", "--progress-lines",
            "--memory-gib", "--help"};
        if (*option && fits.count(option->get_name()) == 0) {
          throw CLI::ValidationError("run", option->get_name() + ": not with an experiment file");
        }
      }
    }
    if (!*experiment && !*scene && !*spec) {
      throw CLI::ValidationError("run", "one of FILE, --scene, --spec is required");
    }
    if (*scene && !*load) throw CLI::ValidationError("run", "--scene needs --load");
    if (*scene && arguments->mode == "rim" && !*slip) {
      throw CLI::ValidationError("run", "mode rim needs --slip");
    }
    if (*scene && arguments->mode == "free" && !*drawbar) {
      throw CLI::ValidationError("run", "mode free needs --drawbar");
    }
    const auto refuse = [&](const CLI::Option* option, bool of_mode, const char* mode) {
      if (*option && !of_mode) {
        throw CLI::ValidationError(
            "run", option->get_name() + " goes with mode " + mode + ", not " + arguments->mode);
      }
    };
    refuse(slip, arguments->mode == "rim", "rim");
    refuse(drawbar, arguments->mode == "free", "free");
    refuse(angle, arguments->mode != "free", "rim or towed");
    *action = [arguments](const StopSignals& signals) { return Run(*arguments, signals); };
  });
}

}  // namespace grouser::campaign

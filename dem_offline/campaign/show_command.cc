#include <fmt/format.h>

#include <memory>
#include <vector>

#include "dem_offline/campaign/commands.h"
#include "proto/records/message_json.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

constexpr char kShowExamples[] = R"(Examples:
  grouser-dem show out/demo/campaign/runs/*.run.h5
  grouser-dem show a.run.h5 --json      # a JSON array of grouser.v1alpha1.RunRecord)";

struct ShowArguments {
  std::vector<std::string> files;
  bool json = false;
};

int Show(const ShowArguments& arguments) {
  std::string json;
  for (const auto& file : arguments.files) {
    const records::RunFile run = records::ReadAnyRunFile(file);
    if (!run.note.empty()) fmt::print(stderr, "{}: {}\n", file, run.note);
    if (arguments.json) {
      json += (json.empty() ? "" : ",\n ") + records::ToJson(run.record);
    } else {
      fmt::print("{}: ", file);
      PrintRecord(run.record);
    }
  }
  if (arguments.json) fmt::print("[{}]\n", json);
  return 0;
}

}  // namespace

void PrintRecord(const v1alpha1::RunRecord& record) {
  fmt::print("run {} {}{}{}\n", record.run_id(), v1alpha1::RunStatus_Name(record.status()),
             record.reason().empty() ? "" : ": ", record.reason());
  if (record.has_experiment_spec()) {
    const auto& n = record.numerics();
    fmt::print("  experiment {}: {} grains, {} steps of {:.3g} s, {:.1f} s of work\n",
               record.experiment_spec().name(), record.bed().grains(), n.steps(), n.dt_s(),
               n.wall_s());
    fmt::print(
        "  solid fraction {:.3f}, contacts a grain {:.2f}, overlap over radius: 99th "
        "percentile {:.3g}, largest {:.3g}\n",
        record.bed().solid_fraction(), record.bed().coordination(), n.overlap_p99_over_radius(),
        n.overlap_max_over_radius());
  }
  for (const auto& output : record.outputs()) {
    fmt::print("  {:8} {:12.5g} +- {:.2g}\n", output.name(), output.mean(),
               output.standard_error());
  }
  for (const auto& rule : record.rules()) {
    if (rule.kept()) continue;
    fmt::print("  size rule broken: {} is {:.3g}, limit {:.3g}\n", rule.name(), rule.value(),
               rule.limit());
  }
}

void AddShowCommand(CLI::App& app, Action* action) {
  auto arguments = std::make_shared<ShowArguments>();
  CLI::App* show = app.add_subcommand("show", "What run files hold, without the series");
  show->footer(kShowExamples);
  show->add_option("files", arguments->files, "Run files (*.run.h5)")->required();
  show->add_flag("--json", arguments->json, "The records as a JSON array on stdout");
  show->callback([=] { *action = [arguments](const StopSignals&) { return Show(*arguments); }; });
}

}  // namespace grouser::campaign

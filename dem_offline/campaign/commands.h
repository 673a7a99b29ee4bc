#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "dem_offline/campaign/stop_signals.h"
#include "dem_offline/engine/rig/work.h"

namespace grouser::v1alpha1 {
class RunRecord;
}

namespace grouser::campaign {

/// What a chosen subcommand does; returns the exit code: 0 done, 1 failed, 2
/// bad input (by exception), 130/143 stopped by a signal.
using Action = std::function<int(const StopSignals&)>;

/// Each adds its subcommand to the program and sets `action` when chosen.
void AddRunCommand(CLI::App& app, Action* action);
void AddCampaignCommand(CLI::App& app, Action* action);
/// estimate and design, of campaigns.
void AddEstimateCommands(CLI::App& campaign, Action* action);
void AddShowCommand(CLI::App& app, Action* action);
void AddLawsCommand(CLI::App& app, Action* action);
void AddVerifyCommands(CLI::App& app, Action* action);  ///< verify and torture
void AddBenchCommand(CLI::App& app, Action* action);
void AddExperimentCommands(CLI::App& app, Action* action);  ///< check and schema

/// The option --set.
CLI::Option* AddSets(CLI::App& command, std::vector<std::string>* sets);

/// The option --memory-gib.
void AddMemoryLimit(CLI::App& command, dem::WorkLimits* limits);

/// A record for people, on stdout: status, means, broken size rules.
void PrintRecord(const v1alpha1::RunRecord& record);

}  // namespace grouser::campaign

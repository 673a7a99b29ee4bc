// Any text is an experiment within the limits or refused with an InputError; nothing else comes
// out, and nothing is made that grows with the numbers in it. What is tiny runs to its end.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/scenes/sweep_yaml.h"

namespace {

/// A run ends with a Result, or says why there is none.
void RunTiny(const grouser::dem::experiment::Experiment& e,
             const grouser::dem::WorkLimits& limits) {
  const auto sink = [](const grouser::dem::experiment::Table& table,
                       const std::vector<double>& row) {
    if (row.size() != table.columns.size()) std::abort();
  };
  try {
    const auto result = grouser::dem::experiment::RunExperiment(e, sink, nullptr, limits);
    if (!result.done && result.reason.empty()) std::abort();
  } catch (const grouser::dem::SpecError&) {
  } catch (const std::runtime_error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace grouser;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const dem::WorkLimits limits = {.bytes = 1e9, .steps = 1e9, .grain_steps = 1e13};
  try {
    const auto sweep = campaign::ReadSweep(text, "fuzz", "/nowhere");
    if (sweep && sweep->members.size() > campaign::kMostMembers * 2) std::abort();
    const auto file = sweep ? campaign::ReadMember(*sweep, sweep->members.back(), limits)
                            : campaign::ReadExperiment(text, "fuzz", "/nowhere", limits);
    const auto plan = dem::experiment::PlanOf(file.experiment, limits);
    // What was accepted keeps what the plan promises.
    if (!(plan.work.bytes <= limits.bytes) || !(plan.work.steps <= limits.steps)) std::abort();
    if (!(plan.dt_s > 0) || !std::isfinite(plan.dt_s)) std::abort();
    if (!std::isfinite(plan.program_s) || !(plan.program_s > 0)) std::abort();
    const bool tiny = plan.work.grains <= 200 && plan.work.grains * plan.work.steps <= 3e4;
    if (tiny && plan.work.bytes < 1e7) RunTiny(file.experiment, limits);
  } catch (const campaign::InputError&) {  // refused: as it should be
  }
  return 0;
}

// Any text is an experiment within the limits or refused with an InputError; nothing else comes
// out, and nothing is made that grows with the numbers in it.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/scenes/sweep_yaml.h"

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
  } catch (const campaign::InputError&) {  // refused: as it should be
  }
  return 0;
}

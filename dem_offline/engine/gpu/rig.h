#pragma once

#include <functional>
#include <vector>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem::gpu {

/// One wheel test of a batch.
struct WheelJob {
  WheelTestSpec spec;
  const Tile* tile = nullptr;  ///< outlives the call
};

/// A stage of the progress that begins so says what the next batch takes.
inline constexpr const char* kMemoryStage = "memory: ";

/// Many wheel tests at once on a device, each as RunWheelTest would do it: same
/// motion, same rules, a result of its own whoever is beside it. Tests whose
/// laws differ go one group after the other, and so do those that do not fit the
/// memories of device and host together. progress: of all; its stage
/// says how many are done. done: called with the number of a job as soon as its
/// result is there. Throws std::invalid_argument on a bad spec, or one too large for the
/// device, with its number, before anything runs.
std::vector<WheelTestResult> RunWheelTests(
    const std::vector<WheelJob>& jobs, Device& device, const ProgressFn& progress = {},
    const std::function<void(std::size_t, const WheelTestResult&)>& done = {},
    const WorkLimits& limits = {});

}  // namespace grouser::dem::gpu

#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dem_offline/engine/gpu/rig.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::campaign {

/// What executes a run. The campaign logic knows the engine only through this,
/// so that it is tested without DEM and later runs on other back ends.
struct Backend {
  std::function<void(const dem::WheelTestSpec&)> validate;
  std::function<dem::Tile(const dem::BedSpec&, const dem::ProgressFn&)> prepare_bed;
  std::function<dem::WheelTestResult(const dem::WheelTestSpec&, const dem::Tile&,
                                     const dem::ProgressFn&)>
      run;
  /// Many runs side by side; empty: they go one a core. As gpu::RunWheelTests.
  using Done = std::function<void(std::size_t, const dem::WheelTestResult&)>;
  std::function<void(const std::vector<dem::gpu::WheelJob>&, const dem::ProgressFn&, const Done&)>
      run_many;
  dem::WorkLimits limits;  ///< what validate, prepare_bed and the runs accept
  std::string engine_version;
  std::string isa;
};

/// The DEM engine of this program. device: "cpu"; "cuda"; "emulated" (what a
/// card does, on one thread, for tests); "auto": a card where there is one, else
/// the cores. Throws std::invalid_argument for another name or a build without
/// CUDA, std::runtime_error without a card.
Backend EngineBackend(const std::string& device = "cpu", const dem::WorkLimits& limits = {});

}  // namespace grouser::campaign

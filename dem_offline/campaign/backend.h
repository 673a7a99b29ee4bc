#pragma once

#include <functional>
#include <string>

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::campaign {

/// What executes a run. The campaign logic knows the engine only through this,
/// so that it is tested without DEM and later runs on other back ends.
struct Backend {
  std::function<void(const dem::WheelTestSpec&)> validate;
  std::function<dem::Tile(const dem::WheelTestSpec&, const dem::ProgressFn&)> prepare_tile;
  std::function<dem::WheelTestResult(const dem::WheelTestSpec&, const dem::Tile&,
                                     const dem::ProgressFn&)>
      run;
  std::string engine_version;
  std::string isa;
};

/// The DEM engine of this program.
Backend EngineBackend();

}  // namespace grouser::campaign

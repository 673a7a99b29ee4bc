#include "dem_offline/campaign/backend.h"

namespace grouser::campaign {

Backend EngineBackend() {
  return {.validate = dem::ValidateSpec,
          .prepare_tile = dem::PrepareTile,
          .run = dem::RunWheelTest,
          .engine_version = dem::EngineVersion(),
          .isa = dem::EngineIsa()};
}

}  // namespace grouser::campaign

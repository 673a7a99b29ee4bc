#pragma once

#include <memory>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/world/stepper.h"

namespace grouser::dem::gpu {

/// One World on a device, for checks (each World its own stepper): each call takes it there, steps
/// it and brings it back, with a search at either end. Many worlds: Ensemble.
std::shared_ptr<Stepper> StepperOn(std::shared_ptr<Device> device);

}  // namespace grouser::dem::gpu

#pragma once

#include "dem_offline/engine/experiment/joints.h"

namespace grouser::dem {

/// Moves the jointed bodies of an experiment by Simbody (coupling.h).
experiment::MechanismFn SimbodyMechanism();

}  // namespace grouser::dem

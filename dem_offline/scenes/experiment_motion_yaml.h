#pragma once

#include <vector>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/scenes/experiment_keys.h"

namespace grouser::campaign {

inline dem::Vec3d ToVec3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

dem::experiment::Preparation ReadPreparation(KeyedSection& section);
/// One step of a body's program.
dem::experiment::MotionStep ReadStep(KeyedSection& section);

}  // namespace grouser::campaign

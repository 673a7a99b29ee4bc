#pragma once

#include "dem_offline/engine/experiment/joints.h"
#include "dem_offline/scenes/experiment_keys.h"

namespace grouser::campaign {

dem::experiment::Joint ReadJoint(KeyedSection& section);
dem::experiment::Spring ReadSpring(KeyedSection& section);

/// What moves bodies in joints; none where this program was built without Simbody.
dem::experiment::MechanismFn JointMechanism();

}  // namespace grouser::campaign

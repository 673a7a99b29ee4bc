#include "dem_offline/engine/bodies/part_distance.h"

namespace grouser::dem {

SignedDistance PartDistance(const Part& part, Vec3f p) { return part_distance::ToPart(part, p); }

}  // namespace grouser::dem

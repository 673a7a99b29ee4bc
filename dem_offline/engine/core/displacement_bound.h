#pragma once

#include "dem_offline/engine/core/drift_kernel.h"
#include "dem_offline/engine/core/frame.h"

// How far each grain may move before the inner list must be pruned again. Shared by all
// back ends.

namespace grouser::dem {

// The bound is the way of so many steps at the present speed, but at least and at most
// these shares of half the skin.
inline constexpr float kStepsOfRoom = 40, kLeastRoom = 0.06f, kMostRoom = 0.7f;

/// Index body: sets the displacement bound of one grain that was at (x, y, z) at the last
/// search, and its reach (radius and bound). False: the grain is so close to half a skin
/// from there that a new search is due.
/// q: quanta [m]; half: of the skin [m]; room: kStepsOfRoom dt [s].
GROUSER_HD bool BoundGrain(const Grain& g, std::int32_t x, std::int32_t y, std::int32_t z,
                           const float* q, float half, float room, DisplacementBound* bound,
                           float* reach) {
  if (g.kind & kFrozen) {  // goes nowhere
    *bound = {g.x, g.y, g.z, half * half};
    *reach = g.radius;
    return true;
  }
  const float dx = static_cast<float>(WrapDiff(g.x, x)) * q[0];
  const float dy = static_cast<float>(WrapDiff(g.y, y)) * q[1];
  const float dz = static_cast<float>(WrapDiff(g.z, z)) * q[2];
  const float gone = Sqrt(dx * dx + dy * dy + dz * dz);
  const float speed = Sqrt(g.vx * g.vx + g.vy * g.vy + g.vz * g.vz);
  const float wish = Min(Max(speed * room, kLeastRoom * half), kMostRoom * half);
  if (gone + kLeastRoom * half > half) return false;
  const float length = Min(wish, half - gone);
  *bound = {g.x, g.y, g.z, length * length};
  *reach = g.radius + length;
  return true;
}

}  // namespace grouser::dem

#pragma once

#include <cstdint>

namespace grouser::dem {

/// Grains are worked on in tiles of this many neighbours in memory, one per
/// SIMD lane; results do not depend on the instruction set because the tile
/// does not.
inline constexpr int kLanes = 16;

/// All that others need to know of a grain: one cache line.
/// Position: fixed point, quanta of World::quantum_m per axis; x and y wrap
/// with the period of the world, so differences are exact minimum images.
struct alignas(64) Grain {
  std::int32_t x, y, z;
  float radius;  ///< [m]; 0: padding
  float vx, vy, vz;
  float mass;  ///< [kg]
  float wx, wy, wz;
  float inertia;           ///< [kg m^2]
  float rest_x, rest_y, rest_z;  ///< what rounding left over [quanta]: slow grains never stall
  std::int32_t id;         ///< persistent
};

/// Force and moment of one step.
struct alignas(32) GrainLoad {
  float fx, fy, fz, stored;  ///< stored: unused by the motion
  float tx, ty, tz, touching;  ///< touching: number of contacts
};

}  // namespace grouser::dem

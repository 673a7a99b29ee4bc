#pragma once

#include <cstdint>

#include "dem_offline/engine/core/vec3.h"

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
  float mass;  ///< [kg]; of its clump
  float wx, wy, wz;
  std::int32_t kind;             ///< material in the low 16 bits, flags above
  float rest_x, rest_y, rest_z;  ///< what rounding left over [quanta]: slow grains never stall
  std::int32_t id;               ///< persistent
  GROUSER_HD void SetMotion(Vec3f velocity, Vec3f spin) {
    vx = velocity.x, vy = velocity.y, vz = velocity.z;
    wx = spin.x, wy = spin.y, wz = spin.z;
  }
};

inline constexpr std::int32_t kGlued = 1 << 16;   ///< keeps its velocity
inline constexpr std::int32_t kMember = 1 << 17;  ///< moved by its clump
inline constexpr std::int32_t kFrozen = 1 << 18;  ///< at rest and left out of all work
/// Does not move of itself.
inline constexpr std::int32_t kHeld = kGlued | kMember | kFrozen;
inline constexpr std::int32_t MaterialOf(const Grain& g) { return g.kind & 0xffff; }

/// Force and moment of one step: of a grain, or of one contact on a grain (a
/// record).
struct alignas(32) GrainLoad {
  float fx, fy, fz, deepest;   ///< deepest: largest overlap with another grain [m]
  float tx, ty, tz, touching;  ///< touching: number of contacts
  GROUSER_HD void Add(Vec3f force, Vec3f moment) {
    fx += force.x, fy += force.y, fz += force.z;
    tx += moment.x, ty += moment.y, tz += moment.z;
  }
};

}  // namespace grouser::dem

#pragma once

#include <cstdint>

#include "dem_offline/engine/core/grain.h"

namespace grouser::dem {

/// What goes with a grain from step to step and only its own motion needs.
/// Rests: what rounding left over of velocity and spin (small steps add little
/// to a fast grain, and always round the same way).
struct alignas(32) Kinetics {
  float vx = 0, vy = 0, vz = 0;
  float inverse_mass = 0;  ///< [1/kg]
  float wx = 0, wy = 0, wz = 0;
  float inverse_inertia = 0;  ///< [1/(kg m^2)]
};

/// Where a grain was when the inner list was last pruned, and how far it may go.
struct alignas(16) DisplacementBound {
  std::int32_t x, y, z;
  float length2;  ///< square of the way it may go [m^2]
};

/// What kick and drift see: plain arrays, no owner.
struct DriftView {
  Grain* grains;
  const GrainLoad* loads;
  Kinetics* kinetics;
  const DisplacementBound* bounds;
  const std::uint8_t* idle;  ///< [tiles] where nothing moves; null: none
  float dt, drag;
  float per_quantum[3];  ///< dt/quantum
  float gravity_dt[3];
  float quantum[3];  ///< [m]
  bool planar;
};

/// What a range of grains found.
struct DriftFound {
  bool finite = true, slow = true, apart = true, beyond = false;
};

/// One leapfrog step of the grains of tiles [from, to) of kLanes: velocities
/// by the loads, positions by the velocities. A grain that would go a quarter
/// radius stays where it is (not slow). Bitwise the same for every set.
using DriftKernelFn = void (*)(const DriftView&, std::int64_t from, std::int64_t to, DriftFound*);

}  // namespace grouser::dem

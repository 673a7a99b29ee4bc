#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/core/drift_kernel.h"
#include "dem_offline/engine/core/energy_sums.h"
#include "dem_offline/engine/world/clump_body.h"
#include "dem_offline/engine/world/rigid_body.h"

namespace grouser::dem {

/// Where the grains near a body stand with it.
struct DeviceBodyState {
  RigidBody body;
  BodyTrack track;
  int per_grain = 1;
  std::vector<std::int32_t> near;  ///< places, rising
  std::vector<std::int32_t> key;   ///< [near x per_grain]; -1: free
  std::vector<float> words;        ///< [near x per_grain x words]
};

/// All of a world that changes as it runs, for another back end to go on with
/// (bonds are not in it). Grains by place.
struct DeviceState {
  std::vector<Grain> grains;
  std::vector<GrainLoad> loads;
  std::vector<Kinetics> kinetics;
  struct Pair {
    std::int32_t first, second;  ///< first < second
  };
  std::vector<Pair> pairs;   ///< those with a history, but of two frozen grains
  std::vector<float> words;  ///< [pairs x words] as the first sees it
  std::vector<DeviceBodyState> bodies;
  std::vector<ClumpEntry> clumps;
  EnergySums energy;  ///< channels since the start
  std::uint64_t steps = 0;
  bool started = false;
};

}  // namespace grouser::dem

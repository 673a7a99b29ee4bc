#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/world/simulation_state.h"

namespace grouser::dem {

/// A body, and where the grains near it stand with it (but for BodySlots::clear).
struct DeviceBodyState {
  RigidBody body;
  BodyTrack track;
  BodySlots slots;
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

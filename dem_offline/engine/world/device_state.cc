// A World's state, out to another back end and back.
#include "dem_offline/engine/world/device_state.h"

#include <stdexcept>

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

DeviceState World::ExportState() const {
  DeviceState h;
  h.grains.assign(state_.grains.begin(), state_.grains.begin() + state_.count);
  h.loads.assign(state_.loads.begin(), state_.loads.begin() + state_.count);
  h.kinetics.assign(state_.kinetics.begin(), state_.kinetics.begin() + state_.count);
  const int words = state_.list.words();
  state_.list.ForEachHistory([&](std::int32_t i, std::int32_t j, const float* word) {
    if (state_.grains[i].kind & state_.grains[j].kind & kFrozen)
      return;  // their histories stay here
    h.pairs.push_back({i, j});
    h.words.insert(h.words.end(), word, word + words);
  });
  for (const BodyEntry& b : state_.bodies) {
    h.bodies.push_back({b.body, b, b.slots});
  }
  h.clumps = state_.clumps;
  h.energy = state_.energy;
  h.steps = state_.steps;
  h.started = state_.started;
  return h;
}

void World::ImportState(const DeviceState& h) {
  if (static_cast<std::int64_t>(h.grains.size()) != state_.count ||
      h.bodies.size() != state_.bodies.size()) {
    throw std::invalid_argument("import state: " + std::to_string(h.grains.size()) + " grains, " +
                                std::to_string(h.bodies.size()) + " bodies, expected " +
                                std::to_string(state_.count) + " and " +
                                std::to_string(state_.bodies.size()));
  }
  std::copy(h.grains.begin(), h.grains.end(), state_.grains.begin());
  std::copy(h.loads.begin(), h.loads.end(), state_.loads.begin());
  std::copy(h.kinetics.begin(), h.kinetics.end(), state_.kinetics.begin());
  // It may have sorted them; ids may come from a world that took grains out.
  for (const Grain& g : h.grains) {
    const auto ids = static_cast<std::size_t>(g.id) + 1;
    if (ids > state_.index_of.size()) state_.index_of.resize(ids);
  }
  std::fill(state_.index_of.begin(), state_.index_of.end(), -1);
  for (std::int64_t i = 0; i < state_.count; ++i) {
    state_.index_of[state_.grains[i].id] = static_cast<std::int32_t>(i);
  }
  for (std::size_t n = 0; n < h.bodies.size(); ++n) {
    const DeviceBodyState& from = h.bodies[n];
    BodyEntry& to = state_.bodies[n];
    static_cast<BodyTrack&>(to) = from.track;
    static_cast<RigidBody&>(to.body) = from.body;
    to.slots = from.slots;
    to.slots.clear.assign(from.slots.near.size(), 0.0f);
  }
  state_.clumps = h.clumps;
  state_.energy = h.energy;
  state_.steps = h.steps;
  state_.started = h.started;
  state_.list.Forget();
  Rebuild();
  for (std::size_t p = 0; p < h.pairs.size(); ++p) {
    state_.list.SetHistory(h.pairs[p].first, h.pairs[p].second, &h.words[p * state_.list.words()]);
  }
}

}  // namespace grouser::dem

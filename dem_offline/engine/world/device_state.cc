// A World's state, out to another back end and back.
#include "dem_offline/engine/world/device_state.h"

#include <stdexcept>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {

DeviceState World::ExportState() const {
  DeviceState h;
  h.grains.assign(grains_.begin(), grains_.begin() + count_);
  h.loads.assign(loads_.begin(), loads_.begin() + count_);
  h.kinetics.assign(kinetics_.begin(), kinetics_.begin() + count_);
  const int words = list_.words();
  list_.ForEachHistory([&](std::int32_t i, std::int32_t j, const float* word) {
    if (grains_[i].kind & grains_[j].kind & kFrozen) return;  // their histories stay here
    h.pairs.push_back({i, j});
    h.words.insert(h.words.end(), word, word + words);
  });
  for (const BodyEntry& b : parts_->bodies) {
    h.bodies.push_back({b.body, b, b.slots.per_grain, b.slots.near, b.slots.key, b.slots.words});
  }
  h.clumps = parts_->clumps;
  h.energy = energy_;
  h.steps = steps_;
  h.started = started_;
  return h;
}

void World::ImportState(const DeviceState& h) {
  if (static_cast<std::int64_t>(h.grains.size()) != count_ ||
      h.bodies.size() != parts_->bodies.size()) {
    throw std::invalid_argument("import state: " + std::to_string(h.grains.size()) + " grains, " +
                                std::to_string(h.bodies.size()) + " bodies, expected " +
                                std::to_string(count_) + " and " +
                                std::to_string(parts_->bodies.size()));
  }
  std::copy(h.grains.begin(), h.grains.end(), grains_.begin());
  std::copy(h.loads.begin(), h.loads.end(), loads_.begin());
  std::copy(h.kinetics.begin(), h.kinetics.end(), kinetics_.begin());
  // It may have sorted them.
  for (std::int64_t i = 0; i < count_; ++i) {
    index_of_[grains_[i].id] = static_cast<std::int32_t>(i);
  }
  for (std::size_t n = 0; n < h.bodies.size(); ++n) {
    const DeviceBodyState& from = h.bodies[n];
    BodyEntry& to = parts_->bodies[n];
    static_cast<BodyTrack&>(to) = from.track;
    static_cast<RigidBody&>(to.body) = from.body;
    to.slots.per_grain = from.per_grain;
    to.slots.near = from.near;
    to.slots.key = from.key;
    to.slots.words = from.words;
    to.slots.clear.assign(from.near.size(), 0.0f);
  }
  parts_->clumps = h.clumps;
  energy_ = h.energy;
  steps_ = h.steps;
  started_ = h.started;
  list_.Forget();
  Rebuild();
  for (std::size_t p = 0; p < h.pairs.size(); ++p) {
    list_.SetHistory(h.pairs[p].first, h.pairs[p].second, &h.words[p * list_.words()]);
  }
}

}  // namespace grouser::dem

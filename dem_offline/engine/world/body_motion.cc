// Bodies of a World: how they come and how they move.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

void CheckBody(const Body& b, int materials) {
  if (b.material < 0 || b.material >= materials) {
    throw std::invalid_argument("body: material: " + std::to_string(b.material) +
                                ", expected 0 to " + std::to_string(materials - 1));
  }
  if (b.shape.parts.empty() && !b.shape.mesh) {
    throw std::invalid_argument("body: shape: no part, expected one or more");
  }
  if (b.motion != BodyMotion::kFree) return;
  if (!(b.mass_kg > 0)) throw std::invalid_argument("body: mass_kg: expected > 0 for a free body");
  for (const double i : b.inertia_kg_m2) {
    if (!(i > 0)) throw std::invalid_argument("body: inertia_kg_m2: expected > 0 for a free body");
  }
}

}  // namespace

BodySurroundings BodyPass::Around(const SimulationState& w) {
  return {w.config.gravity_m_per_s2, w.config.dt_s, w.config.skin_m, w.config.planar};
}

int World::AddBody(const Body& body) {
  CheckBody(body, state_.config.contacts.materials());
  BodyEntry entry;
  entry.body = body;
  entry.body.orientation = Unit(body.orientation);
  // Whoever moves is given room, so that it is not searched for every step.
  entry.margin_m = body.motion == BodyMotion::kFixed
                       ? state_.config.skin_m
                       : state_.config.skin_m + 2.0 * state_.largest_radius;
  if (body.motion == BodyMotion::kFree) {
    entry.angular_momentum =
        MomentumOf(entry.body.orientation, body.spin_rad_per_s, body.inertia_kg_m2);
  }
  entry.left_at = entry.body.position_m;
  entry.left_turned = entry.body.orientation;
  state_.bodies.push_back(entry);
  BodyPass::Find(state_, state_.bodies.back());
  return static_cast<int>(state_.bodies.size()) - 1;
}

void World::Release(int b) {
  BodyEntry& entry = state_.bodies.at(b);
  entry.body.motion = BodyMotion::kFree;
  CheckBody(entry.body, state_.config.contacts.materials());
  entry.angular_momentum =
      MomentumOf(entry.body.orientation, entry.body.spin_rad_per_s, entry.body.inertia_kg_m2);
  // Velocities of the half step before, as all others are once the world has started.
  if (state_.started) StepBodyBack(BodyPass::Around(state_), &entry.body, &entry);
  BodyPass::Find(state_, entry);  // it may turn now
}

void BodyPass::Move(SimulationState& w) {
  const BodySurroundings around = Around(w);
  for (BodyEntry& b : w.bodies) {
    if (MoveBody(around, b.body.shape.reach, &b.body, &b) && !w.stale) Find(w, b);
  }
}

void BodyPass::StepBack(SimulationState& w) {
  const BodySurroundings around = Around(w);
  for (BodyEntry& b : w.bodies) StepBodyBack(around, &b.body, &b);
}

const float* World::BodyHistory(std::int64_t i, int body, std::int32_t key) const {
  const BodySlots& s = state_.bodies.at(body).slots;
  const auto at = std::lower_bound(s.near.begin(), s.near.end(), static_cast<std::int32_t>(i));
  if (at == s.near.end() || *at != i) return nullptr;
  const auto k = (at - s.near.begin()) * s.per_grain;
  for (int n = 0; n < s.per_grain; ++n) {
    if (s.key[k + n] == key) return &s.words[(k + n) * state_.list.words()];
  }
  return nullptr;
}

void World::SetBodyHistory(std::int64_t i, int body, std::int32_t key, const float* words) {
  BodySlots& s = state_.bodies.at(body).slots;
  const auto at = std::lower_bound(s.near.begin(), s.near.end(), static_cast<std::int32_t>(i));
  if (at == s.near.end() || *at != i) return;
  const auto k = (at - s.near.begin()) * s.per_grain;
  for (int n = 0; n < s.per_grain; ++n) {
    if (s.key[k + n] >= 0 && s.key[k + n] != key) continue;
    s.key[k + n] = key;
    std::copy_n(words, state_.list.words(), &s.words[(k + n) * state_.list.words()]);
    return;
  }
}

}  // namespace grouser::dem

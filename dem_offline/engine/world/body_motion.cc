// Bodies of a World: how they come and how they move.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/world/parts.h"

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

BodySurroundings BodyPass::Around(const World& w) {
  return {w.config_.gravity_m_per_s2, w.config_.dt_s, w.config_.skin_m, w.config_.planar};
}

int World::AddBody(const Body& body) {
  CheckBody(body, config_.contacts.materials());
  BodyEntry entry;
  entry.body = body;
  entry.body.orientation = Unit(body.orientation);
  // Whoever moves is given room, so that it is not searched for every step.
  entry.margin_m =
      body.motion == BodyMotion::kFixed ? config_.skin_m : config_.skin_m + 2.0 * largest_radius_;
  if (body.motion == BodyMotion::kFree) {
    entry.angular_momentum =
        MomentumOf(entry.body.orientation, body.spin_rad_per_s, body.inertia_kg_m2);
  }
  entry.left_at = entry.body.position_m;
  entry.left_turned = entry.body.orientation;
  parts_->bodies.push_back(entry);
  BodyPass::Find(*this, parts_->bodies.back());
  return static_cast<int>(parts_->bodies.size()) - 1;
}

void BodyPass::Move(World& w) {
  const BodySurroundings around = Around(w);
  for (BodyEntry& b : w.parts_->bodies) {
    if (MoveBody(around, b.body.shape.reach, &b.body, &b) && !w.stale_) Find(w, b);
  }
}

void BodyPass::StepBack(World& w) {
  const BodySurroundings around = Around(w);
  for (BodyEntry& b : w.parts_->bodies) StepBodyBack(around, &b.body, &b);
}

Body& World::body(int b) { return parts_->bodies.at(b).body; }
const Body& World::body(int b) const { return parts_->bodies.at(b).body; }
int World::bodies() const { return static_cast<int>(parts_->bodies.size()); }
const Wrench& World::wrench(int b) const { return parts_->bodies.at(b).wrench; }
double World::body_work_j(int b) const { return parts_->bodies.at(b).work_j; }
void World::RecordContacts(std::function<void(const BodyContact&)> sink) {
  parts_->sink = std::move(sink);
}

const float* World::BodyHistory(std::int64_t i, int body, std::int32_t key) const {
  const BodySlots& s = parts_->bodies.at(body).slots;
  const auto at = std::lower_bound(s.near.begin(), s.near.end(), static_cast<std::int32_t>(i));
  if (at == s.near.end() || *at != i) return nullptr;
  const auto k = (at - s.near.begin()) * s.per_grain;
  for (int n = 0; n < s.per_grain; ++n) {
    if (s.key[k + n] == key) return &s.words[(k + n) * list_.words()];
  }
  return nullptr;
}

void World::SetBodyHistory(std::int64_t i, int body, std::int32_t key, const float* words) {
  BodySlots& s = parts_->bodies.at(body).slots;
  const auto at = std::lower_bound(s.near.begin(), s.near.end(), static_cast<std::int32_t>(i));
  if (at == s.near.end() || *at != i) return;
  const auto k = (at - s.near.begin()) * s.per_grain;
  for (int n = 0; n < s.per_grain; ++n) {
    if (s.key[k + n] >= 0 && s.key[k + n] != key) continue;
    s.key[k + n] = key;
    std::copy_n(words, list_.words(), &s.words[(k + n) * list_.words()]);
    return;
  }
}

}  // namespace grouser::dem

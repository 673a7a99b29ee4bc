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

Vec3d ForceOn(const World& w, const BodyEntry& b) {
  const Vec3d& g = w.config().gravity_m_per_s2;
  const double m = b.body.mass_kg;
  return {b.wrench.fx + m * g[0] + b.body.outer_force_n[0],
          b.wrench.fy + m * g[1] + b.body.outer_force_n[1],
          b.wrench.fz + m * g[2] + b.body.outer_force_n[2]};
}
Vec3d MomentOn(const BodyEntry& b) {
  return Add({b.wrench.tx, b.wrench.ty, b.wrench.tz}, b.body.outer_moment_n_m);
}

}  // namespace

double BodyPass::Travel(const Body& b, double dt_s, bool axle) {
  Vec3d turn = b.spin_rad_per_s;
  if (!axle) {
    const Vec3d y = MatrixOf(b.orientation) * Vec3d{0, 1, 0};
    turn = Sub(turn, Scale(DotD(turn, y), y));
  }
  const double rate = Norm(turn);
  return dt_s * (Norm(b.velocity_m_per_s) + (rate > 0 ? rate * b.shape.reach : 0.0));
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
  const double dt = w.config_.dt_s;
  for (BodyEntry& b : w.parts_->bodies) {
    Body& body = b.body;
    const bool put = body.position_m != b.left_at || body.orientation != b.left_turned;
    if (body.motion == BodyMotion::kFixed) {
      if (put && !w.stale_) Find(w, b);
      b.left_at = body.position_m;
      b.left_turned = body.orientation;
      continue;
    }
    if (body.motion == BodyMotion::kFree) {
      body.velocity_m_per_s = Add(body.velocity_m_per_s, Scale(dt / body.mass_kg, ForceOn(w, b)));
      b.angular_momentum = Add(b.angular_momentum, Scale(dt, MomentOn(b)));
      if (w.config_.planar) {
        body.velocity_m_per_s[1] = 0;
        b.angular_momentum[0] = b.angular_momentum[2] = 0;
      }
      body.orientation = TurnFreely(body.orientation, b.angular_momentum, body.inertia_kg_m2, dt,
                                    &body.spin_rad_per_s);
    } else if (DotD(body.spin_rad_per_s, body.spin_rad_per_s) > 0) {
      body.orientation = Turn(body.orientation, body.spin_rad_per_s, dt);
    }
    body.position_m = Add(body.position_m, Scale(dt, body.velocity_m_per_s));
    b.moved_m += Travel(body, dt, false);
    // Grains move at most half a skin between searches.
    const bool starts = !b.turning && DotD(body.spin_rad_per_s, body.spin_rad_per_s) > 0;
    b.left_at = body.position_m;
    b.left_turned = body.orientation;
    if (!w.stale_ && (put || starts || b.moved_m + 0.5 * w.config_.skin_m > b.margin_m)) Find(w, b);
  }
}

void BodyPass::StepBack(World& w) {
  const double half = 0.5 * w.config_.dt_s;
  for (BodyEntry& b : w.parts_->bodies) {
    if (b.body.motion != BodyMotion::kFree) continue;
    b.body.velocity_m_per_s =
        Sub(b.body.velocity_m_per_s, Scale(half / b.body.mass_kg, ForceOn(w, b)));
    b.angular_momentum = Sub(b.angular_momentum, Scale(half, MomentOn(b)));
  }
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

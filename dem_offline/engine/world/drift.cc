// Kick and drift of a World's grains, and the start of its leapfrog.
#include <cmath>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

std::int32_t Advance(std::int32_t at, float velocity, float dt_over_quantum, float& rest) {
  const float go = velocity * dt_over_quantum + rest;
  const auto whole = static_cast<std::int32_t>(go);
  rest = go - static_cast<float>(whole);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(at) +
                                   static_cast<std::uint32_t>(whole));
}

/// What a range of grains found.
struct Found {
  bool finite = true, slow = true, apart = true;
  float moved2 = 0;
};

struct Kick {
  float dt, drag, inertia_factor;
  float gx, gy, gz;     ///< dt/quantum
  float ax, ay, az;     ///< gravity x dt
  const float* q;
  bool planar;
};

/// v + by, and in `rest` what rounding took (Knuth's two-sum, exact).
float Add(float v, float by, float& rest) {
  const float y = by + rest, sum = v + y, back = sum - v;
  rest = (v - (sum - back)) + (y - back);
  return sum;
}

void Accelerate(const Kick& k, const GrainLoad& f, Grain& g, VelocityRest& rest) {
  const float a = k.dt / g.mass;
  const float b = k.dt / (k.inertia_factor * g.mass * g.radius * g.radius);
  g.vx = Add(g.vx, f.fx * a + k.ax, rest.vx) * k.drag;
  g.vy = Add(g.vy, f.fy * a + k.ay, rest.vy) * k.drag;
  g.vz = Add(g.vz, f.fz * a + k.az, rest.vz) * k.drag;
  g.wx = Add(g.wx, f.tx * b, rest.wx) * k.drag;
  g.wy = Add(g.wy, f.ty * b, rest.wy) * k.drag;
  g.wz = Add(g.wz, f.tz * b, rest.wz) * k.drag;
  if (k.planar) g.vy = g.wx = g.wz = 0.0f;
}

}  // namespace

StepFault World::Drift() {
  ClumpPass::Move(*this);
  if (count_ == 0) return StepFault::kNone;
  const auto q = config_.frame.Quantum();
  const float dt = static_cast<float>(config_.dt_s);
  const auto& gravity = config_.gravity_m_per_s2;
  const Kick kick = {dt, drag_, static_cast<float>(config_.inertia_factor),
                     dt / q[0], dt / q[1], dt / q[2],
                     static_cast<float>(gravity[0]) * dt, static_cast<float>(gravity[1]) * dt,
                     static_cast<float>(gravity[2]) * dt, q.data(), config_.planar};
  const int size = parts_->team.size();
  std::vector<Found> found(size);
  parts_->team.Run([&](int part) {
    Found f;
    const std::int64_t from = count_ * part / size, to = count_ * (part + 1) / size;
    for (std::int64_t i = from; i < to; ++i) {
      Grain& g = grains_[i];
      const bool carried = (g.kind & kMember) != 0;
      if (!(g.kind & (kGlued | kMember))) Accelerate(kick, loads_[i], g, velocity_rest_[i]);
      const float v2 = g.vx * g.vx + g.vy * g.vy + g.vz * g.vz;
      const float w2 = g.wx * g.wx + g.wy * g.wy + g.wz * g.wz;
      const float go2 = v2 * (dt * dt);
      f.finite &= v2 + w2 < 1e30f;  // false for NaN
      f.apart &= !(loads_[i].deepest > 0.9f * g.radius);
      const bool slow = go2 < 0.0625f * g.radius * g.radius;  // else it could tunnel
      f.slow &= slow;
      if (!slow) continue;
      if (!carried) {
        g.x = Advance(g.x, g.vx, kick.gx, g.rest_x);
        g.y = Advance(g.y, g.vy, kick.gy, g.rest_y);
        g.z = Advance(g.z, g.vz, kick.gz, g.rest_z);
      }
      const std::int32_t* ref = &reference_[3 * i];
      const float dx = static_cast<float>(WrapDiff(g.x, ref[0])) * q[0];
      const float dy = static_cast<float>(WrapDiff(g.y, ref[1])) * q[1];
      const float dz = static_cast<float>(WrapDiff(g.z, ref[2])) * q[2];
      f.moved2 = Max(f.moved2, dx * dx + dy * dy + dz * dz);
    }
    found[part] = f;
  });
  const float half = 0.5f * static_cast<float>(config_.skin_m);
  for (const Found& f : found) {
    if (!f.finite) return StepFault::kNonFinite;
  }
  for (const Found& f : found) {
    if (!f.apart) return StepFault::kOverlap;
    if (!f.slow) return StepFault::kTooFast;
    if (f.moved2 > half * half) stale_ = true;
  }
  return fault_;
}

void World::Start() {
  if (started_) return;
  started_ = true;
  Forces();
  energy_ = EnergySums{};
  energy_.stored = step_energy_.stored;
  const float half = 0.5f * static_cast<float>(config_.dt_s);
  const auto& gravity = config_.gravity_m_per_s2;
  for (std::int64_t i = 0; i < count_; ++i) {
    Grain& g = grains_[i];
    if (g.kind & (kGlued | kMember)) continue;
    const GrainLoad& f = loads_[i];
    const float inertia = static_cast<float>(config_.inertia_factor) * g.mass * g.radius * g.radius;
    g.vx -= half * (f.fx / g.mass + static_cast<float>(gravity[0]));
    g.vy -= half * (f.fy / g.mass + static_cast<float>(gravity[1]));
    g.vz -= half * (f.fz / g.mass + static_cast<float>(gravity[2]));
    g.wx -= half * f.tx / inertia;
    g.wy -= half * f.ty / inertia;
    g.wz -= half * f.tz / inertia;
    if (config_.planar) g.vy = g.wx = g.wz = 0.0f;
  }
  ClumpPass::StepBack(*this);
  BodyPass::StepBack(*this);
}

}  // namespace grouser::dem

#include "dem_offline/engine/world/world.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grouser::dem {
namespace {

std::int32_t Advance(std::int32_t at, float velocity, float dt_over_quantum, float& rest) {
  const float go = velocity * dt_over_quantum + rest;
  const auto whole = static_cast<std::int32_t>(go);
  rest = go - static_cast<float>(whole);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(at) +
                                   static_cast<std::uint32_t>(whole));
}

Grain MakeGrain(const GrainState& s, const Frame& frame, std::int32_t id) {
  const double r = s.radius_m;
  const double mass = s.density_kg_per_m3 * 4.0 / 3.0 * M_PI * r * r * r;
  Grain g = {};
  g.x = frame.FixX(s.x_m);
  g.y = frame.FixY(s.y_m);
  g.z = frame.FixZ(s.z_m);
  g.radius = static_cast<float>(r);
  g.vx = static_cast<float>(s.v_x);
  g.vy = static_cast<float>(s.v_y);
  g.vz = static_cast<float>(s.v_z);
  g.wx = static_cast<float>(s.w_x);
  g.wy = static_cast<float>(s.w_y);
  g.wz = static_cast<float>(s.w_z);
  g.mass = static_cast<float>(mass);
  g.inertia = static_cast<float>(0.4 * mass * r * r);
  g.id = id;
  return g;
}

}  // namespace

World::World(const WorldConfig& config, const std::vector<GrainState>& grains)
    : config_(config), count_(static_cast<std::int64_t>(grains.size())) {
  if (!(config.dt_s > 0)) throw std::invalid_argument("dt_s: expected > 0");
  std::vector<Grain> raw;
  raw.reserve(grains.size());
  for (std::size_t i = 0; i < grains.size(); ++i) {
    if (!(grains[i].radius_m > 0)) throw std::invalid_argument("radius_m: expected > 0");
    raw.push_back(MakeGrain(grains[i], config.frame, static_cast<std::int32_t>(i)));
    largest_radius_ = std::max(largest_radius_, raw.back().radius);
  }
  const std::int64_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  grains_.assign(padded, Grain{});
  for (auto& g : grains_) g.mass = g.inertia = 1.0f, g.id = -1;
  if (count_ > 0) {
    // Neighbours in space become neighbours in memory: cells of two diameters.
    const double cell = std::min({4.0 * largest_radius_, config.frame.length_m / 3.01,
                                  config.frame.width_m / 3.01});
    const CellGrid grid(raw, count_, config.frame, cell);
    for (std::int64_t i = 0; i < count_; ++i) grains_[i] = raw[grid.order()[i]];
  }
  loads_.assign(padded, GrainLoad{});
  floor_.history.assign(padded, ContactHistory{});
  wheel_contacts_.history.assign(padded, ContactHistory{});
  if (!(config_.skin_m > 0)) config_.skin_m = 0.2 * largest_radius_;
  Rebuild();
}

void World::EnableWheel(const WheelBody& wheel) {
  wheel_ = wheel;
  has_wheel_ = true;
  wheel_margin_m_ = 2.0 * largest_radius_;
  FindWheelNeighbours();
}

void World::Rebuild() {
  list_.Build(grains_, count_, config_.frame, static_cast<float>(config_.skin_m));
  reference_.resize(3 * count_);
  floor_.near.clear();
  const double reach = config_.floor_z_m + config_.skin_m;
  const double qz = config_.frame.z_span_m / 4294967296.0;
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    reference_[3 * i] = g.x;
    reference_[3 * i + 1] = g.y;
    reference_[3 * i + 2] = g.z;
    if (g.z * qz - g.radius < reach) {
      floor_.near.push_back(static_cast<std::int32_t>(i));
    } else {
      floor_.history[i] = ContactHistory{};
    }
  }
  if (has_wheel_) FindWheelNeighbours();
  stale_ = false;
  ++rebuilds_;
}

StepFault World::Drift() {
  if (count_ == 0) return StepFault::kNone;
  const auto q = config_.frame.Quantum();
  const float dt = static_cast<float>(config_.dt_s);
  const float gx = dt / q[0], gy = dt / q[1], gz = dt / q[2];
  const float fall = static_cast<float>(config_.gravity_m_per_s2) * dt;
  const float half = 0.5f * static_cast<float>(config_.skin_m);
  const float fast = 0.25f * largest_radius_ / dt;  // a quarter radius a step: tunnelling
  const float floor = static_cast<float>(config_.floor_z_m);
  float moved = 0, speed = 0;
  bool finite = true, sunk = false;
  for (std::int64_t i = 0; i < count_; ++i) {
    Grain& g = grains_[i];
    const GrainLoad& f = loads_[i];
    const float a = dt / g.mass, b = dt / g.inertia;
    g.vx = (g.vx + f.fx * a) * drag_;
    g.vy = (g.vy + f.fy * a) * drag_;
    g.vz = (g.vz + (f.fz * a - fall)) * drag_;
    g.wx = (g.wx + f.tx * b) * drag_;
    g.wy = (g.wy + f.ty * b) * drag_;
    g.wz = (g.wz + f.tz * b) * drag_;
    const float v2 = g.vx * g.vx + g.vy * g.vy + g.vz * g.vz;
    const float w2 = g.wx * g.wx + g.wy * g.wy + g.wz * g.wz;
    finite &= v2 + w2 < 1e30f;  // false for NaN
    speed = Max(speed, v2);
    sunk |= static_cast<float>(g.z) * q[2] < floor - g.radius;
    if (!(v2 < fast * fast)) continue;
    g.x = Advance(g.x, g.vx, gx, g.rest_x);
    g.y = Advance(g.y, g.vy, gy, g.rest_y);
    g.z = Advance(g.z, g.vz, gz, g.rest_z);
    const std::int32_t* ref = &reference_[3 * i];
    const float dx = static_cast<float>(static_cast<std::int32_t>(
                         static_cast<std::uint32_t>(g.x) - static_cast<std::uint32_t>(ref[0]))) * q[0];
    const float dy = static_cast<float>(static_cast<std::int32_t>(
                         static_cast<std::uint32_t>(g.y) - static_cast<std::uint32_t>(ref[1]))) * q[1];
    const float dz = static_cast<float>(static_cast<std::int32_t>(
                         static_cast<std::uint32_t>(g.z) - static_cast<std::uint32_t>(ref[2]))) * q[2];
    moved = Max(moved, dx * dx + dy * dy + dz * dz);
  }
  if (!finite) return StepFault::kNonFinite;
  if (sunk) return StepFault::kTunnelled;
  if (!(speed < fast * fast)) return StepFault::kTooFast;
  if (moved > half * half) stale_ = true;
  return StepFault::kNone;
}

void World::Start() {
  if (started_) return;
  started_ = true;
  Forces();
  energy_ = EnergySums{};
  energy_.stored = step_energy_.stored;
  const float half = 0.5f * static_cast<float>(config_.dt_s);
  for (std::int64_t i = 0; i < count_; ++i) {
    Grain& g = grains_[i];
    const GrainLoad& f = loads_[i];
    g.vx -= half * f.fx / g.mass;
    g.vy -= half * f.fy / g.mass;
    g.vz -= half * (f.fz / g.mass - static_cast<float>(config_.gravity_m_per_s2));
    g.wx -= half * f.tx / g.inertia;
    g.wy -= half * f.ty / g.inertia;
    g.wz -= half * f.tz / g.inertia;
  }
}

StepFault World::Step() {
  if (fault_ != StepFault::kNone) return fault_;
  Start();
  fault_ = Drift();
  if (fault_ != StepFault::kNone) return fault_;
  if (has_wheel_) {
    const double move = config_.dt_s * std::sqrt(wheel_.v_x * wheel_.v_x + wheel_.v_y * wheel_.v_y +
                                                 wheel_.v_z * wheel_.v_z);
    wheel_moved_m_ += move;
    wheel_.x_m += wheel_.v_x * config_.dt_s;
    wheel_.y_m += wheel_.v_y * config_.dt_s;
    wheel_.z_m += wheel_.v_z * config_.dt_s;
  }
  if (stale_) {
    Rebuild();
  } else if (has_wheel_ && wheel_moved_m_ + config_.skin_m > wheel_margin_m_) {
    FindWheelNeighbours();
  }
  Forces();
  ++steps_;
  energy_.stored = step_energy_.stored;
  energy_.normal_damping += step_energy_.normal_damping;
  energy_.tangent_damping += step_energy_.tangent_damping;
  energy_.slip += step_energy_.slip;
  energy_.rolling += step_energy_.rolling;
  return StepFault::kNone;
}

void World::Forces() {
  step_energy_ = EnergySums{};
  PairView v = {};
  v.grains = grains_.data();
  v.loads = loads_.data();
  v.tiles = static_cast<int>(grains_.size() / kLanes);
  v.first_slot = list_.first_slot().data();
  v.partner = list_.partner().data();
  for (int w = 0; w < kHistoryWords; ++w) v.history[w] = list_.history()[w].data();
  v.row_touches = list_.row_touches().data();
  const auto q = config_.frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.params = config_.grain_grain;
  v.dt = static_cast<float>(config_.dt_s);
  v.energy = config_.energy ? &step_energy_ : nullptr;
  PairForces(v);
  FloorForces();
  if (has_wheel_) WheelForces();
}

void World::Count(const ContactResult& r) {
  if (!config_.energy) return;
  step_energy_.stored += r.stored;
  step_energy_.normal_damping += r.normal_damping;
  step_energy_.tangent_damping += r.tangent_damping;
  step_energy_.slip += r.slip;
  step_energy_.rolling += r.rolling;
}

void World::Apply(std::int32_t i, const ContactResult& r, Vec3f n, float lever) {
  GrainLoad& f = loads_[i];
  const Vec3f torque = r.moment - lever * Cross(n, r.force);
  f.fx += r.force.x;
  f.fy += r.force.y;
  f.fz += r.force.z;
  f.tx += torque.x;
  f.ty += torque.y;
  f.tz += torque.z;
  f.touching += 1.0f;
  Count(r);
}

void World::FloorForces() {
  const float qz = config_.frame.Quantum()[2];
  const std::int32_t base = config_.floor_z_m > -0.5 * config_.frame.z_span_m
                                ? config_.frame.FixZ(config_.floor_z_m)
                                : INT32_MIN;
  if (base == INT32_MIN) return;
  for (const std::int32_t i : floor_.near) {
    const Grain& g = grains_[i];
    const float overlap = g.radius - static_cast<float>(g.z - static_cast<std::int64_t>(base)) * qz;
    ContactHistory& h = floor_.history[i];
    if (overlap <= 0.0f) {
      h = ContactHistory{};
      continue;
    }
    ContactGeometry c;
    c.n = {0, 0, 1};
    c.overlap = overlap;
    const float lever = g.radius - 0.5f * overlap;  // the middle of the overlap, as for pairs
    const Vec3f w = {g.wx, g.wy, g.wz};
    c.v_rel = Vec3f{g.vx, g.vy, g.vz} - lever * Cross(w, c.n);
    c.w_rel = w;
    c.r_eff = g.radius;
    c.m_eff = g.mass;
    c.roll_inertia = 1.4f * g.mass * g.radius * g.radius;
    const ContactResult r =
        HertzMindlinEpsd::Evaluate(config_.grain_floor, c, h, static_cast<float>(config_.dt_s));
    h = r.history;
    Apply(i, r, c.n, lever);
  }
}

double World::KineticEnergy() const {
  double sum = 0;
  for (std::int64_t i = 0; i < count_; ++i) {
    const GrainState s = State(i);
    const Grain& g = grains_[i];
    sum += 0.5 * g.mass * (s.v_x * s.v_x + s.v_y * s.v_y + s.v_z * s.v_z) +
           0.5 * g.inertia * (s.w_x * s.w_x + s.w_y * s.w_y + s.w_z * s.w_z);
  }
  return sum;
}

double World::PotentialEnergy() const {
  double sum = 0;
  const double qz = config_.frame.z_span_m / 4294967296.0;
  for (std::int64_t i = 0; i < count_; ++i) {
    sum += grains_[i].mass * config_.gravity_m_per_s2 * (grains_[i].z * qz);
  }
  return sum;
}

double World::MeanContacts() const {
  double sum = 0;
  for (std::int64_t i = 0; i < count_; ++i) sum += loads_[i].touching;
  return count_ ? sum / static_cast<double>(count_) : 0.0;
}

GrainState World::State(std::int64_t i) const {
  const Grain& g = grains_[i];
  const GrainLoad& f = loads_[i];
  const double period = 4294967296.0, half = started_ ? 0.5 * config_.dt_s : 0.0;
  GrainState s = {};
  s.x_m = static_cast<std::uint32_t>(g.x) / period * config_.frame.length_m;
  s.y_m = static_cast<std::uint32_t>(g.y) / period * config_.frame.width_m;
  s.z_m = g.z / period * config_.frame.z_span_m;
  s.radius_m = g.radius;
  s.density_kg_per_m3 = g.mass / (4.0 / 3.0 * M_PI * std::pow(static_cast<double>(g.radius), 3));
  s.v_x = g.vx + half * f.fx / g.mass;
  s.v_y = g.vy + half * f.fy / g.mass;
  s.v_z = g.vz + half * (f.fz / g.mass - config_.gravity_m_per_s2);
  s.w_x = g.wx + half * f.tx / g.inertia;
  s.w_y = g.wy + half * f.ty / g.inertia;
  s.w_z = g.wz + half * f.tz / g.inertia;
  return s;
}

std::vector<float> World::OverlapRatios() const {
  std::vector<float> out;
  const auto q = config_.frame.Quantum();
  const auto diff = [](std::int32_t a, std::int32_t b, float quantum) {
    return static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(a) -
                                                        static_cast<std::uint32_t>(b))) * quantum;
  };
  for (std::size_t t = 0; t + 1 < list_.first_slot().size(); ++t) {
    for (std::int64_t s = list_.first_slot()[t]; s < list_.first_slot()[t + 1]; ++s) {
      const auto i = static_cast<std::int64_t>(t) * kLanes + s % kLanes;
      const std::int32_t j = list_.partner()[s];
      if (j <= i) continue;
      const Grain &a = grains_[i], &b = grains_[j];
      const float dx = diff(a.x, b.x, q[0]), dy = diff(a.y, b.y, q[1]), dz = diff(a.z, b.z, q[2]);
      const float gap = std::sqrt(dx * dx + dy * dy + dz * dz) - a.radius - b.radius;
      if (gap < 0) out.push_back(-gap / std::min(a.radius, b.radius));
    }
  }
  return out;
}

double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio) {
  const double shear = youngs_modulus_pa / (2 * (1 + poisson_ratio));
  return M_PI * radius_m * std::sqrt(density_kg_per_m3 / shear) / (0.1631 * poisson_ratio + 0.8766);
}

}  // namespace grouser::dem

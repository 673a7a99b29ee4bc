// What a World says of itself: states, energies, overlaps, its hash.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

class Fnv {
 public:
  void Add(const void* data, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) hash_ = (hash_ ^ p[i]) * 1099511628211ull;
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace

GrainState World::State(std::int64_t i) const {
  const Grain& g = grains_[i];
  const GrainLoad& f = loads_[i];
  const double period = 4294967296.0;
  const bool free = started_ && !(g.kind & kHeld);
  const double half = free ? 0.5 * config_.dt_s : 0.0;
  const double inertia = config_.inertia_factor * g.mass * g.radius * g.radius;
  const Vec3d& gravity = config_.gravity_m_per_s2;
  GrainState s = {};
  s.x_m = static_cast<std::uint32_t>(g.x) / period * config_.frame.length_m + config_.origin_m[0];
  s.y_m = static_cast<std::uint32_t>(g.y) / period * config_.frame.width_m + config_.origin_m[1];
  s.z_m = g.z / period * config_.frame.z_span_m + config_.origin_m[2];
  s.radius_m = g.radius;
  s.density_kg_per_m3 = g.mass / (4.0 / 3.0 * M_PI * std::pow(static_cast<double>(g.radius), 3));
  s.v_x = g.vx + half * (f.fx / g.mass + gravity[0]);
  s.v_y = g.vy + half * (f.fy / g.mass + gravity[1]);
  s.v_z = g.vz + half * (f.fz / g.mass + gravity[2]);
  s.w_x = g.wx + half * f.tx / inertia;
  s.w_y = g.wy + half * f.ty / inertia;
  s.w_z = g.wz + half * f.tz / inertia;
  if (config_.planar) s.v_y = s.w_x = s.w_z = 0;
  s.material = MaterialOf(g);
  s.glued = (g.kind & kGlued) != 0;
  s.mass_kg = g.mass;
  return s;
}

GrainState World::StateOf(std::int32_t id) const {
  const std::int32_t place = index_of_.at(id);
  if (place < 0) throw std::out_of_range("grain " + std::to_string(id) + ": has left the world");
  return State(place);
}

void World::SetVelocity(std::int32_t id, Vec3d velocity, Vec3d spin) {
  Grain& g = grains_[index_of_.at(id)];
  g.vx = static_cast<float>(velocity[0]);
  g.vy = static_cast<float>(velocity[1]);
  g.vz = static_cast<float>(velocity[2]);
  g.wx = static_cast<float>(spin[0]);
  g.wy = static_cast<float>(spin[1]);
  g.wz = static_cast<float>(spin[2]);
  kinetics_[index_of_[id]] = AtRest(g);
}

double World::KineticEnergy() const {
  double sum = ClumpPass::Kinetic(*this);
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    if (g.kind & kHeld) continue;
    const GrainState s = State(i);
    const double inertia = config_.inertia_factor * g.mass * g.radius * g.radius;
    sum += 0.5 * g.mass * (s.v_x * s.v_x + s.v_y * s.v_y + s.v_z * s.v_z) +
           0.5 * inertia * (s.w_x * s.w_x + s.w_y * s.w_y + s.w_z * s.w_z);
  }
  for (const BodyEntry& b : parts_->bodies) {
    if (b.body.motion != BodyMotion::kFree) continue;
    sum += 0.5 * b.body.mass_kg * DotD(b.body.velocity_m_per_s, b.body.velocity_m_per_s) +
           0.5 * DotD(b.angular_momentum,
                      SpinOf(b.body.orientation, b.angular_momentum, b.body.inertia_kg_m2));
  }
  return sum;
}

double World::PotentialEnergy() const {
  const Vec3d& gravity = config_.gravity_m_per_s2;
  const double q[3] = {config_.frame.length_m / 4294967296.0, config_.frame.width_m / 4294967296.0,
                       config_.frame.z_span_m / 4294967296.0};
  double sum = 0;
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    if (g.kind & (kGlued | kMember)) continue;
    // Along x and y a period has no height: from the middle of the frame.
    sum -= g.mass * (gravity[0] * g.x * q[0] + gravity[1] * g.y * q[1] + gravity[2] * g.z * q[2]);
  }
  for (const ClumpEntry& e : parts_->clumps) sum -= e.mass_kg * DotD(gravity, e.state.position_m);
  for (const BodyEntry& b : parts_->bodies) {
    if (b.body.motion != BodyMotion::kFree) continue;
    sum -= b.body.mass_kg * DotD(gravity, Sub(b.body.position_m, config_.origin_m));
  }
  return sum;
}

EnergyBalance World::Balance() const {
  EnergyBalance e;
  e.kinetic = KineticEnergy();
  e.potential = PotentialEnergy();
  const BondStatistics& bonds = parts_->bond_statistics;
  e.stored = energy_.stored + inactive_j_ + bonds.stored_j;
  e.frozen = frozen_j_;
  e.normal_damping = energy_.normal_damping;
  e.tangent_damping = energy_.tangent_damping;
  e.slip = energy_.slip;
  e.rolling = energy_.rolling;
  e.plastic = energy_.plastic;
  e.cohesion = energy_.cohesion;
  e.bonds = bonds.damped_j + bonds.broken_j;
  for (const BodyEntry& b : parts_->bodies) e.body_work += b.work_j;
  return e;
}

double World::MeanContacts() const {
  double sum = 0;
  for (std::int64_t i = 0; i < count_; ++i) sum += loads_[i].touching;
  return count_ ? sum / static_cast<double>(count_) : 0.0;
}

std::vector<float> World::OverlapRatios() const {
  std::vector<float> out;
  const auto q = config_.frame.Quantum();
  for (std::int64_t c = 0; c < list_.inner_pairs(); ++c) {
    const Grain &a = grains_[list_.first(c)], &b = grains_[list_.second(c)];
    const float dx = static_cast<float>(WrapDiff(a.x, b.x)) * q[0];
    const float dy = static_cast<float>(WrapDiff(a.y, b.y)) * q[1];
    const float dz = static_cast<float>(WrapDiff(a.z, b.z)) * q[2];
    const float gap = std::sqrt(dx * dx + dy * dy + dz * dz) - a.radius - b.radius;
    if (gap < 0) out.push_back(-gap / std::min(a.radius, b.radius));
  }
  return out;
}

std::int64_t World::pairs_touching() const {
  double sides = 0;
  for (std::int64_t i = 0; i < count_; ++i) sides += loads_[i].touching;
  return static_cast<std::int64_t>(sides / 2);
}

double World::BytesPerStep() const {
  const auto pairs = static_cast<double>(list_.blocks() * kLanes);
  const auto grains = static_cast<double>(grains_.size());
  const double word = sizeof(float);
  // Indices, history both ways, two records written and read.
  const double per_pair = 4 * word + 2 * word * list_.words() + 4 * sizeof(GrainLoad);
  // Line for the pairs; line both ways, loads both ways, kinetics both
  // ways and the bound for the drift; the records' starts.
  const double per_grain = 3 * sizeof(Grain) + 2 * sizeof(GrainLoad) + 2 * sizeof(Kinetics) +
                           sizeof(DisplacementBound) + word;
  return pairs * per_pair + grains * per_grain;
}

std::uint64_t World::Hash() const {
  Fnv fnv;
  fnv.Add(grains_.data(), static_cast<std::size_t>(count_) * sizeof(Grain));
  fnv.Add(loads_.data(), static_cast<std::size_t>(count_) * sizeof(GrainLoad));
  fnv.Add(list_.history().data(), list_.history().size() * sizeof(float));
  for (const BodyEntry& b : parts_->bodies) {
    fnv.Add(&b.wrench, sizeof(b.wrench));
    fnv.Add(b.body.position_m.data(), sizeof(Vec3d));
    fnv.Add(b.slots.words.data(), b.slots.words.size() * sizeof(float));
  }
  for (const ClumpEntry& c : parts_->clumps) fnv.Add(&c.state.position_m, sizeof(Vec3d));
  return fnv.value();
}

}  // namespace grouser::dem

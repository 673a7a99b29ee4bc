// What a World says of itself: states, energies, overlaps, its hash.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

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
  const Grain& g = state_.grains[i];
  const GrainLoad& f = state_.loads[i];
  const double period = 4294967296.0;
  const bool free = state_.started && !(g.kind & kHeld);
  const double half = free ? 0.5 * state_.config.dt_s : 0.0;
  const double inertia = state_.config.inertia_factor * g.mass * g.radius * g.radius;
  const Vec3d& gravity = state_.config.gravity_m_per_s2;
  GrainState s = {};
  s.x_m = static_cast<std::uint32_t>(g.x) / period * state_.config.frame.length_m +
          state_.config.origin_m[0];
  s.y_m = static_cast<std::uint32_t>(g.y) / period * state_.config.frame.width_m +
          state_.config.origin_m[1];
  s.z_m = g.z / period * state_.config.frame.z_span_m + state_.config.origin_m[2];
  s.radius_m = g.radius;
  s.density_kg_per_m3 = g.mass / (4.0 / 3.0 * M_PI * std::pow(static_cast<double>(g.radius), 3));
  s.v_x = g.vx + half * (f.fx / g.mass + gravity[0]);
  s.v_y = g.vy + half * (f.fy / g.mass + gravity[1]);
  s.v_z = g.vz + half * (f.fz / g.mass + gravity[2]);
  s.w_x = g.wx + half * f.tx / inertia;
  s.w_y = g.wy + half * f.ty / inertia;
  s.w_z = g.wz + half * f.tz / inertia;
  if (state_.config.planar) s.v_y = s.w_x = s.w_z = 0;
  s.material = MaterialOf(g);
  s.glued = (g.kind & kGlued) != 0;
  s.mass_kg = g.mass;
  return s;
}

GrainState World::StateOf(std::int32_t id) const {
  const std::int32_t place = state_.index_of.at(id);
  if (place < 0) throw std::out_of_range("grain " + std::to_string(id) + ": has left the world");
  return State(place);
}

void World::SetVelocity(std::int32_t id, Vec3d velocity, Vec3d spin) {
  Grain& g = state_.grains[state_.index_of.at(id)];
  g.SetMotion(ToFloat(velocity), ToFloat(spin));
  state_.kinetics[state_.index_of[id]] = AtRest(g);
}

double World::KineticEnergy() const {
  double sum = ClumpPass::Kinetic(state_);
  for (std::int64_t i = 0; i < state_.count; ++i) {
    const Grain& g = state_.grains[i];
    if (g.kind & kHeld) continue;
    const GrainState s = State(i);
    const double inertia = state_.config.inertia_factor * g.mass * g.radius * g.radius;
    sum += 0.5 * g.mass * (s.v_x * s.v_x + s.v_y * s.v_y + s.v_z * s.v_z) +
           0.5 * inertia * (s.w_x * s.w_x + s.w_y * s.w_y + s.w_z * s.w_z);
  }
  for (const BodyEntry& b : state_.bodies) {
    if (b.body.motion != BodyMotion::kFree) continue;
    sum += 0.5 * b.body.mass_kg * DotD(b.body.velocity_m_per_s, b.body.velocity_m_per_s) +
           0.5 * DotD(b.angular_momentum,
                      SpinOf(b.body.orientation, b.angular_momentum, b.body.inertia_kg_m2));
  }
  return sum;
}

double World::PotentialEnergy() const {
  const Vec3d& gravity = state_.config.gravity_m_per_s2;
  const double q[3] = {state_.config.frame.length_m / 4294967296.0,
                       state_.config.frame.width_m / 4294967296.0,
                       state_.config.frame.z_span_m / 4294967296.0};
  double sum = 0;
  for (std::int64_t i = 0; i < state_.count; ++i) {
    const Grain& g = state_.grains[i];
    if (g.kind & (kGlued | kMember)) continue;
    // Along x and y a period has no height: from the middle of the frame.
    sum -= g.mass * (gravity[0] * g.x * q[0] + gravity[1] * g.y * q[1] + gravity[2] * g.z * q[2]);
  }
  for (const ClumpEntry& e : state_.clumps) sum -= e.mass_kg * DotD(gravity, e.state.position_m);
  for (const BodyEntry& b : state_.bodies) {
    if (b.body.motion != BodyMotion::kFree) continue;
    sum -= b.body.mass_kg * DotD(gravity, Sub(b.body.position_m, state_.config.origin_m));
  }
  return sum;
}

EnergyBalance World::Balance() const {
  EnergyBalance e;
  e.kinetic = KineticEnergy();
  e.potential = PotentialEnergy();
  const BondStatistics& bonds = state_.bond_statistics;
  static_cast<EnergySums&>(e) = state_.energy;
  e.stored += state_.inactive_j + bonds.stored_j;
  e.frozen = state_.frozen_j;
  e.bonds = bonds.damped_j + bonds.broken_j;
  for (const BodyEntry& b : state_.bodies) e.body_work += b.work_j;
  return e;
}

std::vector<BondLoad> World::BondLoads() const { return BondPass::Loads(state_); }

double World::MeanContacts() const {
  double sum = 0;
  for (std::int64_t i = 0; i < state_.count; ++i) sum += state_.loads[i].touching;
  return state_.count ? sum / static_cast<double>(state_.count) : 0.0;
}

std::vector<float> World::OverlapRatios() const {
  std::vector<float> out;
  const auto q = state_.config.frame.Quantum();
  for (std::int64_t c = 0; c < state_.list.inner_pairs(); ++c) {
    const Grain &a = state_.grains[state_.list.first(c)], &b = state_.grains[state_.list.second(c)];
    const Vec3f d = Apart(a, b, q.data());
    const float gap = std::sqrt(Dot(d, d)) - a.radius - b.radius;
    if (gap < 0) out.push_back(-gap / std::min(a.radius, b.radius));
  }
  return out;
}

double World::BytesPerStep() const {
  const auto pairs = static_cast<double>(state_.list.blocks() * kLanes);
  const auto grains = static_cast<double>(state_.grains.size());
  const double word = sizeof(float);
  // Indices, history both ways, two records written and read.
  const double per_pair = 4 * word + 2 * word * state_.list.words() + 4 * sizeof(GrainLoad);
  // Line for the pairs; line both ways, loads both ways, kinetics both
  // ways and the bound for the drift; the records' starts.
  const double per_grain = 3 * sizeof(Grain) + 2 * sizeof(GrainLoad) + 2 * sizeof(Kinetics) +
                           sizeof(DisplacementBound) + word;
  return pairs * per_pair + grains * per_grain;
}

std::uint64_t World::Hash() const {
  Fnv fnv;
  fnv.Add(state_.grains.data(), static_cast<std::size_t>(state_.count) * sizeof(Grain));
  fnv.Add(state_.loads.data(), static_cast<std::size_t>(state_.count) * sizeof(GrainLoad));
  fnv.Add(state_.list.history().data(), state_.list.history().size() * sizeof(float));
  for (const BodyEntry& b : state_.bodies) {
    fnv.Add(&b.wrench, sizeof(b.wrench));
    fnv.Add(b.body.position_m.data(), sizeof(Vec3d));
    fnv.Add(b.slots.words.data(), b.slots.words.size() * sizeof(float));
  }
  for (const ClumpEntry& c : state_.clumps) fnv.Add(&c.state.position_m, sizeof(Vec3d));
  return fnv.value();
}

}  // namespace grouser::dem

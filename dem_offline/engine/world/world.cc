#include "dem_offline/engine/world/world.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/core/displacement_bound.h"
#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/world/passes.h"

namespace grouser::dem {
namespace {

constexpr int kBlocksPerChunk = 64;  // energy is summed chunk by chunk, whatever the threads

/// Adds the wall time of its life to a phase; nothing when not asked to.
class Stopwatch {
 public:
  Stopwatch(bool on, double& sum) : on_(on), sum_(sum) {
    if (on_) begin_ = std::chrono::steady_clock::now();
  }
  ~Stopwatch() {
    if (!on_) return;
    sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  bool on_;
  double& sum_;
  std::chrono::steady_clock::time_point begin_;
};

const WorldConfig& Checked(const WorldConfig& c) {
  if (!(c.dt_s > 0)) throw std::invalid_argument("dt_s: expected > 0");
  if (c.threads < 1 || c.threads > 256) throw std::invalid_argument("threads: expected 1 to 256");
  if (!(c.inertia_factor > 0)) throw std::invalid_argument("inertia_factor: expected > 0");
  for (const double s : {c.frame.length_m, c.frame.width_m, c.frame.z_span_m}) {
    if (!(s > 0) || !std::isfinite(s)) throw std::invalid_argument("frame: expected sizes > 0");
  }
  return c;
}

}  // namespace

const char* Explain(StepFault fault) {
  static constexpr const char* kWords[] = {
      // in the order of the faults
      "", "a grain became non-finite", "a grain moved a quarter radius in one step",
      "a grain went through a body", "two grains overlap by nine tenths of a radius"};
  return kWords[static_cast<int>(fault)];
}

World::World(const WorldConfig& config, const Contents& contents) : state_(Checked(config)) {
  Construct(contents);
}

World::World(const WorldConfig& config, const std::vector<GrainState>& grains)
    : state_(Checked(config)) {
  Contents contents;
  contents.grains = grains;
  Construct(contents);
}

void World::Construct(const Contents& contents) {
  state_.params = state_.config.contacts.Table();
  state_.combination = state_.config.contacts.combination();
  std::vector<GrainState> grains = contents.grains;
  ClumpPass::Add(state_, contents, &grains);
  state_.count = static_cast<std::int64_t>(grains.size());
  std::vector<Grain> raw;
  raw.reserve(grains.size());
  for (std::size_t i = 0; i < grains.size(); ++i) {
    CheckGrain(grains[i], i, state_.config.contacts.materials());
    raw.push_back(MakeGrain(grains[i], state_.config, static_cast<std::int32_t>(i)));
    const float r = raw.back().radius;
    state_.largest_radius = std::max(state_.largest_radius, r);
    state_.smallest_radius = i == 0 ? r : std::min(state_.smallest_radius, r);
    if (grains[i].material != 0) state_.combination = -1;
  }
  const std::int64_t padded = (state_.count + kLanes - 1) / kLanes * kLanes;
  state_.grains.assign(padded, PaddingGrain());
  state_.index_of.assign(state_.count, 0);
  if (state_.count > 0) {
    const auto order = SpatialOrder(raw, state_.config.frame);
    for (std::int64_t i = 0; i < state_.count; ++i) {
      state_.grains[i] = raw[order[i]];
      state_.index_of[order[i]] = static_cast<std::int32_t>(i);
    }
  }
  state_.loads.assign(padded, GrainLoad{});
  state_.kinetics.assign(padded, Kinetics{});
  for (std::int64_t i = 0; i < state_.count; ++i) state_.kinetics[i] = AtRest(state_.grains[i]);
  state_.range = static_cast<float>(
      state_.config.contacts.Range(state_.smallest_radius, state_.largest_radius));
  if (!(state_.config.skin_m > 0)) state_.config.skin_m = 0.2 * state_.largest_radius;
  state_.contact = BodyPass::ContactOf(state_.config.contacts.combination());
  const WordLayout& layout = state_.config.contacts.layout();
  state_.list.Configure(layout.words, layout.vector_words, state_.config.first_pairs);
  ClumpPass::Index(state_);
  BondPass::Add(state_, contents);
  Rebuild();
  for (const Body& b : contents.bodies) AddBody(b);
  CheckGuard();
}

void World::CheckGuard() const {
  if (!(state_.config.guard_overlap > 0) || state_.count == 0) return;
  const double critical = CriticalStep(state_.config.guard_overlap);
  if (state_.config.dt_s > critical * (1 + 1e-9)) {
    throw std::invalid_argument(
        "dt_s: " + std::to_string(state_.config.dt_s) + " s, expected at most the critical step " +
        std::to_string(critical) + " s (0.2 sqrt(m/K), m/(8 C)) at an overlap of " +
        std::to_string(state_.config.guard_overlap) + " radii");
  }
}

double World::CriticalStep(double overlap_ratio) const {
  double step = 1e300;
  for (std::int64_t i = 0; i < state_.count; ++i) {
    const Grain& g = state_.grains[i];
    step = std::min(
        step, CriticalStepOf(state_.config.contacts, overlap_ratio * g.radius, g.radius, g.mass));
  }
  return std::min(step, BondPass::CriticalStep(state_));
}

void World::Rebuild(const std::vector<std::int32_t>* place_of) {
  {
    const Stopwatch watch(state_.timing, state_.phases.search_s);
    Exclusions excluded;
    if (!state_.clump_of.empty()) excluded.clump_of = state_.clump_of.data();
    if (!state_.bonded.empty()) excluded.bonded = &state_.bonded;
    state_.list.Build(state_.grains, state_.count, state_.config.frame,
                      static_cast<float>(state_.config.skin_m) + state_.range, excluded, place_of);
    state_.found_at.resize(state_.count);
    for (std::int64_t i = 0; i < state_.count; ++i) {
      state_.found_at[i] = {state_.grains[i].x, state_.grains[i].y, state_.grains[i].z, 0.0f};
    }
    BodyPass::FindAll(state_);
  }
  state_.stale = false;
  ++state_.rebuilds;
  Prune();
}

Kinetics World::AtRest(const Grain& g) const {
  Kinetics k;
  k.inverse_mass = 1.0f / g.mass;
  k.inverse_inertia =
      1.0f / (static_cast<float>(state_.config.inertia_factor) * g.mass * g.radius * g.radius);
  return k;
}

/// Gives every grain a displacement bound; false where one that ends within the half skin of
/// the search can not be had.
bool World::SetBounds() {
  const auto q = state_.config.frame.Quantum();
  const float half = 0.5f * static_cast<float>(state_.config.skin_m);
  const float room = kStepsOfRoom * static_cast<float>(state_.config.dt_s);
  state_.reaches.resize(state_.count);
  state_.bounds.resize(state_.grains.size());
  // Padding goes nowhere, also where grains have been before an exchange.
  std::fill(state_.bounds.begin() + state_.count, state_.bounds.end(),
            DisplacementBound{0, 0, 0, 0.0f});
  for (std::int64_t i = 0; i < state_.count; ++i) {
    const auto& at = state_.found_at[i];
    if (!BoundGrain(state_.grains[i], at.x, at.y, at.z, q.data(), half, room, &state_.bounds[i],
                    &state_.reaches[i])) {
      return false;
    }
  }
  return true;
}

void World::Prune() {
  if (!SetBounds()) return Rebuild();
  const Stopwatch watch(state_.timing, state_.phases.prune_s);
  state_.inner_stale = false;
  state_.list.Prune(state_.grains, state_.reaches, state_.config.frame, state_.range);
  ++state_.phases.prunes;
}

StepFault World::Step() {
  if (state_.fault != StepFault::kNone) return state_.fault;
  if (state_.config.stepper) return state_.fault = state_.config.stepper->Run(*this, 1);
  Start();
  if (SortDue()) Sort();
  if (state_.fault == StepFault::kNone) {
    const Stopwatch watch(state_.timing, state_.phases.drift_s);
    state_.fault = Drift();
  }
  if (state_.fault != StepFault::kNone) return state_.fault;
  {
    const Stopwatch watch(state_.timing, state_.phases.bodies_s);
    BondPass::Turn(state_);
    BodyPass::Move(state_);
  }
  if (state_.stale) {
    Rebuild();
  } else if (state_.inner_stale) {
    Prune();
  }
  Forces();
  ++state_.steps;
  state_.energy.AddStep(state_.step_energy);
  return state_.fault;
}

StepFault World::Run(std::int64_t steps) {
  if (state_.config.stepper && state_.fault == StepFault::kNone && steps > 0) {
    return state_.fault = state_.config.stepper->Run(*this, steps);
  }
  for (std::int64_t s = 0; s < steps; ++s) {
    if (Step() != StepFault::kNone) return state_.fault;
  }
  return StepFault::kNone;
}

PairView World::View(double dt_s) {
  PairView v = {};
  v.grains = state_.grains.data();
  state_.list.Fill(v);
  const auto q = state_.config.frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.range = state_.range;
  v.dt = static_cast<float>(dt_s);
  v.params = state_.params.data();
  v.materials = state_.config.contacts.materials();
  v.layout = state_.config.contacts.layout();
  return v;
}

void World::PairForces() {
  const PairView v = View(state_.config.dt_s);
  const Kernels kernels = KernelsFor(nullptr, state_.combination, state_.config.energy);
  const std::int64_t blocks = state_.list.blocks();
  const std::int64_t chunks = (blocks + kBlocksPerChunk - 1) / kBlocksPerChunk;
  auto& energy = state_.chunk_energy;
  energy.assign(state_.config.energy ? chunks : 0, EnergySums{});
  const int size = state_.team.size();
  {
    const Stopwatch watch(state_.timing, state_.phases.pairs_s);
    state_.team.Run([&](int part) {
      for (std::int64_t c = chunks * part / size; c < chunks * (part + 1) / size; ++c) {
        const std::int64_t last = std::min(blocks, (c + 1) * kBlocksPerChunk);
        kernels.pairs(v, c * kBlocksPerChunk, last, state_.config.energy ? &energy[c] : nullptr);
      }
    });
  }
  const Stopwatch watch(state_.timing, state_.phases.sum_s);
  const auto tiles = static_cast<std::int64_t>(state_.grains.size()) / kLanes;
  state_.team.Run([&](int part) {
    kernels.sum(v, state_.idle.empty() ? nullptr : state_.idle.data(), state_.loads.data(),
                tiles * part / size, tiles * (part + 1) / size);
  });
  for (const auto& e : energy) state_.step_energy.Add(e);
}

void World::Forces() {
  state_.step_energy = EnergySums{};
  PairForces();
  const Stopwatch watch(state_.timing, state_.phases.bodies_s);
  BondPass::Forces(state_);
  BodyPass::Forces(state_);
  ClumpPass::Gather(state_);
}

void World::SetContacts(const ContactModel& contacts) {
  if (!contacts.SameLaws(state_.config.contacts)) {
    throw std::invalid_argument("contacts: expected the laws and materials the world began with");
  }
  state_.config.contacts = contacts;
  state_.params = contacts.Table();
}

double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio) {
  const double shear = youngs_modulus_pa / (2 * (1 + poisson_ratio));
  return M_PI * radius_m * std::sqrt(density_kg_per_m3 / shear) / (0.1631 * poisson_ratio + 0.8766);
}

}  // namespace grouser::dem

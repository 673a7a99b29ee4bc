#include "dem_offline/engine/world/world.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/core/displacement_bound.h"
#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/world/parts.h"

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

void CheckConfig(const WorldConfig& c) {
  if (!(c.dt_s > 0)) throw std::invalid_argument("dt_s: expected > 0");
  if (c.threads < 1 || c.threads > 256) throw std::invalid_argument("threads: expected 1 to 256");
  if (!(c.inertia_factor > 0)) throw std::invalid_argument("inertia_factor: expected > 0");
  for (const double s : {c.frame.length_m, c.frame.width_m, c.frame.z_span_m}) {
    if (!(s > 0) || !std::isfinite(s)) throw std::invalid_argument("frame: expected sizes > 0");
  }
}

}  // namespace

const char* Explain(StepFault fault) {
  switch (fault) {
    case StepFault::kNone:
      return "";
    case StepFault::kNonFinite:
      return "a grain became non-finite";
    case StepFault::kTooFast:
      return "a grain moved a quarter radius in one step";
    case StepFault::kTunnelled:
      return "a grain went through a body";
    case StepFault::kOverlap:
      return "two grains overlap by nine tenths of a radius";
  }
  return "";
}

World::World(const WorldConfig& config, const Contents& contents) : config_(config) {
  CheckConfig(config_);
  Construct(contents);
}

World::World(const WorldConfig& config, const std::vector<GrainState>& grains) : config_(config) {
  CheckConfig(config_);
  Contents contents;
  contents.grains = grains;
  Construct(contents);
}

World::~World() = default;

void World::Construct(const Contents& contents) {
  parts_ = std::make_unique<Parts>(config_.threads);
  params_ = config_.contacts.Table();
  combination_ = config_.contacts.combination();
  std::vector<GrainState> grains = contents.grains;
  ClumpPass::Add(*this, contents, &grains);
  count_ = static_cast<std::int64_t>(grains.size());
  std::vector<Grain> raw;
  raw.reserve(grains.size());
  for (std::size_t i = 0; i < grains.size(); ++i) {
    CheckGrain(grains[i], i, config_.contacts.materials());
    raw.push_back(MakeGrain(grains[i], config_, static_cast<std::int32_t>(i)));
    const float r = raw.back().radius;
    largest_radius_ = std::max(largest_radius_, r);
    smallest_radius_ = i == 0 ? r : std::min(smallest_radius_, r);
    if (grains[i].material != 0) combination_ = -1;
  }
  const std::int64_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  grains_.assign(padded, PaddingGrain());
  index_of_.assign(count_, 0);
  if (count_ > 0) {
    const auto order = SpatialOrder(raw, config_.frame);
    for (std::int64_t i = 0; i < count_; ++i) {
      grains_[i] = raw[order[i]];
      index_of_[order[i]] = static_cast<std::int32_t>(i);
    }
  }
  loads_.assign(padded, GrainLoad{});
  kinetics_.assign(padded, Kinetics{});
  for (std::int64_t i = 0; i < count_; ++i) kinetics_[i] = AtRest(grains_[i]);
  range_ = static_cast<float>(config_.contacts.Range(smallest_radius_, largest_radius_));
  if (!(config_.skin_m > 0)) config_.skin_m = 0.2 * largest_radius_;
  parts_->contact = BodyPass::ContactOf(config_.contacts.combination());
  const WordLayout& layout = config_.contacts.layout();
  list_.Configure(layout.words, layout.vector_words, config_.first_pairs);
  ClumpPass::Index(*this);
  BondPass::Add(*this, contents);
  Rebuild();
  for (const Body& b : contents.bodies) AddBody(b);
  CheckGuard();
}

void World::CheckGuard() const {
  if (!(config_.guard_overlap > 0) || count_ == 0) return;
  const double critical = CriticalStep(config_.guard_overlap);
  if (config_.dt_s > critical * (1 + 1e-9)) {
    throw std::invalid_argument(
        "dt_s: " + std::to_string(config_.dt_s) + " s, expected at most the critical step " +
        std::to_string(critical) + " s (0.2 sqrt(m/K), m/(8 C)) at an overlap of " +
        std::to_string(config_.guard_overlap) + " radii");
  }
}

double World::CriticalStep(double overlap_ratio) const {
  double step = 1e300;
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    step = std::min(step,
                    CriticalStepOf(config_.contacts, overlap_ratio * g.radius, g.radius, g.mass));
  }
  return std::min(step, BondPass::CriticalStep(*this));
}

void World::Rebuild(const std::vector<std::int32_t>* place_of) {
  {
    const Stopwatch watch(timing_, phases_.search_s);
    Exclusions excluded;
    if (!parts_->clump_of.empty()) excluded.clump_of = parts_->clump_of.data();
    if (!parts_->bonded.empty()) excluded.bonded = &parts_->bonded;
    list_.Build(grains_, count_, config_.frame, static_cast<float>(config_.skin_m) + range_,
                excluded, place_of);
    found_at_.resize(count_);
    for (std::int64_t i = 0; i < count_; ++i) {
      found_at_[i] = {grains_[i].x, grains_[i].y, grains_[i].z, 0.0f};
    }
    BodyPass::FindAll(*this);
  }
  stale_ = false;
  ++rebuilds_;
  Prune();
}

Kinetics World::AtRest(const Grain& g) const {
  Kinetics k;
  k.inverse_mass = 1.0f / g.mass;
  k.inverse_inertia =
      1.0f / (static_cast<float>(config_.inertia_factor) * g.mass * g.radius * g.radius);
  return k;
}

/// Gives every grain a displacement bound; false where one that ends within the half skin of
/// the search can not be had.
bool World::SetBounds() {
  const auto q = config_.frame.Quantum();
  const float half = 0.5f * static_cast<float>(config_.skin_m);
  const float room = kStepsOfRoom * static_cast<float>(config_.dt_s);
  reaches_.resize(count_);
  bounds_.resize(grains_.size());
  // Padding goes nowhere, also where grains have been before an exchange.
  std::fill(bounds_.begin() + count_, bounds_.end(), DisplacementBound{0, 0, 0, 0.0f});
  for (std::int64_t i = 0; i < count_; ++i) {
    const auto& at = found_at_[i];
    if (!BoundGrain(grains_[i], at.x, at.y, at.z, q.data(), half, room, &bounds_[i],
                    &reaches_[i])) {
      return false;
    }
  }
  return true;
}

void World::Prune() {
  if (!SetBounds()) return Rebuild();
  const Stopwatch watch(timing_, phases_.prune_s);
  inner_stale_ = false;
  list_.Prune(grains_, reaches_, config_.frame, range_);
  ++phases_.prunes;
}

StepFault World::Step() {
  if (fault_ != StepFault::kNone) return fault_;
  if (config_.stepper) return fault_ = config_.stepper->Run(*this, 1);
  Start();
  if (SortDue()) Sort();
  if (fault_ == StepFault::kNone) {
    const Stopwatch watch(timing_, phases_.drift_s);
    fault_ = Drift();
  }
  if (fault_ != StepFault::kNone) return fault_;
  {
    const Stopwatch watch(timing_, phases_.bodies_s);
    BondPass::Turn(*this);
    BodyPass::Move(*this);
  }
  if (stale_) {
    Rebuild();
  } else if (inner_stale_) {
    Prune();
  }
  Forces();
  ++steps_;
  energy_.AddStep(step_energy_);
  return fault_;
}

StepFault World::Run(std::int64_t steps) {
  if (config_.stepper && fault_ == StepFault::kNone && steps > 0) {
    return fault_ = config_.stepper->Run(*this, steps);
  }
  for (std::int64_t s = 0; s < steps; ++s) {
    if (Step() != StepFault::kNone) return fault_;
  }
  return StepFault::kNone;
}

PairView World::View(double dt_s) {
  PairView v = {};
  v.grains = grains_.data();
  list_.Fill(v);
  const auto q = config_.frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.range = range_;
  v.dt = static_cast<float>(dt_s);
  v.params = params_.data();
  v.materials = config_.contacts.materials();
  v.laws = config_.contacts.laws();
  v.layout = config_.contacts.layout();
  return v;
}

void World::PairForces() {
  const PairView v = View(config_.dt_s);
  const Kernels kernels = KernelsFor(nullptr, combination_, config_.energy);
  const std::int64_t blocks = list_.blocks();
  const std::int64_t chunks = (blocks + kBlocksPerChunk - 1) / kBlocksPerChunk;
  auto& energy = parts_->chunk_energy;
  energy.assign(config_.energy ? chunks : 0, EnergySums{});
  const int size = parts_->team.size();
  {
    const Stopwatch watch(timing_, phases_.pairs_s);
    parts_->team.Run([&](int part) {
      for (std::int64_t c = chunks * part / size; c < chunks * (part + 1) / size; ++c) {
        const std::int64_t last = std::min(blocks, (c + 1) * kBlocksPerChunk);
        kernels.pairs(v, c * kBlocksPerChunk, last, config_.energy ? &energy[c] : nullptr);
      }
    });
  }
  const Stopwatch watch(timing_, phases_.sum_s);
  const auto tiles = static_cast<std::int64_t>(grains_.size()) / kLanes;
  parts_->team.Run([&](int part) {
    kernels.sum(v, idle_.empty() ? nullptr : idle_.data(), loads_.data(), tiles * part / size,
                tiles * (part + 1) / size);
  });
  for (const auto& e : energy) step_energy_.Add(e);
}

void World::Forces() {
  step_energy_ = EnergySums{};
  PairForces();
  const Stopwatch watch(timing_, phases_.bodies_s);
  BondPass::Forces(*this);
  BodyPass::Forces(*this);
  ClumpPass::Gather(*this);
}

void World::SetContacts(const ContactModel& contacts) {
  if (!(contacts.laws() == config_.contacts.laws()) ||
      contacts.materials() != config_.contacts.materials()) {
    throw std::invalid_argument("contacts: expected the laws and materials the world began with");
  }
  config_.contacts = contacts;
  params_ = contacts.Table();
}

double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio) {
  const double shear = youngs_modulus_pa / (2 * (1 + poisson_ratio));
  return M_PI * radius_m * std::sqrt(density_kg_per_m3 / shear) / (0.1631 * poisson_ratio + 0.8766);
}

}  // namespace grouser::dem

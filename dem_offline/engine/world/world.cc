#include "dem_offline/engine/world/world.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

constexpr int kTilesPerChunk = 32;  // energy is summed chunk by chunk, whatever the threads

void RequireFinite(double value, const char* field, std::size_t i) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument("grain " + std::to_string(i) + ": " + field +
                                ": not finite, expected a number");
  }
}

void CheckGrain(const GrainState& s, std::size_t i, int materials) {
  for (const double v : {s.x_m, s.y_m, s.z_m}) RequireFinite(v, "position", i);
  for (const double v : {s.v_x, s.v_y, s.v_z, s.w_x, s.w_y, s.w_z}) RequireFinite(v, "velocity", i);
  if (!(s.radius_m > 0) || !std::isfinite(s.radius_m)) {
    throw std::invalid_argument("grain " + std::to_string(i) + ": radius_m: " +
                                std::to_string(s.radius_m) + ", expected > 0");
  }
  if (!(s.mass_kg > 0 || s.density_kg_per_m3 > 0)) {
    throw std::invalid_argument("grain " + std::to_string(i) +
                                ": density_kg_per_m3: expected > 0 (or mass_kg > 0)");
  }
  if (s.material < 0 || s.material >= materials) {
    throw std::invalid_argument("grain " + std::to_string(i) + ": material: " +
                                std::to_string(s.material) + ", expected 0 to " +
                                std::to_string(materials - 1));
  }
}

Grain MakeGrain(const GrainState& s, const WorldConfig& config, std::int32_t id) {
  const double r = s.radius_m;
  Grain g = {};
  g.x = config.frame.FixX(s.x_m - config.origin_m[0]);
  g.y = config.frame.FixY(s.y_m - config.origin_m[1]);
  g.z = config.frame.FixZ(s.z_m - config.origin_m[2]);
  g.radius = static_cast<float>(r);
  g.vx = static_cast<float>(s.v_x);
  g.vy = static_cast<float>(s.v_y);
  g.vz = static_cast<float>(s.v_z);
  g.wx = static_cast<float>(s.w_x);
  g.wy = static_cast<float>(s.w_y);
  g.wz = static_cast<float>(s.w_z);
  const double sphere = s.density_kg_per_m3 * 4.0 / 3.0 * M_PI * r * r * r;
  g.mass = static_cast<float>(s.mass_kg > 0 ? s.mass_kg : sphere);
  g.kind = s.material | (s.glued ? kGlued : 0);
  g.id = id;
  return g;
}

/// Places in memory: by class of size (factors of two), in space within each,
/// so that tiles hold neighbours of about the same number of partners.
std::vector<std::int32_t> Sorted(const std::vector<Grain>& raw, const WorldConfig& config,
                                 float smallest, float largest) {
  const double cell = std::min({4.0 * largest, config.frame.length_m / 3.01,
                                config.frame.width_m / 3.01});
  const CellGrid grid(raw, static_cast<std::int64_t>(raw.size()), config.frame, cell);
  std::vector<std::int32_t> order = grid.order();
  const auto size_class = [&](std::int32_t i) {
    int c = 0;
    for (float r = 2 * smallest; raw[i].radius >= r; r *= 2) ++c;
    return c;
  };
  std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    return size_class(a) < size_class(b);
  });
  return order;
}

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
    case StepFault::kNone: return "";
    case StepFault::kNonFinite: return "a grain became non-finite";
    case StepFault::kTooFast: return "a grain moved a quarter radius in one step";
    case StepFault::kTunnelled: return "a grain went through a body";
    case StepFault::kOverlap: return "two grains overlap by nine tenths of a radius";
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
  recipe_ = config_.contacts.recipe();
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
    if (grains[i].material != 0) recipe_ = -1;
  }
  const std::int64_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  grains_.assign(padded, Grain{});
  for (auto& g : grains_) g.mass = 1.0f, g.id = -1;
  index_of_.assign(count_, 0);
  if (count_ > 0) {
    const auto order = Sorted(raw, config_, smallest_radius_, largest_radius_);
    for (std::int64_t i = 0; i < count_; ++i) {
      grains_[i] = raw[order[i]];
      index_of_[order[i]] = static_cast<std::int32_t>(i);
    }
  }
  loads_.assign(padded, GrainLoad{});
  velocity_rest_.assign(padded, VelocityRest{});
  range_ = static_cast<float>(config_.contacts.Range(smallest_radius_, largest_radius_));
  if (!(config_.skin_m > 0)) config_.skin_m = 0.2 * largest_radius_;
  parts_->contact = BodyPass::ContactOf(config_.contacts.recipe());
  list_.Configure(config_.contacts.layout().words, config_.first_slots);
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
    throw std::invalid_argument("dt_s: " + std::to_string(config_.dt_s) +
                                " s, expected at most the critical step 0.2 sqrt(m/K) = " +
                                std::to_string(critical) + " s at an overlap of " +
                                std::to_string(config_.guard_overlap) + " radii");
  }
}

double World::CriticalStep(double overlap_ratio) const {
  double step = 1e300;
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    // The partner that is hardest on it: a rigid body.
    const double k =
        config_.contacts.Stiffness(overlap_ratio * g.radius, g.radius, g.mass);
    step = std::min(step, 0.2 * std::sqrt(g.mass / k));
  }
  return step;
}

void World::Rebuild() {
  Exclusions excluded;
  if (!parts_->clump_of.empty()) excluded.clump_of = parts_->clump_of.data();
  if (!parts_->bonded.empty()) excluded.bonded = &parts_->bonded;
  list_.Build(grains_, count_, config_.frame, static_cast<float>(config_.skin_m) + range_, excluded);
  reference_.resize(3 * count_);
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    reference_[3 * i] = g.x;
    reference_[3 * i + 1] = g.y;
    reference_[3 * i + 2] = g.z;
  }
  BodyPass::FindAll(*this);
  stale_ = false;
  ++rebuilds_;
}

StepFault World::Step() {
  if (fault_ != StepFault::kNone) return fault_;
  Start();
  if (fault_ == StepFault::kNone) fault_ = Drift();
  if (fault_ != StepFault::kNone) return fault_;
  BondPass::Turn(*this);
  BodyPass::Move(*this);
  if (stale_) Rebuild();
  Forces();
  ++steps_;
  const double stored = step_energy_.stored;
  step_energy_.stored = 0;
  energy_.Add(step_energy_);
  energy_.stored = stored;
  return fault_;
}

StepFault World::Run(std::int64_t steps) {
  for (std::int64_t s = 0; s < steps; ++s) {
    if (Step() != StepFault::kNone) return fault_;
  }
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
  for (int w = 0; w < list_.words(); ++w) v.history[w] = list_.history()[w].data();
  v.row_touches = list_.row_touches().data();
  const auto q = config_.frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.range = range_;
  v.dt = static_cast<float>(config_.dt_s);
  v.params = params_.data();
  v.materials = config_.contacts.materials();
  v.laws = config_.contacts.laws();
  v.layout = config_.contacts.layout();
  const PairKernelFn kernel = PairKernel(recipe_, config_.energy);
  const int chunks = (v.tiles + kTilesPerChunk - 1) / kTilesPerChunk;
  auto& energy = parts_->chunk_energy;
  energy.assign(config_.energy ? chunks : 0, EnergySums{});
  const int size = parts_->team.size();
  parts_->team.Run([&](int part) {
    const int from = static_cast<int>(static_cast<std::int64_t>(chunks) * part / size);
    const int to = static_cast<int>(static_cast<std::int64_t>(chunks) * (part + 1) / size);
    for (int c = from; c < to; ++c) {
      const int last = std::min(v.tiles, (c + 1) * kTilesPerChunk);
      kernel(v, c * kTilesPerChunk, last, config_.energy ? &energy[c] : nullptr);
    }
  });
  for (const auto& e : energy) step_energy_.Add(e);
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

#include "dem_offline/engine/gpu/ensemble.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/core/displacement_bound.h"
#include "dem_offline/engine/core/drift_body.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem::gpu {
namespace {

constexpr double kGrowth = 1.5;  // of lists that are too short
constexpr int kLayersAbove = 4;  // of cells, for grains that are thrown up

[[noreturn]] void Refuse(std::size_t world, const std::string& what) {
  throw NotElsewhere("ensemble: world " + std::to_string(world) + ": " + what);
}

std::int32_t Grown(std::int32_t n) { return static_cast<std::int32_t>(std::ceil(n * kGrowth)); }

}  // namespace

void Ensemble::CheckWorld(std::size_t number) const {
  const SimulationState& w = worlds_[number]->state();
  const WorldConfig &c = w.config, &first = worlds_[0]->state().config;
  if (!c.contacts.SameLaws(first.contacts)) {
    Refuse(number, "laws or materials, expected those of world 0");
  }
  if (w.count == 0) Refuse(number, "no grain, expected one or more");
  if (!w.bonds.empty()) Refuse(number, "bonds, expected none: not on the device yet");
  if (w.sink) Refuse(number, "a recorder of contacts, expected none: not on the device yet");
  if (w.fault != StepFault::kNone) Refuse(number, std::string("has failed: ") + Explain(w.fault));
  if (w.bodies.size() > kMostBodies) {
    Refuse(number, std::to_string(w.bodies.size()) + " bodies, expected at most " +
                       std::to_string(kMostBodies));
  }
  for (const BodyEntry& b : w.bodies) {
    if (b.body.shape.mesh) Refuse(number, "a mesh, expected parts: not on the device yet");
  }
  if (w.combination != combination_)
    Refuse(number, "kinds of grains, expected as many as world 0 has");
}

WorldView Ensemble::ViewOfWorld(std::size_t number) const {
  const SimulationState& w = worlds_[number]->state();
  const WorldConfig& c = w.config;
  WorldView v = {};
  v.count = static_cast<std::int32_t>(w.count);
  v.drift = DriftNumbers(w);
  for (int a = 0; a < 3; ++a) v.gravity[a] = static_cast<float>(c.gravity_m_per_s2[a]);
  v.energy = c.energy;
  v.sort = SortGridOf(w);
  v.inertia_factor = static_cast<float>(c.inertia_factor);
  v.range = w.range;
  v.half_skin = 0.5f * static_cast<float>(c.skin_m);
  v.room = kStepsOfRoom * static_cast<float>(c.dt_s);
  v.search_reach = static_cast<float>(c.skin_m) + w.range;
  const double cell = 2.0 * w.largest_radius + v.search_reach;
  v.nx = static_cast<std::int32_t>(c.frame.length_m / cell);
  v.ny = static_cast<std::int32_t>(c.frame.width_m / cell);
  std::int32_t low = w.grains[0].z, high = low;
  for (std::int64_t i = 0; i < w.count; ++i) {
    low = std::min(low, w.grains[i].z);
    high = std::max(high, w.grains[i].z);
  }
  v.z_low = low;
  v.z_scale = c.frame.z_span_m / 4294967296.0 / cell;
  v.nz =
      static_cast<std::int32_t>((static_cast<double>(high) - low) * v.z_scale) + 1 + kLayersAbove;
  return v;
}

Ensemble::Ensemble(const std::vector<World*>& worlds, Device& device, const ListSizes& sizes)
    : device_(device), worlds_(worlds) {
  if (worlds_.empty()) throw std::invalid_argument("ensemble: no world, expected one or more");
  combination_ = worlds_[0]->state().combination;
  words_ = worlds_[0]->state().config.contacts.layout().words;
  layout_.sizes = sizes;
  for (std::size_t n = 0; n < worlds_.size(); ++n) {
    CheckWorld(n);
    views_.push_back(ViewOfWorld(n));
    const WorldView& v = views_.back();
    layout_.tiles.push_back(TilesFor(v.count));
    layout_.cells.push_back(static_cast<std::int64_t>(v.nx) * v.ny * v.nz);
    const SimulationState& w = worlds_[n]->state();
    first_clump_.push_back(layout_.clumps);
    layout_.clumps += static_cast<std::int64_t>(w.clumps.size());
    for (const ClumpEntry& e : w.clumps) {
      layout_.clump_members += static_cast<std::int64_t>(w.templates[e.state.shape].members.size());
    }
  }
  AddBodies();
  layout_.Place();
  const MemoryPlan plan = PlanOf(layout_, words_);
  if (plan.Total() > device_.FreeBytes()) {
    throw std::runtime_error("ensemble: " + std::to_string(layout_.grains()) + " grains need " +
                             ToText(plan) + "; expected at most " +
                             std::to_string(device_.FreeBytes() >> 20) + " MiB on " +
                             device_.name());
  }
  states_.assign(worlds_.size(), WorldState{});
  sent_energy_.assign(worlds_.size(), EnergySums{});
  sorted_at_.assign(worlds_.size(), -1);
  Begin();
}

void Ensemble::AddBodies() {
  for (int number = 0; number < kMostBodies; ++number) {
    for (std::size_t w = 0; w < worlds_.size(); ++w) {
      const auto& bodies = worlds_[w]->state().bodies;
      if (number >= static_cast<int>(bodies.size())) continue;
      const BodySlots& slots = bodies[number].slots;
      layout_.bodies.push_back({static_cast<int>(w), number});
      layout_.per_grain.push_back(slots.per_grain);
      layout_.entries.push_back(RunsFor(Grown(static_cast<std::int32_t>(slots.near.size()))) +
                                kRun);
    }
  }
}

bool Ensemble::Overflowed(std::int32_t* bits) {
  states_ = memory_.states.now.Download();
  *bits = 0;
  for (const WorldState& s : states_) *bits |= s.overflow;
  return *bits != 0;
}

void Ensemble::Begin() {
  for (;;) {
    memory_.Allocate(device_, layout_, words_);
    SendShapes();
    SendMembers();
    SendTables();
    for (int w = 0; w < size(); ++w) SendWorld(w);
    device_.Start(View(), combination_);
    std::int32_t bits;
    if (!Overflowed(&bits)) return;
    ++regrowths_;
    Regrow(bits);
  }
}

/// Wider lists where these bits ask for them.
void Ensemble::Regrow(std::int32_t bits) {
  Layout next = layout_;
  ListSizes& s = next.sizes;
  if (bits & kCellsFull) s.cell_slots = Grown(s.cell_slots);
  if (bits & kOuterFull) {
    if (s.outer_slots >= kMostOuter) {
      throw std::runtime_error("ensemble: a grain has more than " + std::to_string(kMostOuter) +
                               " neighbours");
    }
    s.outer_slots = std::min<std::int32_t>(Grown(s.outer_slots), kMostOuter);
  }
  if (bits & kInnerFull) s.inner_slots = Grown(s.inner_slots);
  if (bits & kBodyFull) {
    for (std::size_t b = 0; b < next.bodies.size(); ++b) {
      if (states_[next.bodies[b].world].overflow & kBodyFull) {
        next.entries[b] = RunsFor(Grown(next.entries[b]));
      }
    }
  }
  Relayout(next);
}

double Ensemble::BytesPerStep() const {
  double grains = 0, listed = 0;
  for (int w = 0; w < size(); ++w) {
    const std::int32_t n = views_[w].count;
    grains += n;
    for (const std::int32_t k :
         memory_.inner_count[states_[w].turn].now.Download(layout_.first[w], n)) {
      listed += k;
    }
  }
  const double word = sizeof(float);
  // Drift: grain and kinetics both ways, load, bound. Forces: grain, load, count;
  // of every listed contact partner, and history both ways.
  const double per_grain = 3 * sizeof(Grain) + 2 * sizeof(Kinetics) + 2 * sizeof(GrainLoad) +
                           sizeof(DisplacementBound) + word;
  return grains * per_grain + listed * (1 + 2 * words_) * word;
}

StepFault Ensemble::fault(int world) const {
  const std::int32_t f = states_[world].fault;
  if (f & (kInfiniteGrain | kBodyAway)) return StepFault::kNonFinite;
  if (f & kDeepGrain) return StepFault::kOverlap;
  if (f & kFastGrain) return StepFault::kTooFast;
  if (f & kThroughBody) return StepFault::kTunnelled;
  return StepFault::kNone;
}

}  // namespace grouser::dem::gpu

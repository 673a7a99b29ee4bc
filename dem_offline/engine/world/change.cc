// Grains of a World that freeze, move again, leave and come.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

[[noreturn]] void Bad(const std::string& what) { throw std::invalid_argument("exchange: " + what); }

void Stop(Grain& g) {
  g.vx = g.vy = g.vz = g.wx = g.wy = g.wz = 0.0f;
  g.rest_x = g.rest_y = g.rest_z = 0.0f;
}

}  // namespace

/// Forces on the grains with a flag, at the present positions: a step of no
/// length, which leaves every history where it is. All others keep theirs, and so do
/// bodies their wrenches.
void World::RenewLoads(const std::vector<std::uint8_t>& wanted) {
  if (std::find(wanted.begin(), wanted.end(), 1) == wanted.end()) return;
  const std::vector<GrainLoad> before = loads_;
  const double dt = config_.dt_s;
  const bool energy = config_.energy;
  std::vector<Wrench> wrenches;
  for (const BodyEntry& b : parts_->bodies) wrenches.push_back(b.wrench);
  const auto sink = std::move(parts_->sink);
  parts_->sink = nullptr;
  config_.dt_s = 0;
  config_.energy = false;
  Forces();
  config_.dt_s = dt;
  config_.energy = energy;
  parts_->sink = sink;
  for (std::size_t b = 0; b < wrenches.size(); ++b) parts_->bodies[b].wrench = wrenches[b];
  for (std::int64_t i = 0; i < count_; ++i) {
    if (!wanted[i]) loads_[i] = before[i];
  }
}

/// Energy in the springs of all evaluated contacts, as they stand [J].
double World::StoredNow() {
  // A step of no length leaves every law where it is; on copies all the same.
  PairList copy = list_;
  PairView v = View(0);
  copy.Fill(v);
  EnergySums sum;
  KernelsFor(nullptr, combination_, true).pairs(v, 0, copy.blocks(), &sum);
  return sum.stored + BodyPass::Stored(*this);
}

void World::Freeze(const std::vector<std::uint8_t>& frozen) {
  if (static_cast<std::int64_t>(frozen.size()) != count_) {
    throw std::invalid_argument("freeze: " + std::to_string(frozen.size()) +
                                " flags, expected one a grain: " + std::to_string(count_));
  }
  Start();
  const auto differs = [&](std::int64_t i) { return (frozen[i] != 0) != Frozen(i); };
  bool any = false;
  for (std::int64_t i = 0; i < count_ && !any; ++i) any = differs(i);
  if (!any) return;
  const double kinetic = config_.energy ? KineticEnergy() : 0;
  const double stored = config_.energy ? StoredNow() : 0;
  std::vector<std::uint8_t> woken(count_, 0);
  for (std::int64_t i = 0; i < count_; ++i) {
    Grain& g = grains_[i];
    if (g.kind & (kGlued | kMember) || !differs(i)) continue;  // those never move of themselves
    g.kind ^= kFrozen;
    woken[i] = frozen[i] == 0;
    Stop(g);
    loads_[i] = GrainLoad{};
    kinetics_[i] = AtRest(g);
  }
  idle_.assign(grains_.size() / kLanes, 1);
  for (std::int64_t i = 0; i < count_; ++i) {
    if (!Frozen(i)) idle_[i / kLanes] = 0;
  }
  // Pairs of two frozen grains are in no list: a search finds those of grains that move again.
  if (std::find(woken.begin(), woken.end(), 1) == woken.end()) {
    Prune();
  } else {
    Rebuild();
  }
  RenewLoads(woken);  // else the first kick of the woken would be by gravity alone
  if (!config_.energy) return;
  frozen_j_ += kinetic - KineticEnergy();
  inactive_j_ += stored - StoredNow();
}

/// Puts these grains in place of all, with what belongs to each. from[i]: the
/// old place of grain i, or -1. Ends with a search.
void World::Rearrange(const std::vector<Grain>& grains, const std::vector<std::int32_t>& from) {
  const auto count = static_cast<std::int64_t>(grains.size());
  const std::int64_t padded = (count + kLanes - 1) / kLanes * kLanes;
  std::vector<std::int32_t> place_of(count_, -1);
  std::vector<GrainLoad> loads(padded, GrainLoad{});
  std::vector<Kinetics> kinetics(padded, Kinetics{});
  std::vector<Grain> all = grains;
  all.resize(padded, PaddingGrain());
  for (std::int64_t i = 0; i < count; ++i) {
    if (from[i] < 0) {
      kinetics[i] = AtRest(grains[i]);
      continue;
    }
    place_of[from[i]] = static_cast<std::int32_t>(i);
    loads[i] = loads_[from[i]];
    kinetics[i] = kinetics_[from[i]];
  }
  grains_ = std::move(all);
  loads_ = std::move(loads);
  kinetics_ = std::move(kinetics);
  count_ = count;
  std::fill(index_of_.begin(), index_of_.end(), -1);
  for (std::int64_t i = 0; i < count; ++i) {
    index_of_[grains_[i].id] = static_cast<std::int32_t>(i);
    largest_radius_ = std::max(largest_radius_, grains_[i].radius);
    smallest_radius_ = std::min(smallest_radius_, grains_[i].radius);
  }
  if (!idle_.empty()) {
    idle_.assign(padded / kLanes, 1);
    for (std::int64_t i = 0; i < count; ++i) {
      if (!Frozen(i)) idle_[i / kLanes] = 0;
    }
  }
  BodyPass::Renumber(*this, place_of);
  Rebuild(&place_of);
}

bool World::MaySort() const {
  return count_ > 0 && parts_->clumps.empty() && parts_->bonds.empty() && idle_.empty();
}

bool World::SortDue() const {
  return config_.sort_steps > 0 && steps_ > 0 &&
         steps_ % static_cast<std::uint64_t>(config_.sort_steps) == 0 && MaySort();
}

SortGrid World::GridForSort() const {
  const Frame& f = config_.frame;
  const double cell = 4.0 * largest_radius_;
  const double most = std::min(16383.0, 4 * (8 + std::sqrt(static_cast<double>(count_))));
  const auto along = [&](double length) {
    return static_cast<std::int32_t>(std::max(1.0, std::min(length / cell, most)));
  };
  return {along(f.length_m), along(f.width_m), f.z_span_m / 4294967296.0 / cell, smallest_radius_};
}

void World::Sort() {
  if (!MaySort()) return;
  const SortGrid grid = GridForSort();
  std::vector<std::pair<std::uint64_t, std::int32_t>> order;
  for (std::int64_t i = 0; i < count_; ++i) {
    order.push_back({SortKey(grid, grains_[i]), static_cast<std::int32_t>(i)});
  }
  std::sort(order.begin(), order.end());  // equal keys: by place
  std::vector<Grain> grains;
  std::vector<std::int32_t> from;
  for (const auto& [key, place] : order) {
    grains.push_back(grains_[place]);
    from.push_back(place);
  }
  Rearrange(grains, from);
}

std::int32_t World::Exchange(const GrainExchange& e) {
  if (!parts_->clumps.empty() || !parts_->bonds.empty()) Bad("clumps or bonds, expected neither");
  Start();
  const auto first_id = static_cast<std::int32_t>(index_of_.size());
  std::vector<std::uint8_t> leaves(count_, 0);
  for (const std::int32_t id : e.out) {
    if (id < 0 || id >= first_id || index_of_[id] < 0) {
      Bad("out: " + std::to_string(id) + ", expected the id of a grain");
    }
    leaves[index_of_[id]] = 1;
  }
  std::vector<Grain> raw;
  std::vector<std::int32_t> old_place;
  for (std::int64_t i = 0; i < count_; ++i) {
    if (leaves[i]) continue;
    raw.push_back(grains_[i]);
    old_place.push_back(static_cast<std::int32_t>(i));
  }
  for (std::size_t i = 0; i < e.in.size(); ++i) {
    CheckGrain(e.in[i], i, config_.contacts.materials());
    if (combination_ >= 0 && e.in[i].material != 0) Bad("in: a second material of grains");
    raw.push_back(MakeGrain(e.in[i], config_, first_id + static_cast<std::int32_t>(i)));
    old_place.push_back(-1);
  }
  if (raw.empty()) Bad("no grain would be left");
  const auto all = [&] { return KineticEnergy() + PotentialEnergy() + StoredNow() + inactive_j_; };
  const double before = config_.energy ? all() : 0;
  std::vector<Grain> grains;
  std::vector<std::int32_t> from;
  for (const std::int32_t k : SpatialOrder(raw, config_.frame)) {
    grains.push_back(raw[k]);
    from.push_back(old_place[k]);
  }
  index_of_.resize(first_id + e.in.size(), -1);
  Rearrange(grains, from);
  SetTouches(e, first_id);
  std::vector<std::uint8_t> fresh(count_);
  for (std::int64_t i = 0; i < count_; ++i) fresh[i] = grains_[i].id >= first_id;
  RenewLoads(fresh);
  if (config_.energy) frozen_j_ += before - all();
  return first_id;
}

void World::SetTouches(const GrainExchange& e, std::int32_t first_id) {
  const auto place = [&](std::int32_t n) {
    const std::int32_t id = n >= 0 ? first_id + n : -1 - n;
    if (id < 0 || id >= static_cast<std::int32_t>(index_of_.size()) || index_of_[id] < 0) {
      Bad("touches: " + std::to_string(n) +
          ", expected a grain of `in` or -1 - the id of one here");
    }
    return index_of_[id];
  };
  for (const auto& t : e.touches) list_.SetHistory(place(t.a), place(t.b), t.words.data());
  for (const auto& t : e.body_touches) {
    SetBodyHistory(place(t.a), t.body, t.key, t.words.data());
  }
}

}  // namespace grouser::dem

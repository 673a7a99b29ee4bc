// Grains of a World that freeze, move again, leave and come.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

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
  const std::vector<GrainLoad> before = state_.loads;
  const double dt = state_.config.dt_s;
  const bool energy = state_.config.energy;
  std::vector<Wrench> wrenches;
  for (const BodyEntry& b : state_.bodies) wrenches.push_back(b.wrench);
  const auto sink = std::move(state_.sink);
  state_.sink = nullptr;
  state_.config.dt_s = 0;
  state_.config.energy = false;
  Forces();
  state_.config.dt_s = dt;
  state_.config.energy = energy;
  state_.sink = sink;
  for (std::size_t b = 0; b < wrenches.size(); ++b) state_.bodies[b].wrench = wrenches[b];
  for (std::int64_t i = 0; i < state_.count; ++i) {
    if (!wanted[i]) state_.loads[i] = before[i];
  }
}

/// Energy in the springs of all evaluated contacts, as they stand [J].
double World::StoredNow() {
  // A step of no length leaves every law where it is; on copies all the same.
  PairList copy = state_.list;
  PairView v = View(0);
  copy.Fill(v);
  EnergySums sum;
  KernelsFor(nullptr, state_.combination, true).pairs(v, 0, copy.blocks(), &sum);
  return sum.stored + BodyPass::Stored(state_);
}

std::vector<BodyContact> World::ContactsOf(int b) const { return BodyPass::ContactsOf(state_, b); }

void World::Freeze(const std::vector<std::uint8_t>& frozen) {
  if (static_cast<std::int64_t>(frozen.size()) != state_.count) {
    throw std::invalid_argument("freeze: " + std::to_string(frozen.size()) +
                                " flags, expected one a grain: " + std::to_string(state_.count));
  }
  Start();
  const auto differs = [&](std::int64_t i) { return (frozen[i] != 0) != Frozen(i); };
  bool any = false;
  for (std::int64_t i = 0; i < state_.count && !any; ++i) any = differs(i);
  if (!any) return;
  const double kinetic = state_.config.energy ? KineticEnergy() : 0;
  const double stored = state_.config.energy ? StoredNow() : 0;
  std::vector<std::uint8_t> woken(state_.count, 0);
  for (std::int64_t i = 0; i < state_.count; ++i) {
    Grain& g = state_.grains[i];
    if (g.kind & (kGlued | kMember) || !differs(i)) continue;  // those never move of themselves
    g.kind ^= kFrozen;
    woken[i] = frozen[i] == 0;
    Stop(g);
    state_.loads[i] = GrainLoad{};
    state_.kinetics[i] = AtRest(g);
  }
  state_.idle.assign(state_.grains.size() / kLanes, 1);
  for (std::int64_t i = 0; i < state_.count; ++i) {
    if (!Frozen(i)) state_.idle[i / kLanes] = 0;
  }
  // Pairs of two frozen grains are in no list: a search finds those of grains that move again.
  if (std::find(woken.begin(), woken.end(), 1) == woken.end()) {
    Prune();
  } else {
    Rebuild();
  }
  RenewLoads(woken);  // else the first kick of the woken would be by gravity alone
  if (!state_.config.energy) return;
  state_.frozen_j += kinetic - KineticEnergy();
  state_.inactive_j += stored - StoredNow();
}

/// Puts these grains in place of all, with what belongs to each. from[i]: the
/// old place of grain i, or -1. Ends with a search.
void World::Rearrange(const std::vector<Grain>& grains, const std::vector<std::int32_t>& from) {
  const auto count = static_cast<std::int64_t>(grains.size());
  const std::int64_t padded = (count + kLanes - 1) / kLanes * kLanes;
  std::vector<std::int32_t> place_of(state_.count, -1);
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
    loads[i] = state_.loads[from[i]];
    kinetics[i] = state_.kinetics[from[i]];
  }
  state_.grains = std::move(all);
  state_.loads = std::move(loads);
  state_.kinetics = std::move(kinetics);
  state_.count = count;
  std::fill(state_.index_of.begin(), state_.index_of.end(), -1);
  for (std::int64_t i = 0; i < count; ++i) {
    state_.index_of[state_.grains[i].id] = static_cast<std::int32_t>(i);
    state_.largest_radius = std::max(state_.largest_radius, state_.grains[i].radius);
    state_.smallest_radius = std::min(state_.smallest_radius, state_.grains[i].radius);
  }
  if (!state_.idle.empty()) {
    state_.idle.assign(padded / kLanes, 1);
    for (std::int64_t i = 0; i < count; ++i) {
      if (!Frozen(i)) state_.idle[i / kLanes] = 0;
    }
  }
  BodyPass::Renumber(state_, place_of);
  Rebuild(&place_of);
}

bool MaySort(const SimulationState& w) {
  return w.count > 0 && w.clumps.empty() && w.bonds.empty() && w.idle.empty();
}

bool World::SortDue() const {
  return state_.config.sort_steps > 0 && state_.steps > 0 &&
         state_.steps % static_cast<std::uint64_t>(state_.config.sort_steps) == 0 &&
         MaySort(state_);
}

SortGrid SortGridOf(const SimulationState& w) {
  const Frame& f = w.config.frame;
  const double cell = 4.0 * w.largest_radius;
  const double most = std::min(16383.0, 4 * (8 + std::sqrt(static_cast<double>(w.count))));
  const auto along = [&](double length) {
    return static_cast<std::int32_t>(std::max(1.0, std::min(length / cell, most)));
  };
  return {along(f.length_m), along(f.width_m), f.z_span_m / 4294967296.0 / cell, w.smallest_radius};
}

void World::Sort() {
  if (!MaySort(state_)) return;
  const SortGrid grid = SortGridOf(state_);
  std::vector<std::pair<std::uint64_t, std::int32_t>> order;
  for (std::int64_t i = 0; i < state_.count; ++i) {
    order.push_back({SortKey(grid, state_.grains[i]), static_cast<std::int32_t>(i)});
  }
  std::sort(order.begin(), order.end());  // equal keys: by place
  std::vector<Grain> grains;
  std::vector<std::int32_t> from;
  for (const auto& [key, place] : order) {
    grains.push_back(state_.grains[place]);
    from.push_back(place);
  }
  Rearrange(grains, from);
}

std::int32_t World::Exchange(const GrainExchange& e) {
  if (!state_.clumps.empty() || !state_.bonds.empty()) Bad("clumps or bonds, expected neither");
  Start();
  const auto first_id = static_cast<std::int32_t>(state_.index_of.size());
  std::vector<std::uint8_t> leaves(state_.count, 0);
  for (const std::int32_t id : e.out) {
    if (id < 0 || id >= first_id || state_.index_of[id] < 0) {
      Bad("out: " + std::to_string(id) + ", expected the id of a grain");
    }
    leaves[state_.index_of[id]] = 1;
  }
  std::vector<Grain> raw;
  std::vector<std::int32_t> old_place;
  for (std::int64_t i = 0; i < state_.count; ++i) {
    if (leaves[i]) continue;
    raw.push_back(state_.grains[i]);
    old_place.push_back(static_cast<std::int32_t>(i));
  }
  for (std::size_t i = 0; i < e.in.size(); ++i) {
    CheckGrain(e.in[i], i, state_.config.contacts.materials());
    if (state_.combination >= 0 && e.in[i].material != 0) Bad("in: a second material of grains");
    raw.push_back(MakeGrain(e.in[i], state_.config, first_id + static_cast<std::int32_t>(i)));
    old_place.push_back(-1);
  }
  if (raw.empty()) Bad("no grain would be left");
  const auto all = [&] {
    return KineticEnergy() + PotentialEnergy() + StoredNow() + state_.inactive_j;
  };
  const double before = state_.config.energy ? all() : 0;
  std::vector<Grain> grains;
  std::vector<std::int32_t> from;
  for (const std::int32_t k : SpatialOrder(raw, state_.config.frame)) {
    grains.push_back(raw[k]);
    from.push_back(old_place[k]);
  }
  state_.index_of.resize(first_id + e.in.size(), -1);
  Rearrange(grains, from);
  SetTouches(e, first_id);
  std::vector<std::uint8_t> fresh(state_.count);
  for (std::int64_t i = 0; i < state_.count; ++i) fresh[i] = state_.grains[i].id >= first_id;
  RenewLoads(fresh);
  if (state_.config.energy) state_.frozen_j += before - all();
  return first_id;
}

void World::SetTouches(const GrainExchange& e, std::int32_t first_id) {
  const auto place = [&](std::int32_t n) {
    const std::int32_t id = n >= 0 ? first_id + n : -1 - n;
    if (id < 0 || id >= static_cast<std::int32_t>(state_.index_of.size()) ||
        state_.index_of[id] < 0) {
      Bad("touches: " + std::to_string(n) +
          ", expected a grain of `in` or -1 - the id of one here");
    }
    return state_.index_of[id];
  };
  for (const auto& t : e.touches) state_.list.SetHistory(place(t.a), place(t.b), t.words.data());
  for (const auto& t : e.body_touches) {
    SetBodyHistory(place(t.a), t.body, t.key, t.words.data());
  }
}

}  // namespace grouser::dem

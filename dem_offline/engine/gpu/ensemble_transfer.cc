// Between an ensemble's worlds and its device.
#include <algorithm>

#include "dem_offline/engine/gpu/ensemble.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem::gpu {
namespace {

/// Elements of one slot array at grain i (place within its world).
std::int64_t At(std::int64_t i, std::int64_t s, std::int64_t slots) {
  return EnsembleView::At(i, s, slots);
}

}  // namespace

/// A world's state out of its World; its lists are to be searched for.
void Ensemble::SendWorld(int world) {
  const DeviceState h = worlds_[world]->ExportState();
  const std::int64_t first = layout_.first[world];
  const auto room = static_cast<std::size_t>(layout_.first[world + 1] - first);
  const auto filled = [room](auto values, const auto& with) {
    values.resize(room, with);
    return values;
  };
  memory_.grains.now.Upload(filled(h.grains, PaddingGrain()), first);
  memory_.loads.now.Upload(filled(h.loads, GrainLoad{}), first);
  memory_.kinetics.now.Upload(filled(h.kinetics, Kinetics{}), first);
  std::vector<Found> found;
  for (const Grain& g : h.grains) found.push_back({g.x, g.y, g.z});
  memory_.found.now.Upload(filled(found, Found{}), first);
  sent_energy_[world] = h.energy;
  std::vector<EnergySums> energy(room / kTile);
  energy[0].stored = h.energy.stored;  // until the next step
  memory_.tile_energy.now.Upload(energy, first / kTile);
  const std::vector<PairParams>& params = worlds_[world]->state().params;
  memory_.params.Upload(params, world * static_cast<std::int64_t>(params.size()));
  std::vector<ClumpRecord> clumps;
  for (std::size_t k = 0; k < h.clumps.size(); ++k) {
    clumps.push_back(clumps_[first_clump_[world] + static_cast<std::int64_t>(k)]);
    clumps.back().entry = h.clumps[k];
  }
  memory_.clumps.now.Upload(clumps, first_clump_[world]);
  memory_.clump_around.Upload(
      std::vector<ClumpSurroundings>{ClumpPass::Around(worlds_[world]->state())}, world);
  SendLists(world, h);
  SendBodies(world, h);
  WorldState& s = states_[world];
  s.turn = 0;
  s.stale = s.search = 1;
  s.overflow = 0;
  s.started = h.started;
  s.steps = s.until = static_cast<std::int64_t>(h.steps);
  memory_.states.now.Upload(std::vector<WorldState>{s}, world);
}

/// The pairs with a history, as an inner list of before the search.
void Ensemble::SendLists(int world, const DeviceState& h) {
  const std::int64_t first = layout_.first[world], room = layout_.first[world + 1] - first;
  std::vector<std::int32_t> count(room, 0);
  for (const auto& p : h.pairs) {
    ++count[p.first];
    ++count[p.second];
  }
  const std::int32_t most = *std::max_element(count.begin(), count.end());
  if (most > layout_.sizes.inner_slots) {
    Layout next = layout_;
    next.sizes.inner_slots = most;
    Relayout(next);
    return SendLists(world, h);
  }
  const std::int64_t slots = layout_.sizes.inner_slots;
  std::vector<std::int32_t> partner(room * slots, 0);
  std::vector<float> history(room * slots * words_, 0.0f);
  std::fill(count.begin(), count.end(), 0);
  for (std::size_t n = 0; n < h.pairs.size(); ++n) {
    const auto& p = h.pairs[n];
    for (const bool turned : {false, true}) {
      const std::int32_t own = turned ? p.second : p.first, other = turned ? p.first : p.second;
      const std::int64_t k = count[own]++;
      partner[At(own, k, slots)] = other;
      for (int w = 0; w < words_; ++w) {
        history[At(own, k * words_ + w, slots * words_)] = h.words[n * words_ + w];
      }
    }
  }
  memory_.inner_count[0].now.Upload(count, first);
  memory_.inner_partner[0].now.Upload(partner, first * slots);
  memory_.history[0].now.Upload(history, first * slots * words_);
}

BodyRecord Ensemble::RecordOf(std::size_t number, const DeviceBodyState& h) const {
  const BodyIndex index = layout_.bodies[number];
  const SimulationState& w = worlds_[index.world]->state();
  const BodyEntry& entry = w.bodies[index.number];
  BodyRecord b = {};
  b.body = h.body;
  b.track = h.track;
  b.shape = shapes_[number];
  b.around = BodyPass::Around(w);
  b.frame = w.config.frame;
  b.origin_m = w.config.origin_m;
  b.reach = entry.body.shape.reach;
  b.round = entry.body.shape.round;
  b.world = index.world;
  b.per_grain = layout_.per_grain[number];
  b.capacity = layout_.entries[number];
  b.count[0] = static_cast<std::int32_t>(h.slots.near.size());
  b.search = 1;
  b.first_entry = layout_.first_entry[number];
  b.first_slot = layout_.first_slot[number];
  b.first_tile = layout_.first_tile[number];
  TouchView& t = b.touch;
  const bool free = h.body.motion == BodyMotion::kFree;
  t.free_mass = free ? static_cast<float>(h.body.mass_kg) : 0.0f;
  t.range = w.range;
  t.dt = static_cast<float>(w.config.dt_s);
  t.per_grain = b.per_grain;
  t.words = words_;
  t.material = h.body.material;
  t.materials = w.config.contacts.materials();
  return b;
}

void Ensemble::SendBodies(int world, const DeviceState& h) {
  for (std::size_t k = 0; k < h.bodies.size(); ++k) {
    const DeviceBodyState& from = h.bodies[k];
    const std::size_t b = IndexOf(world, static_cast<int>(k));
    const auto near = static_cast<std::int32_t>(from.slots.near.size());
    if (near > layout_.entries[b]) {
      Layout next = layout_;
      next.entries[b] = RunsFor(near);
      Relayout(next);
    }
    memory_.bodies.now.Upload(std::vector<BodyRecord>{RecordOf(b, from)},
                              static_cast<std::int64_t>(b));
    memory_.near_body[0].now.Upload(from.slots.near, layout_.first_entry[b]);
    memory_.key[0].now.Upload(from.slots.key, layout_.first_slot[b]);
    memory_.word[0].now.Upload(from.slots.words, layout_.first_slot[b] * words_);
  }
}

void Ensemble::Pull(int world) {
  const WorldState& s = states_[world];
  const std::int64_t first = layout_.first[world], room = layout_.first[world + 1] - first;
  const std::int64_t slots = layout_.sizes.inner_slots;
  DeviceState h;
  h.steps = static_cast<std::uint64_t>(s.steps);
  h.started = s.started != 0;
  const std::int32_t count = views_[world].count;
  h.grains = memory_.grains.now.Download(first, count);
  h.loads = memory_.loads.now.Download(first, count);
  h.kinetics = memory_.kinetics.now.Download(first, count);
  const auto near = memory_.inner_count[s.turn].now.Download(first, room);
  const auto partner = memory_.inner_partner[s.turn].now.Download(first * slots, room * slots);
  const auto history =
      memory_.history[s.turn].now.Download(first * slots * words_, room * slots * words_);
  std::vector<float> word(words_);
  for (std::int32_t i = 0; i < count; ++i) {
    for (std::int32_t k = 0; k < near[i]; ++k) {
      const std::int32_t j = partner[At(i, k, slots)];
      if (j < i) continue;
      bool alive = false;
      for (int n = 0; n < words_; ++n) {
        word[n] = history[At(i, k * words_ + n, slots * words_)];
        alive |= word[n] != 0.0f;
      }
      if (!alive) continue;
      h.pairs.push_back({i, j});
      h.words.insert(h.words.end(), word.begin(), word.end());
    }
  }
  for (const ClumpRecord& c :
       memory_.clumps.now.Download(first_clump_[world], worlds_[world]->clumps())) {
    h.clumps.push_back(c.entry);
  }
  h.energy = sent_energy_[world];
  EnergySums since;
  for (const EnergySums& e : memory_.tile_energy.now.Download(first / kTile, room / kTile)) {
    since.Add(e);
  }
  for (int k = 0; k < worlds_[world]->bodies(); ++k) {
    const std::size_t b = IndexOf(world, k);
    const BodyRecord r = memory_.bodies.now.Download(static_cast<std::int64_t>(b), 1)[0];
    const std::int32_t n = r.count[r.turn];
    since.Add(r.energy);
    BodySlots slots;
    slots.per_grain = r.per_grain;
    slots.near = memory_.near_body[r.turn].now.Download(r.first_entry, n);
    slots.key = memory_.key[r.turn].now.Download(r.first_slot, n * r.per_grain);
    slots.words =
        memory_.word[r.turn].now.Download(r.first_slot * words_, n * r.per_grain * words_);
    h.bodies.push_back({r.body, r.track, slots});
  }
  h.energy.AddStep(since);
  worlds_[world]->ImportState(h);
}

void Ensemble::Push(int world) {
  CheckWorld(world);
  views_[world] = ViewOfWorld(world);
  const WorldView& v = views_[world];
  Layout next = layout_;
  next.tiles[world] = std::max(next.tiles[world], TilesFor(v.count) - 2);
  next.cells[world] = std::max(next.cells[world], static_cast<std::int64_t>(v.nx) * v.ny * v.nz);
  if (next.tiles != layout_.tiles || next.cells != layout_.cells) {
    Relayout(next);
  } else {
    SendTables();
  }
  SendWorld(world);
  do {
    memory_.Checkpoint();
    device_.Start(View(), combination_);
  } while (!Fitted());
}

std::vector<Grain> Ensemble::Grains(int world) const {
  return memory_.grains.now.Download(layout_.first[world], views_[world].count);
}
std::vector<GrainLoad> Ensemble::Loads(int world) const {
  return memory_.loads.now.Download(layout_.first[world], views_[world].count);
}
RigidBody Ensemble::BodyOf(int world, int body) const {
  return memory_.bodies.now.Download(static_cast<std::int64_t>(IndexOf(world, body)), 1)[0].body;
}
BodyTrack Ensemble::TrackOf(int world, int body) const {
  return memory_.bodies.now.Download(static_cast<std::int64_t>(IndexOf(world, body)), 1)[0].track;
}

}  // namespace grouser::dem::gpu

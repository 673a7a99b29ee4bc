// Where an ensemble's arrays lie: tables of it for the device, and the move to
// another layout.
#include "dem_offline/engine/gpu/ensemble.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem::gpu {

/// Parts of all bodies, for good.
void Ensemble::SendShapes() {
  std::vector<Part> parts;
  std::vector<Shape::Ring> rings;
  for (const BodyIndex& index : layout_.bodies) {
    const Shape& s = worlds_[index.world]->state().bodies[index.number].body.shape;
    parts.insert(parts.end(), s.parts.begin(), s.parts.end());
    rings.insert(rings.end(), s.rings.begin(), s.rings.end());
  }
  memory_.parts = Buffer<Part>(device_, parts.size());
  memory_.parts.Upload(parts);
  memory_.rings = Buffer<Shape::Ring>(device_, rings.size());
  memory_.rings.Upload(rings);
  memory_.params = Buffer<PairParams>(device_, worlds_.size() * worlds_[0]->state().params.size());
  shapes_.clear();
  std::size_t part = 0, ring = 0;
  for (const BodyIndex& index : layout_.bodies) {
    const Shape& s = worlds_[index.world]->state().bodies[index.number].body.shape;
    shapes_.push_back({memory_.parts.data() + part, memory_.rings.data() + ring,
                       static_cast<std::int32_t>(s.parts.size()),
                       static_cast<std::int32_t>(s.rings.size())});
    part += s.parts.size();
    ring += s.rings.size();
  }
}

/// Clumps, and who belongs to them, for good: no world of an ensemble gains,
/// loses or sorts grains while it has clumps.
void Ensemble::SendMembers() {
  std::vector<ClumpTemplate::Member> members;
  std::vector<std::int32_t> place;
  clumps_.clear();
  for (int n = 0; n < size(); ++n) {
    const SimulationState& w = worlds_[n]->state();
    std::vector<std::int64_t> first_of;
    for (const ClumpTemplate& t : w.templates) {
      first_of.push_back(static_cast<std::int64_t>(members.size()));
      members.insert(members.end(), t.members.begin(), t.members.end());
    }
    for (const ClumpEntry& e : w.clumps) {
      const auto count = static_cast<std::int32_t>(w.templates[e.state.shape].members.size());
      clumps_.push_back(
          {e, n, count, first_of[e.state.shape], static_cast<std::int64_t>(place.size())});
      for (std::int32_t k = 0; k < count; ++k) place.push_back(w.index_of[e.first_id + k]);
    }
  }
  memory_.members = Buffer<ClumpTemplate::Member>(device_, members.size());
  memory_.members.Upload(members);
  memory_.clump_around = Buffer<ClumpSurroundings>(device_, worlds_.size());
  memory_.member_place = Buffer<std::int32_t>(device_, place.size());
  memory_.member_place.Upload(place);
  memory_.clumps.now.Upload(clumps_);
}

void Ensemble::SendClumpOf() {
  if (layout_.clumps == 0) return;
  std::vector<std::int32_t> clump_of(layout_.grains(), -1);
  for (int n = 0; n < size(); ++n) {
    const auto& own = worlds_[n]->state().clump_of;
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(own.size()); ++i) {
      if (i < views_[n].count) clump_of[layout_.first[n] + i] = own[i];
    }
  }
  memory_.clump_of.Upload(clump_of);
}

/// Worlds with the addresses of this allocation, and who owns what.
void Ensemble::SendTables() {
  std::vector<WorldView> views = views_;
  for (std::size_t n = 0; n < views.size(); ++n) {
    WorldView& v = views[n];
    v.first = layout_.first[n];
    v.first_cell = layout_.first_cell[n];
    v.drift.grains = memory_.grains.now.data() + v.first;
    v.drift.loads = memory_.loads.now.data() + v.first;
    v.drift.kinetics = memory_.kinetics.now.data() + v.first;
    v.drift.bounds = memory_.bounds.now.data() + v.first;
  }
  memory_.worlds.Upload(views);
  memory_.world_of_tile.Upload(WorldOfTile(layout_));
  memory_.world_of_cell.Upload(WorldOfCell(layout_));
  memory_.body_of_tile.Upload(BodyOfTile(layout_));
  memory_.body_of_run.Upload(BodyOfRun(layout_));
  SendClumpOf();
}

std::size_t Ensemble::IndexOf(int world, int body) const {
  for (std::size_t b = 0; b < layout_.bodies.size(); ++b) {
    if (layout_.bodies[b].world == world && layout_.bodies[b].number == body) return b;
  }
  throw std::out_of_range("ensemble: body " + std::to_string(body) + " of world " +
                          std::to_string(world));
}

/// The same state in arrays of another layout, to the bit.
void Ensemble::Relayout(const Layout& layout) {
  Layout next = layout;
  next.Place();
  memory_.Relayout(device_, layout_, next, words_);
  layout_ = next;
  std::vector<WorldState> states = memory_.states.now.Download();
  for (WorldState& s : states) s.overflow = 0;
  memory_.states.now.Upload(states);
  std::vector<BodyRecord> bodies = memory_.bodies.now.Download();
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    bodies[n].capacity = next.entries[n];
    bodies[n].first_entry = next.first_entry[n];
    bodies[n].first_slot = next.first_slot[n];
    bodies[n].first_tile = next.first_tile[n];
  }
  memory_.bodies.now.Upload(bodies);
  SendTables();
}

EnsembleView Ensemble::View() {
  EnsembleMemory& m = memory_;
  EnsembleView v = {};
  v.worlds = m.worlds.data();
  v.states = m.states.now.data();
  v.world_count = size();
  v.grains = layout_.grains();
  v.cells = layout_.all_cells();
  v.world_of_tile = m.world_of_tile.data();
  v.world_of_cell = m.world_of_cell.data();
  v.grain = m.grains.now.data();
  v.load = m.loads.now.data();
  v.found = m.found.now.data();
  v.bound = m.bounds.now.data();
  v.reach = m.reach.data();
  v.cell_count = m.cell_count.data();
  v.cell_items = m.cell_items.data();
  v.cell_slots = layout_.sizes.cell_slots;
  v.outer_count = m.outer_count.now.data();
  v.outer_partner = m.outer_partner.now.data();
  v.outer_slots = layout_.sizes.outer_slots;
  v.inner_slots = layout_.sizes.inner_slots;
  v.words = words_;
  v.grain_energy = m.grain_energy.data();
  v.tile_energy = m.tile_energy.now.data();
  v.params = m.params.data();
  const ContactModel& contacts = worlds_[0]->state().config.contacts;
  v.materials = contacts.materials();
  v.layout = contacts.layout();
  v.clumps = m.clumps.now.data();
  v.clump_count = layout_.clumps;
  v.clump_around = m.clump_around.data();
  v.members = m.members.data();
  v.member_place = m.member_place.data();
  v.clump_of = layout_.clumps > 0 ? m.clump_of.data() : nullptr;
  v.bodies = m.bodies.now.data();
  v.body_count = static_cast<std::int32_t>(layout_.bodies.size());
  v.rounds = layout_.rounds();
  for (int r = 0; r <= v.rounds; ++r) v.round_entry[r] = layout_.RoundEntry(r);
  v.body_tiles = layout_.body_tiles();
  v.runs = layout_.all_entries() / kRun;
  v.body_of_tile = m.body_of_tile.data();
  v.body_of_run = m.body_of_run.data();
  v.tile_near = m.tile_near.data();
  v.clear = m.clear.now.data();
  v.touches = m.touches.data();
  v.records = m.records.data();
  v.run_sums = m.run_sums.data();
  v.wheels = m.wheels.now.data();  // null: none
  v.stress = m.stress.now.data();
  for (int k = 0; k < 2; ++k) {
    v.inner_count[k] = m.inner_count[k].now.data();
    v.inner_partner[k] = m.inner_partner[k].now.data();
    v.history[k] = m.history[k].now.data();
    v.near_body[k] = m.near_body[k].now.data();
    v.key[k] = m.key[k].now.data();
    v.word[k] = m.word[k].now.data();
  }
  return v;
}

}  // namespace grouser::dem::gpu

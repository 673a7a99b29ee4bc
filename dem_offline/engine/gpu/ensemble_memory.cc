#include "dem_offline/engine/gpu/ensemble_memory.h"

#include <type_traits>

namespace grouser::dem::gpu {

template <class F>
void EnsembleMemory::ForEachKept(F&& f) {
  f(states);
  f(grains);
  f(loads);
  f(kinetics);
  f(bounds);
  f(found);
  f(outer_count);
  f(outer_partner);
  f(bodies);
  f(clumps);
  f(tile_energy);
  f(clear);
  f(wheels);
  f(stress);
  for (int k = 0; k < 2; ++k) {
    f(inner_count[k]);
    f(inner_partner[k]);
    f(history[k]);
    f(near_body[k]);
    f(key[k]);
    f(word[k]);
  }
}

void EnsembleMemory::Allocate(Device& device, const Layout& l, int words) {
  const auto both = [&](auto& kept, std::int64_t count) {
    using B = std::decay_t<decltype(kept.now)>;
    kept.now = B();
    kept.then = B();
    kept.now = B(device, static_cast<std::size_t>(count));
    kept.then = B(device, static_cast<std::size_t>(count));
  };
  const auto one = [&](auto& buffer, std::int64_t count) {
    using B = std::decay_t<decltype(buffer)>;
    buffer = B();
    buffer = B(device, static_cast<std::size_t>(count));
  };
  const ListSizes& s = l.sizes;
  const std::int64_t n = l.grains(), worlds_count = static_cast<std::int64_t>(l.tiles.size());
  one(worlds, worlds_count);
  one(world_of_tile, n / kTile);
  one(world_of_cell, l.all_cells());
  one(body_of_tile, l.body_tiles());
  one(body_of_run, l.all_entries() / kRun);
  one(cell_count, l.all_cells());
  one(cell_items, l.all_cells() * s.cell_slots);
  one(tile_near, l.body_tiles());
  one(touches, l.all_entries());
  one(reach, n);
  one(records, l.slots());
  one(run_sums, l.all_entries() / kRun);
  both(states, worlds_count);
  both(grains, n);
  both(loads, n);
  both(kinetics, n);
  both(bounds, n);
  both(found, n);
  both(outer_count, n);
  both(outer_partner, n * s.outer_slots);
  one(grain_energy, n);
  for (int k = 0; k < 2; ++k) {
    one(sort_key[k], n);
    one(sort_place[k], n);
  }
  one(sort_wanted, worlds_count);
  both(tile_energy, n / kTile);
  both(clumps, l.clumps);
  one(member_place, l.clump_members);
  one(clump_of, l.clumps > 0 ? n : 0);
  both(bodies, static_cast<std::int64_t>(l.bodies.size()));
  both(clear, l.all_entries());
  for (int k = 0; k < 2; ++k) {
    both(inner_count[k], n);
    both(inner_partner[k], n * s.inner_slots);
    both(history[k], n * s.inner_slots * words);
    both(near_body[k], l.all_entries());
    both(key[k], l.slots());
    both(word[k], l.slots() * words);
  }
}

MemoryPlan PlanOf(const Layout& l, int words) {
  const auto n = static_cast<std::size_t>(l.grains());
  const auto cells = static_cast<std::size_t>(l.all_cells());
  const auto entries = static_cast<std::size_t>(l.all_entries());
  const auto slots = static_cast<std::size_t>(l.slots());
  const ListSizes& s = l.sizes;
  const std::size_t word = sizeof(float);
  const std::size_t state = n * (sizeof(Grain) + sizeof(GrainLoad) + sizeof(Kinetics) +
                                 sizeof(DisplacementBound) + sizeof(Found)) +
                            n / kTile * sizeof(EnergySums);
  const std::size_t bodies =
      l.bodies.size() * sizeof(BodyRecord) + entries * 3 * word + 2 * slots * (1 + words) * word;
  MemoryPlan p;
  const std::size_t sorting = 2 * n * (sizeof(std::uint64_t) + word);
  p.grains = state + sorting + n * (word + sizeof(ContactEnergy)) + n / kTile * word;
  p.lists = n * (3 + s.outer_slots + 2 * s.inner_slots) * word;
  p.histories = 2 * n * s.inner_slots * words * word;
  p.cells = cells * (2 + s.cell_slots) * word;
  p.bodies = bodies + entries * word + slots * sizeof(TouchRecord) +
             entries / kRun * (sizeof(RunSum) + word) + 2 * l.body_tiles() * word;
  const std::size_t clumps = static_cast<std::size_t>(l.clumps) * sizeof(ClumpRecord);
  p.grains += clumps + l.clump_members * word + (l.clumps > 0 ? n * word : 0);
  p.checkpoint = clumps + state + p.lists + p.histories + bodies;
  return p;
}

std::string ToText(const MemoryPlan& p) {
  const auto mib = [](std::size_t bytes) { return std::to_string((bytes + (1u << 20) - 1) >> 20); };
  return mib(p.Total()) + " MiB: grains " + mib(p.grains) + ", lists " + mib(p.lists) +
         ", histories " + mib(p.histories) + ", cells " + mib(p.cells) + ", bodies " +
         mib(p.bodies) + ", checkpoint " + mib(p.checkpoint);
}

void EnsembleMemory::AllocateWheels(Device& device, std::size_t worlds_count, std::size_t bins) {
  wheels.now = Buffer<WheelRecord>(device, worlds_count);
  wheels.then = Buffer<WheelRecord>(device, worlds_count);
  stress.now = Buffer<double>(device, 3 * bins);
  stress.then = Buffer<double>(device, 3 * bins);
}

void EnsembleMemory::Checkpoint() {
  ForEachKept([](auto& a) { a.then.CopyFrom(a.now); });
}
void EnsembleMemory::Restore() {
  ForEachKept([](auto& a) { a.now.CopyFrom(a.then); });
}

}  // namespace grouser::dem::gpu

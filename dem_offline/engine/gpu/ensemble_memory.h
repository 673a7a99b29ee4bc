#pragma once

#include <string>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/gpu/layout.h"
#include "dem_offline/engine/gpu/wheel_body.h"

namespace grouser::dem::gpu {

/// Bytes of a device that an ensemble takes, by what for.
struct MemoryPlan {
  std::size_t grains = 0, lists = 0, histories = 0, cells = 0, bodies = 0, checkpoint = 0;
  std::size_t Total() const { return grains + lists + histories + cells + bodies + checkpoint; }
};
/// Before anything is allocated. words: of one contact's history.
MemoryPlan PlanOf(const Layout& layout, int words);
std::string ToText(const MemoryPlan& plan);

/// An array, and its copy of the last checkpoint.
template <class T>
struct Kept {
  Buffer<T> now, then;
};

/// All arrays of an ensemble on its device.
struct EnsembleMemory {
  void Allocate(Device& device, const Layout& layout, int words);
  /// The same state in arrays of another layout, to the bit; tables have to be sent again.
  void Relayout(Device& device, const Layout& from, const Layout& to, int words);
  void AllocateWheels(Device& device, std::size_t worlds_count, std::size_t bins);
  void Checkpoint();
  void Restore();

  // Tables, and what is made anew in every search.
  Buffer<WorldView> worlds;
  Buffer<PairParams> params;
  Buffer<Part> parts;
  Buffer<Shape::Ring> rings;
  Buffer<std::int32_t> world_of_tile, world_of_cell, body_of_tile, body_of_run;
  Buffer<std::int32_t> cell_count, cell_items, tile_near, touches;
  Buffer<float> reach;
  Buffer<TouchRecord> records;
  Buffer<RunSum> run_sums;
  Buffer<ContactEnergy> grain_energy;
  Buffer<ClumpSurroundings> clump_around;
  Buffer<ClumpTemplate::Member> members;
  Buffer<std::int32_t> member_place, clump_of;
  // Of a sort.
  Buffer<std::uint64_t> sort_key[2];
  Buffer<std::int32_t> sort_place[2];
  Buffer<std::uint8_t> sort_wanted;
  // The state.
  Kept<WorldState> states;
  Kept<Grain> grains;
  Kept<GrainLoad> loads;
  Kept<Kinetics> kinetics;
  Kept<DisplacementBound> bounds;
  Kept<Found> found;
  Kept<std::int32_t> outer_count, outer_partner, inner_count[2], inner_partner[2];
  Kept<float> history[2];
  Kept<BodyRecord> bodies;
  Kept<ClumpRecord> clumps;
  Kept<EnergySums> tile_energy;
  Kept<std::int32_t> near_body[2], key[2];
  Kept<float> word[2], clear;
  Kept<WheelRecord> wheels;  ///< empty: no wheel tests
  Kept<double> stress;

  /// Calls f(array, extent, what it counts as) for every array that the layout sizes.
  template <class F>
  void ForEach(F&& f) {
    constexpr auto kGrains = &MemoryPlan::grains, kLists = &MemoryPlan::lists,
                   kHistories = &MemoryPlan::histories, kCells = &MemoryPlan::cells,
                   kBodies = &MemoryPlan::bodies;
    constexpr auto kInner = &ListSizes::inner_slots;
    f(worlds, Extent{Of::kWorld}, kGrains);
    f(states, Extent{Of::kWorld}, kGrains);
    f(world_of_tile, Extent{Of::kTile}, kGrains);
    f(tile_energy, Extent{Of::kTile}, kGrains);
    f(grains, Extent{Of::kGrain}, kGrains);
    f(loads, Extent{Of::kGrain}, kGrains);
    f(kinetics, Extent{Of::kGrain}, kGrains);
    f(bounds, Extent{Of::kGrain}, kGrains);
    f(found, Extent{Of::kGrain}, kGrains);
    f(reach, Extent{Of::kGrain}, kGrains);
    f(grain_energy, Extent{Of::kGrain}, kGrains);
    f(sort_wanted, Extent{Of::kWorld}, kGrains);
    f(clumps, Extent{Of::kClump}, kGrains);
    f(clump_of, Extent{Of::kClumpGrain}, kGrains);
    f(world_of_cell, Extent{Of::kCell}, kCells);
    f(cell_count, Extent{Of::kCell}, kCells);
    f(cell_items, Extent{Of::kCell, &ListSizes::cell_slots}, kCells);
    f(outer_count, Extent{Of::kGrain}, kLists);
    f(outer_partner, Extent{Of::kGrain, &ListSizes::outer_slots}, kLists);
    f(bodies, Extent{Of::kBody}, kBodies);
    f(body_of_tile, Extent{Of::kBodyTile}, kBodies);
    f(tile_near, Extent{Of::kBodyTile}, kBodies);
    f(body_of_run, Extent{Of::kRun}, kBodies);
    f(run_sums, Extent{Of::kRun}, kBodies);
    f(touches, Extent{Of::kEntry}, kBodies);
    f(clear, Extent{Of::kEntry}, kBodies);
    f(records, Extent{Of::kSlot}, kBodies);
    for (int k = 0; k < 2; ++k) {
      f(sort_key[k], Extent{Of::kGrain}, kGrains);
      f(sort_place[k], Extent{Of::kGrain}, kGrains);
      f(inner_count[k], Extent{Of::kGrain}, kLists);
      f(inner_partner[k], Extent{Of::kGrain, kInner}, kLists);
      f(history[k], Extent{Of::kGrain, kInner, true}, kHistories);
      f(near_body[k], Extent{Of::kEntry}, kBodies);
      f(key[k], Extent{Of::kSlot}, kBodies);
      f(word[k], Extent{Of::kSlot, nullptr, true}, kBodies);
    }
  }
};

}  // namespace grouser::dem::gpu

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

 private:
  template <class F>
  void ForEachKept(F&& f);
};

}  // namespace grouser::dem::gpu

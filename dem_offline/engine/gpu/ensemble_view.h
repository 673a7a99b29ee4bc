#pragma once

#include <cstdint>

#include "dem_offline/engine/contact/contact_body.h"
#include "dem_offline/engine/core/drift_kernel.h"
#include "dem_offline/engine/world/clump_body.h"
#include "dem_offline/engine/world/sort_key.h"
#include "dem_offline/engine/world/touch_body.h"

// Many independent worlds side by side, as plain arrays: what the bodies of
// gpu/*_body.h see on a card, and in the emulation on one CPU thread.

namespace grouser::dem::gpu {

/// Grains of one world fill whole tiles; slots of a tile interleave, so that
/// neighbouring threads touch neighbouring words.
inline constexpr int kTile = 32;
/// Outer neighbours that one grain can have while they are put in order.
inline constexpr int kMostOuter = 96;
/// Grains near a body are summed run by run, as World does.
inline constexpr int kRun = 64;
/// Bodies of one world.
inline constexpr int kMostBodies = 8;

/// One world's numbers; nothing of it depends on its batch-mates.
struct WorldView {
  std::int64_t first;  ///< place of its first grain in the arrays of all, whole tiles
  std::int32_t count;
  DriftView drift;  ///< its part of the arrays
  float range, half_skin, room, search_reach;
  float gravity[3], inertia_factor;
  bool energy;  ///< books its channels
  std::int64_t first_cell;
  SortGrid sort;
  std::int32_t nx, ny, nz, z_low;
  double z_scale;  ///< [cells per quantum]
};

enum Overflow : std::int32_t { kCellsFull = 1, kOuterFull = 2, kInnerFull = 4, kBodyFull = 8 };
/// Beside those of DriftFault: a grain is nearly through a body; a body has left
/// the frame.
inline constexpr std::int32_t kThroughBody = 8, kBodyAway = 16;

/// What changes from step to step for a whole world.
struct WorldState {
  std::int32_t fault;     ///< bits of DriftFault; stays
  std::int32_t halted;    ///< by a fault of a step before
  std::int32_t stale;     ///< the inner list has to be renewed
  std::int32_t search;    ///< and the outer list
  std::int32_t overflow;  ///< bits of Overflow; stays
  std::int32_t turn;      ///< which of the two inner lists is in use
  std::int32_t started;   ///< velocities are of the half step
  std::int32_t rebuilds, prunes;
  std::int32_t called;        ///< for the host; waits until it has looked
  std::int64_t steps, until;  ///< waits there
};

/// One body of one world.
struct BodyRecord {
  RigidBody body;
  BodyTrack track;
  TouchView touch;  ///< of this step
  ShapeView shape;
  BodySurroundings around;
  Frame frame;
  Vec3d origin_m;
  double reach;
  bool round;
  std::int32_t world, per_grain;
  std::int32_t capacity, count[2], turn;  ///< grains near it, in two lists by turns
  std::int32_t search;
  EnergySums energy;                                 ///< of its contacts, since it was sent
  std::int64_t first_entry, first_slot, first_tile;  ///< into the arrays of entries, slots, tiles
};

/// One clump of one world.
struct ClumpRecord {
  ClumpEntry entry;
  std::int32_t world, members;
  std::int64_t first_shape;   ///< into EnsembleView::members: of its template
  std::int64_t first_member;  ///< into EnsembleView::member_place
};

/// What a run of grains did to a body.
struct RunSum {
  Wrench wrench;
  EnergySums energy;
};

/// A place at the last search.
struct Found {
  std::int32_t x, y, z;
};

struct WheelRecord;

struct EnsembleView {
  WorldView* worlds;
  WorldState* states;
  std::int32_t world_count;
  std::int64_t grains, cells;         ///< of all, padded
  const std::int32_t* world_of_tile;  ///< [grains / kTile]
  const std::int32_t* world_of_cell;  ///< [cells]
  Grain* grain;
  GrainLoad* load;
  Found* found;  ///< [grains]
  DisplacementBound* bound;
  float* reach;
  std::int32_t *cell_count, *cell_items;  ///< [cells], [cells x cell_slots]
  std::int32_t cell_slots;
  std::int32_t *outer_count, *outer_partner;  ///< by gap; places within the world
  std::int32_t outer_slots;
  std::int32_t *inner_count[2], *inner_partner[2];
  float* history[2];  ///< [slot x words] as the lower place sees it
  std::int32_t inner_slots, words;
  const PairParams* params;  ///< [worlds x materials x materials]
  std::int32_t materials;
  WordLayout layout;
  ContactEnergy* grain_energy;  ///< [grains] of contacts whose lower place it is, in this step
  EnergySums* tile_energy;      ///< [grains / kTile] since the world was sent
  // Clumps.
  ClumpRecord* clumps;
  std::int64_t clump_count;
  const ClumpSurroundings* clump_around;  ///< [worlds]
  const ClumpTemplate::Member* members;
  const std::int32_t* member_place;  ///< of each clump's members, within its world
  const std::int32_t* clump_of;      ///< [grains] -1: none; null: no clumps at all
  // Bodies, those of the same number in their worlds together: two bodies of one
  // world touch its grains one after the other.
  BodyRecord* bodies;
  std::int32_t body_count, rounds;
  std::int64_t round_entry[kMostBodies + 1];  ///< [rounds + 1] entries of a round
  std::int64_t body_tiles, runs;
  const std::int32_t *body_of_tile, *body_of_run;
  std::int32_t* tile_near;              ///< [body tiles] grains near; then the first of them
  std::int32_t *near_body[2], *key[2];  ///< [entries] place, rising; [slots]
  float* word[2];                       ///< [slots x words]
  float* clear;                         ///< [entries]
  std::int32_t* touches;                ///< [entries] records written in this step
  TouchRecord* records;                 ///< [slots]
  RunSum* run_sums;                     ///< [runs]
  /// [grains] place that a grain had when its world was sorted just now, for the
  /// lists of before; null: where it is.
  const std::int32_t* was;
  WheelRecord* wheels;  ///< [worlds]; null: no wheel tests
  double* stress;       ///< [bins x 3] of each world

  GROUSER_HD const PairParams* ParamsOf(std::int32_t world) const {
    return params + static_cast<std::int64_t>(world) * materials * materials;
  }
  /// Slot s of grain i of `slots` a grain.
  static GROUSER_HD std::int64_t At(std::int64_t i, std::int64_t s, std::int64_t slots) {
    return (i / kTile * slots + s) * kTile + i % kTile;
  }
};

}  // namespace grouser::dem::gpu

#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/world/simulation_state.h"
#include "dem_offline/engine/world/sort_key.h"

// The parts of a step that act on grains and bodies, clumps or bonds, and how grains come in.

namespace grouser::dem {

struct TouchView;

/// Bodies: search, forces, motion.
struct BodyPass {
  static void Find(SimulationState& w, BodyEntry& b);
  static void FindAll(SimulationState& w);
  static void Forces(SimulationState& w);
  static double Stored(const SimulationState& w);  ///< energy in the contacts' springs [J]
  /// The contacts of body `number` as they are now; no history changes.
  static std::vector<BodyContact> ContactsOf(const SimulationState& w, int number);
  static void Renumber(SimulationState& w, const std::vector<std::int32_t>& place_of);
  static void Move(SimulationState& w);      ///< before the forces; searches where needed
  static void StepBack(SimulationState& w);  ///< velocities of time zero to the half step before
  static ContactFn ContactOf(int combination);
  static BodySurroundings Around(const SimulationState& w);

 private:
  struct Sums;
  static void TouchEntry(SimulationState& w, BodyEntry& b, int number, const TouchView& view,
                         std::size_t k, Sums& sums);
};

struct ClumpPass {
  static void Add(SimulationState& w, const Contents& c, std::vector<GrainState>* grains);
  static void Index(SimulationState& w);   ///< after sorting
  static void Gather(SimulationState& w);  ///< loads of the members to the clumps
  static void Move(SimulationState& w);    ///< kick, drift, members follow
  static ClumpSurroundings Around(const SimulationState& w);
  static void StepBack(SimulationState& w);
  static double Kinetic(const SimulationState& w);
};

struct BondPass {
  static void Add(SimulationState& w, const Contents& c);
  static void Turn(SimulationState& w);    ///< orientations follow the spins
  static void Forces(SimulationState& w);  ///< adds to the loads
  static std::vector<BondLoad> Loads(const SimulationState& w);
  static double CriticalStep(
      const SimulationState& w);  ///< a tenth of the least LeapfrogLimit of a bond
};

/// Whether the order in memory may change: no clumps, bonds or frozen grains.
bool MaySort(const SimulationState& w);
/// Columns in which World::Sort and a device put the grains in order.
SortGrid SortGridOf(const SimulationState& w);

/// What a drift needs beside the grains' arrays.
DriftView DriftNumbers(const SimulationState& w);

/// Throws std::invalid_argument "grain I: field: got, expected ...".
void CheckGrain(const GrainState& s, std::size_t i, int materials);
Grain MakeGrain(const GrainState& s, const WorldConfig& config, std::int32_t id);
/// Fills the last tile: no size, never moves.
Grain PaddingGrain();
/// Places in memory: by class of size (factors of two), in space within each,
/// so that neighbours lie near one another. Not empty.
std::vector<std::int32_t> SpatialOrder(const std::vector<Grain>& raw, const Frame& frame);

}  // namespace grouser::dem

#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dem_offline/engine/contact/pair_list.h"
#include "dem_offline/engine/core/drift_kernel.h"
#include "dem_offline/engine/world/clump_body.h"
#include "dem_offline/engine/world/rigid_body.h"
#include "dem_offline/engine/world/team.h"
#include "dem_offline/engine/world/world_types.h"

namespace grouser::dem {

/// Grains near one body, in rising order, each with a few slots for contacts.
struct BodySlots {
  int per_grain = 1;
  std::vector<std::int32_t> near;
  std::vector<std::int32_t> key;  ///< [near x per_grain]; -1: free
  std::vector<float> words;       ///< [near x per_grain x words]
  std::vector<float> clear;  ///< [near] way that grain and body may go before they can touch [m]
};

struct BodyEntry : BodyTrack {
  Body body;
  BodySlots slots;
};

struct BondEntry {
  std::int32_t a = 0, b = 0;  ///< places in memory
  int law = 0;
  bool intact = true;
  Vec3d arm_a, arm_b, axis_a, axis_b;  ///< grain frames
  Quatd rest;                          ///< relative orientation at rest
  double area = 0, bending = 0, polar = 0, radius = 0, length = 0;
  double stored = 0;
};

using ContactFn = ContactResult (*)(const WorldConfig&, const PairParams&, const ContactGeometry&,
                                    float* words, float dt);

/// All of one simulation, as plain data: World and its passes change it, a device copies it.
/// Grains by place in memory unless it says id.
struct SimulationState {
  explicit SimulationState(const WorldConfig& c) : config(c), team(c.threads) {}

  WorldConfig config;
  Team team;
  std::int64_t count = 0;  ///< grains; arrays are padded to whole tiles
  std::vector<Grain> grains;
  std::vector<GrainLoad> loads;
  std::vector<Kinetics> kinetics;
  std::vector<std::int32_t> index_of;       ///< [id]; -1: gone
  std::vector<DisplacementBound> bounds;    ///< since the inner list was last pruned
  std::vector<float> reaches;               ///< radius and displacement bound [m]
  std::vector<DisplacementBound> found_at;  ///< since the last search; no length
  std::vector<std::uint8_t> idle;           ///< [tiles] no grain moves there; empty: none idle
  PairList list;
  std::vector<PairParams> params;  ///< [materials x materials]
  /// Of the pair kernel; -1, the generic path, where grains are of several materials.
  int combination = -1;

  std::vector<BodyEntry> bodies;
  std::function<void(const BodyContact&)> sink;
  ContactFn contact = nullptr;
  std::vector<ClumpTemplate> templates;
  std::vector<ClumpEntry> clumps;
  std::vector<std::int32_t> clump_of;  ///< [grains]; empty: no clumps
  std::vector<BondLaw> bond_laws;
  std::vector<BondEntry> bonds;
  /// [grains] partners of bonds that replace the contact; empty: no bonds
  std::vector<std::vector<std::int32_t>> bonded;
  std::vector<std::uint8_t> turns;  ///< [grains] has a bond: its orientation counts
  std::vector<Quatd> orientation;   ///< [grains]; empty: no bonds
  BondStatistics bond_statistics;

  bool started = false;      ///< velocities are of the half step
  bool stale = true;         ///< a search is due
  bool inner_stale = false;  ///< the inner list has to be pruned
  bool timing = false;
  Phases phases;
  double frozen_j = 0;    ///< taken out by Freeze and Exchange
  double inactive_j = 0;  ///< stored by pairs of two frozen grains
  EnergySums energy, step_energy;
  std::vector<EnergySums> chunk_energy;
  StepFault fault = StepFault::kNone;
  float drag = 1.0f;
  float largest_radius = 0, smallest_radius = 0, range = 0;  ///< [m]
  double earlier_s = 0;  ///< what time is beyond steps times the time step
  std::uint64_t steps = 0, rebuilds = 0;
};

}  // namespace grouser::dem

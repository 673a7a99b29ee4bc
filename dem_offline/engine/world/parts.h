#pragma once

#include <vector>

#include "dem_offline/engine/world/clump_body.h"
#include "dem_offline/engine/world/team.h"
#include "dem_offline/engine/world/world.h"

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

struct TouchView;

struct World::Parts {
  explicit Parts(int threads) : team(threads) {}
  Team team;
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
  std::vector<EnergySums> chunk_energy;
};

/// Bodies: search, forces, motion.
struct BodyPass {
  static void Find(World& w, BodyEntry& b);
  static void FindAll(World& w);
  static void Forces(World& w);
  static double Stored(const World& w);  ///< energy in the contacts' springs [J]
  static void Renumber(World& w, const std::vector<std::int32_t>& place_of);
  static void Move(World& w);      ///< before the forces; searches where needed
  static void StepBack(World& w);  ///< velocities of time zero to the half step before
  static ContactFn ContactOf(int combination);
  static BodySurroundings Around(const World& w);

 private:
  struct Sums;
  static void TouchEntry(World& w, BodyEntry& b, int number, const TouchView& view, std::size_t k,
                         Sums& sums);
};

struct ClumpPass {
  static void Add(World& w, const Contents& c, std::vector<GrainState>* grains);
  static void Index(World& w);   ///< after sorting
  static void Gather(World& w);  ///< loads of the members to the clumps
  static void Move(World& w);    ///< kick, drift, members follow
  static ClumpSurroundings Around(const World& w);
  static void StepBack(World& w);
  static double Kinetic(const World& w);
};

struct BondPass {
  static void Add(World& w, const Contents& c);
  static void Turn(World& w);                  ///< orientations follow the spins
  static void Forces(World& w);                ///< adds to the loads
  static double CriticalStep(const World& w);  ///< a tenth of the least LeapfrogLimit of a bond
};

/// Throws std::invalid_argument "grain I: field: got, expected ...".
void CheckGrain(const GrainState& s, std::size_t i, int materials);
Grain MakeGrain(const GrainState& s, const WorldConfig& config, std::int32_t id);
/// Fills the last tile: no size, never moves.
Grain PaddingGrain();
/// Places in memory: by class of size (factors of two), in space within each,
/// so that neighbours lie near one another. Not empty.
std::vector<std::int32_t> SpatialOrder(const std::vector<Grain>& raw, const Frame& frame);

}  // namespace grouser::dem

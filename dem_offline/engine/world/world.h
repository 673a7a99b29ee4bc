#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dem_offline/engine/isa/kernels.h"
#include "dem_offline/engine/world/device_state.h"
#include "dem_offline/engine/world/simulation_state.h"

namespace grouser::dem {

/// One independent simulation. Leapfrog: velocities live at half steps.
/// Bitwise repeatable, whatever the number of threads.
class World {
 public:
  /// Throws std::invalid_argument with the field, what it got and what was
  /// expected; with a guard, also for a step above the critical one.
  World(const WorldConfig& config, const Contents& contents);
  World(const WorldConfig& config, const std::vector<GrainState>& grains);

  /// Advances by one step. After a fault further calls do nothing.
  StepFault Step();
  StepFault Run(std::int64_t steps);
  StepFault fault() const { return state_.fault; }
  /// Forces at the present positions; then sets velocities back by half a step
  /// so that they are of time zero. Called by the first Step if not before.
  void Start();

  int AddBody(const Body& body);
  /// Pose and motion may be changed between steps.
  Body& body(int b) { return state_.bodies.at(b).body; }
  const Body& body(int b) const { return state_.bodies.at(b).body; }
  int bodies() const { return static_cast<int>(state_.bodies.size()); }
  /// Lets go of a body that was moved or held: from now on it is kFree, with the velocity and spin
  /// that it has. Throws as AddBody does for a body without mass.
  void Release(int b);
  const Wrench& wrench(int b) const { return state_.bodies.at(b).wrench; }
  /// Called for each body contact of every step while set.
  void RecordContacts(std::function<void(const BodyContact&)> sink) {
    state_.sink = std::move(sink);
  }

  std::int64_t count() const { return state_.count; }
  double time_s() const {
    return state_.earlier_s + static_cast<double>(state_.steps) * state_.config.dt_s;
  }
  GrainState State(std::int64_t i) const;  ///< by place in memory; velocities at the present time
  GrainState StateOf(std::int32_t id) const;  ///< by id; throws std::out_of_range
  const std::vector<Grain>& grains() const { return state_.grains; }
  const std::vector<GrainLoad>& loads() const { return state_.loads; }
  const GrainLoad& LoadOf(std::int32_t id) const { return state_.loads[state_.index_of[id]]; }
  std::int64_t clumps() const { return static_cast<std::int64_t>(state_.clumps.size()); }
  ClumpState Clump(std::int64_t c) const;
  const BondStatistics& bond_statistics() const { return state_.bond_statistics; }
  bool BondIntact(std::int64_t b) const { return state_.bonds.at(b).intact; }
  const PairList& list() const { return state_.list; }
  PairList& list() { return state_.list; }
  const WorldConfig& config() const { return state_.config; }

  /// History of a grain's contact with a body part, for tiles; null: none.
  const float* BodyHistory(std::int64_t i, int body, std::int32_t key) const;
  void SetBodyHistory(std::int64_t i, int body, std::int32_t key, const float* words);

  /// Velocities are multiplied by this every step (preparation only).
  void SetDrag(double factor_per_step) { state_.drag = static_cast<float>(factor_per_step); }
  void SetVelocity(std::int32_t id, Vec3d velocity, Vec3d spin);
  void SetGravity(Vec3d gravity_m_per_s2) { state_.config.gravity_m_per_s2 = gravity_m_per_s2; }
  void SetContacts(const ContactModel& contacts);  ///< same laws, other numbers
  /// Another time step from here on; velocities are moved to its half step. Throws
  /// std::invalid_argument as the constructor does.
  void SetTimeStep(double dt_s);
  void SetEnergy(bool on) { state_.config.energy = on; }

  /// Takes grains out and puts grains in (velocities as given; no clumps or
  /// bonds in the world). Histories of pairs that stay are kept, those given
  /// are set where the pair is within the skin. Returns the id of the first new
  /// grain; ids are never used again. Throws std::invalid_argument.
  std::int32_t Exchange(const GrainExchange& exchange);
  /// Grains with a flag stop and are left out of all work: pairs of two of them
  /// keep their history, unevaluated; they hold up others like glued ones. The
  /// others are active (from rest, where they were frozen). [count()] by place.
  void Freeze(const std::vector<std::uint8_t>& frozen);
  bool Frozen(std::int64_t i) const { return (state_.grains[i].kind & kFrozen) != 0; }

  /// Memory in the order of space; ends with a search. No forces change, sums
  /// over bodies and energies may be rounded otherwise after it. Worlds with clumps,
  /// bonds or frozen grains keep their order.
  void Sort();
  /// Whether a sort is due before the step that follows.
  bool SortDue() const;

  /// The state for another back end, and back from it with the same grains and
  /// bodies; then a search. Throws std::invalid_argument.
  DeviceState ExportState() const;
  void ImportState(const DeviceState& state);

  void SetTiming(bool on) { state_.timing = on; }
  const Phases& phases() const { return state_.phases; }
  /// Bytes that one step reads and writes, each array counted once a pass.
  double BytesPerStep() const;
  std::int64_t pairs_listed() const { return state_.list.inner_pairs(); }

  double KineticEnergy() const;    ///< [J], grains and clumps, at the present time
  double PotentialEnergy() const;  ///< [J], zero at the frame's origin
  /// Dissipation channels summed since the start; `stored` is the present one.
  const EnergySums& energy() const { return state_.energy; }
  EnergyBalance Balance() const;  ///< needs config.energy
  double MeanContacts() const;    ///< contacts with grains and bodies per grain
  /// Overlap over the smaller radius of all present grain-grain contacts.
  std::vector<float> OverlapRatios() const;
  /// The least CriticalStepOf (laws/time_step.h) of a grain, at this overlap over its
  /// radius, or of an intact bond.
  double CriticalStep(double overlap_ratio) const;
  std::uint64_t steps() const { return state_.steps; }
  std::uint64_t rebuilds() const { return state_.rebuilds; }
  std::uint64_t regrowths() const { return state_.list.regrowths(); }
  /// FNV-1a over positions, velocities, spins and histories: equal bits, equal hash.
  std::uint64_t Hash() const;

  /// All there is of the world; what a device copies.
  const SimulationState& state() const { return state_; }

 private:
  void Construct(const Contents& contents);
  StepFault Drift();
  void Forces();
  void PairForces();
  void Prune();
  bool SetBounds();
  void StepAllBack();
  Kinetics AtRest(const Grain& g) const;
  void Rebuild(const std::vector<std::int32_t>* place_of = nullptr);
  void CheckGuard() const;
  void Rearrange(const std::vector<Grain>& grains, const std::vector<std::int32_t>& from);
  void SetTouches(const GrainExchange& exchange, std::int32_t first_id);
  PairView View(double dt_s);
  double StoredNow();
  void RenewLoads(const std::vector<std::uint8_t>& wanted);

  SimulationState state_;
};

/// Rayleigh time [s]: pi R sqrt(rho/G)/(0.1631 nu + 0.8766). The time step is
/// a fraction (0.1-0.3) of that of the smallest grain.
double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio);

}  // namespace grouser::dem

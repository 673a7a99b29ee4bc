#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/contact/bond.h"
#include "dem_offline/engine/contact/pair_list.h"
#include "dem_offline/engine/core/grain.h"
#include "dem_offline/engine/isa/kernels.h"
#include "dem_offline/engine/laws/contact_model.h"
#include "dem_offline/engine/world/device_state.h"
#include "dem_offline/engine/world/rigid_body.h"
#include "dem_offline/engine/world/sort_key.h"
#include "dem_offline/engine/world/stepper.h"

namespace grouser::dem {

namespace gpu {
class Ensemble;
}

struct WorldConfig {
  Frame frame;                 ///< x, y periodic; see there
  Vec3d origin_m = {0, 0, 0};  ///< of the frame, in the user's coordinates
  Vec3d gravity_m_per_s2 = {0, 0, -9.81};
  double dt_s = 1e-4;
  double skin_m = 0;  ///< of the Verlet lists; 0: 0.2 largest radius
  ContactModel contacts;
  double inertia_factor = 0.4;  ///< I/(m r^2): 0.4 spheres, 0.5 discs
  bool planar = false;          ///< no motion along y, no spin but about y
  bool energy = false;          ///< integrate the energy channels
  int threads = 1;              ///< same bits for any number
  /// Refuse steps above World::CriticalStep at `guard_overlap` of the radius. 0: no guard.
  double guard_overlap = 0.0;
  std::int64_t first_pairs = 0;  ///< capacity of the lists to begin with; 0: ample
  /// Every so many steps grains are put in the order of space again, as World::Sort
  /// does: worth it where soil mixes. 0: never.
  std::int64_t sort_steps = 0;
  /// Makes the steps of Step and Run; null: these cores do.
  std::shared_ptr<Stepper> stepper;
};

/// One grain, as somebody outside sees it (SI, user's coordinates).
struct GrainState {
  double x_m, y_m, z_m, radius_m, density_kg_per_m3;
  double v_x = 0, v_y = 0, v_z = 0, w_x = 0, w_y = 0, w_z = 0;
  int material = 0;
  bool glued = false;  ///< keeps its velocity (0: fixed in space) whatever pushes
  double mass_kg = 0;  ///< 0: from the density of a sphere (discs: set it)
};

/// All that a world starts with. Ids: grains in order, then clump members.
struct Contents {
  std::vector<GrainState> grains;
  std::vector<ClumpTemplate> templates;
  std::vector<ClumpState> clumps;
  std::vector<BondLaw> bond_laws;
  std::vector<BondState> bonds;
  std::vector<Body> bodies;
};

/// One contact of a body, for whoever records stresses (world axes).
struct BodyContact {
  int body;
  Vec3f point;  ///< relative to the origin [m]
  Vec3f force;  ///< on the body [N]
  std::int32_t part;
  bool rim;
};

/// What went wrong in a step; the world stops there.
enum class StepFault : int { kNone, kNonFinite, kTooFast, kTunnelled, kOverlap };
const char* Explain(StepFault fault);

/// Where the energy is [J]. Total = kinetic + potential + stored + dissipated
/// + frozen - body_work is constant but for the integrator's error.
struct EnergyBalance {
  double kinetic = 0, potential = 0, stored = 0;
  double normal_damping = 0, tangent_damping = 0, slip = 0, rolling = 0, plastic = 0, cohesion = 0,
         bonds = 0;
  double body_work = 0;  ///< done by moving bodies on the grains
  double frozen = 0;     ///< taken out by Freeze and Exchange (kinetic, potential, stored)
  double Dissipated() const {
    return normal_damping + tangent_damping + slip + rolling + plastic + cohesion + bonds;
  }
  double Total() const { return kinetic + potential + stored + Dissipated() + frozen - body_work; }
};

/// Wall time by phase [s], summed over the steps since SetTiming(true).
struct Phases {
  double search_s = 0;  ///< outer lists and bodies
  double prune_s = 0;   ///< inner lists
  double pairs_s = 0, sum_s = 0, drift_s = 0;
  double bodies_s = 0;  ///< bodies, bonds, clumps
  std::uint64_t prunes = 0;
};

/// Grains out and grains in, between two steps; see World::Exchange.
struct GrainExchange {
  std::vector<std::int32_t> out;  ///< ids that leave
  std::vector<GrainState> in;
  /// History of a pair as `a` sees it. a, b >= 0: index into `in`; < 0: -1 - id
  /// of a grain that stays.
  struct Touch {
    std::int32_t a = 0, b = 0;
    std::array<float, kMaxHistoryWords> words = {};
  };
  struct BodyTouch {
    std::int32_t a = 0;  ///< index into `in`
    int body = 0;
    std::int32_t key = 0;
    std::array<float, kMaxHistoryWords> words = {};
  };
  std::vector<Touch> touches;
  std::vector<BodyTouch> body_touches;
};

/// One independent simulation. Leapfrog: velocities live at half steps.
/// Bitwise repeatable, whatever the number of threads.
class World {
 public:
  /// Throws std::invalid_argument with the field, what it got and what was
  /// expected; with a guard, also for a step above the critical one.
  World(const WorldConfig& config, const Contents& contents);
  World(const WorldConfig& config, const std::vector<GrainState>& grains);
  ~World();

  /// Advances by one step. After a fault further calls do nothing.
  StepFault Step();
  StepFault Run(std::int64_t steps);
  StepFault fault() const { return fault_; }
  /// Forces at the present positions; then sets velocities back by half a step
  /// so that they are of time zero. Called by the first Step if not before.
  void Start();

  int AddBody(const Body& body);
  Body& body(int b);  ///< pose and motion may be changed between steps
  const Body& body(int b) const;
  int bodies() const;
  const Wrench& wrench(int b) const;
  double body_work_j(int b) const;  ///< done by the body on the grains
  /// Called for each body contact of every step while set.
  void RecordContacts(std::function<void(const BodyContact&)> sink);

  std::int64_t count() const { return count_; }
  double time_s() const { return static_cast<double>(steps_) * config_.dt_s; }
  GrainState State(std::int64_t i) const;  ///< by place in memory; velocities at the present time
  GrainState StateOf(std::int32_t id) const;  ///< by id; throws std::out_of_range
  const std::vector<Grain>& grains() const { return grains_; }
  const std::vector<GrainLoad>& loads() const { return loads_; }
  const GrainLoad& LoadOf(std::int32_t id) const { return loads_[index_of_[id]]; }
  std::int64_t clumps() const;
  ClumpState Clump(std::int64_t c) const;
  const BondStatistics& bond_statistics() const;
  bool BondIntact(std::int64_t b) const;
  const PairList& list() const { return list_; }
  PairList& list() { return list_; }
  const WorldConfig& config() const { return config_; }

  /// History of a grain's contact with a body part, for tiles; null: none.
  const float* BodyHistory(std::int64_t i, int body, std::int32_t key) const;
  void SetBodyHistory(std::int64_t i, int body, std::int32_t key, const float* words);

  /// Velocities are multiplied by this every step (preparation only).
  void SetDrag(double factor_per_step) { drag_ = static_cast<float>(factor_per_step); }
  void SetVelocity(std::int32_t id, Vec3d velocity, Vec3d spin);
  void SetGravity(Vec3d gravity_m_per_s2) { config_.gravity_m_per_s2 = gravity_m_per_s2; }
  void SetContacts(const ContactModel& contacts);  ///< same laws, other numbers
  void SetEnergy(bool on) { config_.energy = on; }

  /// Takes grains out and puts grains in (velocities as given; no clumps or
  /// bonds in the world). Histories of pairs that stay are kept, those given
  /// are set where the pair is within the skin. Returns the id of the first new
  /// grain; ids are never used again. Throws std::invalid_argument.
  std::int32_t Exchange(const GrainExchange& exchange);
  /// Grains with a flag stop and are left out of all work: pairs of two of them
  /// keep their history, unevaluated; they hold up others like glued ones. The
  /// others are active (from rest, where they were frozen). [count()] by place.
  void Freeze(const std::vector<std::uint8_t>& frozen);
  bool Frozen(std::int64_t i) const { return (grains_[i].kind & kFrozen) != 0; }

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

  void SetTiming(bool on) { timing_ = on; }
  const Phases& phases() const { return phases_; }
  /// Bytes that one step reads and writes, each array counted once a pass.
  double BytesPerStep() const;
  std::int64_t pairs_listed() const { return list_.inner_pairs(); }
  std::int64_t pairs_touching() const;

  double KineticEnergy() const;    ///< [J], grains and clumps, at the present time
  double PotentialEnergy() const;  ///< [J], zero at the frame's origin
  /// Dissipation channels summed since the start; `stored` is the present one.
  const EnergySums& energy() const { return energy_; }
  EnergyBalance Balance() const;  ///< needs config.energy
  double MeanContacts() const;    ///< contacts with grains and bodies per grain
  /// Overlap over the smaller radius of all present grain-grain contacts.
  std::vector<float> OverlapRatios() const;
  /// The least CriticalStepOf (laws/time_step.h) of a grain, at this overlap over its
  /// radius, or of an intact bond.
  double CriticalStep(double overlap_ratio) const;
  std::uint64_t steps() const { return steps_; }
  std::uint64_t rebuilds() const { return rebuilds_; }
  std::uint64_t regrowths() const { return list_.regrowths(); }
  /// FNV-1a over positions, velocities, spins and histories: equal bits, equal hash.
  std::uint64_t Hash() const;

 private:
  struct Parts;  // bodies, clumps, bonds and threads, in files of their own
  friend class gpu::Ensemble;
  friend struct BodyPass;
  friend struct ClumpPass;
  friend struct BondPass;

  void Construct(const Contents& contents);
  StepFault Drift();
  void Forces();
  void PairForces();
  void Prune();
  bool SetBounds();
  Kinetics AtRest(const Grain& g) const;
  void Rebuild(const std::vector<std::int32_t>* place_of = nullptr);
  void CheckGuard() const;
  void Rearrange(const std::vector<Grain>& grains, const std::vector<std::int32_t>& from);
  void SetTouches(const GrainExchange& exchange, std::int32_t first_id);
  PairView View(double dt_s);
  double StoredNow();
  void RenewLoads(const std::vector<std::uint8_t>& wanted);
  bool MaySort() const;
  SortGrid GridForSort() const;

  WorldConfig config_;
  std::int64_t count_ = 0;
  std::vector<Grain> grains_;
  std::vector<GrainLoad> loads_;
  std::vector<Kinetics> kinetics_;
  std::vector<std::int32_t> index_of_;       ///< [id]; -1: gone
  std::vector<DisplacementBound> bounds_;    ///< since the inner list was last pruned
  std::vector<float> reaches_;               ///< radius and displacement bound [m]
  std::vector<DisplacementBound> found_at_;  ///< since the last search; no length
  std::vector<std::uint8_t> idle_;           ///< [tiles] no grain moves there; empty: none idle
  PairList list_;
  std::vector<PairParams> params_;
  /// Of the pair kernel; -1, the generic path, where grains are of several materials.
  int combination_ = -1;
  std::unique_ptr<Parts> parts_;
  bool started_ = false, stale_ = true, inner_stale_ = false, timing_ = false;
  Phases phases_;
  double frozen_j_ = 0;
  double inactive_j_ = 0;  ///< stored by pairs of two frozen grains
  EnergySums energy_, step_energy_;
  StepFault fault_ = StepFault::kNone;
  float drag_ = 1.0f;
  float largest_radius_ = 0, smallest_radius_ = 0, range_ = 0;
  std::uint64_t steps_ = 0, rebuilds_ = 0;
};

/// Rayleigh time [s]: pi R sqrt(rho/G)/(0.1631 nu + 0.8766). The time step is
/// a fraction (0.1-0.3) of that of the smallest grain.
double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio);

}  // namespace grouser::dem

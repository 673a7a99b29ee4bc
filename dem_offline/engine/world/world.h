#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "dem_offline/engine/bodies/wheel_body.h"
#include "dem_offline/engine/contact/neighbour_list.h"
#include "dem_offline/engine/contact/pair_kernel.h"
#include "dem_offline/engine/world/grain.h"

namespace grouser::dem {

struct WorldConfig {
  Frame frame;
  double gravity_m_per_s2 = 9.81;  ///< along -z
  double dt_s = 1e-4;
  double skin_m = 0;               ///< of the Verlet lists
  HertzMindlinEpsd::Params grain_grain;
  HertzMindlinEpsd::Params grain_floor;
  HertzMindlinEpsd::Params grain_wheel;
  double floor_z_m = -1e9;
  bool energy = false;             ///< integrate the energy channels
};

/// One grain, as somebody outside sees it (SI, world frame).
struct GrainState {
  double x_m, y_m, z_m, radius_m, density_kg_per_m3;
  double v_x = 0, v_y = 0, v_z = 0, w_x = 0, w_y = 0, w_z = 0;
};

/// Force and moment of the grains on the wheel, at its centre [N, N m], world
/// axes; summed in double in a fixed order.
struct Wrench {
  double fx = 0, fy = 0, fz = 0, tx = 0, ty = 0, tz = 0;
};

/// One contact of the wheel, for whoever records stresses (wheel frame).
struct WheelContact {
  Vec3f point;  ///< relative to the centre [m]
  Vec3f force;  ///< on the wheel [N]
  bool on_rim;  ///< not on a closed side
};

/// What went wrong in a step; the world stays as it was found.
enum class StepFault { kNone, kNonFinite, kTooFast, kTunnelled };

/// One independent simulation: grains in a box that is periodic in x and y,
/// over a floor, with at most one wheel. Leapfrog: velocities live at half
/// steps. Single-threaded; bitwise repeatable.
class World {
 public:
  World(const WorldConfig& config, const std::vector<GrainState>& grains);

  /// Advances by one step. After a fault further calls do nothing.
  StepFault Step();
  /// Forces at the present positions; then sets velocities back by half a step
  /// so that they are of time zero. Called by the first Step if not before.
  void Start();

  WheelBody& wheel() { return wheel_; }
  void EnableWheel(const WheelBody& wheel);
  const Wrench& wrench() const { return wrench_; }
  /// Called for each wheel contact of every step while set.
  void RecordWheelContacts(std::function<void(const WheelContact&)> sink) { sink_ = std::move(sink); }

  std::int64_t count() const { return count_; }
  GrainState State(std::int64_t i) const;  ///< velocities at the present time; x, y in the first period
  const std::vector<Grain>& grains() const { return grains_; }
  const std::vector<GrainLoad>& loads() const { return loads_; }
  const NeighbourList& list() const { return list_; }
  NeighbourList& list() { return list_; }
  std::vector<ContactHistory>& floor_history() { return floor_.history; }
  const WorldConfig& config() const { return config_; }

  /// Velocities are multiplied by this every step (preparation only).
  void SetDrag(double factor_per_step) { drag_ = static_cast<float>(factor_per_step); }
  void SetGrainParams(const HertzMindlinEpsd::Params& p) { config_.grain_grain = p; }
  void SetEnergy(bool on) { config_.energy = on; }

  double KineticEnergy() const;    ///< [J], grains, at the present time
  double PotentialEnergy() const;  ///< [J], grains, zero at z = 0
  /// Dissipation channels summed since the start; `stored` is the present one.
  const EnergySums& energy() const { return energy_; }
  double floor_work() const { return 0.0; }  ///< the floor does not move
  double MeanContacts() const;     ///< grain-grain and floor contacts per grain
  std::uint64_t steps() const { return steps_; }
  std::uint64_t rebuilds() const { return rebuilds_; }
  /// Overlap over the smaller radius of all present grain-grain contacts.
  std::vector<float> OverlapRatios() const;

 private:
  struct BodyContacts {
    std::vector<std::int32_t> near;  ///< grains that may touch
    std::vector<ContactHistory> history;
  };

  StepFault Drift();
  void Forces();
  void Rebuild();
  void FindWheelNeighbours();
  void FloorForces();
  void WheelForces();
  void Apply(std::int32_t i, const ContactResult& r, Vec3f n, float lever);
  void Count(const ContactResult& r);

  WorldConfig config_;
  std::int64_t count_ = 0;
  std::vector<Grain> grains_;
  std::vector<GrainLoad> loads_;
  std::vector<std::int32_t> reference_;  ///< [3 n] positions at the last rebuild
  NeighbourList list_;
  BodyContacts floor_, wheel_contacts_;
  WheelBody wheel_;
  bool has_wheel_ = false, started_ = false, stale_ = true;
  double wheel_margin_m_ = 0, wheel_moved_m_ = 0;
  Wrench wrench_;
  std::function<void(const WheelContact&)> sink_;
  EnergySums energy_, step_energy_;
  StepFault fault_ = StepFault::kNone;
  float drag_ = 1.0f;
  float largest_radius_ = 0;
  std::uint64_t steps_ = 0, rebuilds_ = 0;
};

/// Rayleigh time [s]: pi R sqrt(rho/G)/(0.1631 nu + 0.8766). The time step is
/// a fraction (0.1-0.3) of that of the smallest grain.
double RayleighTime(double radius_m, double density_kg_per_m3, double youngs_modulus_pa,
                    double poisson_ratio);

}  // namespace grouser::dem

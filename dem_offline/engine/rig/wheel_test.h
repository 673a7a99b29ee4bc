#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/shape.h"
#include "dem_offline/engine/laws/settings.h"

namespace grouser::dem {

/// One size class of the grain mixture.
struct SizeBin {
  double diameter_m = 0.008;
  double mass_fraction = 1.0;  ///< [-]; the bins sum to 1
};

/// Grain-scale description of a soil. `contact` names the laws, of grains
/// among themselves and on floor and wheel alike, and their numbers at each.
struct GrainSoil {
  double density_kg_per_m3 = 2290.0;  ///< of the grain material
  double youngs_modulus_pa = 1e7;
  double poisson_ratio = 0.3;     ///< [-]
  double restitution = 0.5;       ///< grain-grain [-], (0, 1]
  double friction = 0.5;          ///< grain-grain [-]
  double rolling_friction = 0.1;  ///< mu_r [-]
  ContactChoice contact;
  double solid_fraction = 0.58;    ///< target of the settled tile [-]
  double gravity_m_per_s2 = 9.81;  ///< magnitude, along -z
  std::vector<SizeBin> sizes;      ///< at least one
};

/// A rigid wheel: cylinder of radius r and width b with closed sides,
/// axle along y. r is also the reference radius of slip.
struct WheelShape {
  double radius_m = 0.0625;
  double width_m = 0.05;
  double restitution = 0.5;       ///< grain-wheel [-]
  double friction = 0.4;          ///< grain-wheel [-]
  double rolling_friction = 0.1;  ///< grain-wheel EPSD [-]
  std::vector<Tread> treads;      ///< grousers, teeth, lugs; none: smooth
};

enum class RigMode { kRimSpeed, kTowed, kFreeSlip };

/// What is held. slip = (r w - v_x)/max(|r w|, V); see DESIGN "Wheel state".
struct TestState {
  RigMode mode = RigMode::kRimSpeed;
  double slip = 0.0;              ///< [-], kRimSpeed only
  double attack_angle_rad = 0.0;  ///< atan2(v_y, v_x); kRimSpeed, kTowed
  double load_n = 24.0;           ///< constant vertical load, > 0
  double drawbar_n = 0.0;         ///< kFreeSlip: pull to overcome along x
};

/// Which bed a wheel runs on. All start from the same tile.
enum class SceneBed {
  kPeriodic,  ///< one tile, closed on itself: a run ends where the wheel would meet its own track
  kFull,      ///< as many tiles in a row as the wheel can travel: the reference
  kWindow,    ///< a frame that follows the wheel and is fed with virgin soil in front
};

/// How much of the bed is worked on. The defaults simulate everything; with
/// `kWindow`, `freeze` and `largest_step` only what the scene needs.
struct SceneSettings {
  SceneBed bed = SceneBed::kPeriodic;
  double window_length_m = 0;  ///< 0: by the rule of its distance from the wheel
  double window_ahead = 0.5;   ///< share of the window in front of the hub
  bool freeze = false;         ///< stop grains that rest, away from the wheel
  double freeze_box = 2.5;     ///< never within this many half-sizes of the wheel from its hub [-]
  double freeze_speed = 0.01;  ///< at rest: slower than this share of rig.speed [-]
  int look_steps = 100;        ///< steps between looks of window and freezing
  bool largest_step = false;   ///< time step by LargestStep (scaling.h), not rayleigh_fraction
};

struct RigSettings {
  double bed_length_m = 0.28;                   ///< x, periodic
  double bed_width_m = 0.20;                    ///< y, periodic
  double bed_depth_m = 0.10;                    ///< undisturbed depth above the floor
  double speed_m_per_s = 0.1;                   ///< max(|r w|, V)
  double max_time_s = 3.0;                      ///< simulated, after touch-down
  double rayleigh_fraction = 0.2;               ///< dt over the Rayleigh time [-]
  double target_relative_error = 0.02;          ///< stop: SE(F_x), SE(F_y) <= this * load
  double stress_bin_rad = 0.08726646259971647;  ///< 5 degrees
  int width_bins = 5;
  SceneSettings scene;
};

/// The two ends of the choice, for comparisons.
SceneSettings EverythingSimulated();
SceneSettings OnlyWhatIsNeeded();

struct WheelTestSpec {
  GrainSoil soil;
  WheelShape wheel;
  RigSettings rig;
  TestState state;
  std::uint64_t seed = 1;  ///< a seed is a new tile
};

/// A settled bed, periodic in x and y, cut flat at z = 0 (the undisturbed
/// plane; floor at -depth), at rest, with its contact history. Plain arrays so
/// that anybody can store it.
struct Tile {
  double length_m = 0, width_m = 0, depth_m = 0;
  std::vector<float> radius_m;         ///< [n]
  std::vector<std::int32_t> position;  ///< [3 n], fixed point, x y z per grain
  std::vector<float> velocity;         ///< [3 n] m/s
  std::vector<float> spin;             ///< [3 n] rad/s
  /// Contacts: first[n+1] into the flat arrays below. Partner: id, or a
  /// negative body number.
  std::vector<std::int32_t> contact_first;
  std::vector<std::int32_t> contact_partner;
  std::vector<float> contact_history;  ///< [history words of the laws, per contact]
  double solid_fraction = 0, coordination = 0, preparation_friction = 0;
  double overlap_p99_over_radius = 0;
};

/// Why a run ended.
enum class StopCause {
  kTimeUp,    ///< max_time_s
  kPrecise,   ///< the stopping rule (steady.h) was met
  kBedEnd,    ///< the wheel came to ground that it has disturbed, or to the edge of its window
  kOverload,  ///< sinkage beyond 0.7 of the radius
  kFault,     ///< physics or numbers
  kCaller,    ///< the progress function said so
};
const char* Explain(StopCause cause);

/// What a scene cost: grains times steps.
struct SceneUse {
  double particle_steps = 0;        ///< of all grains present
  double awake_particle_steps = 0;  ///< of those not frozen
  double deep_particle_steps = 0;   ///< of those awake in the lower half of the bed
};

enum class RunStatus { kSteady, kUnsteady, kOverload, kFailed };

struct OutputMean {
  std::string name;           ///< f_x f_y f_z torque m_z sinkage slip
  double mean = 0;            ///< N, N m, m, -
  double standard_error = 0;  ///< block-averaged
  double drift = 0;           ///< second minus first half of the window
  double fluctuation = 0;     ///< standard deviation of the series
};

struct RuleCheck {
  std::string name;
  double value = 0, limit = 0;
  bool kept = false;
};

struct EnergyLedger {
  double input_j = 0, kinetic_j = 0, potential_j = 0, elastic_j = 0;
  double normal_damping_j = 0, tangential_damping_j = 0, slip_j = 0, rolling_j = 0;
  double plastic_j = 0, cohesion_j = 0;  ///< plastic work; necks and bridges made and broken
  double frozen_j = 0;  ///< taken by freezing, and by soil exchanged at the window's seam
  double residual_j = 0;
};

/// Time series, one entry per sample (wrench on the wheel, contact frame).
struct Series {
  std::vector<double> time_s, f_x_n, f_y_n, f_z_n, torque_n_m, m_z_n_m, sinkage_m, v_x_m_per_s,
      rim_speed_m_per_s, travel_m;
};

/// See StressProfile in proto/grouser/v1alpha1/run.proto.
struct StressProfile {
  double first_angle_rad = 0, angle_step_rad = 0;
  int width_bins = 0;
  std::vector<double> normal_pa, shear_tangential_pa, shear_axial_pa;
  double entry_angle_rad = 0, exit_angle_rad = 0;
};

struct SurfaceProfile {
  double x_first_m = 0, y_first_m = 0, step_m = 0;
  int nx = 0, ny = 0;
  std::vector<double> height_m;  ///< [nx * ny], NaN: no grain
};

struct WheelTestResult {
  RunStatus status = RunStatus::kFailed;
  std::string reason;
  StopCause stopped = StopCause::kTimeUp;
  double slip = 0, attack_angle_rad = 0, v_x_m_per_s = 0, v_y_m_per_s = 0, rim_speed_m_per_s = 0;
  std::vector<OutputMean> outputs;
  double window_start_s = 0, window_end_s = 0;
  int blocks = 0;
  double travel_m = 0;          ///< in the window: the longer of the hub's path and the rim's
  double contact_length_m = 0;  ///< at the window's mean sinkage
  std::vector<RuleCheck> rules;
  EnergyLedger energy;
  Series series;
  StressProfile stress;
  SurfaceProfile surface;
  // Bed and numbers.
  std::uint64_t grains = 0, steps = 0, list_rebuilds = 0;
  double mean_diameter_m = 0, bulk_density_kg_per_m3 = 0;
  double dt_s = 0, rayleigh_time_s = 0, particle_steps = 0, wall_s = 0, quantum_m = 0;
  double overlap_mean_over_radius = 0, overlap_p99_over_radius = 0, overlap_max_over_radius = 0,
         inertial_number = 0;
  SceneUse use;
};

/// Called now and then; return false to stop (the run then FAILs as
/// "stopped by caller"). `fraction` in [0, 1].
using ProgressFn = std::function<bool(double fraction, const std::string& stage)>;

/// Throws std::invalid_argument "field: value, expected ..." on a bad spec.
void ValidateSpec(const WheelTestSpec& spec);

/// The part of a spec that determines a tile (state and wheel do not).
/// Deterministic in (soil, rig bed sizes, rayleigh_fraction, seed).
Tile PrepareTile(const WheelTestSpec& spec, const ProgressFn& progress);

/// Sets the wheel down, runs until steady or max_time_s, reports. Never
/// throws for physics: that becomes status and reason.
WheelTestResult RunWheelTest(const WheelTestSpec& spec, const Tile& tile,
                             const ProgressFn& progress);

/// Version that goes into every record; changes when results may change.
const char* EngineVersion();
/// Instruction set in use, e.g. "avx512".
const char* EngineIsa();

}  // namespace grouser::dem

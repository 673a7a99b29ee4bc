#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/shape.h"
#include "dem_offline/engine/rig/bed.h"

namespace grouser::dem {

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

/// What is held. slip = (r w - v_x)/max(|r w|, V); see docs/glossary.md.
struct TestState {
  RigMode mode = RigMode::kRimSpeed;
  double slip = 0.0;              ///< [-], kRimSpeed; else 0
  double attack_angle_rad = 0.0;  ///< atan2(v_y, v_x); kRimSpeed, kTowed; else 0
  double load_n = 24.0;           ///< constant vertical load, > 0
  double drawbar_n = 0.0;         ///< kFreeSlip: pull to overcome along x; else 0
};

/// Which bed a wheel runs on. All start from the same tile.
enum class SceneBed {
  kPeriodic,  ///< one tile, closed on itself: a run ends where the wheel would meet its own track
  kFull,      ///< as many tiles in a row as the wheel can travel: the reference
  kWindow,    ///< a frame that follows the wheel and is fed with virgin soil in front
};

/// How much of the bed is simulated. Defaults: the full domain; `kWindow`, `freeze` and
/// `largest_step` make it the reduced domain.
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

/// How far a wheel goes: paths of its hub on the ground since it was set in motion; 0: by rule
/// (TravelOf).
struct TravelSettings {
  double least_hub_m = 0;  ///< no run is stopped as precise enough before
  /// The stretch whose means are WheelTestResult::equal_travel.
  double compare_from_hub_m = 0, compare_to_hub_m = 0;
};

struct RigSettings {
  double bed_length_m = 0.28;                   ///< x, periodic
  double bed_width_m = 0.20;                    ///< y, periodic
  double bed_depth_m = 0.10;                    ///< undisturbed depth above the floor
  double speed_m_per_s = 0.1;                   ///< max(|r w|, V)
  double max_time_s = 3.0;                      ///< simulated, after touch-down; 0: DriveTime
  double rayleigh_fraction = 0.2;               ///< dt over the Rayleigh time [-]
  double target_relative_error = 0.02;          ///< stop: SE(F_x), SE(F_y) <= this * load
  double stress_bin_rad = 0.08726646259971647;  ///< 5 degrees
  int width_bins = 5;
  double most_sinkage_m = 0;  ///< beyond it a run is an overload; 0: MostSinkage
  TravelSettings travel;
  SceneSettings scene;
};

/// Every switch off, with the whole way of the wheel as bed (kFull); every switch on.
SceneSettings FullDomain();
SceneSettings ReducedDomain();

struct WheelTestSpec {
  GrainSoil soil;
  WheelShape wheel;
  RigSettings rig;
  TestState state;
  std::uint64_t seed = 1;  ///< a seed is a new tile
};

/// Why a run ended.
enum class StopCause {
  kTimeUp,    ///< max_time_s
  kPrecise,   ///< the stopping rule (steady.h) was met
  kBedEnd,    ///< the wheel came to ground that it has disturbed, or to the edge of its window
  kOverload,  ///< sinkage beyond MostSinkage
  kLost,      ///< a free wheel cannot hold its drawbar
  kFault,     ///< physics or numbers
  kCaller,    ///< the progress function said so
};
const char* Explain(StopCause cause);

/// What a scene cost: grains times steps.
struct SceneUse {
  double particle_steps = 0;         ///< of all grains present
  double active_particle_steps = 0;  ///< of those not frozen
  double deep_particle_steps = 0;    ///< of those active in the lower half of the bed
};

/// What became of a run. Only steady runs give the forces of their state.
enum class RunStatus {
  kSteady,    ///< a window without drift, in balance, precise and long enough (steady.h)
  kUnsteady,  ///< ran to its end without such a window
  kOverload,  ///< sinkage beyond MostSinkage
  kFailed,    ///< physics or numbers
  kLost,      ///< a free wheel that cannot hold its drawbar
};
const char* NameOf(RunStatus status);  ///< "steady", ...

struct OutputMean {
  std::string name;           ///< f_x f_y f_z torque m_z sinkage slip
  double mean = 0;            ///< N, N m, m, -
  double standard_error = 0;  ///< block-averaged
  double drift = 0;           ///< second minus first half of the window
  double fluctuation = 0;     ///< standard deviation of the series
};

/// Means over a stretch of the hub's path.
struct EqualTravel {
  double from_hub_m = 0, to_hub_m = 0;
  std::vector<OutputMean> outputs;  ///< none: the run ended before
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
      rim_speed_m_per_s, travel_m, hub_travel_m;
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
  /// UNSTEADY because a free axis accelerates or a mean is too uncertain: the means are
  /// those of no state. (Else UNSTEADY means are those of the last way.)
  bool means_of_no_state = false;
  StopCause stopped = StopCause::kTimeUp;
  double slip = 0, attack_angle_rad = 0, v_x_m_per_s = 0, v_y_m_per_s = 0, rim_speed_m_per_s = 0;
  std::vector<OutputMean> outputs;
  double window_start_s = 0, window_end_s = 0;
  int blocks = 0;
  double travel_m = 0;          ///< in the window: the longer of the hub's path and the rim's
  double contact_length_m = 0;  ///< at the window's mean sinkage
  double hub_travel_m = 0;      ///< since the wheel was set in motion
  EqualTravel equal_travel;
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

/// The bed that a wheel test runs on.
BedSpec BedOf(const WheelTestSpec& spec);

/// What a wheel test takes at most: its own bed of as many tiles, or as long a
/// window, as its scene asks for, over its longest time. Meaningful for a spec
/// whose single numbers are valid.
Work WorkOf(const WheelTestSpec& spec);

/// Soil, bed, wheel and rig of a wheel test, whatever its state. Throws SpecError.
void ValidateRig(const WheelTestSpec& spec, const WorkLimits& limits = {});
/// The whole of it. Throws SpecError; nothing has been allocated by then.
void ValidateSpec(const WheelTestSpec& spec, const WorkLimits& limits = {});

/// Sets the wheel down, runs until steady or max_time_s, reports. Never
/// throws for physics: that becomes status and reason.
WheelTestResult RunWheelTest(const WheelTestSpec& spec, const Tile& tile,
                             const ProgressFn& progress, const WorkLimits& limits = {});

/// The deepest sinkage [m] of a run: rig.most_sinkage_m, or by rule the less of 1.5 radii, up to
/// which the wheel's sides stand above the soil, of 3/4 of the bed's depth, and of that depth less
/// two of the largest grains.
double MostSinkage(const WheelTestSpec& spec);
/// rig.travel with its rules: at least one radius; compared over the last third of that.
TravelSettings TravelOf(const WheelTestSpec& spec);
/// Longest drive [s]: rig.max_time_s, or by rule 1.25 times what the hub takes for the end of its
/// travel at its speed, or at a tenth of the rig's where it is slower.
double DriveTime(const WheelTestSpec& spec);

/// Version that goes into every record; changes when results may change.
const char* EngineVersion();
/// Instruction set in use, e.g. "avx512".
const char* EngineIsa();

}  // namespace grouser::dem

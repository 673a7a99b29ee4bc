#pragma once

/// Motions side by side, one to a lane, as the kernels of each instruction set read and write them.
/// Plain arrays: nothing of the standard library may be compiled once a set (models/number.h).
namespace grouser::vehicle::pack {

inline constexpr int kLanes = 16, kGroup = 8;  // motions; lanes are worked on by groups
inline constexpr int kWheels = 8, kDrives = 8, kUnknowns = 4 + kWheels;

typedef double PerLane[kLanes];
typedef long long Truths[kLanes];  ///< 0 or -1 a lane

/// A vehicle: what is the same for all motions.
struct Body {
  struct Wheel {
    double x, y, radius, per_radius;
    double across, along;                       ///< of Steering: y/L, (x - centre)/L
    double load_by_load, load_by_x, load_by_y;  ///< by the resultant, all wheels down
    int steered;
    int drive;    ///< -1: rolls freely
    int follows;  ///< its drive turns it in proportion to what the steering asks
    int first;    ///< wheel of its drive (itself without one)
  };
  int wheels, edges, steered;
  double mass, centre_x, centre_y, centre_z;
  double middle_x, middle_y, edge_x[kWheels], edge_y[kWheels];  ///< support polygon, see Support
  double per[4];  ///< 1 over the units of the first four rows of the imbalance
  double yaw_inertia;
  Wheel wheel[kWheels];
};

/// Where the unknowns stand; -1: given. v_y is the first.
struct Unknowns {
  int size, v_x, yaw, psi, moment;
  int drive[kDrives], rim[kWheels];
};

/// The wheels' states, and how they change with the unknowns. What is not listed follows from these
/// or is 0.
struct Placed {
  PerLane v_x[kWheels], v_y[kWheels], rim[kWheels], load[kWheels], yaw[kWheels];
  PerLane cos[kWheels], sin[kWheels], steer_slope[kWheels];  ///< of the steer angle; by psi
  PerLane rim_by_psi[kWheels], rim_by_own[kWheels];
  PerLane load_by_v_x[kWheels], load_by_v_y[kWheels], load_by_yaw[kWheels], load_by_moment[kWheels];
};

/// What the models said to them: f_x, f_y, torque, m_z; each its value and derivatives by v_x, v_y,
/// rim speed and load.
struct Felt {
  PerLane part[4][5][kWheels];
  PerLane high[3][kWheels];  ///< ends of the intervals of f_x, f_y, torque
  PerLane sinkage[kWheels];
};

/// All that the kernels know of the motions.
struct alignas(64) Lanes {
  PerLane v_x, yaw, speed, load, gravity_x, gravity_y, acceleration, yaw_up, steering, sds;
  PerLane rim_given[kDrives];
  PerLane unit[kUnknowns];
  PerLane psi_cos, psi_sin;  ///< of steered vehicles, at `at`
  PerLane at[kUnknowns];     ///< tried
  PerLane f_x, f_y, m_z;     ///< that gravity and inertia ask for, at `at`
  PerLane tip_margin;
  Truths rare;  ///< loads need Support::Spread: a wheel is up, or it tips
  Placed placed;
  Felt felt;
  PerLane tried[kUnknowns];             ///< imbalance at `at`, scaled
  PerLane merit, largest;               ///< its sum of squares, its largest entry
  PerLane fresh[kUnknowns][kUnknowns];  ///< its derivatives by the models' gradients, scaled
  // Of the last point that was accepted.
  PerLane last[kUnknowns], residual[kUnknowns], step[kUnknowns];
  PerLane share;
  PerLane jacobian[kUnknowns][kUnknowns], gradients[kUnknowns][kUnknowns];
  /// What the models' gradients leave out (those of their intervals), from the steps.
  PerLane missing[kUnknowns][kUnknowns];
  Truths learning;       ///< worse ground or a draw: `missing` counts
  Truths going, begins;  ///< to be linearised; the first point of an attempt
  Truths least;          ///< no unknown changes the imbalance along itself
  Truths solving;        ///< to be solved for a step
  Truths solved;         ///< ... and were
  Truths stepping;       ///< whose step is new, and to be bounded
  Truths moving;         ///< to be moved along the step
};

/// The work of one round on the first `lanes` lanes, a multiple of kGroup. Every set gives the
/// same bits. In this order:
struct Kernel {
  using Fn = void (*)(const Body&, const Unknowns&, int lanes, Lanes*) noexcept;
  Fn place;      ///< `placed`, `rare` and what gravity and inertia ask for, at `at`
  Fn weigh;      ///< `felt` on ground worse by `sds`; `tried`, `merit`, `largest`, `fresh`
  Fn linearise;  ///< `jacobian`, `gradients`, `missing` and `least` of the lanes `going`
  Fn solve;      ///< jacobian step = residual of the lanes `solving`; sizes that Solves() knows
  Fn move;       ///< bounds the step of the lanes `stepping`, then moves `at` of those `moving`
};
constexpr bool Solves(int size) { return size == 4 || size == 8; }

/// The kernel of an instruction set, null where this machine lacks it; null: the widest there is.
const Kernel* KernelFor(const char* isa) noexcept;

}  // namespace grouser::vehicle::pack

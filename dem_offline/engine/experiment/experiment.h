#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/contact/bond.h"
#include "dem_offline/engine/core/vec3d.h"
#include "dem_offline/engine/experiment/joints.h"
#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/engine/rig/bed.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/world/world_types.h"

// Any experiment as plain structs: grains in a box, bodies with a program of motion, probes. SI,
// radians; x, y from the corner of the box, z = 0 at its floor. Fields are named as in experiment
// files (docs/experiments.md), and so are they in every SpecError.

namespace grouser::dem::experiment {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

struct Material {
  std::string name;
  double density_kg_per_m3 = 0;  ///< of grains; of bodies whose mass is computed
  double youngs_modulus_pa = 0;  ///< 0: rigid
  double poisson_ratio = 0;      ///< [-]
};

/// Numbers of a pair of materials, and the laws by name in which it differs from the experiment.
struct PairProperties {
  std::string a, b;
  double restitution = 0.5, friction = 0.5, rolling_friction = 0;
  InterfaceChoice numbers;
  std::optional<std::string> normal = {}, tangential = {}, rolling = {}, cohesion = {};
};

enum class Side {
  kPeriodic,  ///< what leaves on one side comes in on the other
  kWall,      ///< a wall at either end
  kOpen,      ///< grains whose centre leaves are taken out of the world
};

/// A window that goes along x with a body: a periodic frame that is fed with copies of the prepared
/// bed (rig/window.h).
struct FollowSpec {
  std::string body;     ///< none: the box stands still
  double length_m = 0;  ///< of the window
  double ahead = 0.5;   ///< share of it in front of the body's origin
};

struct BoxSpec {
  double length_m = 0, width_m = 0, height_m = 0;  ///< along x, y, z; nothing rises above
  Side x = Side::kPeriodic, y = Side::kPeriodic;
  std::string material;  ///< of floor and walls
  /// Nothing moves along y: one layer of grains in the plane y = width/2. Solid fractions are
  /// those of areas.
  bool planar = false;
  double disc_thickness_m = 0;  ///< planar: discs of this thickness; 0: spheres
  FollowSpec follow = {};
};

/// An upright block, or the upright cylinder of this radius in its middle, or the annulus that an
/// inner radius leaves of that. In a planar box the axis is along y.
struct Region {
  Vec3d low_m = {0, 0, 0}, high_m = {0, 0, 0};
  double radius_m = 0;  ///< 0: a block
  double inner_radius_m = 0;
};

enum class Filling {
  kBed,        ///< the settled periodic bed of a wheel test (rig/bed.h)
  kPoured,     ///< a loose column over the region that falls at once
  kRained,     ///< layers that come in one after another under the region's top
  kLattice,    ///< a simple cubic lattice in the region
  kListed,     ///< given one by one
  kScattered,  ///< put at random in the region and moved apart until none overlap (scatter.h)
  kPlaced,     ///< at given places
};

/// Grains made of bonded fragments (contact/bond.h, experiment/bonded_grain.h).
struct Bonding {
  double fragment_m = 0;   ///< diameter of the fragments
  int fragments = 0;       ///< of a grain; 0: not bonded
  std::int64_t count = 0;  ///< of bonds in a grain
  double disk_scale = 1;   ///< R_B over the fragments' radius
  /// A bond is dropped where its fragments are farther apart than this times the length of the
  /// grain's longest bond as it was made.
  double largest_distance = 1e300;
  BondLaw law;  ///< but for its largest length
};

/// One group of grains.
struct Grains {
  Filling filling = Filling::kPoured;
  std::string material;
  std::vector<SizeBin> sizes;
  /// Members of a rigid clump in any unit, scaled so that its union has the volume of a sphere of
  /// the drawn diameter; none: spheres. Poured and lattice.
  std::vector<ClumpTemplate::Member> clump;
  Bonding bonds;                ///< poured, lattice, placed; the sizes are those of the grains
  std::vector<Vec3d> places_m;  ///< placed: of centres
  Region region;                ///< poured, rained, lattice
  std::int64_t count = 0;       ///< poured, rained, scattered; lattice: 0 = as many as fit
  /// Scattered: sum of pi d^2/4 over the region seen along its axis; gives the count.
  double areal_fraction = 0;
  double pitch_m = 0;          ///< lattice; 0: 1.02 of the largest diameter
  double speed_m_per_s = 0;    ///< rained: first speed downwards; 0: sqrt(g d)
  double depth_m = 0;          ///< bed
  double solid_fraction = 0;   ///< bed: its target, under its top layer
  BedPreparation preparation;  ///< bed
  TopLayer top;                ///< bed
  std::vector<GrainState> listed;
};

/// What is done to the grains before the bodies come and the program begins.
struct Preparation {
  enum class Kind {
    kSettle,  ///< under gravity with viscous drag until at rest
    kRelax,   ///< the same without drag
    kShake,   ///< floor and walls swing
    kCut,     ///< grains that reach above the height are taken out
    kTurn,    ///< the box, with a lid, is turned over: seen from it, gravity turns
  };
  Kind kind = Kind::kSettle;
  double rest = 1e-6;    ///< settle, relax: at rest below this kinetic energy over sum m g d
  double most_s = 0;     ///< settle, relax: given up and gone on after; 0: by rule
  double friction = -1;  ///< settle, relax, shake: between grains meanwhile; < 0: their own
  double rolling_friction = -1;         ///< the same
  double surface_energy_j_per_m2 = -1;  ///< the same, of jkr laws
  /// settle: met within kFractionTolerance at the end of the whole preparation, which is repeated
  /// with other frictions until then; 0: as it falls
  double solid_fraction = 0;
  Vec3d amplitude_m = {0, 0, 0};  ///< shake
  double frequency_hz = 0;        ///< shake
  double for_s = 0;               ///< shake
  double height_m = 0;            ///< cut; turn: of the lid
  double rate_rad_per_s = 0;      ///< turn
  int turns = 1;                  ///< turn: whole ones
  bool about_x = false;           ///< turn: about x, else about y
};

enum class PartShape {
  kBox,
  kCylinder,
  kTube,
  kDisc,
  kAnnulus,
  kRing,
  kVanes,
  kCone,
  kSphere,
  kWheel,
  kMesh,
  kSpheres,
  kPlane,
};

/// A part of a body, in body coordinates. Its own axis is z before `turn`.
struct PartSpec {
  PartShape shape = PartShape::kBox;
  Vec3d at_m = {0, 0, 0};  ///< of the part's own origin
  Quatd turn = {1, 0, 0, 0};
  Vec3d size_m = {0, 0, 0};  ///< box: full sizes
  double radius_m = 0;       ///< cylinder, tube (inner), disc, cone (base), sphere(s), wheel
  double length_m = 0;       ///< cylinder, tube
  double wall_m = 0;         ///< tube
  double inner_radius_m = 0, outer_radius_m = 0;  ///< annulus, ring, vanes
  double height_m = 0;       ///< ring (from z = 0 up), vanes (from z = 0 down), cone
  double thickness_m = 0;    ///< vanes
  int count = 0;             ///< vanes, spheres
  double ring_radius_m = 0;  ///< spheres: of the circle of their centres, about y
  double shaft_radius_m = 0, shaft_length_m = 0;  ///< cone; 0: none. Its tip is at z = 0.
  double width_m = 0;                             ///< wheel, along y
  std::vector<Tread> treads;                      ///< wheel
  TriangleSoup mesh;                              ///< mesh, scaled and turned as read
};

/// A step of a body's program: how it moves, until the first of its ends is met. What no
/// step asks for stands still. Directions are of the world.
struct MotionStep {
  std::string verb;  ///< as in files, for messages
  Vec3d velocity_m_per_s = {0, 0, 0};
  Vec3d spin_rad_per_s = {0, 0, 0};
  Vec3d amplitude_m = {0, 0, 0};  ///< shake: displacement A sin(2 pi f t)
  double frequency_hz = 0;
  double ramp_s = 0;  ///< velocity and spin rise as 1/2 - 1/2 cos(pi t/ramp)
  /// A free axis along `direction` (unit): m dv/dt = force + grains' force - m v/damper.
  bool hold = false;
  Vec3d direction = {0, 0, -1};
  double hold_force_n = 0;
  double hold_mass_kg = 0;    ///< 0: that of the dead weight, force/g
  double hold_damper_s = -1;  ///< < 0: sqrt(d/g)/3, none beside a motion; 0: none
  bool free = false;          ///< a rigid body under gravity
  bool about_axle = false;    ///< spin_rad_per_s is in the body's axes, along its own y
  /// A rig's degrees of freedom (freedoms.h): axes of the world that are free with the body's mass
  /// and weight, and its spin about its own y axis; what acts on them beside grains and gravity.
  std::array<bool, 3> free_axes = {false, false, false};
  bool free_spin = false;
  Vec3d applied_force_n = {0, 0, 0};
  double applied_torque_n_m = 0;
  // Ends.
  double for_s = kNever, distance_m = kNever, angle_rad = kNever;
  double force_n = kNever;  ///< against the motion (lower, move) or held
  bool touch = false;
  double rest = 0;         ///< > 0: the grains are at rest, as in Preparation
  std::string until_done;  ///< another body has ended its program
  double most_s = 0;       ///< the run fails where no end is met by then; 0: by rule
};

struct BodySpec {
  std::string name, material;
  std::vector<PartSpec> parts;
  Vec3d position_m = {0, 0, 0};  ///< of the origin of body coordinates
  Quatd turn = {1, 0, 0, 0};
  /// The lowest point so far above the surface; NaN: position_m[2] counts.
  double above_surface_m = std::numeric_limits<double>::quiet_NaN();
  double mass_kg = 0;               ///< 0: from density and parts, where it is needed
  Vec3d centre_m = {0, 0, 0};       ///< of mass, in body coordinates; with mass_kg
  Vec3d inertia_kg_m2 = {0, 0, 0};  ///< about it, principal along the body's axes; with mass_kg
  bool while_preparing = false;     ///< stands there from the beginning
  std::vector<MotionStep> motion;   ///< none: fixed
};

struct Probe {
  enum class Kind {
    kWrench,        ///< of the grains on a body [N, N m], mean over the sample
    kPose,          ///< position, turn since the start, sinkage of its lowest point
    kVelocity,      ///< of a body
    kCoordination,  ///< mean contacts of a grain
    kEnergy,        ///< channels of World::Balance, and the residual
    kRest,          ///< kinetic energy over sum m g d
    kRepose,        ///< angle and height of a heap
    kBins,          ///< solid fraction, velocity, granular temperature in bins
    kSurface,       ///< height of the surface on a grid
    kTreads,        ///< where the treads of a wheel enter and leave, and what flows around it
    kRings,         ///< means over rings of an annulus and over time (rings.h)
    kGrains,        ///< every grain
    kBonds,         ///< how many are left, what broke the others, their forces, pieces
    kBondForces,    ///< table of every bond
    kFragments,     ///< table of every sphere: place, velocity, spin, piece, bodies that it touches
    kTouching,      ///< spheres that touch a body, and their mean distance from its z axis
    kJoint,         ///< coordinates, rates, reaction and gap of a joint
    kSpring,        ///< force and length, or torque and angle
    kMixing,        ///< of fine and coarse grains (mixing.h)
    kRuts,          ///< surface behind a wheel with treads, and its ruts (ruts.h)
  };
  Kind kind = Kind::kWrench;
  std::string name;       ///< of its table
  std::string body;       ///< wrench, pose, velocity, treads, touching, ruts
  std::string of;         ///< joint, spring: its name
  double diameter_m = 0;  ///< mixing: grains below it are fine
  bool body_frame = false;
  Region region;  ///< bins, surface, ruts, repose; repose, cylindrical bins: about its middle
  int n[3] = {1, 1, 1};  ///< bins along x, y, z (cylindrical: radius, turn, z); surface, ruts: x, y
  double every_s = 0;    ///< tables: between two; 0: at the end only. rings: over which a mean goes
  int rings = 1;         ///< rings: of equal width between the radii of the region
  double from_s = 0;     ///< rings: the first mean begins; ruts: the trace begins at the body
};

/// Whether a probe writes a table of its own, beside the series.
inline bool HasTable(const Probe& p) {
  using K = Probe::Kind;
  return p.kind == K::kBins || p.kind == K::kSurface || p.kind == K::kRuts || p.kind == K::kRings ||
         p.kind == K::kGrains || p.kind == K::kBondForces || p.kind == K::kFragments;
}

/// When the grains are drawn; the end is drawn as well where any other time is.
struct FrameSpec {
  double every_s = 0;           ///< from the beginning of the program on; 0: at times_s
  std::vector<double> times_s;  ///< of the program, rising
};

struct Experiment {
  std::string name;
  std::uint64_t seed = 1;
  double gravity_m_per_s2 = 9.81;
  ContactChoice laws;  ///< of interfaces without their own; its wheel and floor: unused
  std::vector<Material> materials;
  std::vector<PairProperties> interfaces;
  BoxSpec box;
  std::vector<Grains> grains;
  std::vector<Preparation> preparation;  ///< none: settle (bed, lattice, listed: none)
  std::vector<BodySpec> bodies;
  std::vector<Joint> joints;
  std::vector<Spring> springs;
  MechanismFn mechanism;      ///< what moves the bodies in joints; none: joints are refused
  std::vector<Probe> probes;  ///< none: wrench, pose, velocity of bodies that move
  double duration_s = 0;      ///< most of the program; 0: as long as it takes
  double sample_s = 0.01;
  FrameSpec frames;
  double checkpoint_every_s = 0;     ///< of the program; 0: none
  double rayleigh_fraction = 0.2;    ///< time step over the Rayleigh time, at most
  double program_step = 1;           ///< time step of the program over that of the preparation
  double overlap = 0.05;             ///< largest overlap over the radius that the step bears
  double largest_speed_m_per_s = 0;  ///< of bodies; checked against step and grain
};

/// What an experiment takes, before anything is allocated.
struct Plan {
  Work work;  ///< as an upper bound
  double dt_s = 0, program_dt_s = 0, rayleigh_time_s = 0;
  double preparation_s = 0, program_s = 0;  ///< simulated, at most
  double preparation_grain_steps = 0, program_grain_steps = 0;
};

/// Throws SpecError for what cannot be, with the field as in files, and for more work than
/// the limits allow; nothing has been allocated by then.
Plan PlanOf(const Experiment& experiment, const WorkLimits& limits = {});

/// Grain-steps a second of one core with these laws, measured on a small dense packing in a
/// fraction of a second.
double MeasureRate(const Experiment& experiment);

/// One table of results: `series` for probes that give numbers, else by the probe's name.
struct Table {
  std::string name;
  std::vector<std::string> columns;
};
/// Rows as they come, from the thread that runs. The columns of a table never change.
using SinkFn = std::function<void(const Table& table, const std::vector<double>& row)>;

struct Result {
  bool done = false;                                                 ///< the program ran to its end
  std::string reason;                                                ///< why not
  std::uint64_t grains = 0, steps = 0, list_rebuilds = 0, left = 0;  ///< left: at open sides
  double particle_steps = 0, wall_s = 0, dt_s = 0, rayleigh_time_s = 0;
  double prepared_s = 0, run_s = 0;  ///< simulated
  double solid_fraction = 0;         ///< of the prepared grains, below the surface
  double top_solid_fraction = 0;     ///< of a bed's top layer; 0: there is none
  /// Frictions that a bed and its top layer settled with; 0: none, or resumed.
  std::array<GrainFriction, 2> packed_with = {};
  double surface_m = 0;  ///< height of the prepared surface
  double level_m = 0;    ///< from which sinkage counts: Ground::level_m
  double coordination = 0, overlap_p99 = 0, overlap_max = 0, quantum_m = 0;
  double energy_residual_j = 0, energy_input_j = 0;  ///< where the energy is probed
};

struct Snapshot;

/// What else a run hands out.
struct RunExtras {
  std::function<void(const Snapshot&)> frame;  ///< at the times of Experiment::frames
  /// Every checkpoint_every_s: all that the rest of the run depends on.
  std::function<void(const std::string& bytes)> checkpoint;
  /// A checkpoint of the same experiment to go on from, to the bit; empty: from the beginning.
  std::string resume;
};

/// Prepares and runs. Throws as PlanOf, SpecError for a solid fraction that cannot be reached, and
/// std::runtime_error where the caller stops it;
/// physics and numbers that fail become `reason`. Deterministic in the experiment.
Result RunExperiment(const Experiment& experiment, const SinkFn& sink, const ProgressFn& progress,
                     const WorkLimits& limits = {}, const RunExtras& extras = {});

}  // namespace grouser::dem::experiment

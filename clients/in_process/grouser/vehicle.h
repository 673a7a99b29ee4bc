#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grouser/model.h"

/// A vehicle in your own process: loads, slips, forces and power of a steady motion, safe speeds
/// along a path, energy, grades, and the constants that skid-steering controllers ask for. What is
/// solved, and how: docs/planning.md. The answers are those of `grouser vehicle` and of the gRPC
/// service VehicleService, bit for bit.
///
/// SI and radians. Axes of ISO 8855: x forward, y to the left, z up; the origin lies on the
/// ground, where the vehicle file puts it.
namespace grouser {

/// Why a motion has no solution, or none to rely on. Bits; 0: solved, within every limit.
enum Reason : std::uint32_t {
  kNoBalance = 1,   ///< no rim speeds and steering balance forces and moments on this ground
  kOverTorque = 2,  ///< a motor's torque, current, voltage or power, or the steering, is exceeded
  kSinksIn = 4,     ///< a wheel sinks deeper than the limit, or the soil carries it nowhere
  kTips = 8,        ///< gravity and inertia meet the ground outside the wheels
  kUntrainedSpeed = 16,  ///< faster than the models' runs: no limit of the ground
  kModelDomain = 32,     ///< outside what the models' runs covered: no limit of the ground
  kBadInput = 64,  ///< the motion is not finite, a wheel has no model of its soil, no such draw
};
/// "BALANCE|TORQUE", ...; "" for none.
GROUSER_PUBLIC std::string NamesOfReasons(std::uint32_t reasons);

/// A solution is one where its residual is at most this [-].
inline constexpr double kBalancedResidual = 1e-6;
/// 1.645: a normal quantity is worse than so many standard deviations one time in twenty.
inline constexpr double kWorseBySd = 1.6448536269514722;

/// n steady motions, structure of arrays. v_x has n entries, or rim_speed n times drives(); every
/// other span has n, or none: 0.
struct Motions {
  /// Given the twist of the origin (its path has the curvature yaw_rate / v_x), rim speeds and
  /// steering are found...
  std::span<const double> v_x{};       ///< [m/s]
  std::span<const double> yaw_rate{};  ///< to the left [rad/s]
  /// ... or given these, the twist is. n times drives(), motion by motion; with it v_x and
  /// yaw_rate are empty.
  std::span<const double> rim_speed{};         ///< r w of each drive [m/s]
  std::span<const double> steering{};          ///< of the vehicle file; with rim_speed alone [rad]
  std::span<const double> acceleration{};      ///< rate of v_x [m/s^2]
  std::span<const double> yaw_acceleration{};  ///< [rad/s^2]
  std::span<const double> grade{};  ///< the ground rises ahead: minus the pitch of ISO 8855 [rad]
  std::span<const double> bank{};   ///< the ground rises to the left: the roll of ISO 8855 [rad]
  /// Ground worse than the models' mean by so many standard deviations, at all wheels at once.
  std::span<const double> worse_by_sd{};
  /// Draw of the ground at all wheels (VehicleSolver::UseDraws), each by its soil; -1: the mean. Of
  /// no such draw: kBadInput.
  std::span<const std::int32_t> draw{};
  /// Index into soils(): n entries, or n times wheels(), motion by motion; none: the first soil.
  std::span<const std::uint8_t> soil{};
};

/// Answers by wheel; each span has n times wheels() entries, motion by motion, or none and costs
/// nothing. Forces of the ground on the wheel, in the wheel's own axes.
struct WheelSpans {
  std::span<double> load{};           ///< [N]
  std::span<double> rim_speed{};      ///< r w [m/s]
  std::span<double> v_x{}, v_y{};     ///< of the hub [m/s]
  std::span<double> slip{};           ///< as of grouser::States [-]
  std::span<double> slip_angle{};     ///< [rad]
  std::span<double> steer{};          ///< from the vehicle's x [rad]
  std::span<double> f_x{}, f_y{};     ///< [N]
  std::span<double> torque{}, m_z{};  ///< [N m]
  std::span<double> sinkage{};        ///< [m]
  std::span<double> shaft_power{};    ///< torque times spin [W]
  std::span<std::uint32_t> flags{};   ///< bits of Flag
};

/// Where the answers of n motions go: each span has n entries, or none and costs nothing. No span
/// may overlap another or the motions.
struct Solutions {
  std::span<std::uint32_t> reasons{};  ///< required, n entries; bits of Reason
  /// Largest imbalance over weight (of moments: over weight times length); NaN for bad input.
  std::span<double> residual{};
  std::span<double> v_x{}, v_y{}, yaw_rate{};  ///< of the origin [m/s], [rad/s]
  std::span<double> side_slip{};               ///< of the centre of gravity [rad]
  std::span<double> steering{};                ///< [rad]
  std::span<double> pitching_moment{};         ///< sum of (r - sinkage) f_x - torque [N m]
  std::span<double> f_x{}, f_y{}, m_z{};       ///< ground on vehicle, at the origin [N], [N m]
  std::span<double> shaft_power{}, electric_power{};  ///< [W]
  std::span<double> tip_margin{};                     ///< 0: about to tip, 1: at the centre [-]
  std::span<double> torque_margin{};   ///< 1 - largest use of a motor or steering limit
  std::span<double> sinkage_margin{};  ///< 1 - largest sinkage over its limit
  std::span<double> rim_speed{};       ///< r w by drive, n times drives() [m/s]
  WheelSpans wheel{};
};

/// Where the power of n motions goes [W]; spans as of Solutions. With T w shaft power, F and M_z in
/// a wheel's axes:
///   rolling = sum (T - r F_x) w
///   slip = sum F_x (r w - v_x)
///   scrub = -sum (F_y v_y + M_z yaw rate)
///   electric = drive + rolling + slip + scrub + grade + acceleration + imbalance
///
/// drive: losses of the motors, electric - shaft. imbalance: what the solve left over.
struct Powers {
  std::span<std::uint32_t> reasons{};  ///< required, n entries
  std::span<double> residual{};        ///< as of Solutions
  std::span<double> electric{}, shaft{}, drive{}, rolling{}, slip{}, scrub{}, grade{},
      acceleration{}, imbalance{};
  /// On ground better and worse by the standard deviations asked for; both NaN: no balance at one.
  std::span<double> electric_low{}, electric_high{};
  /// Electric energy by way of the centre [J/m]; NaN where it does not move.
  std::span<double> joules_per_metre{}, joules_per_metre_low{}, joules_per_metre_high{};
  std::span<double> wheel_shaft{};  ///< n times wheels()
};

/// What must be left of a limit, and whether what the models' runs do not cover counts as one.
struct Margins {
  double tip = 0.1, torque = 0, sinkage = 0;  ///< least ones; tip: 0 to below 1 [-]
  bool trained_only = true;
};

/// n points of a path: 2 or more; s ascends. Spans have n entries, or none: 0.
struct Path {
  std::span<const double> s{};              ///< way along the path, n entries [m]
  std::span<const double> curvature{};      ///< to the left [1/m]
  std::span<const double> grade{}, bank{};  ///< as of Motions [rad]
  std::span<const std::uint8_t> soil{};     ///< of all wheels, index into soils()
};

struct SpeedOptions {
  double speed_limit = 0;           ///< > 0: never faster [m/s]
  double worse_by_sd = kWorseBySd;  ///< ground that the plan must stand; see Motions
  Margins margins{};
  double acceleration = 2, braking = 2;  ///< of comfort, largest; above 0 [m/s^2]
  double start = 0, end = 0;             ///< speeds at the first and the last point [m/s]
};

/// What keeps a point from being driven faster.
enum class Binding : std::uint8_t {
  kSpeedLimit,
  kTraction,
  kLateralGrip,
  kTorque,
  kRollover,
  kSinkage,
  kUntrainedSpeed,  ///< of the models' runs: no limit of the ground
  kModelDomain,     ///< the same
  kAcceleration,
  kBraking,
  kInput  ///< a wheel has no model of the soil
};
/// "SPEED_LIMIT", ...
GROUSER_PUBLIC const char* NameOfBinding(Binding binding) noexcept;

/// Where a plan of n points goes: n entries, or none.
struct SpeedPlan {
  std::span<double> speed{};         ///< of the plan; required, n entries [m/s]
  std::span<double> acceleration{};  ///< [m/s^2]
  std::span<double> safe{};          ///< highest at constant speed; 0: cannot be driven [m/s]
  /// By how much the binding one is exceeded one level of the search (1/256 of the speed limit)
  /// above the safe speed: residual over weight, or the margin that is missing; by the secant of
  /// the margin from the points before where that level was not solved. 0 for kSpeedLimit.
  std::span<double> shortfall{};
  std::span<Binding> safe_binding{}, binding{};  ///< of the safe speed, of the plan
  /// 1: the plan can be driven here with every margin left, and does not rest up to the next point.
  std::span<std::uint8_t> holds{};
};

/// The grades about the level that are driven, to 1e-4 rad, up to 85 degrees.
struct GradeRange {
  bool any = false;         ///< false: none; binding_up says why not the level
  double down = 0, up = 0;  ///< lowest and highest; both of one sign: not the level [rad]
  Binding binding_down = Binding::kSpeedLimit, binding_up = Binding::kSpeedLimit;  ///< beyond
};

/// What a differential-drive controller asks for, of one soil, speed and radius of path. With rim
/// speeds l, r of the sides and their distance b:
///   separation_multiplier = (r - l)/(b yaw rate),  radius_multiplier = 2 v_x/(l + r)
/// low and high: ends of the ground's 90 % interval; both NaN: no balance at one.
struct SkidConstants {
  std::string soil;
  double speed, radius;  ///< [m/s], [m]
  double separation_multiplier, separation_low, separation_high;
  double radius_multiplier, radius_low, radius_high;
  /// Variances of odometry with these multipliers, of the ground alone: (m/s)^2, (rad/s)^2.
  double variance_speed, variance_yaw_rate;
  /// Largest forward force over weight that balances, at the mean ground and 1.645 sd worse.
  double pull_over_weight, pull_low;
  std::uint32_t reasons;
};

/// A wheel as the vehicle file has it. With the steering psi, its length L and centre,
/// (c, s) = (cos psi - sin psi y/L, sin psi (x - centre)/L): a steered wheel points along (c, s).
struct WheelPlace {
  double x_m, y_m;  ///< of its centre, from the origin
  double radius_m;  ///< r of rim speeds r w
  int drive;        ///< index into drive_names(); -1: it rolls freely
  bool steered;
  /// A motor of its own: in a vehicle that steers its rim speed is that of the drive times
  /// hypot(c, s), or c if it is not steered itself. Else all wheels of the drive have its rim speed
  /// (locked), or have it as their mean (differential).
  bool own_motor;
};

/// An immutable vehicle with a model for each wheel type and soil that its file names. Copies share
/// it. Const members may be called from any number of threads at once.
class GROUSER_PUBLIC Vehicle {
 public:
  /// Reads and checks a vehicle file (docs/planning.md); its models are named from its folder.
  /// Throws std::runtime_error "FILE:LINE: key 'a.b': got X, expected Y": also for a model that
  /// cannot be read, is of another wheel, or of another gravity than the others.
  static Vehicle Open(const std::filesystem::path& vehicle_file);

  Vehicle(const Vehicle& other) noexcept;
  Vehicle& operator=(const Vehicle& other) noexcept;
  ~Vehicle();

  const std::string& name() const noexcept;
  double mass_kg() const noexcept;
  double gravity_m_per_s2() const noexcept;
  std::size_t wheels() const noexcept;
  std::size_t drives() const noexcept;
  bool steered() const noexcept;
  /// Names, in the order of every answer by wheel, of every rim speed, of every index of a soil.
  const std::vector<std::string>& wheel_names() const noexcept;
  const std::vector<std::string>& drive_names() const noexcept;
  const std::vector<std::string>& soils() const noexcept;
  /// In the order of wheel_names().
  const std::vector<WheelPlace>& wheel_places() const noexcept;
  double steering_centre_m() const noexcept;  ///< x of the axle that does not steer
  double steering_length_m() const noexcept;  ///< L: tan(psi) = L times curvature
  /// Index of a soil. Throws std::invalid_argument with the nearest name there is.
  std::uint8_t soil(const std::string& name) const;

  /// For each soil, speed and radius in this order. Throws std::invalid_argument where the vehicle
  /// is no skid-steered one, a list is empty, or a number is not finite and above 0.
  std::vector<SkidConstants> Constants(std::span<const double> speeds,
                                       std::span<const double> radii) const;

 private:
  friend class VehicleSolver;
  friend class SpeedPlanner;
  friend class TerrainMap;
  struct Parts;
  explicit Vehicle(std::shared_ptr<const Parts> parts) noexcept;
  std::shared_ptr<const Parts> parts_;
};

/// Solves steady motions of a vehicle. One for each thread: it owns the room that solving needs.
/// After a move, the object that was moved from may only be assigned to, destroyed, or asked
/// (which it then refuses).
///
/// Answers return false, having written nothing, if a span has the wrong size or a number makes no
/// sense for all motions; Problem says which it was. A single bad motion gets kBadInput and harms
/// no other. No allocation, lock or system call.
class GROUSER_PUBLIC VehicleSolver {
 public:
  explicit VehicleSolver(const Vehicle& vehicle);
  VehicleSolver(VehicleSolver&& other) noexcept;
  VehicleSolver& operator=(VehicleSolver&& other) noexcept;
  ~VehicleSolver();

  [[nodiscard]] bool Solve(const Motions& in, const Solutions& out) noexcept;
  /// Power at the mean ground, and at grounds better and worse by `sds` standard deviations.
  [[nodiscard]] bool Energy(const Motions& in, const Powers& out, double sds = kWorseBySd) noexcept;
  /// Probability that a motion leaves every margin: that of ground no worse than the worst on which
  /// it does, from -4 to 4 standard deviations (worse_by_sd of the motions does not count). Where
  /// the models' runs do not cover what decides, `least` counts it as not going and `most` as
  /// going. n entries each.
  [[nodiscard]] bool ProbabilityToGo(const Motions& in, const Margins& margins,
                                     std::span<double> least, std::span<double> most) noexcept;

  /// From now on motions may name one of so many coherent draws of the ground (grouser::Draws, of
  /// each soil by its name in the vehicle file; docs/planning.md, "Draws"); 0: none. A draw of one
  /// of the file's mixtures is that draw of one of its soils. Allocates 6 KiB a draw and soil.
  /// Throws std::invalid_argument for more than Draws::kMost.
  void UseDraws(std::size_t count);
  /// Probability that a motion leaves every margin: the share of the draws on which it does, all
  /// wheels of a soil on the same one (draw and worse_by_sd of the motions do not count); least and
  /// most as of ProbabilityToGo. False also where there are no draws.
  [[nodiscard]] bool ProbabilityByDraws(const Motions& in, const Margins& margins,
                                        std::span<double> least, std::span<double> most) noexcept;

  /// Which span or number makes an answer refuse, e.g. "wheel.load: 8 entries, expected 12 or
  /// none"; empty if none does. Allocates: not for the loop.
  std::string Problem(const Motions& in, const Solutions& out) const;
  std::string Problem(const Motions& in, const Powers& out, double sds = kWorseBySd) const;
  std::string Problem(const Motions& in, const Margins& margins, std::span<const double> least,
                      std::span<const double> most) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Safe speeds and speed plans along paths. One for each thread, as VehicleSolver.
class GROUSER_PUBLIC SpeedPlanner {
 public:
  /// With room for paths of so many points (some 3 KB each).
  SpeedPlanner(const Vehicle& vehicle, std::size_t most_points);
  SpeedPlanner(SpeedPlanner&& other) noexcept;
  SpeedPlanner& operator=(SpeedPlanner&& other) noexcept;
  ~SpeedPlanner();

  /// The highest safe speed at each point, and a plan that can be driven: forward and backward
  /// passes v_2^2 = v_1^2 + 2 a d over what balances, every point solved once more with its speed
  /// and acceleration and slowed down where that does not hold. No allocation, lock or system call.
  /// Returns false, having written nothing, where Problem says something. `not_held`: at how many
  /// points the plan does not hold.
  [[nodiscard]] bool Plan(const Path& path, const SpeedOptions& options, const SpeedPlan& out,
                          std::size_t* not_held = nullptr) noexcept;
  /// As VehicleSolver::UseDraws.
  void UseDraws(std::size_t count);
  /// Of a plan, by `speed` and `acceleration` of Plan for the same path: share of the draws on
  /// which it holds at all points with every margin left, all points of a soil on the same draw;
  /// `by_point`: at each (n entries, or none). As in Plan a start below options.start does not
  /// hold, nor rest up to the next point, nor a point whose `safe` (of Plan; n entries, or none:
  /// not known) is 0. worse_by_sd of the options does not count. False where there are no draws, a
  /// span has the wrong size, a speed is below 0 or a number not finite.
  [[nodiscard]] bool PlanByDraws(const Path& path, const SpeedOptions& options,
                                 std::span<const double> speed,
                                 std::span<const double> acceleration, double* holds,
                                 std::span<double> by_point = {},
                                 std::span<const double> safe = {}) noexcept;
  /// Grades driven straight at constant speed (0: the limit of creeping), on a soil. False where
  /// Problem says something.
  [[nodiscard]] bool Grades(double speed, std::uint8_t soil, double worse_by_sd,
                            const Margins& margins, GradeRange* out) noexcept;

  /// What makes an answer refuse, e.g. "s[3]: 0.2, expected more than that before"; empty if
  /// nothing does. Allocates.
  std::string Problem(const Path& path, const SpeedOptions& options, const SpeedPlan& out) const;
  std::string Problem(double speed, std::uint8_t soil, double worse_by_sd,
                      const Margins& margins) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace grouser

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grouser/model.h"

inline constexpr double kGravity = 9.81;  ///< [m/s^2]

/// Pose in the world [m, rad] and twist in the body frame [m/s, rad/s].
struct Body {
  double x = 0, y = 0, yaw = 0;
  double u = 0, v = 0, r = 0;  ///< forward, to the left, yaw rate
};

/// Rim speeds r w of the wheels of either side [m/s].
struct Control {
  double left = 0, right = 0;
};

/// What one step of one rover cost.
struct StepReport {
  double power_w = 0;       ///< sum of torque times spin of the wheels that drive
  double sinkage_high = 0;  ///< upper end of the interval over the radius, deepest wheel [-]
  double pull_doubt = 0;    ///< half width of the drawbar pull's interval over load, mean [-]
  bool failed = false;      ///< a wheel's soil does not carry it, or an answer is invalid
};

/// A skid-steer rover of 4 or 6 rigid wheels that all point forward: x forward,
/// y left, origin at the middle of the wheels.
///
/// Simplifications: flat virgin ground (a wheel does not run in the rut of the
/// one ahead, although the model's answer would differ there); quasi-static
/// wheel forces (the model's); static loads, no roll or pitch, so no load
/// transfer; rim speeds follow their command at once; no drag but the wheels'.
struct Rover {
  static constexpr int kMostWheels = 6;
  int wheels = 4;
  double radius = 0;                         ///< of the wheels [m]
  double mass = 0, inertia = 0;              ///< [kg], about the vertical [kg m^2]
  double track = 0;                          ///< between left and right wheels [m]
  std::array<double, kMostWheels> x{}, y{};  ///< of the hubs [m]
  std::array<double, kMostWheels> load{};    ///< [N]
  /// How steeply force over load opposes hub speed over rim speed [-], along
  /// and across: of the model, by differences; see WheelBatch::Step.
  double stiffness_x = 0, stiffness_y = 0;

  /// A rover that loads its wheels in the middle of the model's range, with
  /// its centre of gravity a little ahead of the middle:
  ///   load_i = W/n (1 + x_i x_cg / mean(x^2)),
  /// which balances weight and pitching moment with the least sum of squares
  /// (with more than two axles statics alone does not determine it).
  static Rover For(const grouser::Model& model, int wheels);
};

/// Moves many rovers by one step; all their wheels are one batch of the model.
/// Holds its memory, so a step allocates nothing. One for each thread.
class WheelBatch {
 public:
  WheelBatch(const Rover& rover, const grouser::Model& model, std::size_t most_bodies);

  /// Wheel i at (x_i, y_i) has hub velocity v_x = u - r y_i, v_y = v + r x_i.
  /// With the soil's forces on the wheels (F_x, F_y, M_z)_i:
  ///   m (u' - r v) = sum F_x,   m (v' + r u) = sum F_y,
  ///   I r' = sum (x F_y - y F_x + M_z).
  /// Soil makes this stiff (milliseconds), so the step is linearly implicit,
  ///   (m/dt + D) (u_new - u) = sum F_x + m r v, and so on,
  /// D = sum stiffness load / speed a diagonal, fixed stand-in for the Jacobian
  /// (a steep one: stable, but a change of speed takes a few steps longer).
  void Step(double dt, std::span<const Control> controls, std::span<Body> bodies,
            std::span<StepReport> reports);

  /// Spent in Model::Evaluate so far [s], and states asked.
  double model_seconds() const { return model_seconds_; }
  std::int64_t states() const { return states_; }

 private:
  void FillStates(std::span<const Control> controls, std::span<const Body> bodies);
  void Ask(std::size_t states);

  const Rover& rover_;
  const grouser::Model& model_;
  std::vector<double> v_x_, v_y_, rim_, load_;  // wheel i of body k at i n + k
  std::vector<double> f_x_, f_y_, m_z_, torque_, pull_low_, pull_high_, sinkage_high_;
  std::vector<std::uint32_t> flags_;
  double model_seconds_ = 0;
  std::int64_t states_ = 0;
};

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grouser/model.h"
#include "path.h"
#include "rover.h"

struct Settings {
  int rollouts = 5000;  ///< K
  int horizon = 50;     ///< H, steps
  double step_s = 0.2;  ///< dt
  int threads = 1;
  std::uint64_t seed = 1;
  double goal_speed = 0;      ///< along the path [m/s]
  double cruise_rim = 0;      ///< rim speed to begin with [m/s]
  double noise = 0.2;         ///< sd of common and of opposed rim speeds over cruise_rim
  double noise_memory = 0.8;  ///< correlation from one step to the next
  double temperature = 0.05;  ///< lambda over the spread of the costs
};

/// What one cycle found. Costs are means over the horizon [-], see StepCost.
struct CycleReport {
  std::int64_t states = 0;
  double seconds = 0;      ///< wall time of the whole cycle
  double model_share = 0;  ///< of the threads' rollout time spent in the model
  double plan_cost = 0;    ///< of the plan the cycle began with (rollout 0: no noise)
  double mean_cost = 0, best_cost = 0;
  double samples = 0;  ///< effective number, 1 / sum w^2
};

/// Cost of one step per unit of time [-]:
///   tracking  (distance from the goal / 0.1 m)^2 + 4 (1 - cos(yaw error))
///   energy    0.5 power / (weight goal_speed), the cost of transport
///   risk      10 max(0, sinkage_high - 0.4) + pull_doubt, both ends of intervals:
///             a wheel that may dig in, and ground of which the model knows little
///   1000      where the model says that the soil does not carry the wheel
/// The goal runs ahead along the path from where the rover is now.
double StepCost(const Rover& rover, const Settings& settings, const Path::Pose& goal,
                const Body& body, const StepReport& report);

/// Model predictive path integral control (Williams et al. 2017, IEEE T-RO
/// 34(6), 1603-1622): K noisy copies of the plan are rolled out over H steps,
///   U_t <- U_t + sum_k w_k e_kt,   w_k ~ exp(-(S_k - min S) / lambda),
/// S_k the cost of copy k and e_kt its noise (without the reference's term in
/// U^T Sigma^-1 e, that is, controls have no price of their own here: the
/// energy has). lambda is `temperature` times the standard deviation of S.
class Planner {
 public:
  Planner(const grouser::Model& model, const Rover& rover, const Path& path,
          const Settings& settings);

  /// Improves the plan for a rover at `start`.
  CycleReport Improve(const Body& start);
  /// The control to apply now; after it was applied, Advance.
  const Control& now() const { return plan_.front(); }
  void Advance();

 private:
  void DrawNoise(int cycle, std::size_t rollout);
  /// Rolls out [first, last) in one batch a step; adds to cost_.
  void Roll(const Body& start, std::size_t first, std::size_t last, WheelBatch* batch);
  void Update(CycleReport* report);
  Control Clamped(const Control& control) const;

  const Rover& rover_;
  const Path& path_;
  Settings settings_;
  std::vector<Control> plan_;
  std::vector<Control> noise_;  // e_kt at k H + t, after clamping
  std::vector<double> cost_;
  std::vector<WheelBatch> batches_;  // one a thread
  std::size_t block_ = 1;            // rollouts a batch
  int cycle_ = 0;
};

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "surrogate/models/draw_field.h"
#include "surrogate/models/wheel_model.h"
#include "surrogate/vehicle/mechanics.h"
#include "surrogate/vehicle/pack.h"

namespace grouser::vehicle {

inline constexpr std::size_t kSlots = Solver::kLanes * kMostWheels;
inline constexpr int kGuesses = 4;  // starts of Mechanics::Guess
static_assert(Solver::kLanes == pack::kLanes);

/// All that a solver holds. solver.cc: from motions to lanes and back; solver_evaluate.cc: wheels
/// in batches; solver_newton.cc: what each lane does next; solver_follow.cc: what no start finds.
struct Solver::Work {
  Work(const Vehicle& vehicle, const Grounds& g);

  void Run(SolveSource* source, Motion::Given of);
  void SolveOne(const Motion& motion, const Effort& effort, Solution* solution) noexcept;
  void Follow(const Motion& motion, Solution* solution) noexcept;
  bool FollowWays(const Motion& motion, Solution* solution) noexcept;
  bool FollowMirror(const Motion& motion, Solution* solution) noexcept;
  bool FollowWay(const Motion& motion, bool ground, bool turn, Solution* solution) noexcept;
  bool Start(const SolveSource::Task& task, std::size_t lane) noexcept;
  void Round(std::size_t count) noexcept;
  void Place(std::size_t count) noexcept;
  void Lift(std::size_t lane) noexcept;
  void Evaluate(std::size_t count) noexcept;
  void EvaluateTogether(const surrogate::WheelModel& model, std::size_t count) noexcept;
  void EvaluateApart(std::uint32_t model) noexcept;
  void Draw(const surrogate::WheelModel& model, std::size_t n) noexcept;
  void Take(std::size_t state) noexcept;
  void Decide(std::size_t lane) noexcept;
  void Begin(std::size_t lane) noexcept;
  void Relax(Lane* lane) noexcept;
  void StepOn(std::size_t count) noexcept;
  void Damp(std::size_t lane) noexcept;
  bool Retreat(std::size_t lane) noexcept;
  void End(std::size_t lane, bool here) noexcept;
  void Finish(std::size_t lane) noexcept;
  bool Active(std::size_t lane) const noexcept { return lanes[lane].phase != Lane::Phase::kIdle; }

  Mechanics mechanics;
  Grounds grounds;
  std::vector<const surrogate::WheelModel*> models;
  std::vector<double> fastest;       ///< by model: FastestOfRuns [m/s]
  std::vector<std::uint32_t> place;  ///< in `models`, by Grounds::models
  pack::Body body;
  pack::Unknowns unknowns{};
  Motion::Given given = Motion::Given::kTwist;  ///< of all lanes
  const Layout* layout = nullptr;
  const pack::Kernel* kernel = pack::KernelFor(nullptr);
  std::array<Lane, kLanes> lanes;
  pack::Lanes all{};
  std::array<std::uint32_t, kSlots> flags{};  ///< at wheel * kLanes + lane
  // Wheel states of one model among several, and their answers; slot: wheel * kLanes + lane.
  using Batch = std::array<double, kSlots>;
  Batch v_x, v_y, rim, load, yaw, sinkage;
  std::array<std::array<Batch, 5>, 4> answer;  ///< of pack::Felt::part
  std::array<Batch, 5> high;  ///< ends of intervals of f_x, f_y, torque; with draws m_z, sinkage
  std::array<Batch, 3> half;  ///< of intervals, where a motion asks for worse ground and a draw
  std::array<std::uint32_t, kSlots> batch_flags;
  std::array<std::uint16_t, kSlots> slot;
  bool risky = false;  ///< some motion asks for worse ground
  bool drawn = false;  ///< some motion asks for a draw
  std::shared_ptr<const GroundDraws> draws;
};

}  // namespace grouser::vehicle

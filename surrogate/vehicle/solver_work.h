#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "surrogate/models/wheel_model.h"
#include "surrogate/vehicle/mechanics.h"

namespace grouser::vehicle {

inline constexpr std::size_t kLanes = 16;  // motions that advance together
inline constexpr std::size_t kSlots = kLanes * kMostWheels;
inline constexpr int kGuesses = 4;  // starts of Mechanics::Guess

/// Largest of the first n entries, or one that is not a number.
double Largest(const Column& r, std::size_t n);

/// All that a solver holds. solver.cc: from motions to lanes and back; solver_evaluate.cc: wheels
/// in batches; solver_newton.cc: a lane's steps.
struct Solver::Work {
  Work(const Vehicle& vehicle, const Grounds& g) : mechanics(vehicle), grounds(g) {
    for (const auto* model : g.models) {
      if (model == nullptr || std::count(models.begin(), models.end(), model) > 0) continue;
      models.push_back(model);
    }
    for (std::size_t k = 0; k < g.models.size(); ++k) {
      const auto at = std::find(models.begin(), models.end(), g.models[k]);
      place.push_back(static_cast<std::uint32_t>(at - models.begin()));
    }
    for (std::size_t i = 0; i < mechanics.wheels(); ++i) per_radius[i] = 1 / mechanics.radius(i);
  }

  void Run(std::span<const Motion> motions, std::span<Solution> out, const Effort& e) noexcept;
  bool Start(const Motion& motion, Solution* solution, Lane* lane) noexcept;
  void Evaluate() noexcept;
  void Ask(const surrogate::WheelModel& model, std::size_t n) noexcept;
  void Draw(const surrogate::WheelModel& model, std::size_t n) noexcept;
  void Take(std::size_t state, std::uint32_t on_slope) noexcept;
  void Advance(std::size_t lane) noexcept;
  void Linearise(Lane* lane, std::span<const Felt> felt, const Column& before,
                 bool begins) noexcept;
  bool Least(const Lane& lane) const noexcept;
  void Step(Lane* lane) noexcept;
  void Try(Lane* lane) noexcept;
  void Relax(Lane* lane) noexcept;
  bool Retreat(Lane* lane, double tried) noexcept;
  void Finish(Lane* lane, std::span<const Felt> felt) noexcept;

  Mechanics mechanics;
  Grounds grounds;
  std::vector<const surrogate::WheelModel*> models;
  std::vector<std::uint32_t> place;  ///< in `models`, by Grounds::models
  std::array<double, kMostWheels> per_radius{};
  std::array<Lane, kLanes> lanes;
  std::array<std::array<Felt, kMostWheels>, kLanes> felt;
  // Wheel states of a batch and their answers; owner: lane * kMostWheels + wheel.
  using Batch = std::array<double, kSlots>;
  Batch v_x, v_y, rim, load, yaw, sinkage;
  std::array<std::array<Batch, 5>, 4> answer;  ///< of Felt: by output and part
  std::array<Batch, 5> high;  ///< ends of intervals of f_x, f_y, torque; with draws m_z, sinkage
  std::array<Batch, 3> half;  ///< of intervals, where a motion asks for worse ground and a draw
  std::array<std::uint32_t, kSlots> flags;
  std::array<std::uint16_t, kSlots> owner;
  Effort effort;
  bool risky = false;  ///< some motion asks for worse ground
  bool drawn = false;  ///< some motion asks for a draw
  std::shared_ptr<const GroundDraws> draws;
};

}  // namespace grouser::vehicle

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
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
    for (int o : {0, 1, 2, 3}) {
      for (auto& part : answer[static_cast<std::size_t>(o)]) part.resize(kSlots);
    }
    for (auto* array : {&v_x, &v_y, &rim, &load, &yaw, &sinkage}) array->resize(kSlots);
    for (auto& h : high) h.resize(kSlots);
    flags.resize(kSlots);
    owner.resize(kSlots);
  }

  void Run(std::span<const Motion> motions, std::span<Solution> out, const Effort& e) noexcept;
  bool Start(const Motion& motion, Solution* solution, Lane* lane) noexcept;
  void Evaluate() noexcept;
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
  std::array<Lane, kLanes> lanes;
  std::array<std::array<Felt, kMostWheels>, kLanes> felt;
  // Wheel states of a batch and their answers; owner: lane * kMostWheels + wheel.
  std::vector<double> v_x, v_y, rim, load, yaw, sinkage;
  std::array<std::array<std::vector<double>, 5>, 4> answer;
  std::array<std::vector<double>, 3> high;  ///< ends of intervals of f_x, f_y, torque
  std::vector<std::uint32_t> flags;
  std::vector<std::size_t> owner;
  Effort effort;
  bool risky = false;  ///< some motion asks for worse ground
};

}  // namespace grouser::vehicle

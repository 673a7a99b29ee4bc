#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/linear.h"
#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

constexpr int kMostHalvings = 2;  // of a Newton step, before it is damped
constexpr int kMostStalls = 3;    // accepted damped steps in a row that leave more than kGain
constexpr double kGain = 0.95;
constexpr double kLeastDamping = 1e-2, kMostDamping = 1e4;
constexpr double kNoDamping = 1e-3;  // below it a Newton step is tried again

// Entries of one lane.
void Gather(const pack::PerLane* from, std::size_t n, std::size_t lane, Column* to) {
  for (std::size_t k = 0; k < n; ++k) (*to)[k] = from[k][lane];
}
void Scatter(const Column& from, std::size_t n, std::size_t lane, pack::PerLane* to) {
  for (std::size_t k = 0; k < n; ++k) to[k][lane] = from[k];
}

}  // namespace

// An attempt begins at lane.at.
void Solver::Work::Begin(std::size_t l) noexcept {
  Lane& lane = lanes[l];
  lane.stalls = 0;
  lane.first = true;
  lane.damping = 0;
  Scatter(lane.at, layout->size, l, all.at);
}

// After a damped step that was accepted: less damping, much less where it was the first try.
void Solver::Work::Relax(Lane* lane) noexcept {
  if (lane->damping == 0) return;
  lane->damping *= lane->growth > 4 ? 0.5 : 0.1;
  if (lane->damping < kNoDamping) lane->damping = 0;
  lane->growth = 4;
}

// A damped step from the accepted point.
void Solver::Work::Damp(std::size_t l) noexcept {
  const std::size_t n = layout->size;
  std::array<Column, kMostUnknowns> jacobian;
  Column residual, step;
  for (std::size_t i = 0; i < n; ++i) Gather(all.jacobian[i], n, l, &jacobian[i]);
  Gather(all.residual, n, l, &residual);
  SolveDamped(jacobian, residual, n, lanes[l].damping, &step);
  Scatter(step, n, l, all.step);
}

// What to try after a step that made it worse; false: nothing is left.
bool Solver::Work::Retreat(std::size_t l) noexcept {
  Lane& lane = lanes[l];
  if (lane.damping == 0) {
    if (++lane.halvings <= kMostHalvings) {
      // Where a parabola through both ends, with the slope of Newton's step, is least.
      all.share[l] *= std::clamp(lane.merit / (lane.merit + all.merit[l]), 0.1, 0.5);
      all.moving[l] = -1;
      return true;
    }
    lane.damping = kLeastDamping;
    lane.growth = 4;
  } else {
    lane.damping *= lane.growth;
    lane.growth *= 2;
  }
  if (lane.damping > kMostDamping) return false;
  all.share[l] = 1;
  lane.halvings = 0;
  Damp(l);
  all.stepping[l] = all.moving[l] = -1;
  return true;
}

// What the imbalance at the point tried means: linearise there, go back, or end.
void Solver::Work::Decide(std::size_t l) noexcept {
  Lane& lane = lanes[l];
  const std::size_t n = layout->size;
  all.going[l] = all.solving[l] = all.stepping[l] = all.moving[l] = 0;
  if (lane.phase == Lane::Phase::kIdle) return;
  if (lane.phase == Lane::Phase::kWrite) {
    Finish(l);
    return;
  }
  ++lane.evaluations;
  const bool budget = lane.evaluations < lane.effort.evaluations * (lane.attempt + 1);
  const double merit = all.merit[l];
  const bool better = lane.first || merit < lane.merit;
  if (better) {
    // A least imbalance above 0: damped steps that gain little, several in a row.
    const bool gains = lane.first || lane.damping == 0 || merit < kGain * lane.merit;
    lane.stalls = gains ? 0 : lane.stalls + 1;
    all.begins[l] = lane.first ? -1 : 0;
    lane.first = false;
    lane.merit = merit;
    lane.largest = all.largest[l];
    if (lane.largest <= lane.effort.goal) {
      Finish(l);
      return;
    }
    if (lane.stalls < kMostStalls && budget) {
      all.going[l] = -1;
      return;
    }
    for (std::size_t k = 0; k < n; ++k) {
      all.last[k][l] = all.at[k][l];
      all.residual[k][l] = all.tried[k][l];
    }
  } else if (lane.largest > Solution::kTolerance / 2 && budget && Retreat(l)) {
    return;
  }
  End(l, better);
}

// Steps of the lanes that are linearised anew: Newton's where it can be had, else damped.
void Solver::Work::StepOn(std::size_t count) noexcept {
  const bool packed = pack::Solves(unknowns.size);
  for (std::size_t l = 0; l < count; ++l) {
    if (all.going[l] == 0) continue;
    Lane& lane = lanes[l];
    Relax(&lane);
    if (all.least[l] != 0) {
      End(l, true);
      continue;
    }
    all.share[l] = 1;
    lane.halvings = 0;
    all.stepping[l] = all.moving[l] = -1;
    all.solving[l] = lane.damping == 0 ? -1 : 0;
    all.solved[l] = 0;
  }
  if (packed) kernel->solve(body, unknowns, static_cast<int>(count), &all);
  for (std::size_t l = 0; l < count; ++l) {
    if (all.going[l] == 0 || all.stepping[l] == 0) continue;
    Lane& lane = lanes[l];
    if (all.solving[l] != 0) {
      if (!packed) {
        const std::size_t n = layout->size;
        std::array<Column, kMostUnknowns> jacobian;
        Column residual, step;
        for (std::size_t i = 0; i < n; ++i) Gather(all.jacobian[i], n, l, &jacobian[i]);
        Gather(all.residual, n, l, &residual);
        all.solved[l] = SolveLinear(jacobian, residual, n, &step) ? -1 : 0;
        if (all.solved[l] != 0) Scatter(step, n, l, all.step);
      }
      if (all.solved[l] != 0) continue;
      lane.damping = kLeastDamping;
      lane.growth = 4;
    }
    Damp(l);
  }
}

// The end of an attempt; `here`: the wheels' answers are those of the accepted point.
void Solver::Work::End(std::size_t l, bool here) noexcept {
  Lane& lane = lanes[l];
  const std::size_t n = layout->size;
  if (lane.attempt == 0 || lane.merit < lane.best_merit) {
    lane.best_merit = lane.merit;
    lane.best_largest = lane.largest;
    Gather(all.last, n, l, &lane.best);
  }
  if (lane.largest > Solution::kTolerance && all.tip_margin[l] > 0 &&
      lane.attempt + 1 < std::min(lane.effort.attempts, kGuesses + (lane.warm ? 1 : 0))) {
    ++lane.attempt;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < n; ++k) all.missing[i][k][l] = 0;
    }
    mechanics.Guess(&lane);
    Begin(l);
    return;
  }
  if (here && lane.best_merit == lane.merit) {
    Finish(l);
    return;
  }
  lane.phase = Lane::Phase::kWrite;  // the best point, once more
  lane.largest = lane.best_largest;
  Scatter(lane.best, n, l, all.at);
}

// One evaluation of all lanes, and what follows from it.
void Solver::Work::Round(std::size_t count) noexcept {
  const int n = static_cast<int>(count);
  Place(count);
  Evaluate(count);
  kernel->weigh(body, unknowns, n, &all);
  for (std::size_t l = 0; l < count; ++l) Decide(l);
  kernel->linearise(body, unknowns, n, &all);
  StepOn(count);
  kernel->move(body, unknowns, n, &all);
}

}  // namespace grouser::vehicle

#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/linear.h"
#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

constexpr int kMostHalvings = 2;  // of a Newton step, before it is damped
constexpr int kMostStalls = 3;    // accepted damped steps in a row that leave more than kGain
constexpr double kGain = 0.95;
constexpr double kLeastCosine = 0.02;  // between imbalance and what an unknown does to it
constexpr double kLeastDamping = 1e-2, kMostDamping = 1e4;
constexpr double kNoDamping = 1e-3;  // below it a Newton step is tried again
constexpr double kMostStep = 0.5;    // of the fastest speed, and radians of steering

}  // namespace

double Largest(const Column& r, std::size_t n) {
  double largest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    if (!(std::fabs(r[k]) <= largest)) largest = std::fabs(r[k]);
  }
  return largest;
}

// From the accepted point: a Newton step where it can be had, else a damped one.
void Solver::Work::Step(Lane* lane) noexcept {
  const std::size_t n = lane->layout->size;
  lane->share = 1;
  lane->halvings = 0;
  if (lane->damping == 0 && !SolveLinear(lane->jacobian, lane->residual, n, &lane->step)) {
    lane->damping = kLeastDamping;
    lane->growth = 4;
  }
  if (lane->damping > 0) SolveDamped(lane->jacobian, lane->residual, n, lane->damping, &lane->step);
  // Speeds change by a part of the fastest one, angles by a part of a radian; each unknown by
  // itself, as one that has hardly any effect (rims of wheels without load) takes long steps.
  double fastest = lane->speed;
  for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
    fastest = std::max(fastest, std::fabs(lane->placed[i].rim));
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (static_cast<int>(k) == lane->layout->moment) continue;
    const bool angle = static_cast<int>(k) == lane->layout->psi;
    const double limit = kMostStep * (angle ? 1 : fastest / lane->speed);
    lane->step[k] = std::clamp(lane->step[k], -limit, limit);
  }
}

void Solver::Work::Try(Lane* lane) noexcept {
  for (std::size_t k = 0; k < lane->layout->size; ++k) {
    lane->at[k] = lane->last[k] - lane->share * lane->step[k] * lane->unit[k];
  }
  mechanics.Place(lane);
}

// After a damped step that was accepted: less damping, much less where it was the first try.
void Solver::Work::Relax(Lane* lane) noexcept {
  if (lane->damping == 0) return;
  lane->damping *= lane->growth > 4 ? 0.5 : 0.1;
  if (lane->damping < kNoDamping) lane->damping = 0;
  lane->growth = 4;
}

// What to try after a step that made it worse; false: nothing is left.
bool Solver::Work::Retreat(Lane* lane, double tried) noexcept {
  if (lane->damping == 0) {
    if (++lane->halvings <= kMostHalvings) {
      // Where a parabola through both ends, with the slope of Newton's step, is least.
      lane->share *= std::clamp(lane->merit / (lane->merit + tried), 0.1, 0.5);
      Try(lane);
      return true;
    }
    lane->damping = kLeastDamping;
    lane->growth = 4;
  } else {
    lane->damping *= lane->growth;
    lane->growth *= 2;
  }
  if (lane->damping > kMostDamping) return false;
  Step(lane);
  Try(lane);
  return true;
}

// Derivatives at the accepted point. Models give no gradients of their intervals, on which worse
// ground and draws rest: what these add is taken from the steps (Broyden), against the mean of the
// gradients at both ends of a step.
void Solver::Work::Linearise(Lane* lane, std::span<const Felt> felt, const Column& before,
                             bool begins) noexcept {
  const std::size_t n = lane->layout->size;
  Column residual;
  if (lane->motion->worse_by_sd == 0 && lane->motion->draw < 0) {
    mechanics.Imbalance(*lane, felt, &residual, &lane->jacobian);
    return;
  }
  std::array<Column, kMostUnknowns>& gradients = lane->gradients;
  std::array<Column, kMostUnknowns> last;
  std::copy_n(gradients.begin(), n, last.begin());
  mechanics.Imbalance(*lane, felt, &residual, &gradients);
  double moved = 0;
  for (std::size_t k = 0; k < n; ++k) {
    lane->step[k] *= -lane->share;
    moved += lane->step[k] * lane->step[k];
  }
  for (std::size_t i = 0; i < n; ++i) {
    Column& missing = lane->missing[i];
    if (!begins && moved > 0) {
      double more = residual[i] - before[i];
      for (std::size_t k = 0; k < n; ++k) {
        more -= (missing[k] + (last[i][k] + gradients[i][k]) / 2) * lane->step[k];
      }
      for (std::size_t k = 0; k < n; ++k) missing[k] += more * lane->step[k] / moved;
    }
    for (std::size_t k = 0; k < n; ++k) lane->jacobian[i][k] = gradients[i][k] + missing[k];
  }
}

// Whether the imbalance is least here: no unknown changes it along itself.
bool Solver::Work::Least(const Lane& lane) const noexcept {
  const std::size_t n = lane.layout->size;
  for (std::size_t k = 0; k < n; ++k) {
    double along = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i) {
      along += lane.jacobian[i][k] * lane.residual[i];
      size += lane.jacobian[i][k] * lane.jacobian[i][k];
    }
    if (along * along > kLeastCosine * kLeastCosine * size * lane.merit) return false;
  }
  return true;
}

void Solver::Work::Advance(std::size_t index) noexcept {
  Lane& lane = lanes[index];
  const std::size_t n = lane.layout->size;
  if (lane.phase == Lane::Phase::kWrite) {
    Finish(&lane, felt[index]);
    return;
  }
  ++lane.evaluations;
  Column residual;
  mechanics.Imbalance(lane, felt[index], &residual, nullptr);
  double merit = 0;
  for (std::size_t k = 0; k < n; ++k) merit += residual[k] * residual[k];
  const bool better = lane.first || merit < lane.merit;
  if (better) {
    // A least imbalance above 0: damped steps that gain little, several in a row.
    const bool gains = lane.first || lane.damping == 0 || merit < kGain * lane.merit;
    lane.stalls = gains ? 0 : lane.stalls + 1;
    const bool stalled = lane.stalls >= kMostStalls;
    const bool begins = lane.first;
    lane.first = false;
    lane.merit = merit;
    const Column before = lane.residual;
    lane.residual = residual;
    lane.last = lane.at;
    if (Largest(residual, n) <= effort.goal) {
      Finish(&lane, felt[index]);
      return;
    }
    if (!stalled && lane.evaluations < effort.evaluations * (lane.attempt + 1)) {
      Linearise(&lane, felt[index], before, begins);
      Relax(&lane);
      if (!Least(lane)) {
        Step(&lane);
        Try(&lane);
        return;
      }
    }
  } else if (Largest(lane.residual, n) > Solution::kTolerance / 2 &&
             lane.evaluations < effort.evaluations * (lane.attempt + 1) && Retreat(&lane, merit)) {
    return;
  }
  if (lane.attempt == 0 || lane.merit < lane.best_merit) {
    lane.best_merit = lane.merit;
    lane.best = lane.last;
    lane.best_residual = lane.residual;
  }
  if (Largest(lane.residual, n) > Solution::kTolerance && lane.tip_margin > 0 &&
      lane.attempt + 1 < std::min(effort.attempts, kGuesses + (lane.warm ? 1 : 0))) {
    ++lane.attempt;
    for (Column& row : lane.missing) row.fill(0);
    lane.stalls = 0;
    lane.first = true;
    lane.damping = 0;
    mechanics.Guess(&lane);
    mechanics.Place(&lane);
    return;
  }
  if (better && lane.best_merit == merit) {  // the answers of the wheels are those of this point
    Finish(&lane, felt[index]);
    return;
  }
  lane.phase = Lane::Phase::kWrite;  // the best point, once more
  lane.at = lane.best;
  lane.residual = lane.best_residual;
  mechanics.Place(&lane);
}

}  // namespace grouser::vehicle

#include "surrogate/terrain_map/creeping.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {
namespace {

enum From : unsigned char { kBefore = 1, kAfter = 2, kLeast = 4 };
constexpr vehicle::Effort kAllStarts{.warm = true, .attempts = 5};
constexpr vehicle::Effort kOneStart{.warm = true, .attempts = 1, .from_least = true};

}  // namespace

vehicle::Motion MotionOn(double slope_rad, double heading_rad, double speed_m_per_s,
                         double worse_by_sd, std::uint8_t soil) {
  constexpr double kCreeping = 1e-9;  // [m/s]: at rest, about to move forward
  const Attitude attitude = AttitudeOf(slope_rad, heading_rad);
  vehicle::Motion m = vehicle::Motion::OnPath(std::max(speed_m_per_s, kCreeping), 0);
  m.grade_rad = attitude.grade_rad;
  m.bank_rad = attitude.bank_rad;
  m.worse_by_sd = worse_by_sd;
  m.soil.fill(soil);
  return m;
}

bool Goes(const vehicle::Solution& s, const vehicle::SpeedOptions& o, bool unknown) {
  using vehicle::kLimits, vehicle::kNoBalance, vehicle::kUntrained;
  const bool untrained = (s.reasons & kUntrained) != 0;
  if (!s.balanced) {
    return unknown && untrained && (s.reasons & (kLimits & ~kNoBalance)) == 0;
  }
  return (s.reasons & kLimits) == 0 && (unknown || !untrained) && s.tip_margin >= o.tip_margin &&
         s.torque_margin >= o.torque_margin && s.sinkage_margin >= o.sinkage_margin;
}

vehicle::Solution SolveNear(vehicle::Solver* solver, const vehicle::Motion& motion,
                            const vehicle::Solution& near) {
  vehicle::Solution s = near;
  solver->Solve({&motion, 1}, {&s, 1}, kAllStarts);
  if (!s.balanced) solver->Solve({&motion, 1}, {&s, 1}, kOneStart);
  return s;
}

void CreepingBatch::Ask(std::size_t heading, double slope, double sd,
                        const vehicle::Solution* near) {
  if (answered_) {
    motions_.clear();
    solutions_.clear();
    answered_ = false;
  }
  const double turn = static_cast<double>(heading) / static_cast<double>(headings_);
  motions_.push_back(MotionOn(slope, 2 * std::numbers::pi * turn, 0, sd, soil_));
  solutions_.push_back(*near);
}

void CreepingBatch::Answer(std::size_t row) {
  const std::size_t n = motions_.size();
  solver_->Solve(motions_, solutions_, kAllStarts);
  goes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) goes_[i] = Goes(solutions_[i], limits_, unknown_);
  asked_.assign(n, 0);
  while (AskAgain(row)) {
  }
  for (std::size_t i = 0; i < n; ++i) {
    unknown_decides_ |= !goes_[i] && (solutions_[i].reasons & vehicle::kUntrained) != 0;
  }
  answered_ = true;
}

bool CreepingBatch::AskAgain(std::size_t row) {
  again_.clear();
  tried_.clear();
  owner_.clear();
  const auto ask = [&](std::size_t i, From from, const vehicle::Solution& start) {
    if ((asked_[i] & from) != 0) return;
    asked_[i] |= from;
    again_.push_back(motions_[i]);
    tried_.push_back(start);
    owner_.push_back(i);
  };
  for (std::size_t i = 0; i < goes_.size(); ++i) {
    if (goes_[i]) continue;
    const bool before = i % row > 0 && goes_[i - 1];
    const bool after = i % row + 1 < row && goes_[i + 1];
    if (before) ask(i, kBefore, solutions_[i - 1]);
    if (after) ask(i, kAfter, solutions_[i + 1]);
    if ((before || after || row == 1) && !solutions_[i].balanced) ask(i, kLeast, solutions_[i]);
  }
  if (again_.empty()) return false;
  solver_->Solve(again_, tried_, kOneStart);
  for (std::size_t k = 0; k < again_.size(); ++k) {
    if (!Goes(tried_[k], limits_, unknown_)) continue;
    goes_[owner_[k]] = true;
    solutions_[owner_[k]] = tried_[k];
  }
  return true;
}

vehicle::Binding CreepingBatch::BindingAt(std::size_t i) const {
  return vehicle::BindingOf(motions_[i], solutions_[i], limits_,
                            solver_->vehicle().gravity_m_per_s2);
}

}  // namespace grouser::terrain_map

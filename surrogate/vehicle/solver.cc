#include "surrogate/vehicle/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// What intervals add to the gradients, from and to a solution that has room for it.
void RecallSlope(const Solution& from, Lane* lane) {
  const std::size_t n = lane->layout->size, room = from.interval_slope.size();
  const bool known = lane->warm && n <= room;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      lane->missing[i][k] = known ? from.interval_slope[i][k] : 0;
    }
  }
}
void KeepSlope(const Lane& lane, Solution* to) {
  const std::size_t n = std::min(lane.layout->size, to->interval_slope.size());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      to->interval_slope[i][k] = static_cast<float>(lane.missing[i][k]);
    }
  }
}

}  // namespace

bool Solver::Work::Start(const Motion& motion, Solution* solution, Lane* lane) noexcept {
  lane->motion = &motion;
  lane->solution = solution;
  bool known = mechanics.Begin(lane);
  for (std::size_t i = 0; known && i < mechanics.wheels(); ++i) {
    known = motion.soil[i] < grounds.soils.size();
    if (!known) break;
    const std::size_t type = mechanics.vehicle().wheels[i].type;
    lane->model[i] = place[type * grounds.soils.size() + motion.soil[i]];
    known = lane->model[i] < models.size();
  }
  const int most = draws != nullptr ? static_cast<int>(draws->count()) : 0;
  known = known && motion.draw >= Motion::kMeanGround && motion.draw < most;
  if (!known) {
    *solution = Solution{};
    solution->reasons = kBadInput;
    solution->residual = kNaN;
    return false;
  }
  lane->warm = effort.warm && mechanics.Recall(*solution, effort.from_least, lane);
  if (!lane->warm) mechanics.Guess(lane);
  RecallSlope(*solution, lane);
  lane->phase = Lane::Phase::kSearch;
  lane->first = true;
  lane->stalls = 0;
  lane->damping = 0;
  return true;
}

void Solver::Work::Finish(Lane* lane, std::span<const Felt> felt) noexcept {
  Solution& s = *lane->solution;
  mechanics.Write(*lane, felt, effort.brief);
  KeepSlope(*lane, &s);
  s.residual = Largest(lane->residual, lane->layout->size);
  s.balanced = s.residual <= Solution::kTolerance;
  // What does not balance inside of what the runs covered is a limit of the ground.
  if (!s.balanced && s.reasons == 0) s.reasons = kNoBalance;
  lane->phase = Lane::Phase::kIdle;
}

void Solver::Work::Run(std::span<const Motion> motions, std::span<Solution> out,
                       const Effort& e) noexcept {
  effort = e;
  std::size_t next = 0;
  risky = std::any_of(motions.begin(), motions.end(),
                      [](const Motion& m) { return m.worse_by_sd != 0; });
  drawn = std::any_of(motions.begin(), motions.end(), [](const Motion& m) { return m.draw >= 0; });
  const auto refill = [&](Lane* lane) {
    while (lane->phase == Lane::Phase::kIdle && next < motions.size()) {
      if (Start(motions[next], &out[next], lane)) mechanics.Place(lane);
      ++next;
    }
  };
  for (Lane& lane : lanes) lane.phase = Lane::Phase::kIdle;
  while (true) {
    bool any = false;
    for (Lane& lane : lanes) {
      refill(&lane);
      any |= lane.phase != Lane::Phase::kIdle;
    }
    if (!any) return;
    Evaluate();
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (lanes[l].phase != Lane::Phase::kIdle) Advance(l);
    }
  }
}

Solver::Solver(const Vehicle& vehicle, const Grounds& grounds) {
  Check(vehicle);
  if (grounds.soils.empty() || grounds.soils.size() > 255 ||
      grounds.models.size() != vehicle.wheel_types.size() * grounds.soils.size()) {
    throw std::invalid_argument("grounds: got " + std::to_string(grounds.models.size()) +
                                " models, expected wheel types times soils (1 to 255)");
  }
  if (std::all_of(grounds.models.begin(), grounds.models.end(),
                  [](const auto* m) { return m == nullptr; })) {
    throw std::invalid_argument("grounds: got no model, expected one or more");
  }
  work_ = std::make_unique<Work>(vehicle, grounds);
}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;

void Solver::UseDraws(std::shared_ptr<const GroundDraws> draws) {
  if (draws != nullptr && draws->of_soil.size() != work_->grounds.soils.size()) {
    throw std::invalid_argument("draws: of " + std::to_string(draws->of_soil.size()) +
                                " soils, expected those of the grounds");
  }
  work_->draws = std::move(draws);
}

void Solver::Solve(std::span<const Motion> motions, std::span<Solution> out,
                   Effort effort) noexcept {
  work_->Run(motions, out, effort);
}

const Vehicle& Solver::vehicle() const { return work_->mechanics.vehicle(); }

std::string NamesOf(std::uint32_t reasons) {
  constexpr std::pair<Reason, const char*> kNames[] = {{kNoBalance, "BALANCE"},
                                                       {kOverTorque, "TORQUE"},
                                                       {kSinksIn, "SINKAGE"},
                                                       {kTips, "TIP"},
                                                       {kUntrainedSpeed, "UNTRAINED_SPEED"},
                                                       {kModelDomain, "MODEL_DOMAIN"},
                                                       {kBadInput, "INPUT"}};
  std::string text;
  for (const auto& [reason, name] : kNames) {
    if ((reasons & reason) == 0) continue;
    if (!text.empty()) text += '|';
    text += name;
  }
  return text;
}

}  // namespace grouser::vehicle

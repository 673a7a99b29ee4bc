#include "surrogate/vehicle/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "surrogate/vehicle/linear.h"
#include "surrogate/vehicle/mechanics.h"

namespace grouser::vehicle {
namespace {

using surrogate::kFx, surrogate::kFy, surrogate::kTorque, surrogate::kMz, surrogate::kSinkage;
using surrogate::kTwoSided90;

constexpr std::size_t kLanes = 16;  // motions that advance together
constexpr std::size_t kSlots = kLanes * kMostWheels;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kGuesses = 4, kMostHalvings = 2;
constexpr int kMostStalls = 3;
constexpr double kGain = 0.95;
constexpr double kLeastCosine = 0.02;
constexpr double kNoDamping = 1e-3;
constexpr double kLeastDamping = 1e-2, kMostDamping = 1e4;
constexpr double kMostStep = 0.5;  // of the fastest speed, and radians of steering

constexpr surrogate::Part kParts[5] = {surrogate::kValue, surrogate::kDvX, surrogate::kDvY,
                                       surrogate::kDRim, surrogate::kDLoad};

// Less gross traction (torque over radius: of driving wheels and of braking ones) and lateral
// force, more torque; sds are in proportion to the load.
void Worsen(double pull, double side, double torque, double load, double radius, Felt* f) {
  if (!(load > 0)) return;
  // Of a force f, f s/hypot(f, s) is lost: smooth, and what is left keeps its sign and grows with
  // f.
  const double traction = f->torque[0] / radius;
  const double size = std::sqrt(traction * traction + pull * pull);
  if (size > 0) {
    const double a = pull / size, b = traction / size;
    f->f_x[0] -= traction * a;
    for (std::size_t k = 1; k < 5; ++k) f->f_x[k] -= a * a * a * f->torque[k] / radius;
    f->f_x[4] -= b * b * b * pull / load;
  }
  f->torque[0] += torque;
  f->torque[4] += torque / load;
  const double size_y = std::sqrt(f->f_y[0] * f->f_y[0] + side * side);
  if (!(size_y > 0)) return;
  const double share = 1 - side / size_y;
  for (double& part : f->f_y) part *= share;
}

double Largest(const Column& r, std::size_t n) {
  double largest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    if (!(std::fabs(r[k]) <= largest)) largest = std::fabs(r[k]);
  }
  return largest;
}

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

bool Solver::Work::Start(const Motion& motion, Solution* solution, Lane* lane) noexcept {
  lane->motion = &motion;
  lane->solution = solution;
  bool known = mechanics.Begin(lane);
  for (std::size_t i = 0; known && i < mechanics.wheels(); ++i) {
    known = motion.soil[i] < grounds.soils.size() &&
            grounds.At(mechanics.vehicle().wheels[i].type, motion.soil[i]) != nullptr;
  }
  if (!known) {
    *solution = Solution{};
    solution->reasons = kBadInput;
    solution->residual = kNaN;
    return false;
  }
  lane->warm = effort.warm && mechanics.Recall(*solution, lane);
  if (!lane->warm) mechanics.Guess(lane);
  RecallSlope(*solution, lane);
  lane->phase = Lane::Phase::kSearch;
  lane->first = true;
  lane->stalls = 0;
  lane->damping = 0;
  return true;
}

// All wheels of all lanes, a batch for each model.
void Solver::Work::Evaluate() noexcept {
  for (const surrogate::WheelModel* model : models) {
    std::size_t n = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Lane& lane = lanes[l];
      if (lane.phase == Lane::Phase::kIdle) continue;
      for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
        const std::size_t type = mechanics.vehicle().wheels[i].type;
        if (grounds.At(type, lane.motion->soil[i]) != model) continue;
        const Placed& p = lane.placed[i];
        v_x[n] = p.v_x;
        v_y[n] = p.v_y;
        rim[n] = p.rim;
        load[n] = p.load;
        yaw[n] = p.yaw_rate;
        owner[n++] = l * kMostWheels + i;
      }
    }
    if (n == 0) continue;
    const auto in = [n](const std::vector<double>& v) { return std::span(v).first(n); };
    surrogate::WheelStatesView states{in(v_x), in(v_y), in(rim), in(load), {}, {}, {}, {}};
    if (model->UsesYawRate()) states.yaw_rate = in(yaw);
    surrogate::ResponsesView out;
    constexpr surrogate::Output kAsked[4] = {kFx, kFy, kTorque, kMz};
    for (std::size_t o = 0; o < 4; ++o) {
      for (std::size_t p = 0; p < 5; ++p) {
        out.output[kAsked[o]].*surrogate::kPartMembers[kParts[p]] =
            std::span(answer[o][p]).first(n);
      }
    }
    out.output[kSinkage].value = std::span(sinkage).first(n);
    if (risky) {
      for (std::size_t o = 0; o < 3; ++o) out.output[kAsked[o]].high = std::span(high[o]).first(n);
    }
    out.flags = std::span(flags).first(n);
    model->Evaluate(states, out);
    for (std::size_t s = 0; s < n; ++s) {
      Felt& to = felt[owner[s] / kMostWheels][owner[s] % kMostWheels];
      for (std::size_t p = 0; p < 5; ++p) {
        to.f_x[p] = answer[0][p][s];
        to.f_y[p] = answer[1][p][s];
        to.torque[p] = answer[2][p][s];
        to.m_z[p] = answer[3][p][s];
      }
      to.sinkage = sinkage[s];
      to.flags = flags[s];
      const double sds = lanes[owner[s] / kMostWheels].motion->worse_by_sd;
      if (sds == 0) continue;
      const auto sd = [&](std::size_t o) { return (high[o][s] - answer[o][0][s]) / kTwoSided90; };
      Worsen(sds * sd(0), sds * sd(1), sds * sd(2) * (rim[s] < 0 ? -1 : 1), load[s],
             mechanics.radius(owner[s] % kMostWheels), &to);
    }
  }
}

// From the accepted point: a Newton step where it can be had, else a damped one.
void Solver::Work::Step(Lane* lane) noexcept {
  const std::size_t n = lane->layout->size;
  lane->share = 1;
  lane->halvings = 0;
  if (lane->damping == 0 && !SolveLinear(lane->jacobian, lane->residual, n, &lane->step)) {
    lane->damping = kLeastDamping;
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
// ground rests: what these add is taken from the steps (Broyden), against the mean of the gradients
// at both ends of a step.
void Solver::Work::Linearise(Lane* lane, std::span<const Felt> felt, const Column& before,
                             bool begins) noexcept {
  const std::size_t n = lane->layout->size;
  Column residual;
  if (lane->motion->worse_by_sd == 0) {
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
  lane.phase = Lane::Phase::kWrite;  // the best point, once more
  lane.at = lane.best;
  lane.residual = lane.best_residual;
  mechanics.Place(&lane);
}

void Solver::Work::Finish(Lane* lane, std::span<const Felt> felt) noexcept {
  Solution& s = *lane->solution;
  mechanics.Write(*lane, felt);
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

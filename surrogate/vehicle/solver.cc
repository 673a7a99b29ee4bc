#include "surrogate/vehicle/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Motions that are there at the outset: those whose twist is given, or the others.
class SpanSource final : public SolveSource {
 public:
  SpanSource(const Mechanics& mechanics, std::span<const Motion> motions, std::span<Solution> out,
             const Effort& effort, Motion::Given given)
      : mechanics_(mechanics), motions_(motions), out_(out), effort_(effort), given_(given) {}

  bool Next(std::size_t, Task* task) override {
    while (next_ < motions_.size() && mechanics_.GivenOf(motions_[next_]) != given_) ++next_;
    if (next_ == motions_.size()) return false;
    *task = {&motions_[next_], &out_[next_], effort_};
    ++next_;
    return true;
  }
  void Done(std::size_t) override {}

 private:
  const Mechanics& mechanics_;
  std::span<const Motion> motions_;
  std::span<Solution> out_;
  Effort effort_;
  Motion::Given given_;
  std::size_t next_ = 0;
};

}  // namespace

Solver::Work::Work(const Vehicle& vehicle, const Grounds& g) : mechanics(vehicle), grounds(g) {
  for (const auto* model : g.models) {
    if (model == nullptr || std::count(models.begin(), models.end(), model) > 0) continue;
    models.push_back(model);
  }
  for (std::size_t k = 0; k < g.models.size(); ++k) {
    const auto at = std::find(models.begin(), models.end(), g.models[k]);
    place.push_back(static_cast<std::uint32_t>(at - models.begin()));
  }
  for (const auto* model : models) fastest.push_back(model->FastestOfRuns());
  body = mechanics.Body();
}

// False: there is nothing to solve, and the solution says so.
bool Solver::Work::Start(const SolveSource::Task& task, std::size_t l) noexcept {
  Lane& lane = lanes[l];
  const Motion& motion = *task.motion;
  Solution& solution = *task.solution;
  lane.motion = &motion;
  lane.solution = &solution;
  lane.effort = task.effort;
  bool known = mechanics.Begin(&lane);
  const int most = draws != nullptr ? static_cast<int>(draws->count()) : 0;
  known = known && motion.draw >= Motion::kMeanGround && motion.draw < most;
  for (std::size_t i = 0; known && i < mechanics.wheels(); ++i) {
    std::size_t soil = motion.soil[i];
    known = soil < grounds.soils.size();
    if (!known) break;
    if (motion.draw >= 0) {
      soil = draws->SoilOf(grounds, soil, static_cast<std::size_t>(motion.draw));
    }
    const std::size_t type = mechanics.vehicle().wheels[i].type;
    lane.soil[i] = static_cast<std::uint8_t>(soil);
    lane.model[i] = place[type * grounds.soils.size() + soil];
    known = lane.model[i] < models.size();
  }
  if (!known) {
    solution = Solution{};
    solution.reasons = kBadInput;
    solution.residual = kNaN;
    return false;
  }
  lane.warm = lane.effort.warm && mechanics.Recall(solution, lane.effort.from_least, &lane);
  if (!lane.warm) mechanics.Guess(&lane);
  const std::size_t n = layout->size;
  const bool recalls = lane.warm && solution.given == given && n <= solution.interval_slope.size();
  for (std::size_t i = 0; i < n; ++i) {
    all.unit[i][l] = lane.unit[i];
    for (std::size_t k = 0; k < n; ++k) {
      all.missing[i][k][l] = recalls ? solution.interval_slope[i][k] : 0;
    }
  }
  all.v_x[l] = lane.v_x;
  all.yaw[l] = lane.yaw;
  all.speed[l] = lane.speed;
  all.load[l] = lane.load;
  all.gravity_x[l] = lane.gravity_x;
  all.gravity_y[l] = lane.gravity_y;
  all.acceleration[l] = motion.acceleration_m_per_s2;
  all.yaw_up[l] = motion.yaw_acceleration_rad_per_s2;
  all.steering[l] = motion.steering_rad;
  all.sds[l] = motion.worse_by_sd;
  for (std::size_t d = 0; d < mechanics.vehicle().drives.size(); ++d) {
    all.rim_given[d][l] = motion.rim_speed_m_per_s[d];
  }
  all.learning[l] = motion.worse_by_sd != 0 || motion.draw >= 0 ? -1 : 0;
  risky = risky || motion.worse_by_sd != 0;
  drawn = drawn || motion.draw >= 0;
  lane.phase = Lane::Phase::kSearch;
  Begin(l);
  return true;
}

void Solver::Work::Finish(std::size_t l) noexcept {
  Lane& lane = lanes[l];
  Solution& s = *lane.solution;
  const bool sloped = lane.motion->grade_rad != 0 || lane.motion->bank_rad != 0;
  Outcome end;
  end.lane = &lane;
  end.tip_margin = all.tip_margin[l];
  for (std::size_t k = 0; k < layout->size; ++k) end.at[k] = all.at[k][l];
  for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
    const pack::Placed& p = all.placed;
    const pack::Felt& f = all.felt;
    end.wheel[i] = {p.v_x[i][l], p.v_y[i][l], p.rim[i][l], p.load[i][l], p.cos[i][l], p.sin[i][l]};
    end.felt[i] = {f.part[0][0][i][l], f.part[1][0][i][l], f.part[2][0][i][l],
                   f.part[3][0][i][l], f.sinkage[i][l],    flags[i * kLanes + l]};
    std::uint32_t& told = end.felt[i].flags;
    if (sloped && (told & surrogate::kAirborne) == 0 && !models[lane.model[i]]->HoldsOnSlopes()) {
      told |= surrogate::kSlope;
    }
  }
  mechanics.Write(end, &s);
  s.speed_margin = 1;
  for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
    if ((end.felt[i].flags & surrogate::kAirborne) != 0) continue;
    const WheelState& w = end.wheel[i];
    const double speed = std::max(std::fabs(w.rim), std::sqrt(w.v_x * w.v_x + w.v_y * w.v_y));
    s.speed_margin = std::min(s.speed_margin, 1 - speed / fastest[lane.model[i]]);
  }
  s.given = given;
  const std::size_t n = std::min(layout->size, s.interval_slope.size());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      s.interval_slope[i][k] = static_cast<float>(all.missing[i][k][l]);
    }
  }
  s.residual = lane.largest;
  s.balanced = s.residual <= Solution::kTolerance;
  // What does not balance inside of what the runs covered is a limit of the ground.
  if (!s.balanced && s.reasons == 0) s.reasons = kNoBalance;
  lane.phase = Lane::Phase::kIdle;
}

void Solver::Work::Run(SolveSource* source, Motion::Given of) {
  given = of;
  layout = &mechanics.layout(given);
  unknowns = Mechanics::UnknownsOf(*layout);
  risky = drawn = false;
  // What the source calls a lane is a seat, and gets the lowest lane that is free: so few motions
  // leave whole groups of lanes empty.
  std::array<bool, kLanes> idle{};  // there was nothing for it
  std::array<std::size_t, kLanes> lane_of;
  lane_of.fill(kLanes);
  for (Lane& lane : lanes) lane.phase = Lane::Phase::kIdle;
  while (true) {
    for (std::size_t seat = 0; seat < kLanes; ++seat) {
      if (lane_of[seat] == kLanes || Active(lane_of[seat])) continue;
      lane_of[seat] = kLanes;
      source->Done(seat);
      idle = {};
    }
    for (std::size_t seat = 0; seat < kLanes; ++seat) {
      while (lane_of[seat] == kLanes && !idle[seat]) {
        SolveSource::Task task;
        idle[seat] = !source->Next(seat, &task);
        if (idle[seat]) break;
        std::size_t l = 0;
        while (Active(l)) ++l;
        if (Start(task, l)) {
          lane_of[seat] = l;
        } else {
          source->Done(seat);
          idle = {};
        }
      }
    }
    std::size_t count = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (Active(l)) count = l + 1;
    }
    if (count == 0 && std::count(idle.begin(), idle.end(), false) == 0) return;
    Round((count + pack::kGroup - 1) / pack::kGroup * pack::kGroup);
  }
}

Solver::Solver(const Vehicle& vehicle, const Grounds& grounds) {
  Check(vehicle);
  if (grounds.soils.empty() || grounds.soils.size() > kMostSoils ||
      grounds.models.size() != vehicle.wheel_types.size() * grounds.soils.size()) {
    throw std::invalid_argument("grounds: got " + std::to_string(grounds.models.size()) +
                                " models, expected wheel types times soils (1 to " +
                                std::to_string(kMostSoils) + ")");
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

void Solver::Work::SolveOne(const Motion& motion, const Effort& effort,
                            Solution* solution) noexcept {
  SpanSource source(mechanics, {&motion, 1}, {solution, 1}, effort, mechanics.GivenOf(motion));
  Run(&source, mechanics.GivenOf(motion));
}

void Solver::Solve(std::span<const Motion> motions, std::span<Solution> out,
                   Effort effort) noexcept {
  const bool controls = std::any_of(motions.begin(), motions.end(), [](const Motion& m) {
    return m.given == Motion::Given::kControls;
  });
  for (const auto given : {Motion::Given::kTwist, Motion::Given::kControls}) {
    if (given == Motion::Given::kControls && !controls) continue;
    SpanSource source(work_->mechanics, motions, out, effort, given);
    work_->Run(&source, given);
  }
  for (std::size_t i = 0; effort.follows && i < motions.size(); ++i) {
    work_->Follow(motions[i], &out[i]);
  }
}

void Solver::Follow(const Motion& motion, Solution* out) noexcept { work_->Follow(motion, out); }

void Solver::Solve(SolveSource* source) { work_->Run(source, Motion::Given::kTwist); }

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

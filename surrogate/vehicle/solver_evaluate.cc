#include <cmath>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

using surrogate::kFx, surrogate::kFy, surrogate::kTorque, surrogate::kMz, surrogate::kSinkage;
using surrogate::kTwoSided90;

constexpr surrogate::Part kParts[5] = {surrogate::kValue, surrogate::kDvX, surrogate::kDvY,
                                       surrogate::kDRim, surrogate::kDLoad};

// Less gross traction (torque over radius: of driving wheels and of braking ones) and lateral
// force, more torque; sds are in proportion to the load.
void Worsen(double pull, double side, double torque, double load, double per_radius, Felt* f) {
  if (!(load > 0)) return;
  // Of a force f, f s/hypot(f, s) is lost: smooth, and what is left keeps its sign and grows with
  // f.
  const double traction = f->torque() * per_radius, per_load = 1 / load;
  const double size = std::sqrt(traction * traction + pull * pull);
  if (size > 0) {
    const double a = pull / size, b = traction / size, share = a * a * a * per_radius;
    f->part[0][0] -= traction * a;
    for (std::size_t k = 1; k < 5; ++k) f->part[k][0] -= share * f->part[k][2];
    f->part[4][0] -= b * b * b * pull * per_load;
  }
  f->part[0][2] += torque;
  f->part[4][2] += torque * per_load;
  const double size_y = std::sqrt(f->f_y() * f->f_y() + side * side);
  if (!(size_y > 0)) return;
  const Four share{1, 1 - side / size_y, 1, 1};
  for (Four& part : f->part) part *= share;
}

}  // namespace

// All wheels of all lanes, a batch for each model.
void Solver::Work::Evaluate() noexcept {
  for (std::size_t m = 0; m < models.size(); ++m) {
    std::size_t n = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Lane& lane = lanes[l];
      if (lane.phase == Lane::Phase::kIdle) continue;
      for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
        if (lane.model[i] != m) continue;
        const Placed& p = lane.placed[i];
        v_x[n] = p.v_x;
        v_y[n] = p.v_y;
        rim[n] = p.rim;
        load[n] = p.load;
        yaw[n] = p.yaw_rate;
        owner[n++] = static_cast<std::uint16_t>(l * kMostWheels + i);
      }
    }
    if (n == 0) continue;
    Ask(*models[m], n);
    const std::uint32_t on_slope = models[m]->HoldsOnSlopes() ? 0u : surrogate::kSlope;
    for (std::size_t s = 0; s < n; ++s) Take(s, on_slope);
  }
}

// The first n states, of one model.
void Solver::Work::Ask(const surrogate::WheelModel& model, std::size_t n) noexcept {
  surrogate::WheelStatesView states;
  states.v_x = std::span(v_x).first(n);
  states.v_y = std::span(v_y).first(n);
  states.rim_speed = std::span(rim).first(n);
  states.load = std::span(load).first(n);
  if (model.UsesYawRate()) states.yaw_rate = std::span(yaw).first(n);
  surrogate::ResponsesView out;
  constexpr surrogate::Output kAsked[4] = {kFx, kFy, kTorque, kMz};
  for (std::size_t o = 0; o < 4; ++o) {
    for (std::size_t p = 0; p < 5; ++p) {
      out.output[kAsked[o]].*surrogate::kPartMembers[kParts[p]] = std::span(answer[o][p]).first(n);
    }
  }
  out.output[kSinkage].value = std::span(sinkage).first(n);
  if (risky || drawn) {
    for (std::size_t o = 0; o < 3; ++o) out.output[kAsked[o]].high = std::span(high[o]).first(n);
  }
  if (drawn) {
    out.output[kMz].high = std::span(high[3]).first(n);
    out.output[kSinkage].high = std::span(high[4]).first(n);
  }
  out.flags = std::span(flags).first(n);
  model.Evaluate(states, out);
  if (drawn) Draw(model, n);
}

// The same answers as those of their motions' draws; intervals move with them.
void Solver::Work::Draw(const surrogate::WheelModel& model, std::size_t n) noexcept {
  constexpr surrogate::Output kDrawn[5] = {kFx, kFy, kTorque, kMz, kSinkage};
  std::array<const surrogate::draws::Member*, kSlots> member;
  for (std::size_t s = 0; s < n; ++s) {
    const Motion& motion = *lanes[owner[s] / kMostWheels].motion;
    const std::size_t soil = motion.soil[owner[s] % kMostWheels];
    member[s] =
        motion.draw < 0 ? nullptr : &draws->of_soil[soil][static_cast<std::size_t>(motion.draw)];
  }
  surrogate::DrawBatch batch{std::span(v_x).first(n),
                             std::span(v_y).first(n),
                             std::span(rim).first(n),
                             std::span(load).first(n),
                             std::span(yaw).first(n),
                             std::span(member).first(n),
                             {},
                             {},
                             {}};
  for (std::size_t o = 0; o < 5; ++o) {
    Batch& value = o < 4 ? answer[o][0] : sinkage;
    batch.value[kDrawn[o]] = std::span(value).first(n);
    batch.high[kDrawn[o]] = std::span(high[o]).first(n);
    for (std::size_t p = 1; p < 5 && o < 4; ++p) {
      batch.slope[kDrawn[o]][p - 1] = std::span(answer[o][p]).first(n);
    }
  }
  if (!risky) {
    surrogate::AddErrors(model, batch);
    return;
  }
  for (std::size_t o = 0; o < 3; ++o) {
    for (std::size_t s = 0; s < n; ++s) half[o][s] = high[o][s] - answer[o][0][s];
  }
  surrogate::AddErrors(model, batch);
  for (std::size_t o = 0; o < 3; ++o) {
    for (std::size_t s = 0; s < n; ++s) high[o][s] = answer[o][0][s] + half[o][s];
  }
}

// The answer to state s, to the wheel that asked. on_slope: flag where the ground is not level.
void Solver::Work::Take(std::size_t s, std::uint32_t on_slope) noexcept {
  const std::size_t lane = owner[s] / kMostWheels, wheel = owner[s] % kMostWheels;
  Felt& to = felt[lane][wheel];
  for (std::size_t p = 0; p < 5; ++p) {
    to.part[p] = Four{answer[0][p][s], answer[1][p][s], answer[2][p][s], answer[3][p][s]};
  }
  to.sinkage = sinkage[s];
  to.flags = flags[s];
  const Motion& motion = *lanes[lane].motion;
  const bool sloped = motion.grade_rad != 0 || motion.bank_rad != 0;
  if (sloped && (to.flags & surrogate::kAirborne) == 0) to.flags |= on_slope;
  const double sds = motion.worse_by_sd;
  if (sds == 0) return;
  const auto sd = [&](std::size_t o) {
    return (high[o][s] - answer[o][0][s]) * (sds / kTwoSided90);
  };
  Worsen(sd(0), sd(1), sd(2) * (rim[s] < 0 ? -1 : 1), load[s], per_radius[wheel], &to);
}

}  // namespace grouser::vehicle

#include <cmath>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

using surrogate::kFx, surrogate::kFy, surrogate::kTorque, surrogate::kMz, surrogate::kSinkage;

constexpr surrogate::Part kParts[5] = {surrogate::kValue, surrogate::kDvX, surrogate::kDvY,
                                       surrogate::kDRim, surrogate::kDLoad};
constexpr double kTouches = 1e-8;  // load of a wheel of a vehicle that tips, over that of all
constexpr surrogate::Output kAsked[4] = {kFx, kFy, kTorque, kMz};

}  // namespace

// Wheel states of the first lanes.
void Solver::Work::Place(std::size_t count) noexcept {
  for (std::size_t l = 0; body.steered != 0 && l < count; ++l) {
    if (!Active(l)) continue;
    const double psi = unknowns.psi >= 0 ? all.at[unknowns.psi][l] : all.steering[l];
    all.psi_cos[l] = std::cos(psi);
    all.psi_sin[l] = std::sin(psi);
  }
  kernel->place(body, unknowns, static_cast<int>(count), &all);
  for (std::size_t l = 0; l < count; ++l) {
    if (all.rare[l] != 0 && Active(l)) Lift(l);
  }
}

// Loads of a vehicle whose wheels are not all down, or which tips.
void Solver::Work::Lift(std::size_t l) noexcept {
  const pack::Body& b = body;
  const double load = all.load[l], m = b.mass, x = b.centre_x, y = b.centre_y, z = b.centre_z;
  const bool given = unknowns.v_x < 0;
  const double v_x = given ? all.v_x[l] : all.at[1][l],
               yaw_rate = given ? all.yaw[l] : all.at[2][l];
  Loads loads;
  mechanics.support().Spread(
      {load, x * load - z * all.f_x[l] + all.at[unknowns.moment][l], y * load - z * all.f_y[l]},
      &loads);
  all.tip_margin[l] = loads.tip_margin;
  for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
    pack::Placed& p = all.placed;
    const Resultant s = loads.tip_margin > 0 ? loads.slope[i] : Resultant{};
    // The edge of the support polygon itself (Support takes the limit from inside): in the air.
    const bool touches = loads.tip_margin > 0 || loads.load[i] > kTouches * load;
    p.load[i][l] = touches ? loads.load[i] : 0;
    p.load_by_moment[i][l] = s.by_x;
    p.load_by_v_y[i][l] = s.by_x * z * m * yaw_rate;
    p.load_by_v_x[i][l] = -s.by_y * z * m * yaw_rate;
    p.load_by_yaw[i][l] = s.by_x * z * m * (all.at[0][l] + 2 * yaw_rate * x) -
                          s.by_y * z * m * (v_x - 2 * yaw_rate * y);
  }
}

// All wheels of the first lanes: where they stand if one model answers for all, most lanes are busy
// and no draw is asked for, else a batch of each model.
void Solver::Work::Evaluate(std::size_t count) noexcept {
  std::uint32_t asked[kSlots], kinds = 0;
  std::size_t active = 0;
  for (std::size_t l = 0; l < count; ++l) {
    if (!Active(l)) continue;
    ++active;
    for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
      const std::uint32_t m = lanes[l].model[i];
      if (kinds > 0 && m == asked[kinds - 1]) continue;
      if (std::find(asked, asked + kinds, m) == asked + kinds) asked[kinds++] = m;
    }
  }
  if (kinds == 1 && 2 * active >= count && !drawn) {
    EvaluateTogether(*models[asked[0]], count);
    return;
  }
  for (std::uint32_t k = 0; k < kinds; ++k) EvaluateApart(asked[k]);
}

// Of all lanes, or wheel by wheel.
void Solver::Work::EvaluateTogether(const surrogate::WheelModel& model,
                                    std::size_t count) noexcept {
  const std::size_t wheels = mechanics.wheels();
  const bool whole = count == kLanes;
  const std::size_t n = whole ? wheels * kLanes : count;
  for (std::size_t i = 0; i < (whole ? 1 : wheels); ++i) {
    surrogate::WheelStatesView states;
    states.v_x = {all.placed.v_x[i], n};
    states.v_y = {all.placed.v_y[i], n};
    states.rim_speed = {all.placed.rim[i], n};
    states.load = {all.placed.load[i], n};
    if (model.UsesYawRate()) states.yaw_rate = {all.placed.yaw[i], n};
    surrogate::ResponsesView out;
    for (std::size_t o = 0; o < 4; ++o) {
      for (std::size_t p = 0; p < 5; ++p) {
        out.output[kAsked[o]].*surrogate::kPartMembers[kParts[p]] = {all.felt.part[o][p][i], n};
      }
      if (risky && o < 3) out.output[kAsked[o]].high = {all.felt.high[o][i], n};
    }
    out.output[kSinkage].value = {all.felt.sinkage[i], n};
    out.flags = std::span(flags).subspan(i * kLanes, n);
    model.Evaluate(states, out);
  }
}

// The wheels of one model among several.
void Solver::Work::EvaluateApart(std::uint32_t m) noexcept {
  const surrogate::WheelModel& model = *models[m];
  std::size_t n = 0;
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (!Active(l)) continue;
    for (std::size_t i = 0; i < mechanics.wheels(); ++i) {
      if (lanes[l].model[i] != m) continue;
      const pack::Placed& p = all.placed;
      v_x[n] = p.v_x[i][l];
      v_y[n] = p.v_y[i][l];
      rim[n] = p.rim[i][l];
      load[n] = p.load[i][l];
      yaw[n] = p.yaw[i][l];
      slot[n++] = static_cast<std::uint16_t>(i * kLanes + l);
    }
  }
  surrogate::WheelStatesView states;
  states.v_x = std::span(v_x).first(n);
  states.v_y = std::span(v_y).first(n);
  states.rim_speed = std::span(rim).first(n);
  states.load = std::span(load).first(n);
  if (model.UsesYawRate()) states.yaw_rate = std::span(yaw).first(n);
  surrogate::ResponsesView out;
  for (std::size_t o = 0; o < 4; ++o) {
    for (std::size_t p = 0; p < 5; ++p) {
      out.output[kAsked[o]].*surrogate::kPartMembers[kParts[p]] = std::span(answer[o][p]).first(n);
    }
    if (drawn || (risky && o < 3)) out.output[kAsked[o]].high = std::span(high[o]).first(n);
  }
  if (drawn) out.output[kSinkage].high = std::span(high[4]).first(n);
  out.output[kSinkage].value = std::span(sinkage).first(n);
  out.flags = std::span(batch_flags).first(n);
  model.Evaluate(states, out);
  if (drawn) Draw(model, n);
  for (std::size_t s = 0; s < n; ++s) Take(s);
}

// The same answers as those of their motions' draws; intervals move with them.
void Solver::Work::Draw(const surrogate::WheelModel& model, std::size_t n) noexcept {
  constexpr surrogate::Output kDrawn[5] = {kFx, kFy, kTorque, kMz, kSinkage};
  std::array<const surrogate::draws::Member*, kSlots> member;
  for (std::size_t s = 0; s < n; ++s) {
    const Lane& lane = lanes[slot[s] % kLanes];
    const Motion& motion = *lane.motion;
    const std::size_t soil = lane.soil[slot[s] / kLanes];
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

// The answer to state s, to the wheel that asked.
void Solver::Work::Take(std::size_t s) noexcept {
  const std::size_t wheel = slot[s] / kLanes, lane = slot[s] % kLanes;
  for (std::size_t o = 0; o < 4; ++o) {
    for (std::size_t p = 0; p < 5; ++p) all.felt.part[o][p][wheel][lane] = answer[o][p][s];
    if (risky && o < 3) all.felt.high[o][wheel][lane] = high[o][s];
  }
  all.felt.sinkage[wheel][lane] = sinkage[s];
  flags[slot[s]] = batch_flags[s];
}

}  // namespace grouser::vehicle

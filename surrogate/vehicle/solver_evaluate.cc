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

}  // namespace

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

}  // namespace grouser::vehicle

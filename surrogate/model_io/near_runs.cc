#include "surrogate/model_io/near_runs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {
namespace {

double SpeedOf(const VelocityState& v) {
  return std::fmax(std::fabs(v.rim_speed), std::hypot(v.v_x, v.v_y));
}

/// On the unit sphere; over the largest first, so that no square overflows.
std::array<double, 3> Direction(const VelocityState& v) {
  const double most = SpeedOf(v);
  const double x = v.v_x / most, y = v.v_y / most, rim = v.rim_speed / most;
  const double norm = std::sqrt(x * x + y * y + rim * rim);
  return {x / norm, y / norm, rim / norm};
}

}  // namespace

double StateSpace::Speed(const VelocityState& motion) const noexcept {
  if (!speeds_.present()) return 0;
  const double speed = SpeedOf(motion);
  const double froude = std::fmin(speed * speed / (gravity_ * radius_m_), speeds_.high);
  return speeds_.Scale(froude) / speeds_.Scale(speeds_.high);
}

StateSpace::Distance StateSpace::Between(const VelocityState& a, double load_a,
                                         const VelocityState& b, double load_b) const noexcept {
  const std::array<double, 3> from = Direction(a), to = Direction(b);
  double least = -1;
  Distance d{};
  for (const bool x : {false, true}) {
    for (const bool y : {false, true}) {
      const double sign = x ? -1 : 1, side = y ? -1 : 1;
      const double d2 = std::pow(from[0] - sign * to[0], 2) + std::pow(from[1] - side * to[1], 2) +
                        std::pow(from[2] - sign * to[2], 2);
      if (least >= 0 && d2 >= least) continue;
      least = d2;
      d.mirrored_x = x;
      d.mirrored_y = y;
    }
  }
  d.direction = std::sqrt(least) / kNearDirection;
  d.load = std::fabs(std::log(load_a) - std::log(load_b)) / kNearLogLoad;
  d.speed = std::fabs(Speed(a) - Speed(b));
  d.total = std::sqrt(d.direction * d.direction + d.load * d.load + d.speed * d.speed);
  return d;
}

std::vector<RunBeside> NearestRuns(const v1alpha1::Provenance& provenance, const StateSpace& space,
                                   const VelocityState& motion, double load, double otherwise,
                                   std::size_t most,
                                   const std::function<bool(const v1alpha1::RunSummary&)>& counts) {
  std::vector<RunBeside> near;
  for (const v1alpha1::RunSummary& run : provenance.runs()) {
    const VelocityState at = MotionOf(run, otherwise > 0 ? otherwise : 1);
    const bool usable = std::isfinite(at.v_x) && run.load_n() > 0 && std::isfinite(run.load_n());
    if (!usable || !counts(run)) continue;
    const RunBeside beside{&run, at, space.Between(motion, load, at, run.load_n())};
    const auto place = std::ranges::upper_bound(
        near, beside.distance.total, {}, [](const RunBeside& r) { return r.distance.total; });
    if (near.size() == most && place == near.end()) continue;
    near.insert(place, beside);
    if (near.size() > most) near.pop_back();  // never more, however many runs a file has
  }
  return near;
}

}  // namespace grouser::surrogate

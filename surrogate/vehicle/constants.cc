#include "surrogate/vehicle/constants.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <tuple>

#include "surrogate/vehicle/ground_spread.h"

namespace grouser::vehicle {
namespace {

constexpr double kSds = 1.6448536269514722;

// Mean y of the wheels of a drive.
double SideOf(const Vehicle& v, int drive) {
  double sum = 0, count = 0;
  for (const Wheel& w : v.wheels) {
    if (w.drive != drive) continue;
    sum += w.y_m;
    ++count;
  }
  return sum / count;
}

// Largest acceleration that balances on the level, over g.
double PullOf(Solver* solver, Motion motion, const StopWhen& stop) {
  const double g = solver->vehicle().gravity_m_per_s2;
  double low = 0, high = 2;
  for (int i = 0; i < 20; ++i) {
    const double middle = (low + high) / 2;
    motion.acceleration_m_per_s2 = middle * g;
    Solution s;
    StopIfAsked(stop);
    solver->Solve({&motion, 1}, {&s, 1});
    (s.balanced && s.tip_margin > 0 ? low : high) = middle;
  }
  return low;
}

/// Drives of both sides and the distance of their wheels.
struct Sides {
  std::size_t left, right;
  double track;
};
Sides SidesOf(const Vehicle& v) {
  const std::size_t left = SideOf(v, 0) > SideOf(v, 1) ? 0 : 1;
  return {left, 1 - left, std::fabs(SideOf(v, 0) - SideOf(v, 1))};
}

// Of one soil, speed and radius; but for the pull.
SkidConstants ConstantsAt(Solver* solver, const Sides& sides, const Motion& motion, double radius) {
  const double speed = motion.v_x_m_per_s;
  const std::array<Solution, 3> s = SolveSpread(solver, motion, kSds);
  std::array<double, 3> separation, wheel;
  for (std::size_t k = 0; k < 3; ++k) {
    const double l = s[k].rim_speed_m_per_s[sides.left], r = s[k].rim_speed_m_per_s[sides.right];
    separation[k] = s[k].balanced ? (r - l) * radius / (sides.track * speed) : NAN;
    wheel[k] = s[k].balanced ? 2 * speed / (l + r) : NAN;
  }
  SkidConstants c{};
  c.speed_m_per_s = speed;
  c.radius_m = radius;
  c.separation_multiplier = separation[0];
  std::tie(c.separation_low, c.separation_high) = EndsOf(separation[1], separation[2]);
  c.radius_multiplier = wheel[0];
  std::tie(c.radius_low, c.radius_high) = EndsOf(wheel[1], wheel[2]);
  const double sd_v = speed * (c.radius_high - c.radius_low) / (2 * kSds * wheel[0]);
  const double sd_w =
      speed / radius * (c.separation_high - c.separation_low) / (2 * kSds * separation[0]);
  c.variance_speed = sd_v * sd_v;
  c.variance_yaw_rate = sd_w * sd_w;
  c.reasons = s[0].reasons;
  return c;
}

void CheckConstants(const Vehicle& v, const Grounds& grounds, std::span<const double> speeds,
                    std::span<const double> radii, std::span<const std::uint8_t> soils) {
  if (v.steered()) {
    throw std::invalid_argument("constants: got steered wheels, expected a skid-steered vehicle");
  }
  for (const auto list : {speeds, radii}) {
    for (const double x : list) {
      if (!(x > 0) || !std::isfinite(x)) {
        throw std::invalid_argument("constants: got " + std::to_string(x) +
                                    ", expected speeds and radii above 0");
      }
    }
  }
  for (const std::uint8_t soil : soils) {
    if (soil >= grounds.soils.size()) {
      throw std::invalid_argument("constants: got soil " + std::to_string(soil) +
                                  ", expected 0 to " + std::to_string(grounds.soils.size() - 1));
    }
  }
}

}  // namespace

std::vector<SkidConstants> ConstantsOf(const Vehicle& v, const Grounds& grounds,
                                       std::span<const double> speeds,
                                       std::span<const double> radii, const StopWhen& stop,
                                       std::span<const std::uint8_t> soils) {
  CheckConstants(v, grounds, speeds, radii, soils);
  Solver solver(v, grounds);
  const Sides sides = SidesOf(v);
  std::vector<SkidConstants> out;
  const std::size_t count = soils.empty() ? grounds.soils.size() : soils.size();
  for (std::size_t k = 0; k < count; ++k) {
    const auto soil = soils.empty() ? static_cast<std::uint8_t>(k) : soils[k];
    Motion straight = Motion::OnPath(*std::min_element(speeds.begin(), speeds.end()), 0);
    straight.soil.fill(soil);
    const double pull = PullOf(&solver, straight, stop);
    straight.worse_by_sd = kSds;
    const double pull_low = PullOf(&solver, straight, stop);
    for (const double speed : speeds) {
      for (const double radius : radii) {
        Motion motion = Motion::OnPath(speed, 1 / radius);
        motion.soil.fill(soil);
        StopIfAsked(stop);
        SkidConstants c = ConstantsAt(&solver, sides, motion, radius);
        c.soil = grounds.soils[soil];
        c.pull_over_weight = pull;
        c.pull_low = pull_low;
        out.push_back(c);
      }
    }
  }
  return out;
}

std::string YamlOf(const Vehicle& v, std::span<const SkidConstants> constants) {
  const double track = SidesOf(v).track;
  std::string out;
  for (const SkidConstants& c : constants) {
    char text[1600];
    std::snprintf(text, sizeof text,
                  "---\n# %s on %s, %g m/s, radius %g m. Reasons: %s\ndiff_drive_controller:\n"
                  "  ros__parameters:\n    wheel_separation: %.6g\n    wheel_radius: %.6g\n"
                  "    wheel_separation_multiplier: %.6g  # 90 %%: %.6g to %.6g\n"
                  "    left_wheel_radius_multiplier: %.6g  # 90 %%: %.6g to %.6g\n"
                  "    right_wheel_radius_multiplier: %.6g\n"
                  "    twist_covariance_diagonal: [%.6g, 0.0, 0.0, 0.0, 0.0, %.6g]\n"
                  "traction:\n  pull_over_weight: %.4g  # 5 %%: %.4g\n",
                  v.name.c_str(), c.soil.c_str(), c.speed_m_per_s, c.radius_m,
                  c.reasons == 0 ? "none" : NamesOf(c.reasons).c_str(), track,
                  v.wheel_types[v.wheels[0].type].radius_m, c.separation_multiplier,
                  c.separation_low, c.separation_high, c.radius_multiplier, c.radius_low,
                  c.radius_high, c.radius_multiplier, c.variance_speed, c.variance_yaw_rate,
                  c.pull_over_weight, c.pull_low);
    out += text;
  }
  return out;
}

}  // namespace grouser::vehicle

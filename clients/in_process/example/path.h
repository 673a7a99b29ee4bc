#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

/// Where a rover should be: a straight, a left turn of 90 degrees, a straight.
/// The first straight starts at the origin and goes along +x. SI.
struct Path {
  double straight = 0.3, turn_radius = 2.0;

  struct Pose {
    double x, y, yaw;
  };
  double turn_length() const { return turn_radius * std::numbers::pi / 2; }

  /// After arc length s >= 0.
  Pose At(double s) const {
    if (s <= straight) return {s, 0, 0};
    const double angle = (s - straight) / turn_radius;
    if (s <= straight + turn_length()) {
      return {straight + turn_radius * std::sin(angle), turn_radius * (1 - std::cos(angle)), angle};
    }
    return {straight + turn_radius, turn_radius + s - straight - turn_length(),
            std::numbers::pi / 2};
  }

  /// Arc length of the point of the path that is nearest to (x, y).
  double Nearest(double x, double y) const {
    const double angle =
        std::clamp(std::atan2(x - straight, turn_radius - y), 0.0, std::numbers::pi / 2);
    const double ends = straight + turn_length();
    const double candidates[] = {std::clamp(x, 0.0, straight), straight + turn_radius * angle,
                                 ends + std::max(0.0, y - turn_radius)};
    return *std::min_element(std::begin(candidates), std::end(candidates),
                             [&](double a, double b) { return Off(a, x, y) < Off(b, x, y); });
  }

  /// Distance of (x, y) from the point at s [m].
  double Off(double s, double x, double y) const {
    const Pose p = At(s);
    return std::hypot(p.x - x, p.y - y);
  }
};

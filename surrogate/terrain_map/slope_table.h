#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::terrain_map {

/// Slopes that one heading can be driven on, from lo to hi; none where lo > hi.
struct Interval {
  float lo = 1, hi = 0;
  bool any() const { return lo <= hi; }
};

/// What is asked of the ground, and how finely it is tabulated.
struct TableOptions {
  vehicle::SpeedOptions limits;  ///< speed limit, risk (worse_by_sd) and margins
  std::size_t headings = 72;     ///< nodes of heading around the way up
  std::size_t slopes = 33;       ///< nodes from the lowest to the highest driven slope
};

/// Speed shares at which power is tabulated, of the safe speed.
inline constexpr std::array<double, 3> kShares = {0.25, 0.5, 1};

/// What a soil answers on a slope and heading.
struct GroundAnswer {
  double safe_m_per_s = 0;     ///< highest safe forward speed v_x; 0: none
  vehicle::Binding binding{};  ///< what keeps it from being higher, or from being driven
  vehicle::GoProbability go;   ///< creeping
};

/// Answers of one vehicle on one soil by slope and heading. For each heading node h (evenly around
/// the way up) it holds
/// - for rising levels z of the ground's quality (standard deviations worse than the mean) the
///   slopes [lo_z(h), hi_z(h)] that are driven creeping within every margin;
/// - at slopes lo + u (hi - lo), u evenly from 0 to 1, of the interval at the risk asked for: safe
///   speed, what binds, electric power on mean ground at kShares of that speed;
/// - what ends the interval at either side.
/// Between nodes: lo and hi linearly in h, speed and power bilinearly in (u, h), z linearly in the
/// slope between the two levels around it; what binds is that of the nearest node. So an edge of
/// what can be driven stays an edge, where a grid of grade and bank would blur it by its spacing.
class SlopeTable {
 public:
  struct Edge {
    vehicle::Binding below{}, beyond{};  ///< what binds on less and on more slope
  };
  std::string soil;
  double speed_limit_m_per_s = 0;
  std::size_t headings = 0, slopes = 0;
  std::vector<double> levels;  ///< ascending, from kFewestSds to kMostSds
  std::size_t risk = 0;        ///< index of the level at which speeds are safe
  /// At level * headings + heading. `most` is empty where it is equal to `least`.
  std::vector<Interval> least, most;
  double level_least_sd = 0, level_most_sd = 0;  ///< z on level ground
  /// At heading * slopes + slope.
  std::vector<float> speed;
  std::vector<std::uint8_t> binding;
  std::array<std::vector<float>, kShares.size()> power_w;
  std::vector<Edge> edges;  ///< by heading

  GroundAnswer At(double slope_rad, double heading_rad) const noexcept;
  /// Electric power [W] on mean ground at a speed of at most the safe one there; NaN where nothing
  /// is driven.
  double PowerAt(double slope_rad, double heading_rad, double speed_m_per_s) const noexcept;

  static constexpr double kFewestSds = -4, kMostSds = 4;

 private:
  struct Place;
  struct Node;
  Place PlaceOf(double heading_rad) const noexcept;
  Interval Between(const std::vector<Interval>& all, std::size_t level, const Place& p) const;
  bool NodeOf(double slope_rad, const Place& p, Node* node) const noexcept;
  double Bilinear(const std::vector<float>& values, const Place& p, const Node& n) const noexcept;
  double Probability(const std::vector<Interval>& all, double level_sd, double slope_rad,
                     const Place& p) const noexcept;
};

/// Probability of ground at most z standard deviations worse than the mean; 0 and 1 at the ends of
/// what is searched.
double ProbabilityOf(double z) noexcept;

}  // namespace grouser::terrain_map

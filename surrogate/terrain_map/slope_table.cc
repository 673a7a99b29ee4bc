#include "surrogate/terrain_map/slope_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace grouser::terrain_map {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// What has no share may be NaN.
double Mix(double a, double b, double share) {
  return share == 0 ? a : share == 1 ? b : a + share * (b - a);
}

}  // namespace

double ProbabilityOf(double z) noexcept {
  if (z <= SlopeTable::kFewestSds) return 0;
  if (z >= SlopeTable::kMostSds) return 1;
  return 0.5 * std::erfc(-z / std::numbers::sqrt2);
}

/// Heading between two nodes.
struct SlopeTable::Place {
  std::size_t left, right;
  double share;
};
/// Slope between two nodes of the driven interval.
struct SlopeTable::Node {
  std::size_t low;
  double share;
};

SlopeTable::Place SlopeTable::PlaceOf(double heading_rad) const noexcept {
  double turn = heading_rad / (2 * std::numbers::pi);
  turn -= std::floor(turn);
  const double at = turn * static_cast<double>(headings);
  const std::size_t left = std::min(static_cast<std::size_t>(at), headings - 1);
  return {left, left + 1 == headings ? 0 : left + 1, at - static_cast<double>(left)};
}

Interval SlopeTable::Between(const std::vector<Interval>& all, std::size_t level,
                             const Place& p) const {
  const Interval &a = all[level * headings + p.left], &b = all[level * headings + p.right];
  if (!a.any()) return p.share < 1 ? a : b;
  if (!b.any()) return p.share > 0 ? b : a;
  return {static_cast<float>(Mix(a.lo, b.lo, p.share)),
          static_cast<float>(Mix(a.hi, b.hi, p.share))};
}

// False: not driven at the risk asked for.
bool SlopeTable::NodeOf(double slope_rad, const Place& p, Node* node) const noexcept {
  const Interval driven = Between(least, risk, p);
  if (!(slope_rad >= driven.lo && slope_rad <= driven.hi)) return false;
  const double width = double{driven.hi} - double{driven.lo};
  const double u = width > 0 ? (slope_rad - driven.lo) / width : 0;
  const double at = u * static_cast<double>(slopes - 1);
  node->low = std::min(static_cast<std::size_t>(at), slopes - 2);
  node->share = at - static_cast<double>(node->low);
  return true;
}

double SlopeTable::Bilinear(const std::vector<float>& values, const Place& p,
                            const Node& n) const noexcept {
  const float* a = &values[p.left * slopes + n.low];
  const float* b = &values[p.right * slopes + n.low];
  return Mix(Mix(a[0], a[1], n.share), Mix(b[0], b[1], n.share), p.share);
}

// By the highest level that is still driven, and how near the next one is.
double SlopeTable::Probability(const std::vector<Interval>& all, double level_sd, double slope_rad,
                               const Place& p) const noexcept {
  const auto inside = [&](const Interval& i) { return slope_rad >= i.lo && slope_rad <= i.hi; };
  Interval here = Between(all, 0, p);
  if (!inside(here)) return 0;
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
    const Interval next = Between(all, k + 1, p);
    if (inside(next)) {
      here = next;
      continue;
    }
    // From the edge of this level to that of the next, or to the level ground where that is best.
    double share = 0, to = levels[k + 1];
    if (next.any()) {
      const bool above = slope_rad > next.hi;
      const double edge = above ? here.hi : here.lo, other = above ? next.hi : next.lo;
      share = edge == other ? 0 : (slope_rad - edge) / (other - edge);
    } else if (here.lo <= 0 && level_sd > levels[k]) {
      share = here.hi > 0 ? 1 - slope_rad / here.hi : 0;
      to = std::min(to, level_sd);
    }
    return ProbabilityOf(Mix(levels[k], to, share));
  }
  return 1;
}

GroundAnswer SlopeTable::At(double slope_rad, double heading_rad) const noexcept {
  const Place p = PlaceOf(heading_rad);
  const std::size_t nearest = p.share < 0.5 ? p.left : p.right;
  GroundAnswer answer;
  answer.go.least = Probability(least, level_least_sd, slope_rad, p);
  answer.go.most = most.empty() ? answer.go.least : Probability(most, level_most_sd, slope_rad, p);
  Node node;
  if (NodeOf(slope_rad, p, &node)) {
    answer.safe_m_per_s = Bilinear(speed, p, node);
    answer.binding = static_cast<vehicle::Binding>(
        binding[nearest * slopes + node.low + (node.share < 0.5 ? 0 : 1)]);
  } else {
    const Interval& driven = least[risk * headings + nearest];
    answer.binding =
        driven.any() && slope_rad < driven.lo ? edges[nearest].below : edges[nearest].beyond;
  }
  return answer;
}

double SlopeTable::PowerAt(double slope_rad, double heading_rad,
                           double speed_m_per_s) const noexcept {
  const Place p = PlaceOf(heading_rad);
  Node node;
  if (!NodeOf(slope_rad, p, &node)) return kNaN;
  const double safe = Bilinear(speed, p, node);
  if (!(safe > 0)) return kNaN;
  // The parabola through the three shares.
  const double x = std::clamp(speed_m_per_s / safe, 0.0, 1.0);
  double power = 0;
  for (std::size_t i = 0; i < kShares.size(); ++i) {
    double weight = 1;
    for (std::size_t k = 0; k < kShares.size(); ++k) {
      if (k != i) weight *= (x - kShares[k]) / (kShares[i] - kShares[k]);
    }
    if (weight != 0) power += weight * Bilinear(power_w[i], p, node);
  }
  return power;
}

}  // namespace grouser::terrain_map

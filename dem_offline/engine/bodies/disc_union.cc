#include "dem_offline/engine/bodies/disc_union.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace grouser::dem {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Adds the arc of a circle from angle `from` to `to`. With w = r + a c + b s
/// (c, s: cosine and sine of the angle; a, b: centre) x dy - y dx = r w dangle;
/// the products with x, y, x^2, ... are polynomials in c and s.
void AddArc(const PlaneDisc& d, double from, double to, PlaneMoments* sum) {
  const double a = d.x, b = d.y, r = d.radius, r2 = r * r;
  const double c0 = std::cos(from), s0 = std::sin(from), c1 = std::cos(to), s1 = std::sin(to);
  // Integrals of c^m s^n over the arc.
  const double one = to - from, c = s1 - s0, s = c0 - c1;
  const double cs = 0.5 * (s1 * s1 - s0 * s0), bend = s1 * c1 - s0 * c0;
  const double cc = 0.5 * (one + bend), ss = 0.5 * (one - bend);
  const double sines = (s1 * s1 * s1 - s0 * s0 * s0) / 3;
  const double cosines = (c1 * c1 * c1 - c0 * c0 * c0) / 3;
  const double ccc = c - sines, css = sines, ccs = -cosines, sss = s + cosines;
  const double e = a * a + r2, f = b * b + r2;
  sum->area += r * (r * one + a * c + b * s) / 2;
  sum->x += r * (a * r * one + e * c + a * b * s + r * (a * cc + b * cs)) / 3;
  sum->y += r * (b * r * one + a * b * c + f * s + r * (a * cs + b * ss)) / 3;
  sum->xx += r *
             (a * a * r * one + a * (e + r2) * c + a * a * b * s + r * (a * a + e) * cc +
              2 * a * b * r * cs + r2 * (a * ccc + b * ccs)) /
             4;
  sum->yy += r *
             (b * b * r * one + b * (f + r2) * s + b * b * a * c + r * (b * b + f) * ss +
              2 * a * b * r * cs + r2 * (b * sss + a * css)) /
             4;
  sum->xy += r *
             (a * b * r * one + b * e * c + a * f * s + a * b * r * (cc + ss) +
              r * (b * b + e) * cs + r2 * (a * ccs + b * css)) /
             4;
}

double Apart(const PlaneDisc& a, const PlaneDisc& b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// Discs that lie in no other; of equal ones the first.
std::vector<PlaneDisc> Outer(const std::vector<PlaneDisc>& discs) {
  std::vector<PlaneDisc> outer;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    bool within = false;
    for (std::size_t j = 0; j < discs.size() && !within; ++j) {
      if (i == j) continue;
      const double apart = Apart(discs[i], discs[j]);
      const double rounding = 1e-13 * std::max(discs[i].radius, discs[j].radius);
      const bool in = apart + discs[i].radius <= discs[j].radius + rounding;
      const bool same = in && apart + discs[j].radius <= discs[i].radius + rounding;
      within = in && !(same && i < j);
    }
    if (!within) outer.push_back(discs[i]);
  }
  return outer;
}

}  // namespace

PlaneMoments UnionMoments(const std::vector<PlaneDisc>& discs) {
  const std::vector<PlaneDisc> outer = Outer(discs);
  PlaneMoments sum;
  std::vector<std::pair<double, double>> covered;
  for (std::size_t i = 0; i < outer.size(); ++i) {
    const PlaneDisc& d = outer[i];
    covered.clear();
    for (std::size_t j = 0; j < outer.size(); ++j) {
      const PlaneDisc& o = outer[j];
      const double apart = Apart(d, o);
      if (i == j || apart >= d.radius + o.radius || apart <= std::abs(d.radius - o.radius))
        continue;
      const double cosine =
          (apart * apart + d.radius * d.radius - o.radius * o.radius) / (2 * apart * d.radius);
      const double half = std::acos(std::clamp(cosine, -1.0, 1.0));
      double from = std::atan2(o.y - d.y, o.x - d.x) - half;
      if (from < 0) from += kTurn;
      const double to = from + 2 * half;
      covered.emplace_back(from, std::min(to, kTurn));
      if (to > kTurn) covered.emplace_back(0, to - kTurn);
    }
    std::sort(covered.begin(), covered.end());
    double free = 0;  // everything below is done
    for (const auto& [from, to] : covered) {
      if (from > free) AddArc(d, free, from, &sum);
      free = std::max(free, to);
    }
    if (free < kTurn) AddArc(d, free, kTurn, &sum);
  }
  return sum;
}

}  // namespace grouser::dem

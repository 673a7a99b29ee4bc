#include "dem_offline/engine/experiment/ruts.h"

#include <algorithm>
#include <cmath>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/experiment/treads.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kLeastPeriod = 0.5, kMostPeriod = 1.5;  // of the spacing without slip
constexpr double kAlike = 0.8;      // of the largest peak: one at half its lag is the period
constexpr double kLeastFields = 8;  // of that spacing

/// Straight line of least squares through (x, y), and the standard error of its slope.
struct StraightLine {
  double at_zero = 0, slope = 0, error = std::numeric_limits<double>::quiet_NaN();
};
StraightLine Fit(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, rest = 0;
  for (std::size_t k = 0; k < x.size(); ++k) mean_x += x[k] / n, mean_y += y[k] / n;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - mean_x) * (x[k] - mean_x);
    xy += (x[k] - mean_x) * (y[k] - mean_y);
  }
  StraightLine out;
  out.slope = xy / xx;
  out.at_zero = mean_y - out.slope * mean_x;
  for (std::size_t k = 0; k < x.size(); ++k) {
    rest += std::pow(y[k] - out.at_zero - out.slope * x[k], 2);
  }
  if (n > 2) out.error = std::sqrt(rest / (n - 2) / xx);
  return out;
}

/// The heights about the straight line through them.
std::vector<double> Levelled(std::vector<double> height) {
  std::vector<double> x, y;
  for (std::size_t k = 0; k < height.size(); ++k) {
    if (std::isnan(height[k])) continue;
    x.push_back(static_cast<double>(k));
    y.push_back(height[k]);
  }
  if (x.size() < kLeastFields) return {};
  const StraightLine line = Fit(x, y);
  for (std::size_t k = 0; k < height.size(); ++k) {
    height[k] -= line.at_zero + line.slope * static_cast<double>(k);
  }
  return height;
}

/// Mean of h(x) h(x + lag) over the fields where both are known.
double Correlation(const std::vector<double>& h, std::size_t lag) {
  double sum = 0, n = 0;
  for (std::size_t k = 0; k + lag < h.size(); ++k) {
    const double product = h[k] * h[k + lag];
    if (std::isnan(product)) continue;
    sum += product;
    ++n;
  }
  return n > 0 ? sum / n : -std::numeric_limits<double>::infinity();
}

/// In fields; 0: none.
std::size_t PeriodOf(const std::vector<double>& h, double unslipped) {
  if (static_cast<double>(h.size()) < 2 * unslipped) return 0;
  const auto first = static_cast<std::size_t>(std::lround(kLeastPeriod * unslipped));
  const auto last = static_cast<std::size_t>(std::lround(kMostPeriod * unslipped));
  std::vector<double> score;
  for (std::size_t lag = first; lag <= last; ++lag) score.push_back(Correlation(h, lag));
  const auto best = std::max_element(score.begin(), score.end());
  if (best == score.begin() || best + 1 == score.end() || !(*best > 0)) return 0;
  std::size_t k = 1;  // a peak, and as high
  while (score[k] < score[k - 1] || score[k] < score[k + 1] || score[k] < kAlike * *best) ++k;
  return first + k;
}

std::vector<std::size_t> BottomsOf(const std::vector<double>& h, std::size_t period) {
  std::vector<std::size_t> out;
  const std::size_t half = period / 2, margin = period / 4;
  for (std::size_t k = margin; k + margin < h.size(); ++k) {
    bool lowest = !std::isnan(h[k]);
    for (std::size_t o = k > half ? k - half : 0; o < std::min(h.size(), k + half + 1); ++o) {
      if (h[o] < h[k] || (h[o] == h[k] && o < k)) lowest = false;
    }
    if (lowest) out.push_back(k);
  }
  return out;
}

}  // namespace

Ruts FindRuts(const Trace& trace, double unslipped_m) {
  Ruts out;
  const std::vector<double> h = Levelled(trace.height_m);
  const std::size_t period = PeriodOf(h, unslipped_m / trace.step_m);
  if (period == 0) return out;
  out.bottoms = BottomsOf(h, period);
  std::vector<double> crest;  // between two bottoms
  std::vector<double> number, x;
  for (std::size_t k = 0; k < out.bottoms.size(); ++k) {
    const std::size_t from = k > 0 ? out.bottoms[k - 1] : 0, to = out.bottoms[k];
    if (k > 0) {
      crest.push_back(h[from]);
      for (std::size_t o = from; o < to; ++o) crest.back() = std::fmax(crest.back(), h[o]);
    }
    const double gap = static_cast<double>(to - from) / static_cast<double>(period);
    number.push_back(k == 0 ? 0 : number.back() + std::max(1.0, std::round(gap)));
    x.push_back(trace.from_m + static_cast<double>(to) * trace.step_m);
  }
  if (crest.empty()) return Ruts{};
  const StraightLine line = Fit(number, x);
  out.spacing_m = line.slope;
  out.spacing_error_m = line.error;
  out.mean_depth_m = 0;
  for (std::size_t k = 0; k < out.bottoms.size(); ++k) {
    const double before = crest[k > 0 ? k - 1 : 0], after = crest[std::min(k, crest.size() - 1)];
    out.depth_m.push_back(0.5 * (before + after) - h[out.bottoms[k]]);
    out.mean_depth_m += out.depth_m.back() / static_cast<double>(out.bottoms.size());
  }
  return out;
}

double UnslippedSpacing(const Shape& shape) {
  const Shape::Ring& ring = shape.rings.front();
  return 2 * M_PI * ring.outer_radius / ring.count;
}

Trace TraceOf(const std::vector<double>& surface, const Probe& p, double from_m, double to_m) {
  const Region& r = p.region;
  Trace out;
  out.step_m = (r.high_m[0] - r.low_m[0]) / p.n[0];
  for (int ix = 0; ix < p.n[0]; ++ix) {
    const double x = r.low_m[0] + (ix + 0.5) * out.step_m;
    if (!(x > from_m && x < to_m)) continue;
    if (out.height_m.empty()) out.from_m = x;
    double sum = 0, n = 0;
    for (int iy = 0; iy < p.n[1]; ++iy) {
      const double h = surface[static_cast<std::size_t>(ix) * p.n[1] + iy];
      if (!std::isnan(h)) sum += h, ++n;
    }
    out.height_m.push_back(sum / n);  // NaN where there is none
  }
  return out;
}

void CheckRuts(const Experiment& e, const std::string& at, const Probe& p) {
  CheckTreads(e, at, p);
  CheckWithin(at + ".from_s", p.from_s, 0, 1e300);
  if (p.region.radius_m > 0) {
    throw SpecError(at + ".region.radius_m", "a round region of ruts", "low_m and high_m alone");
  }
  for (const BodySpec& b : e.bodies) {
    if (b.name != p.body) continue;
    const double least = kLeastFields * (p.region.high_m[0] - p.region.low_m[0]) /
                         UnslippedSpacing(ShapeOf(b.parts, at));
    if (p.n[0] >= least && p.n[2] == 1) continue;
    const std::string got = std::to_string(p.n[0]) + ", " + std::to_string(p.n[1]) + ", ";
    throw SpecError(at + ".n", "[" + got + std::to_string(p.n[2]) + "]",
                    "[" + Short(std::ceil(least)) +
                        " or more along x, lines across y, 1]: eight fields to the spacing of the "
                        "ruts without slip");
  }
}

}  // namespace grouser::dem::experiment

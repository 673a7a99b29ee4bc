#include "surrogate/terrain_map/driven_slopes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {
namespace {

constexpr double kStep = 2.5 * std::numbers::pi / 180;
constexpr int kSteps = 28;
constexpr int kInnerSteps = 16;  // of an interval whose lower edge is no longer driven
constexpr int kGrowSteps = 8;    // out from an edge, a level better
constexpr double kResolution = 2e-4;
constexpr Interval kAnySlope = {0, static_cast<float>(kStep* kSteps)};

// One heading on its way: an edge between a slope that is driven and one that is not.
struct Edge {
  std::size_t heading = 0;
  double good = 0, bad = 0;
};

class Search {
 public:
  Search(vehicle::Solver* solver, std::uint8_t soil, const vehicle::SpeedOptions& limits,
         std::size_t headings, bool unknown)
      : solver_(solver), soil_(soil), limits_(limits), headings_(headings), unknown_(unknown) {}

  double Heading(std::size_t h) const {
    return 2 * std::numbers::pi * static_cast<double>(h) / static_cast<double>(headings_);
  }
  void Ask(std::size_t heading, double slope, double sd) {
    motions_.push_back(MotionOn(slope, Heading(heading), 0, sd, soil_));
  }
  /// What was asked, in that order.
  const std::vector<char>& Answer() {
    solutions_.resize(motions_.size());
    solver_->Solve(motions_, solutions_);
    goes_.resize(motions_.size());
    for (std::size_t i = 0; i < motions_.size(); ++i) {
      goes_[i] = Goes(solutions_[i], limits_, unknown_);
      unknown_decides_ |= !goes_[i] && (solutions_[i].reasons & vehicle::kUntrained) != 0;
    }
    motions_.clear();
    return goes_;
  }
  void Narrow(std::vector<Edge>* edges, double sd) {
    while (true) {
      std::vector<Edge*> open;
      for (Edge& e : *edges) {
        if (std::fabs(e.bad - e.good) <= kResolution) continue;
        Ask(e.heading, (e.good + e.bad) / 2, sd);
        open.push_back(&e);
      }
      if (open.empty()) return;
      const std::vector<char>& goes = Answer();
      for (std::size_t i = 0; i < open.size(); ++i) {
        Edge& e = *open[i];
        (goes[i] ? e.good : e.bad) = (e.good + e.bad) / 2;
      }
    }
  }
  /// The intervals of one level within `outer`, looked at in steps.
  std::vector<Interval> Scan(const std::vector<Interval>& outer, int steps, double sd) {
    const auto slope = [&](const Interval& o, int i) { return o.lo + (o.hi - o.lo) * i / steps; };
    std::vector<std::size_t> asked;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!outer[h].any()) continue;
      for (int i = 0; i <= steps; ++i) Ask(h, slope(outer[h], i), sd);
      asked.push_back(h);
    }
    std::vector<Interval> out(headings_);
    std::vector<Edge> low, high;
    const std::vector<char>& goes = Answer();
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const std::size_t h = asked[k];
      const char* g = &goes[k * static_cast<std::size_t>(steps + 1)];
      int a = 0;
      while (a <= steps && !g[a]) ++a;
      if (a > steps) continue;
      int b = a;
      while (b < steps && g[b + 1]) ++b;
      out[h] = {static_cast<float>(slope(outer[h], a)), static_cast<float>(slope(outer[h], b))};
      if (a > 0) low.push_back({h, out[h].lo, slope(outer[h], a - 1)});
      if (b < steps) high.push_back({h, out[h].hi, slope(outer[h], b + 1)});
    }
    Narrow(&low, sd);
    Narrow(&high, sd);
    for (const Edge& e : low) out[e.heading].lo = static_cast<float>(e.good);
    for (const Edge& e : high) out[e.heading].hi = static_cast<float>(e.good);
    return out;
  }
  /// The same where most lower edges still hold: these are asked first.
  std::vector<Interval> Shrink(const std::vector<Interval>& outer, double sd) {
    std::vector<std::size_t> asked;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!outer[h].any()) continue;
      Ask(h, outer[h].lo, sd);
      Ask(h, outer[h].hi, sd);
      asked.push_back(h);
    }
    std::vector<Interval> out(headings_), rest(headings_);
    std::vector<Edge> high;
    bool any = false;
    const std::vector<char> goes = Answer();
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const std::size_t h = asked[k];
      if (!goes[2 * k]) {
        rest[h] = outer[h];
        any = true;
        continue;
      }
      out[h] = outer[h];
      if (!goes[2 * k + 1]) high.push_back({h, outer[h].lo, outer[h].hi});
    }
    Narrow(&high, sd);
    for (const Edge& e : high) out[e.heading].hi = static_cast<float>(e.good);
    if (!any) return out;
    const std::vector<Interval> scanned = Scan(rest, kInnerSteps, sd);
    for (std::size_t h = 0; h < headings_; ++h) {
      if (rest[h].any()) out[h] = scanned[h];
    }
    return out;
  }
  /// Better ground than that of `inner`: out from its edges to the first slope that is not driven;
  /// where it has none, anywhere.
  std::vector<Interval> Grow(const std::vector<Interval>& inner, double sd) {
    std::vector<Interval> all(headings_), out = inner;
    std::vector<Edge> edges;
    for (const bool up : {true, false}) {
      const auto slope = [&](const Interval& i, int k) {
        return up ? i.hi + kStep * k : std::max(0.0, i.lo - kStep * k);
      };
      std::vector<std::size_t> asked;
      for (std::size_t h = 0; h < headings_; ++h) {
        if (!inner[h].any()) {
          all[h] = kAnySlope;
        } else if (up || inner[h].lo > 0) {
          for (int k = 1; k <= kGrowSteps; ++k) Ask(h, slope(inner[h], k), sd);
          asked.push_back(h);
        }
      }
      edges.clear();
      const std::vector<char>& goes = Answer();
      for (std::size_t n = 0; n < asked.size(); ++n) {
        const std::size_t h = asked[n];
        int k = 0;
        while (k < kGrowSteps && goes[n * kGrowSteps + static_cast<std::size_t>(k)]) ++k;
        edges.push_back({h, slope(inner[h], k), slope(inner[h], std::min(k + 1, kGrowSteps))});
      }
      Narrow(&edges, sd);
      for (const Edge& e : edges) {
        (up ? out[e.heading].hi : out[e.heading].lo) = static_cast<float>(e.good);
      }
    }
    const std::vector<Interval> anywhere = Scan(all, kSteps, sd);
    for (std::size_t h = 0; h < headings_; ++h) {
      if (all[h].any()) out[h] = anywhere[h];
    }
    return out;
  }
  /// The worst ground on which the level is driven.
  double LevelSd() {
    double low = SlopeTable::kFewestSds, high = SlopeTable::kMostSds;
    for (const double end : {low, high}) {
      Ask(0, 0, end);
      const bool good = Answer()[0] != 0;
      if (good == (end > 0)) return end;
    }
    while (high - low > 2e-3) {
      Ask(0, 0, (low + high) / 2);
      (Answer()[0] ? low : high) = (low + high) / 2;
    }
    return low;
  }
  bool unknown_decides() const { return unknown_decides_; }

 private:
  vehicle::Solver* solver_;
  std::uint8_t soil_;
  const vehicle::SpeedOptions& limits_;
  std::size_t headings_;
  bool unknown_, unknown_decides_ = false;
  std::vector<vehicle::Motion> motions_;
  std::vector<vehicle::Solution> solutions_;
  std::vector<char> goes_;
};

}  // namespace

vehicle::Motion MotionOn(double slope_rad, double heading_rad, double speed_m_per_s,
                         double worse_by_sd, std::uint8_t soil) {
  constexpr double kCreeping = 1e-9;  // [m/s]: at rest, about to move forward
  const Attitude attitude = AttitudeOf(slope_rad, heading_rad);
  vehicle::Motion m = vehicle::Motion::OnPath(std::max(speed_m_per_s, kCreeping), 0);
  m.grade_rad = attitude.grade_rad;
  m.bank_rad = attitude.bank_rad;
  m.worse_by_sd = worse_by_sd;
  m.soil.fill(soil);
  return m;
}

bool Goes(const vehicle::Solution& s, const vehicle::SpeedOptions& o, bool unknown) {
  using vehicle::kLimits, vehicle::kNoBalance, vehicle::kUntrained;
  const bool untrained = (s.reasons & kUntrained) != 0;
  if (!s.balanced) {
    return unknown && untrained && (s.reasons & (kLimits & ~kNoBalance)) == 0;
  }
  return (s.reasons & kLimits) == 0 && (unknown || !untrained) && s.tip_margin >= o.tip_margin &&
         s.torque_margin >= o.torque_margin && s.sinkage_margin >= o.sinkage_margin;
}

DrivenSlopes FindDrivenSlopes(vehicle::Solver* solver, std::uint8_t soil,
                              const vehicle::SpeedOptions& limits,
                              const std::vector<double>& levels, std::size_t headings, bool unknown,
                              const Progress& progress) {
  Search search(solver, soil, limits, headings, unknown);
  DrivenSlopes out;
  const std::size_t n = levels.size();
  const auto middle =
      static_cast<std::size_t>(std::lower_bound(levels.begin(), levels.end(), 0) - levels.begin());
  std::vector<std::vector<Interval>> found(n);
  std::size_t done = 0;
  const auto tick = [&] { progress(static_cast<double>(done++) / static_cast<double>(n)); };
  tick();
  found[middle] = search.Scan(std::vector<Interval>(headings, kAnySlope), kSteps, levels[middle]);
  for (std::size_t k = middle + 1; k < n; ++k) {
    tick();
    found[k] = search.Shrink(found[k - 1], levels[k]);
  }
  for (std::size_t k = middle; k-- > 0;) {
    tick();
    found[k] = search.Grow(found[k + 1], levels[k]);
  }
  for (const auto& intervals : found) {
    out.intervals.insert(out.intervals.end(), intervals.begin(), intervals.end());
  }
  out.level_sd = search.LevelSd();
  out.unknown_decides = search.unknown_decides();
  return out;
}

}  // namespace grouser::terrain_map

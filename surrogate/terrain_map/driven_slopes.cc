#include "surrogate/terrain_map/driven_slopes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "surrogate/terrain_map/creeping.h"

namespace grouser::terrain_map {
namespace {

constexpr double kStep = 2.5 * std::numbers::pi / 180;
constexpr int kSteps = 28;
constexpr int kInnerSteps = 16;  // of an interval whose lower edge is no longer driven
constexpr int kGrowSteps = 8;    // out from an edge, a level better
constexpr double kResolution = 2e-4;
constexpr Interval kAnySlope = {0, static_cast<float>(kStep* kSteps)};

// One heading on its way: an edge between a slope that is driven, and its solution, and one that
// is not, and what binds there.
struct Edge {
  std::size_t heading = 0;
  double good = 0, bad = 0;
  vehicle::Solution at_good;
  vehicle::Binding binding{};
};

// What is driven at one level of the ground, by heading; solutions at both ends.
struct Level {
  std::vector<Interval> intervals;
  std::vector<vehicle::Solution> lo, hi;
  std::vector<SlopeTable::Edge> edges;

  explicit Level(std::size_t headings, Interval all = {})
      : intervals(headings, all), lo(headings), hi(headings), edges(headings) {}
  void Put(const std::vector<Edge>& found, bool upper) {
    for (const Edge& e : found) {
      Interval& i = intervals[e.heading];
      (upper ? i.hi : i.lo) = static_cast<float>(e.good);
      (upper ? hi : lo)[e.heading] = e.at_good;
      (upper ? edges[e.heading].beyond : edges[e.heading].below) = e.binding;
    }
  }
  void Copy(const Level& from, std::size_t h) {
    intervals[h] = from.intervals[h];
    lo[h] = from.lo[h];
    hi[h] = from.hi[h];
    edges[h] = from.edges[h];
  }
};

class Search {
 public:
  Search(vehicle::Solver* solver, std::uint8_t soil, const vehicle::SpeedOptions& limits,
         std::size_t headings, bool unknown)
      : ask_(solver, soil, limits, headings, unknown), headings_(headings) {}

  void Narrow(std::vector<Edge>* edges, double sd) {
    while (true) {
      std::vector<Edge*> open;
      for (Edge& e : *edges) {
        if (std::fabs(e.bad - e.good) <= kResolution) continue;
        ask_.Ask(e.heading, (e.good + e.bad) / 2, sd, &e.at_good);
        open.push_back(&e);
      }
      if (open.empty()) return;
      ask_.Answer(1);
      for (std::size_t i = 0; i < open.size(); ++i) {
        Edge& e = *open[i];
        (ask_.goes(i) ? e.good : e.bad) = (e.good + e.bad) / 2;
        if (ask_.goes(i)) {
          e.at_good = ask_.solution(i);
        } else {
          e.binding = ask_.BindingAt(i);
        }
      }
    }
  }
  /// The intervals of one level within `outer`, looked at in steps.
  Level Scan(const Level& outer, int steps, double sd) {
    const auto slope = [&](std::size_t h, int i) {
      const Interval& o = outer.intervals[h];
      return o.lo + (o.hi - o.lo) * i / steps;
    };
    std::vector<std::size_t> asked;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!outer.intervals[h].any()) continue;
      for (int i = 0; i <= steps; ++i) ask_.Ask(h, slope(h, i), sd, &outer.lo[h]);
      asked.push_back(h);
    }
    Level out(headings_);
    out.edges = outer.edges;
    std::vector<Edge> low, high;
    const auto row = static_cast<std::size_t>(steps + 1);
    ask_.Answer(row);
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const std::size_t h = asked[k];
      const auto at = [&](int i) { return k * row + static_cast<std::size_t>(i); };
      int a = 0;
      while (a <= steps && !ask_.goes(at(a))) ++a;
      if (a > steps) {
        out.edges[h].below = out.edges[h].beyond = ask_.BindingAt(at(0));
        continue;
      }
      int b = a;
      while (b < steps && ask_.goes(at(b + 1))) ++b;
      out.intervals[h] = {static_cast<float>(slope(h, a)), static_cast<float>(slope(h, b))};
      out.lo[h] = ask_.solution(at(a));
      out.hi[h] = ask_.solution(at(b));
      if (a > 0) {
        low.push_back({h, slope(h, a), slope(h, a - 1), out.lo[h], ask_.BindingAt(at(a - 1))});
      }
      if (b < steps) {
        high.push_back({h, slope(h, b), slope(h, b + 1), out.hi[h], ask_.BindingAt(at(b + 1))});
      }
    }
    Narrow(&low, sd);
    Narrow(&high, sd);
    out.Put(low, false);
    out.Put(high, true);
    return out;
  }
  /// The same where most lower edges still hold: these are asked first.
  Level Shrink(const Level& outer, double sd) {
    std::vector<std::size_t> asked;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!outer.intervals[h].any()) continue;
      ask_.Ask(h, outer.intervals[h].lo, sd, &outer.lo[h]);
      ask_.Ask(h, outer.intervals[h].hi, sd, &outer.hi[h]);
      asked.push_back(h);
    }
    Level out(headings_), rest(headings_);
    out.edges = outer.edges;
    std::vector<Edge> high;
    bool any = false;
    ask_.Answer(2);
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const std::size_t h = asked[k];
      const Interval& o = outer.intervals[h];
      if (!ask_.goes(2 * k)) {
        rest.Copy(outer, h);
        any = true;
        continue;
      }
      out.intervals[h] = o;
      out.lo[h] = ask_.solution(2 * k);
      out.hi[h] = ask_.solution(2 * k + 1);
      if (!ask_.goes(2 * k + 1)) {
        high.push_back({h, o.lo, o.hi, out.lo[h], ask_.BindingAt(2 * k + 1)});
      }
    }
    Narrow(&high, sd);
    out.Put(high, true);
    if (!any) return out;
    const Level scanned = Scan(rest, kInnerSteps, sd);
    for (std::size_t h = 0; h < headings_; ++h) {
      if (rest.intervals[h].any()) out.Copy(scanned, h);
    }
    return out;
  }
  /// Better ground than that of `inner`: out from its edges to the first slope that is not driven;
  /// where it has none, anywhere.
  Level Grow(const Level& inner, double sd) {
    Level all(headings_), out = inner;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!inner.intervals[h].any()) all.intervals[h] = kAnySlope;
    }
    for (const bool up : {true, false}) out.Put(GrowSide(inner, up, sd), up);
    const Level anywhere = Scan(all, kSteps, sd);
    for (std::size_t h = 0; h < headings_; ++h) {
      if (all.intervals[h].any()) out.Copy(anywhere, h);
    }
    return out;
  }
  /// The worst ground on which the level is driven.
  double LevelSd() {
    double low = SlopeTable::kFewestSds, high = SlopeTable::kMostSds;
    vehicle::Solution near;
    const auto good = [&](double sd) {
      ask_.Ask(0, 0, sd, &near);
      ask_.Answer(1);
      if (ask_.goes(0)) near = ask_.solution(0);
      return ask_.goes(0);
    };
    if (!good(low)) return low;
    if (good(high)) return high;
    while (high - low > 2e-3) {
      const double middle = (low + high) / 2;
      (good(middle) ? low : high) = middle;
    }
    return low;
  }
  bool unknown_decides() const { return ask_.unknown_decides(); }

 private:
  std::vector<Edge> GrowSide(const Level& inner, bool up, double sd) {
    const auto slope = [&](std::size_t h, int k) {
      const Interval& i = inner.intervals[h];
      return up ? i.hi + kStep * k : std::max(0.0, i.lo - kStep * k);
    };
    std::vector<Edge> edges;
    for (std::size_t h = 0; h < headings_; ++h) {
      if (!inner.intervals[h].any() || (!up && !(inner.intervals[h].lo > 0))) continue;
      edges.push_back({h, slope(h, 0), slope(h, 0), (up ? inner.hi : inner.lo)[h],
                       up ? inner.edges[h].beyond : inner.edges[h].below});
      for (int k = 1; k <= kGrowSteps; ++k) ask_.Ask(h, slope(h, k), sd, &edges.back().at_good);
    }
    ask_.Answer(kGrowSteps);
    for (std::size_t n = 0; n < edges.size(); ++n) {
      Edge& e = edges[n];
      for (int k = 1; k <= kGrowSteps; ++k) {
        const std::size_t i = n * kGrowSteps + static_cast<std::size_t>(k - 1);
        e.bad = slope(e.heading, k);
        if (!ask_.goes(i)) {
          e.binding = ask_.BindingAt(i);
          break;
        }
        e.good = e.bad;
        e.at_good = ask_.solution(i);
      }
    }
    Narrow(&edges, sd);
    return edges;
  }

  CreepingBatch ask_;
  std::size_t headings_;
};

}  // namespace

DrivenSlopes FindDrivenSlopes(vehicle::Solver* solver, std::uint8_t soil,
                              const vehicle::SpeedOptions& limits,
                              const std::vector<double>& levels, std::size_t headings, bool unknown,
                              const Progress& progress) {
  Search search(solver, soil, limits, headings, unknown);
  DrivenSlopes out;
  const std::size_t n = levels.size();
  const auto middle =
      static_cast<std::size_t>(std::lower_bound(levels.begin(), levels.end(), 0) - levels.begin());
  std::vector<Level> found(n, Level(headings));
  std::size_t done = 0;
  const auto tick = [&] { progress(static_cast<double>(done++) / static_cast<double>(n)); };
  tick();
  found[middle] = search.Scan(Level(headings, kAnySlope), kSteps, levels[middle]);
  for (std::size_t k = middle + 1; k < n; ++k) {
    tick();
    found[k] = search.Shrink(found[k - 1], levels[k]);
  }
  for (std::size_t k = middle; k-- > 0;) {
    tick();
    found[k] = search.Grow(found[k + 1], levels[k]);
  }
  for (const Level& l : found) {
    out.intervals.insert(out.intervals.end(), l.intervals.begin(), l.intervals.end());
    out.edges.insert(out.edges.end(), l.edges.begin(), l.edges.end());
  }
  out.level_sd = search.LevelSd();
  out.unknown_decides = search.unknown_decides();
  return out;
}

}  // namespace grouser::terrain_map

#include "surrogate/terrain_map/build_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "surrogate/terrain_map/creeping.h"
#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {
namespace {

using vehicle::Need;

constexpr std::size_t kStretch = 400;      // states of a walk that are planned at a time
constexpr int kSweeps = 8;                 // to mend nodes from their neighbours
constexpr double kBeside = 1e-3;           // [rad]
constexpr double kLeastSpeed = 1.0 / 512;  // over the limit, at which power is asked: half a level

// Slope of a node of one heading's column.
double SlopeOf(const SlopeTable& t, std::size_t h, std::size_t row) {
  const Interval& i = t.least[t.risk * t.headings + h];
  if (!i.any()) return 0;
  const double u = static_cast<double>(row) / static_cast<double>(t.slopes - 1);
  return i.lo + u * (double{i.hi} - double{i.lo});
}

// Heading and row of the k-th state of a walk: up one column and down the next, or around one row
// and back around the next, so that neighbours on the walk are neighbours in the table.
std::pair<std::size_t, std::size_t> StateAt(const SlopeTable& t, bool columns, std::size_t k) {
  const std::size_t inner = columns ? t.slopes : t.headings;
  const std::size_t outer = k / inner, at = k % inner;
  const std::size_t turned = outer % 2 == 0 ? at : inner - 1 - at;
  return columns ? std::pair(outer, turned) : std::pair(turned, outer);
}

double HeadingOf(const SlopeTable& t, std::size_t h) {
  return 2 * std::numbers::pi * static_cast<double>(h) / static_cast<double>(t.headings);
}

// By two walks, the higher of both speeds: each was found driven, but a walk may miss a balance
// that exists, above all on ice. In stretches, between which it can be ended.
void FillSpeeds(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds, std::uint8_t soil,
                const vehicle::SpeedOptions& limits, SlopeTable* t, const Progress& progress) {
  const std::size_t n = t->headings * t->slopes;
  t->speed.assign(n, -1);
  t->binding.resize(n);
  std::size_t done = 0;
  for (const bool columns : {true, false}) {
    for (std::size_t first = 0; first < n;) {
      progress(static_cast<double>(done) / static_cast<double>(2 * n));
      // A single one left over is no path.
      const std::size_t last = first + kStretch + 1 >= n ? n : first + kStretch;
      std::vector<SlopeHeading> states;
      for (std::size_t k = first; k < last; ++k) {
        const auto [h, row] = StateAt(*t, columns, k);
        states.push_back({SlopeOf(*t, h, row), HeadingOf(*t, h)});
      }
      const std::vector<vehicle::SpeedPoint> plan =
          SafeSpeeds(vehicle, grounds, soil, limits, states);
      for (std::size_t k = first; k < last; ++k) {
        const auto [h, row] = StateAt(*t, columns, k);
        const vehicle::SpeedPoint& p = plan[k - first];
        const std::size_t i = h * t->slopes + row;
        const bool any = t->least[t->risk * t->headings + h].any();
        const float safe = any ? static_cast<float>(p.safe_m_per_s) : 0.0F;
        if (safe <= t->speed[i]) continue;
        t->speed[i] = safe;
        t->binding[i] = static_cast<std::uint8_t>(p.safe_binding);
      }
      done += last - first;
      first = last;
    }
  }
}

// The fastest of the four neighbours of a node.
std::size_t FastestBeside(const SlopeTable& t, std::size_t i) {
  const std::size_t h = i / t.slopes, row = i % t.slopes, n = t.headings;
  std::size_t best = i;
  const auto look = [&](std::size_t k) { best = t.speed[k] > t.speed[best] ? k : best; };
  look((h + 1) % n * t.slopes + row);
  look((h + n - 1) % n * t.slopes + row);
  if (row > 0) look(i - 1);
  if (row + 1 < t.slopes) look(i + 1);
  return best;
}

// Nodes that are driven creeping, but that both walks missed (an edge found from a neighbour's
// solution is apt to be one): asked from the solution of the fastest node beside them, by halves of
// its speed. At single states a solve stalls at 1e-4 of the weight: it then stands for them what
// is found kBeside next to them. Returns whether one became driven.
bool Raise(vehicle::Solver* solver, std::uint8_t soil, const vehicle::SpeedOptions& limits,
           SlopeTable* t) {
  const auto motion = [&](std::size_t i, double turned, double v) {
    const std::size_t h = i / t->slopes;
    return MotionOn(SlopeOf(*t, h, i % t->slopes), HeadingOf(*t, h) + turned, v, limits.worse_by_sd,
                    soil);
  };
  bool any = false;
  for (std::size_t i = 0; i < t->speed.size(); ++i) {
    const std::size_t beside = FastestBeside(*t, i);
    double low = 0, high = t->speed[beside];
    if (t->speed[i] > 0 || !(high > 0) || !t->least[t->risk * t->headings + i / t->slopes].any()) {
      continue;
    }
    const vehicle::Motion there = motion(beside, 0, high);
    vehicle::Solution near;
    solver->Solve({&there, 1}, {&near, 1});
    auto binding = static_cast<vehicle::Binding>(t->binding[beside]);
    const auto goes = [&](double v) {
      for (const double turned : {0.0, kBeside, -kBeside}) {
        const vehicle::Motion m = motion(i, turned, v);
        const vehicle::Solution s = SolveNear(solver, m, near);
        if (Goes(s, limits, false)) {
          near = s;
          return true;
        }
        binding = BindingOf(m, s, limits, solver->vehicle().gravity_m_per_s2);
      }
      return false;
    };
    if (goes(high)) {
      low = high;
      binding = static_cast<vehicle::Binding>(t->binding[beside]);
    }
    while (high - low > 2 * kLeastSpeed * limits.speed_limit_m_per_s) {
      (goes((low + high) / 2) ? low : high) = (low + high) / 2;
    }
    if (!(low > 0)) continue;
    t->speed[i] = static_cast<float>(low);
    t->binding[i] = static_cast<std::uint8_t>(binding);
    any = true;
  }
  return any;
}

void FillPower(vehicle::Solver* solver, std::uint8_t soil, SlopeTable* t,
               const Progress& progress) {
  const std::size_t n = t->speed.size();
  std::vector<vehicle::Motion> motions(n);
  std::vector<vehicle::Solution> solutions(n);
  for (std::size_t share = 0; share < kShares.size(); ++share) {
    progress(static_cast<double>(share) / kShares.size());
    for (std::size_t i = 0; i < n; ++i) {
      const double v = std::max<double>(t->speed[i], kLeastSpeed * t->speed_limit_m_per_s);
      const std::size_t h = i / t->slopes, row = i % t->slopes;
      motions[i] = MotionOn(SlopeOf(*t, h, row), HeadingOf(*t, h), kShares[share] * v, 0, soil);
    }
    solver->Solve(motions, solutions);
    std::vector<float>& power = t->power_w[share];
    power.assign(n, std::nanf(""));
    for (std::size_t i = 0; i < n; ++i) {
      if (solutions[i].balanced) power[i] = static_cast<float>(solutions[i].electric_power_w);
    }
    // At an edge the mean ground may not balance at the least speed: as one node further in.
    for (std::size_t i = 1; i < n; ++i) {
      if (std::isnan(power[i]) && i % t->slopes > 0) power[i] = power[i - 1];
    }
    for (std::size_t i = n - 1; i-- > 0;) {
      if (std::isnan(power[i]) && i % t->slopes + 1 < t->slopes) power[i] = power[i + 1];
    }
  }
}

}  // namespace

std::vector<vehicle::SpeedPoint> SafeSpeeds(const vehicle::Vehicle& vehicle,
                                            const vehicle::Grounds& grounds, std::uint8_t soil,
                                            vehicle::SpeedOptions limits,
                                            std::span<const SlopeHeading> states) {
  constexpr double kWay = 1e4;  // [m] between the states: no acceleration
  std::vector<vehicle::PathPoint> path;
  for (const SlopeHeading& s : states) {
    const Attitude a = AttitudeOf(s.slope_rad, s.heading_rad);
    path.push_back({.s_m = kWay * static_cast<double>(path.size()),
                    .grade_rad = a.grade_rad,
                    .bank_rad = a.bank_rad,
                    .soil = soil});
  }
  limits.start_m_per_s = limits.end_m_per_s = limits.speed_limit_m_per_s;
  std::vector<vehicle::SpeedPoint> plan(path.size());
  vehicle::SpeedPlanner(vehicle, grounds, path.size()).Plan(path, limits, plan);
  return plan;
}

SlopeTable BuildTable(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds,
                      std::uint8_t soil, const TableOptions& options, const Progress& progress) {
  const vehicle::SpeedOptions& limits = options.limits;
  const double risk = limits.worse_by_sd;
  Need(risk > SlopeTable::kFewestSds && risk < SlopeTable::kMostSds, "worse_by_sd",
       "a number between -4 and 4");
  Need(limits.trained_only, "trained_only", "true");
  Need(options.headings >= 4 && options.slopes >= 3, "headings, slopes", "4 and 3 or more");
  SlopeTable t;
  t.soil = grounds.soils.at(soil);
  t.speed_limit_m_per_s = limits.speed_limit_m_per_s;
  t.headings = options.headings;
  t.slopes = options.slopes;
  t.levels = {SlopeTable::kFewestSds, -3, -2, -1, 0, 1, 2, 3, SlopeTable::kMostSds};
  const auto place = std::lower_bound(t.levels.begin(), t.levels.end(), risk);
  t.risk = static_cast<std::size_t>(place - t.levels.begin());
  if (*place != risk) t.levels.insert(place, risk);
  vehicle::Solver solver(vehicle, grounds);
  const auto part = [&](double from, double to) {
    return [&progress, from, to](double done) { progress(from + done * (to - from)); };
  };
  DrivenSlopes found =
      FindDrivenSlopes(&solver, soil, limits, t.levels, t.headings, false, part(0, 0.4));
  t.least = std::move(found.intervals);
  const auto edges = found.edges.begin() + static_cast<std::ptrdiff_t>(t.risk * t.headings);
  t.edges.assign(edges, edges + static_cast<std::ptrdiff_t>(t.headings));
  t.level_least_sd = t.level_most_sd = found.level_sd;
  if (found.unknown_decides) {
    found = FindDrivenSlopes(&solver, soil, limits, t.levels, t.headings, true, part(0.4, 0.7));
    t.most = std::move(found.intervals);
    t.level_most_sd = found.level_sd;
  }
  FillSpeeds(vehicle, grounds, soil, limits, &t, part(0.7, 0.95));
  for (int sweep = 0; sweep < kSweeps && Raise(&solver, soil, limits, &t); ++sweep) {
    progress(0.95);
  }
  FillPower(&solver, soil, &t, part(0.95, 1));
  progress(1);
  return t;
}

}  // namespace grouser::terrain_map

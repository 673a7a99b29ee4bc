#include "surrogate/terrain_map/build_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {
namespace {

using vehicle::Need;

constexpr double kBeyond = 5e-3;           // [rad] from an edge to where it is asked what binds
constexpr double kLeastSpeed = 1.0 / 512;  // over the limit, at which power is asked: half a level

// Slopes of one heading's column: below the driven interval, its nodes, beyond it.
double SlopeOf(const SlopeTable& t, std::size_t h, std::size_t row) {
  const Interval& i = t.least[t.risk * t.headings + h];
  if (!i.any()) return 0;
  if (row == 0) return std::max(0.0, i.lo - kBeyond);
  if (row > t.slopes) return i.hi + kBeyond;
  const double u = static_cast<double>(row - 1) / static_cast<double>(t.slopes - 1);
  return i.lo + u * (double{i.hi} - double{i.lo});
}

// Heading and row of the k-th state of a walk: up one column and down the next, or around one row
// and back around the next, so that neighbours on the walk are neighbours in the table.
std::pair<std::size_t, std::size_t> StateAt(const SlopeTable& t, bool columns, std::size_t k) {
  const std::size_t rows = t.slopes + 2, inner = columns ? rows : t.headings;
  const std::size_t outer = k / inner, at = k % inner;
  const std::size_t turned = outer % 2 == 0 ? at : inner - 1 - at;
  return columns ? std::pair(outer, turned) : std::pair(turned, outer);
}

double HeadingOf(const SlopeTable& t, std::size_t h) {
  return 2 * std::numbers::pi * static_cast<double>(h) / static_cast<double>(t.headings);
}

// By two walks, the higher of both speeds: each was found driven, but a walk may miss a balance
// that exists, above all on ice.
void FillSpeeds(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds, std::uint8_t soil,
                const vehicle::SpeedOptions& limits, SlopeTable* t) {
  t->speed.assign(t->headings * t->slopes, -1);
  t->binding.resize(t->speed.size());
  t->edges.resize(t->headings);
  for (const bool columns : {true, false}) {
    std::vector<SlopeHeading> states;
    for (std::size_t k = 0; k < (t->slopes + 2) * t->headings; ++k) {
      const auto [h, row] = StateAt(*t, columns, k);
      states.push_back({SlopeOf(*t, h, row), HeadingOf(*t, h)});
    }
    const std::vector<vehicle::SpeedPoint> plan =
        SafeSpeeds(vehicle, grounds, soil, limits, states);
    for (std::size_t k = 0; k < plan.size(); ++k) {
      const auto [h, row] = StateAt(*t, columns, k);
      if (row == 0) t->edges[h].below = plan[k].safe_binding;
      if (row > t->slopes) t->edges[h].beyond = plan[k].safe_binding;
      if (row == 0 || row > t->slopes) continue;
      const std::size_t i = h * t->slopes + row - 1;
      const bool any = t->least[t->risk * t->headings + h].any();
      const float safe = any ? static_cast<float>(plan[k].safe_m_per_s) : 0.0F;
      if (safe <= t->speed[i]) continue;
      t->speed[i] = safe;
      t->binding[i] = static_cast<std::uint8_t>(plan[k].safe_binding);
    }
  }
}

void FillPower(vehicle::Solver* solver, std::uint8_t soil, SlopeTable* t) {
  const std::size_t n = t->speed.size();
  std::vector<vehicle::Motion> motions(n);
  std::vector<vehicle::Solution> solutions(n);
  for (std::size_t share = 0; share < kShares.size(); ++share) {
    for (std::size_t i = 0; i < n; ++i) {
      const double v = std::max<double>(t->speed[i], kLeastSpeed * t->speed_limit_m_per_s);
      const std::size_t h = i / t->slopes, row = i % t->slopes + 1;
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
  t.level_least_sd = t.level_most_sd = found.level_sd;
  if (found.unknown_decides) {
    found = FindDrivenSlopes(&solver, soil, limits, t.levels, t.headings, true, part(0.4, 0.7));
    t.most = std::move(found.intervals);
    t.level_most_sd = found.level_sd;
  }
  progress(0.7);
  FillSpeeds(vehicle, grounds, soil, limits, &t);
  progress(0.95);
  FillPower(&solver, soil, &t);
  progress(1);
  return t;
}

}  // namespace grouser::terrain_map

#include "surrogate/terrain_map/table_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "surrogate/terrain_map/creeping.h"
#include "surrogate/terrain_map/slope.h"
#include "surrogate/vehicle/energy.h"

namespace grouser::terrain_map {
namespace {

Errors ErrorsOf(std::vector<double> errors) {
  Errors out;
  out.skipped = std::erase_if(errors, [](double e) { return std::isnan(e); });
  out.count = errors.size();
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  const auto at = [&](double share) {
    return errors[static_cast<std::size_t>(share * static_cast<double>(errors.size() - 1))];
  };
  out.median = at(0.5);
  out.p95 = at(0.95);
  out.largest = errors.back();
  return out;
}

// Slope from the state to where the table changes its mind on that heading, to 0.3 mrad.
double ToEdge(const SlopeTable& table, double slope, double heading) {
  constexpr double kStep = 3e-4;
  const bool driven = table.At(slope, heading).safe_m_per_s > 0;
  for (double d = kStep; d < 0.5; d += kStep) {
    for (const double at : {slope - d, slope + d}) {
      if (at >= 0 && (table.At(at, heading).safe_m_per_s > 0) != driven) return d;
    }
  }
  return 0.5;
}

// Highest safe speed [m/s] of one state by itself; 0: not even creeping.
double SafeSpeed(vehicle::Solver* solver, const SlopeHeading& at, std::uint8_t soil,
                 const vehicle::SpeedOptions& limits) {
  constexpr int kLevels = 256;
  const auto goes = [&](int level) {
    const vehicle::Motion m =
        MotionOn(at.slope_rad, at.heading_rad, limits.speed_limit_m_per_s * level / kLevels,
                 limits.worse_by_sd, soil);
    vehicle::Solution s;
    solver->Solve({&m, 1}, {&s, 1});
    return Goes(s, limits, false);
  };
  if (!goes(0)) return 0;
  int low = 0, high = kLevels + 1;
  for (int level = kLevels; high - low > 1; level = (low + high) / 2) {
    (goes(level) ? low : high) = level;
  }
  return limits.speed_limit_m_per_s * low / kLevels;
}

}  // namespace

TableErrors CheckTable(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds,
                       std::uint8_t soil, const TableOptions& options, const SlopeTable& table,
                       std::size_t states, std::uint32_t seed, const Progress& progress) {
  double steepest = 0.05;
  for (std::size_t h = 0; h < table.headings; ++h) {
    const Interval& i = table.least[table.risk * table.headings + h];
    if (i.any()) steepest = std::max<double>(steepest, i.hi);
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> even(0, 1);
  std::vector<SlopeHeading> at(states);
  for (SlopeHeading& s : at) {
    s = {1.2 * steepest * even(random), 2 * std::numbers::pi * even(random)};
  }
  vehicle::SpeedPlanner planner(vehicle, grounds, 1);
  vehicle::Solver solver(vehicle, grounds);

  TableErrors out;
  out.states = states;
  std::vector<double> speed, energy, direct_energy, go;
  for (std::size_t i = 0; i < states; ++i) {
    progress(static_cast<double>(i) / static_cast<double>(states));
    const auto [slope, heading] = at[i];
    const GroundAnswer answer = table.At(slope, heading);
    const vehicle::Motion creeping = MotionOn(slope, heading, 0, 0, soil);
    go.push_back(
        std::fabs(answer.go.least - planner.ProbabilityToGo(creeping, options.limits).least));
    const double direct = SafeSpeed(&solver, at[i], soil, options.limits);
    if ((direct > 0) != (answer.safe_m_per_s > 0)) {
      ++(direct > 0 ? out.only_direct : out.only_table);
      out.edge_rad = std::max(out.edge_rad, ToEdge(table, slope, heading));
      continue;
    }
    if (!(direct > 0)) continue;
    speed.push_back(std::fabs(answer.safe_m_per_s - direct) / options.limits.speed_limit_m_per_s);
    const vehicle::PowerInterval power =
        PowerOf(&solver, MotionOn(slope, heading, direct, 0, soil));
    const double there = power.solution.balanced ? power.mean.electric / direct : std::nan("");
    const double here = table.PowerAt(slope, heading, answer.safe_m_per_s) / answer.safe_m_per_s;
    energy.push_back(std::fabs(here - there));
    direct_energy.push_back(std::fabs(there));
  }
  out.speed = ErrorsOf(speed);
  const double typical = ErrorsOf(direct_energy).median;
  for (double& e : energy) e /= typical;
  out.energy = ErrorsOf(energy);
  out.go = ErrorsOf(go);
  return out;
}

}  // namespace grouser::terrain_map

#include "surrogate/terrain_map/table_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "surrogate/terrain_map/slope.h"
#include "surrogate/vehicle/energy.h"

namespace grouser::terrain_map {
namespace {

Errors ErrorsOf(std::vector<double> errors) {
  Errors out;
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

}  // namespace

TableErrors CheckTable(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds,
                       std::uint8_t soil, const TableOptions& options, const SlopeTable& table,
                       std::size_t states, std::uint32_t seed) {
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
  const std::vector<vehicle::SpeedPoint> plan =
      SafeSpeeds(vehicle, grounds, soil, options.limits, at);
  vehicle::SpeedPlanner planner(vehicle, grounds, 1);
  vehicle::Solver solver(vehicle, grounds);

  TableErrors out;
  out.states = states;
  std::vector<double> speed, energy, direct_energy, go;
  for (std::size_t i = 0; i < states; ++i) {
    const auto [slope, heading] = at[i];
    const GroundAnswer answer = table.At(slope, heading);
    const vehicle::Motion creeping = MotionOn(slope, heading, 0, 0, soil);
    go.push_back(
        std::fabs(answer.go.least - planner.ProbabilityToGo(creeping, options.limits).least));
    const double direct = plan[i].safe_m_per_s;
    if ((direct > 0) != (answer.safe_m_per_s > 0)) {
      ++(direct > 0 ? out.only_direct : out.only_table);
      out.edge_rad = std::max(out.edge_rad, ToEdge(table, slope, heading));
      continue;
    }
    if (!(direct > 0)) continue;
    speed.push_back(std::fabs(answer.safe_m_per_s - direct) / options.limits.speed_limit_m_per_s);
    const vehicle::PowerInterval power =
        PowerOf(&solver, MotionOn(slope, heading, direct, 0, soil));
    if (!power.solution.balanced) continue;
    const double there = power.mean.electric / direct;
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

#include "surrogate/terrain_map/cell.h"

#include <algorithm>
#include <cmath>

#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {

CellAnswer AnswerOf(std::span<const SlopeTable> tables, std::span<const float> probabilities,
                    double negligible, double slope_rad, double heading_rad) noexcept {
  const float most_probable = *std::max_element(probabilities.begin(), probabilities.end());
  const auto counts = [&](float p) {
    double sum = 0;  // of those that are as improbable or more so
    for (const float other : probabilities) sum += other <= p ? other : 0;
    return sum >= negligible || p == most_probable;
  };
  CellAnswer out;
  double speed = -1, least = 0, most = 0;
  for (std::size_t s = 0; s < tables.size(); ++s) {
    const float p = probabilities[s];
    if (!(p > 0)) continue;
    const GroundAnswer ground = tables[s].At(slope_rad, heading_rad);
    least += p * ground.go.least;
    most += p * ground.go.most;
    if (!counts(p) || (speed >= 0 && ground.safe_m_per_s >= speed)) continue;
    speed = ground.safe_m_per_s;
    out.binding = ground.binding;
  }
  out.go_least = static_cast<float>(least);
  out.go_most = static_cast<float>(most);
  out.joules_per_metre = std::nanf("");
  if (!(speed > 0)) return out;
  const double made_good = speed * std::cos(AttitudeOf(slope_rad, heading_rad).grade_rad);
  double power = 0, weight = 0;
  for (std::size_t s = 0; s < tables.size(); ++s) {
    const float p = probabilities[s];
    if (!(p > 0) || !counts(p)) continue;
    power += p * tables[s].PowerAt(slope_rad, heading_rad, speed);
    weight += p;
  }
  out.speed_m_per_s = static_cast<float>(made_good);
  out.joules_per_metre = static_cast<float>(power / weight / made_good);
  return out;
}

}  // namespace grouser::terrain_map

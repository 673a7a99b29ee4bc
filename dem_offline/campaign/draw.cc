#include "dem_offline/campaign/draw.h"

#include <fmt/format.h>

#include <boost/random/sobol.hpp>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>

#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/scenes/yaml_section.h"

namespace grouser::campaign {
namespace {

void CheckRange(const char* name, const std::array<double, 2>& range, double least) {
  if (range[0] >= least && range[1] >= range[0]) return;
  throw InputError(fmt::format("{}: got {:g} to {:g}, expected a range from {:g} on", name,
                               range[0], range[1], least));
}

/// Numbers in [0, 1): of the twister one by one, of Sobol's sequence point by point.
std::function<double()> Source(const DrawRequest& r, std::size_t dimensions) {
  if (!r.sobol) {
    return [random = std::mt19937_64(r.seed)]() mutable {
      return static_cast<double>(random() >> 11) * 0x1p-53;
    };
  }
  const auto sequence = std::make_shared<boost::random::sobol>(dimensions);
  sequence->discard(dimensions * r.seed);
  return [sequence] {
    const double low = static_cast<double>((sequence->min)());
    const double span = static_cast<double>((sequence->max)()) - low + 1;
    return (static_cast<double>((*sequence)()) - low) / span;
  };
}

}  // namespace

std::string DrawStates(const DrawRequest& r) {
  CheckRange("slip", r.slip, -2);
  CheckRange("angle", r.angle_deg, 0);
  CheckRange("load", r.load_n, 1e-9);
  CheckRange("speed", r.speed, 0);
  if (r.tiles[1] < r.tiles[0] || r.tiles[0] < 1 || r.states < 1 || r.slip[1] > 2) {
    throw InputError("draw: expected one state or more, tiles from 1 on, and slip up to 2");
  }
  const bool speeds = r.speed[0] > 0;
  const auto next = Source(r, speeds ? 4 : 3);
  const auto between = [&](const std::array<double, 2>& range) {
    return range[0] + (range[1] - range[0]) * next();
  };
  std::string out;
  for (int drawn = 0, taken = 0; r.sobol ? drawn < r.states : taken < r.states; ++drawn) {
    const double slip = between(r.slip), angle = between(r.angle_deg), load = between(r.load_n);
    const double speed =
        speeds ? std::exp(between({std::log(r.speed[0]), std::log(r.speed[1])})) : 0;
    // By draw, so that a point keeps its tile whatever is left out before it.
    const std::uint64_t tile =
        r.tiles[0] + static_cast<std::uint64_t>(drawn) % (r.tiles[1] - r.tiles[0] + 1);
    const dem::SlipRange possible = dem::SlipsAt(angle * std::numbers::pi / 180);
    if (slip < possible.low + 1e-3 || slip > possible.high) {
      if (drawn > 10000 + 1000 * r.states) {
        throw InputError("draw: no motion has nearly any of these slips at these angles");
      }
      continue;
    }
    ++taken;
    out += fmt::format("  - {{slip: {:.3f}, attack_angle_deg: {:.1f}, load_n: {:.1f}", slip, angle,
                       load);
    if (speeds) out += fmt::format(", speed_m_per_s: {:.3f}", speed);
    out += fmt::format(", seed: {}}}\n", tile);
  }
  return out;
}

}  // namespace grouser::campaign

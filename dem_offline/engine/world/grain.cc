// How grains come into a World, and in which order they lie there.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/passes.h"

namespace grouser::dem {
namespace {

void RequireFinite(double value, const char* field, std::size_t i) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument("grain " + std::to_string(i) + ": " + field +
                                ": not finite, expected a number");
  }
}

}  // namespace

void CheckGrain(const GrainState& s, std::size_t i, int materials) {
  for (const double v : {s.x_m, s.y_m, s.z_m}) RequireFinite(v, "position", i);
  for (const double v : {s.v_x, s.v_y, s.v_z, s.w_x, s.w_y, s.w_z}) RequireFinite(v, "velocity", i);
  if (!(s.radius_m > 0) || !std::isfinite(s.radius_m)) {
    throw std::invalid_argument("grain " + std::to_string(i) +
                                ": radius_m: " + std::to_string(s.radius_m) + ", expected > 0");
  }
  if (!(s.mass_kg > 0 || s.density_kg_per_m3 > 0)) {
    throw std::invalid_argument("grain " + std::to_string(i) +
                                ": density_kg_per_m3: expected > 0 (or mass_kg > 0)");
  }
  if (s.material < 0 || s.material >= materials) {
    throw std::invalid_argument("grain " + std::to_string(i) +
                                ": material: " + std::to_string(s.material) + ", expected 0 to " +
                                std::to_string(materials - 1));
  }
}

Grain MakeGrain(const GrainState& s, const WorldConfig& config, std::int32_t id) {
  const double r = s.radius_m;
  Grain g = {};
  g.x = config.frame.FixX(s.x_m - config.origin_m[0]);
  g.y = config.frame.FixY(s.y_m - config.origin_m[1]);
  g.z = config.frame.FixZ(s.z_m - config.origin_m[2]);
  g.radius = static_cast<float>(r);
  g.SetMotion(ToFloat({s.v_x, s.v_y, s.v_z}), ToFloat({s.w_x, s.w_y, s.w_z}));
  const double sphere = s.density_kg_per_m3 * 4.0 / 3.0 * M_PI * r * r * r;
  g.mass = static_cast<float>(s.mass_kg > 0 ? s.mass_kg : sphere);
  g.kind = s.material | (s.glued ? kGlued : 0);
  g.id = id;
  return g;
}

Grain PaddingGrain() {
  Grain g = {};
  g.mass = 1.0f;
  g.kind = kGlued;
  g.id = -1;
  return g;
}

std::vector<std::int32_t> SpatialOrder(const std::vector<Grain>& raw, const Frame& frame) {
  float smallest = raw.front().radius, largest = smallest;
  for (const Grain& g : raw) {
    smallest = std::min(smallest, g.radius);
    largest = std::max(largest, g.radius);
  }
  const double cell = std::min({4.0 * largest, frame.length_m / 3.01, frame.width_m / 3.01});
  const CellGrid grid(raw, static_cast<std::int64_t>(raw.size()), frame, cell);
  std::vector<std::int32_t> order = grid.order();
  const auto size_class = [&](std::int32_t i) {
    int c = 0;
    for (float r = 2 * smallest; raw[i].radius >= r; r *= 2) ++c;
    return c;
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int32_t a, std::int32_t b) { return size_class(a) < size_class(b); });
  return order;
}

}  // namespace grouser::dem

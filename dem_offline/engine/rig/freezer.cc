#include "dem_offline/engine/rig/freezer.h"

#include <algorithm>
#include <cmath>

namespace grouser::dem {
namespace {

constexpr double kQuanta = 4294967296.0;  // of a periodic axis

}  // namespace

/// Cells of a periodic frame in which something moves.
struct Freezer::Grid {
  const Frame& frame;
  int nx, ny;
  double cell;
  std::vector<std::uint8_t> moving;
  static constexpr int kLayers = 64;  // cells above and below are put in the outermost

  Grid(const Frame& f, double cell_m)
      : frame(f),
        nx(std::max(1, static_cast<int>(f.length_m / cell_m))),
        ny(std::max(1, static_cast<int>(f.width_m / cell_m))),
        cell(cell_m),
        moving(static_cast<std::size_t>(nx) * ny * kLayers, 0) {}
  int X(const Grain& g) const {
    return static_cast<int>(static_cast<std::uint32_t>(g.x) / kQuanta * nx);
  }
  int Y(const Grain& g) const {
    return static_cast<int>(static_cast<std::uint32_t>(g.y) / kQuanta * ny);
  }
  int Z(const Grain& g) const {
    const double layer = std::floor(g.z / kQuanta * frame.z_span_m / cell) + kLayers / 2;
    return static_cast<int>(std::clamp(layer, 0.0, kLayers - 1.0));
  }
  void Mark(const Grain& g) {
    moving[(static_cast<std::size_t>(Z(g)) * ny + Y(g)) * nx + X(g)] = 1;
  }
  bool Near(const Grain& g) const {
    const int x = X(g), y = Y(g), z = Z(g);
    for (int k = std::max(0, z - 1); k <= std::min(kLayers - 1, z + 1); ++k) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const int cx = (x + i + nx) % nx, cy = (y + j + ny) % ny;
          if (moving[(static_cast<std::size_t>(k) * ny + cy) * nx + cx]) return true;
        }
      }
    }
    return false;
  }
};

Freezer::Place Freezer::PlaceOf(const World& world, const Grain& g, const Vec3d& hub_m) const {
  const Frame& f = world.config().frame;
  const double dx =
      std::remainder(static_cast<std::uint32_t>(g.x) / kQuanta * f.length_m - hub_m[0], f.length_m);
  const double dy =
      std::remainder(static_cast<std::uint32_t>(g.y) / kQuanta * f.width_m - hub_m[1], f.width_m);
  const double down = hub_m[2] - g.z / kQuanta * f.z_span_m;
  const double out = std::max({std::abs(dx) / settings_.half_m[0],
                               std::abs(dy) / settings_.half_m[1], down / settings_.half_m[2]});
  if (out <= 1) return Place::kInside;
  return out <= settings_.ring ? Place::kRing : Place::kOutside;
}

double Freezer::Moved2(const World& world, const Grain& g) {
  Seen& s = seen_[g.id];
  const auto q = world.config().frame.Quantum();
  const auto step = [](std::int32_t now, std::int32_t then, float quantum) {
    const auto diff = static_cast<std::int32_t>(static_cast<std::uint32_t>(now) -
                                                static_cast<std::uint32_t>(then));
    return static_cast<double>(diff) * quantum;
  };
  const double dx = step(g.x, s.x, q[0]), dy = step(g.y, s.y, q[1]), dz = step(g.z, s.z, q[2]);
  const bool known = s.looks >= 0;
  s.x = g.x;
  s.y = g.y;
  s.z = g.z;
  if (known) return dx * dx + dy * dy + dz * dz;
  s.looks = 0;
  return 0;
}

void Freezer::Look(const World& world, const Vec3d& hub_m, double look_s,
                   const std::function<bool(const Grain&)>& held,
                   std::vector<std::uint8_t>* frozen) {
  const std::int64_t n = world.count();
  frozen->assign(n, 0);
  const double quiet2 = std::pow(settings_.quiet_m_per_s * look_s, 2);
  const double disturb2 = std::pow(settings_.disturb_m_per_s * look_s, 2);
  Grid grid(world.config().frame, settings_.cell_m);
  for (std::int64_t i = 0; i < n; ++i) {
    const Grain& g = world.grains()[i];
    if (g.id >= static_cast<std::int32_t>(seen_.size())) seen_.resize(g.id + 1);
    const double moved2 = Moved2(world, g);
    Seen& s = seen_[g.id];
    s.looks = moved2 <= quiet2 ? static_cast<std::int16_t>(std::min(s.looks + 1, 1000)) : 0;
    if (moved2 > disturb2) grid.Mark(g);
  }
  for (std::int64_t i = 0; i < n; ++i) {
    const Grain& g = world.grains()[i];
    if (held(g)) {
      (*frozen)[i] = 1;
      continue;
    }
    const Place place = PlaceOf(world, g, hub_m);
    if (place == Place::kInside || grid.Near(g)) continue;
    const bool was = world.Frozen(i);
    (*frozen)[i] = was || (place == Place::kOutside && seen_[g.id].looks > 2);
  }
}

}  // namespace grouser::dem

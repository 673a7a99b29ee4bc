#include "dem_offline/engine/rig/bed_feed.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "dem_offline/engine/rig/materials.h"

namespace grouser::dem {
namespace {

constexpr double kPeriod = 4294967296.0;  // quanta of a periodic axis

void Check(const Tile& tile, std::size_t words) {
  const std::size_t n = tile.radius_m.size();
  const bool fits = tile.length_m > 0 && tile.position.size() == 3 * n &&
                    tile.contact_first.size() == n + 1 &&
                    tile.contact_history.size() == words * tile.contact_partner.size();
  if (!fits) {
    throw std::invalid_argument(
        "tile: its arrays do not fit each other, or hold the histories of other laws");
  }
}

}  // namespace

/// Which places of a piece each copy of the tile fills.
struct BedFeed::Stretch {
  double from, to;
  std::int32_t first_copy = 0;
  struct Part {
    std::int32_t low, high, base;  // ranks [low, high) stand at places from `base` on
  };
  std::vector<Part> parts;

  std::int32_t PlaceOf(TilePlace place, std::int32_t rank) const {
    const std::int64_t k = static_cast<std::int64_t>(place.copy) - first_copy;
    if (k < 0 || k >= static_cast<std::int64_t>(parts.size())) return -1;
    const Part& p = parts[k];
    return rank >= p.low && rank < p.high ? p.base + rank - p.low : -1;
  }
};

BedFeed::BedFeed(const Tile& tile, double grain_density_kg_per_m3, int words)
    : tile_(tile), density_(grain_density_kg_per_m3), length_(tile.length_m) {
  Check(tile, static_cast<std::size_t>(words));
  const auto n = static_cast<std::int32_t>(tile.radius_m.size());
  z_quantum_ = TileZSpan(tile.depth_m) / kPeriod;
  y_quantum_ = tile.width_m / kPeriod;
  for (std::int32_t i = 0; i < n; ++i) {
    // Half a quantum keeps the round trip through a frame of one tile exact.
    x_.push_back((static_cast<std::uint32_t>(tile.position[3 * i]) + 0.5) / kPeriod * length_);
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(),
            [&](std::int32_t a, std::int32_t b) { return x_[a] != x_[b] ? x_[a] < x_[b] : a < b; });
  rank_.resize(n);
  for (std::int32_t k = 0; k < n; ++k) rank_[order_[k]] = k;
  floor_.assign(n, nullptr);
  std::vector<std::vector<std::int32_t>> of(n);
  for (std::int32_t i = 0; i < n; ++i) {
    for (std::int32_t k = tile.contact_first[i]; k < tile.contact_first[i + 1]; ++k) {
      const float* at = tile.contact_history.data() + static_cast<std::size_t>(k) * words;
      const std::int32_t j = tile.contact_partner[k];
      if (j < 0) {
        floor_[i] = at;
        continue;
      }
      // The partner is the nearest of its copies: contacts are far shorter than a tile.
      const auto shift = static_cast<std::int32_t>(std::lround((x_.at(i) - x_.at(j)) / length_));
      of[i].push_back(static_cast<std::int32_t>(links_.size()));
      of[j].push_back(static_cast<std::int32_t>(links_.size()));
      links_.push_back({i, j, shift, at});
    }
  }
  first_link_.push_back(0);
  for (const auto& list : of) {
    link_of_.insert(link_of_.end(), list.begin(), list.end());
    first_link_.push_back(static_cast<std::int32_t>(link_of_.size()));
  }
}

double BedFeed::XOf(TilePlace place) const { return x_[place.grain] + place.copy * length_; }

BedPiece BedFeed::Between(double from_m, double to_m) const {
  BedPiece out;
  if (x_.empty() || !(to_m > from_m)) return out;
  Stretch stretch;
  stretch.from = from_m;
  stretch.to = to_m;
  stretch.first_copy = static_cast<std::int32_t>(std::floor(from_m / length_)) - 1;
  const auto last_copy = static_cast<std::int32_t>(std::floor(to_m / length_)) + 1;
  for (std::int32_t c = stretch.first_copy; c <= last_copy; ++c) {
    const auto before = [&](double plane) {
      return static_cast<std::int32_t>(std::partition_point(order_.begin(), order_.end(),
                                                            [&](std::int32_t i) {
                                                              return XOf({i, c}) < plane;
                                                            }) -
                                       order_.begin());
    };
    const std::int32_t low = before(from_m), high = std::max(low, before(to_m));
    stretch.parts.push_back({low, high, static_cast<std::int32_t>(out.tile_places.size())});
    for (std::int32_t k = low; k < high; ++k) out.tile_places.push_back({order_[k], c});
  }
  for (std::size_t p = 0; p < out.tile_places.size(); ++p) {
    const TilePlace& h = out.tile_places[p];
    GrainState g = {};
    g.x_m = XOf(h);
    g.y_m = (static_cast<std::uint32_t>(tile_.position[3 * h.grain + 1]) + 0.5) * y_quantum_;
    g.z_m = tile_.position[3 * h.grain + 2] * z_quantum_;
    g.radius_m = tile_.radius_m[h.grain];
    g.density_kg_per_m3 = density_;
    out.grains.push_back(g);
    if (floor_[h.grain]) out.floor.push_back({static_cast<std::int32_t>(p), floor_[h.grain]});
    AddTouches(stretch, h.grain, h.copy, static_cast<std::int32_t>(p), &out);
  }
  return out;
}

void BedFeed::AddTouches(const Stretch& stretch, std::int32_t grain, std::int32_t copy,
                         std::int32_t place, BedPiece* out) const {
  for (std::int32_t k = first_link_[grain]; k < first_link_[grain + 1]; ++k) {
    const Link& link = links_[link_of_[k]];
    BedTouch touch;
    touch.words = link.words;
    if (link.a == grain) {
      touch.a = {grain, copy};
      touch.b = {link.b, copy + link.shift};
      touch.in_a = place;
      touch.in_b = stretch.PlaceOf(touch.b, rank_[link.b]);
    } else {
      touch.a = {link.a, copy - link.shift};
      touch.b = {grain, copy};
      touch.in_a = stretch.PlaceOf(touch.a, rank_[link.a]);
      if (touch.in_a >= 0) continue;  // told from that end
      touch.in_b = place;
    }
    out->touches.push_back(touch);
  }
}

}  // namespace grouser::dem

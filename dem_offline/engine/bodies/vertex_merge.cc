#include "dem_offline/engine/bodies/vertex_merge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace grouser::dem {
namespace {

using Point = std::array<double, 3>;

/// Finds vertices that are the same place: cells of twice the distance, so that
/// a vertex need look into one or two along each axis.
class Merger {
 public:
  Merger(const Point& low, double distance) : low_(low), distance_(distance) {}

  std::int32_t NumberOf(const Point& p) {
    std::int64_t from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      from[a] = Cell(p[a] - distance_, a);
      to[a] = Cell(p[a] + distance_, a);
    }
    for (std::int64_t x = from[0]; x <= to[0]; ++x) {
      for (std::int64_t y = from[1]; y <= to[1]; ++y) {
        for (std::int64_t z = from[2]; z <= to[2]; ++z) {
          const std::int32_t v = Find(Key(x, y, z), p);
          if (v >= 0) return v;
        }
      }
    }
    const auto number = static_cast<std::int32_t>(places_.size());
    const std::uint64_t key = Key(Cell(p[0], 0), Cell(p[1], 1), Cell(p[2], 2));
    const auto [entry, fresh] = first_.try_emplace(key, number);
    next_.push_back(fresh ? -1 : entry->second);
    entry->second = number;
    places_.push_back(p);
    return number;
  }
  std::vector<Point> TakePlaces() { return std::move(places_); }

 private:
  std::int64_t Cell(double x, int axis) const {  // at most 5e8 cells a side
    return static_cast<std::int64_t>(std::floor((x - low_[axis]) / (2 * distance_)));
  }
  /// Mixed (splitmix64), so that no file can be made whose cells collide by
  /// plan of a simple sum; a collision costs time only.
  static std::uint64_t Key(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::uint64_t key = 0;
    for (const std::int64_t c : {x, y, z}) {
      key = (key ^ static_cast<std::uint64_t>(c)) + 0x9e3779b97f4a7c15u;
      key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
      key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
      key ^= key >> 31;
    }
    return key;
  }
  std::int32_t Find(std::uint64_t key, const Point& p) const {
    const auto entry = first_.find(key);
    if (entry == first_.end()) return -1;
    for (std::int32_t v = entry->second; v >= 0; v = next_[v]) {
      double d2 = 0;
      for (int a = 0; a < 3; ++a) d2 += (p[a] - places_[v][a]) * (p[a] - places_[v][a]);
      if (d2 <= distance_ * distance_) return v;
    }
    return -1;
  }

  Point low_;
  double distance_;
  std::unordered_map<std::uint64_t, std::int32_t> first_;
  std::vector<std::int32_t> next_;
  std::vector<Point> places_;
};

}  // namespace

void MergeVertices(TriangleSoup* soup, const std::string& source_name) {
  if (soup->vertices.empty()) return;
  Point low = soup->vertices[0], high = low;
  for (const Point& p : soup->vertices) {
    for (int a = 0; a < 3; ++a) {
      if (!(std::abs(p[a]) < 1e100)) {
        throw std::invalid_argument(source_name +
                                    ": size: got coordinates over 1e100, expected less");
      }
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  }
  double size2 = 0;
  for (int a = 0; a < 3; ++a) size2 += (high[a] - low[a]) * (high[a] - low[a]);
  // Far from the origin rounding itself is coarser than 1e-9 of the size.
  double furthest = 0;
  for (int a = 0; a < 3; ++a) furthest = std::max({furthest, std::abs(low[a]), std::abs(high[a])});
  const double distance = std::max({1e-9 * std::sqrt(size2), 1e-15 * furthest, 1e-150});
  Merger merger(low, distance);
  std::vector<std::int32_t> number;
  number.reserve(soup->vertices.size());
  for (const Point& p : soup->vertices) number.push_back(merger.NumberOf(p));
  soup->vertices = merger.TakePlaces();
  for (auto& t : soup->triangles) {
    for (std::int32_t& v : t) v = number[v];
  }
}

}  // namespace grouser::dem

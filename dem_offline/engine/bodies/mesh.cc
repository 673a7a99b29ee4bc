// A mesh made ready: checks, smooth surfaces, corner normals, search tree.
#include "dem_offline/engine/bodies/mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/bodies/face_edges.h"

namespace grouser::dem {
namespace {

constexpr double kLargest = 1e6;  // [m]
constexpr std::int32_t kLeaf = 4;

[[noreturn]] void Refuse(const std::string& what) { throw std::invalid_argument("mesh: " + what); }

std::string Edge(const FaceEdge& s) {
  return "the edge of vertices " + std::to_string(s.low) + " and " + std::to_string(s.high);
}

}  // namespace

Mesh::Mesh(TriangleSoup soup, double smooth_angle_rad) : soup_(std::move(soup)) {
  if (!(smooth_angle_rad >= 0 && smooth_angle_rad <= std::numbers::pi)) {
    Refuse("smooth_angle_rad: got " + std::to_string(smooth_angle_rad) + ", expected 0 to pi");
  }
  if (soup_.triangles.empty()) Refuse("got no triangle, expected at least one");
  if (soup_.triangles.size() > 100'000'000) Refuse("got more than 1e8 triangles");
  CheckVertices();
  MakeNormals();
  JoinEdges(smooth_angle_rad);
  MakeCorners();
  MakeTree();
}

void Mesh::CheckVertices() const {
  for (std::size_t v = 0; v < soup_.vertices.size(); ++v) {
    for (const double x : soup_.vertices[v]) {
      if (!(std::abs(x) <= kLargest)) {
        Refuse("vertex " + std::to_string(v) + ": got a coordinate of " + std::to_string(x) +
               ", expected a finite one within 1e6 m");
      }
    }
  }
  const auto count = static_cast<std::int64_t>(soup_.vertices.size());
  for (std::size_t f = 0; f < soup_.triangles.size(); ++f) {
    for (const std::int32_t v : soup_.triangles[f]) {
      if (v < 0 || v >= count) {
        Refuse("face " + std::to_string(f) + ": got vertex " + std::to_string(v) +
               ", expected 0 to " + std::to_string(count - 1));
      }
    }
  }
}

void Mesh::MakeNormals() {
  const auto faces = static_cast<std::int32_t>(soup_.triangles.size());
  double low = 1e300, high = -1e300, radius2 = 0, reach2 = 0;
  for (std::int32_t f = 0; f < faces; ++f) {
    if (!HasArea(Corner(f, 0), Corner(f, 1), Corner(f, 2))) {
      Refuse("face " + std::to_string(f) +
             " is degenerate (corners on one line or in one point), expected a triangle with area");
    }
    const Vec3d n = CrossD(Sub(Corner(f, 1), Corner(f, 0)), Sub(Corner(f, 2), Corner(f, 1)));
    normal_.push_back(Scale(1 / Norm(n), n));
    for (int k = 0; k < 3; ++k) {
      const Vec3d& v = Corner(f, k);
      low = std::min(low, v[1]);
      high = std::max(high, v[1]);
      radius2 = std::max(radius2, v[0] * v[0] + v[2] * v[2]);
      reach2 = std::max(reach2, DotD(v, v));
    }
  }
  reach_ = std::sqrt(reach2);
  hull_ = {static_cast<float>(std::sqrt(radius2)), static_cast<float>(low),
           static_cast<float>(high)};
}

void Mesh::JoinEdges(double smooth_angle_rad) {
  const std::vector<FaceEdge> sides = SortedEdges(soup_.triangles);
  std::vector<std::int32_t> smooth(soup_.triangles.size()), piece(soup_.triangles.size());
  std::iota(smooth.begin(), smooth.end(), 0);
  std::iota(piece.begin(), piece.end(), 0);
  other_.assign(soup_.triangles.size(), {-1, -1, -1});
  const double straight = std::cos(smooth_angle_rad);  // only compared with
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const FaceEdge &s = sides[i], &t = sides[i + 1];
    if (!s.SamePlace(t)) continue;
    if (i + 2 < sides.size() && t.SamePlace(sides[i + 2])) {
      Refuse("face " + std::to_string(sides[i + 2].face) + " is the third at " + Edge(s) +
             " (with " + std::to_string(s.face) + " and " + std::to_string(t.face) +
             "), expected at most two");
    }
    if (s.rising == t.rising) {
      Refuse("face " + std::to_string(t.face) + " is wound against face " + std::to_string(s.face) +
             " at " + Edge(s) + ", expected both counter-clockwise seen from outside");
    }
    other_[s.face][s.edge] = t.face;
    other_[t.face][t.edge] = s.face;
    Unite(&piece, s.face, t.face);
    if (DotD(normal_[s.face], normal_[t.face]) > straight) Unite(&smooth, s.face, t.face);
  }
  NumberSurfaces(&smooth, &piece);
}

void Mesh::NumberSurfaces(std::vector<std::int32_t>* smooth, std::vector<std::int32_t>* piece) {
  const auto faces = static_cast<std::int32_t>(soup_.triangles.size());
  std::vector<std::int32_t> piece_number(soup_.triangles.size(), -1);
  surface_of_.assign(soup_.triangles.size(), -1);
  for (std::int32_t f = 0; f < faces; ++f) {
    const std::int32_t root = RootOf(piece, f);
    if (root == f) {
      piece_number[f] = static_cast<std::int32_t>(piece_closed_.size());
      piece_closed_.push_back(1);
    }
    for (const std::int32_t beyond : other_[f]) {
      if (beyond < 0) piece_closed_[piece_number[root]] = 0;
    }
    const std::int32_t surface = RootOf(smooth, f);
    if (surface == f) {
      surface_of_[f] = surfaces_++;
      piece_of_surface_.push_back(piece_number[root]);
    } else {
      surface_of_[f] = surface_of_[surface];
    }
  }
}

bool Mesh::closed() const {
  return std::all_of(piece_closed_.begin(), piece_closed_.end(), [](char c) { return c != 0; });
}

/// Sum of the faces' normals weighted by their angles: tells inside from
/// outside at a vertex (Baerentzen & Aanaes, IEEE TVCG 11 (2005) 243).
void Mesh::MakeCorners() {
  corner_normal_.assign(soup_.vertices.size(), {0, 0, 0});
  std::vector<std::pair<std::int32_t, std::int32_t>> spokes;
  for (std::size_t f = 0; f < soup_.triangles.size(); ++f) {
    const auto face = static_cast<std::int32_t>(f);
    for (int k = 0; k < 3; ++k) {
      const Vec3d a = Sub(Corner(face, (k + 1) % 3), Corner(face, k));
      const Vec3d b = Sub(Corner(face, (k + 2) % 3), Corner(face, k));
      const double angle =
          std::acos(std::clamp(DotD(a, b) / std::sqrt(DotD(a, a) * DotD(b, b)), -1.0, 1.0));
      const std::int32_t v = soup_.triangles[f][k];
      for (int i = 0; i < 3; ++i) corner_normal_[v][i] += angle * normal_[f][i];
      spokes.emplace_back(v, soup_.triangles[f][(k + 1) % 3]);
      spokes.emplace_back(v, soup_.triangles[f][(k + 2) % 3]);
    }
  }
  std::sort(spokes.begin(), spokes.end());
  spokes.erase(std::unique(spokes.begin(), spokes.end()), spokes.end());
  spoke_first_.assign(soup_.vertices.size() + 1, 0);
  for (const auto& [from, to] : spokes) {
    ++spoke_first_[from + 1];
    spokes_.push_back(to);
  }
  std::partial_sum(spoke_first_.begin(), spoke_first_.end(), spoke_first_.begin());
}

void Mesh::MakeTree() {
  ordered_.resize(soup_.triangles.size());
  std::iota(ordered_.begin(), ordered_.end(), 0);
  nodes_.emplace_back();
  Split(0, 0, static_cast<std::int32_t>(ordered_.size()));
}

/// Halves the faces by their middles along the longest side of the box.
void Mesh::Split(std::int32_t node, std::int32_t first, std::int32_t count) {
  Box box = {{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  for (std::int32_t i = first; i < first + count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3d& v = Corner(ordered_[i], k);
      for (int a = 0; a < 3; ++a) {
        box.low[a] = std::min(box.low[a], v[a]);
        box.high[a] = std::max(box.high[a], v[a]);
      }
    }
  }
  nodes_[node].box = box;
  const std::int32_t surface = surface_of_[ordered_[first]];
  const bool one = std::all_of(ordered_.begin() + first, ordered_.begin() + first + count,
                               [&](std::int32_t f) { return surface_of_[f] == surface; });
  nodes_[node].surface = one ? surface : -1;
  if (count <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  const Vec3d size = Sub(box.high, box.low);
  const int axis = static_cast<int>(std::max_element(size.begin(), size.end()) - size.begin());
  const auto middle = [&](std::int32_t f) {
    return Corner(f, 0)[axis] + Corner(f, 1)[axis] + Corner(f, 2)[axis];
  };
  const std::int32_t half = count / 2;
  std::nth_element(ordered_.begin() + first, ordered_.begin() + first + half,
                   ordered_.begin() + first + count, [&](std::int32_t f, std::int32_t g) {
                     const double a = middle(f), b = middle(g);
                     return a < b || (a == b && f < g);
                   });
  const auto left = static_cast<std::int32_t>(nodes_.size());
  nodes_[node].left = left;
  nodes_.resize(nodes_.size() + 2);
  Split(left, first, half);
  Split(left + 1, first + half, count - half);
}

}  // namespace grouser::dem

// Edges of three or more triangles are split, and shells get one winding.
#include "dem_offline/engine/bodies/mesh_join.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/bodies/face_edges.h"

namespace grouser::dem {
namespace {

constexpr std::int32_t kOpen = -1, kTangled = -2;  // beyond an edge: no face, two or more
constexpr int kMostJoins = 16;                     // each leaves fewer tangled edges

/// A face at a tangled edge.
struct Spoke {
  FaceEdge edge;
  double angle_rad;  ///< about the edge, from low to high
};

class Joiner {
 public:
  Joiner(TriangleSoup* soup, const std::string& name)
      : soup_(*soup), name_(name), turned_(soup->triangles.size(), 0) {}

  JoinedFaces Run() {
    JoinedFaces out;
    for (int pass = 0; pass < kMostJoins; ++pass) {
      const std::int64_t tangled = PairTwos();
      TurnPatches();
      if (tangled == 0) {
        out.shell_of = patch_of_;
        out.open_edges = open_edges_;
        out.turned = turned_;
        return out;
      }
      if (pass == 0) out.split_edges = tangled;
      PairTangled();
      SplitVertices();
      CutWhatHoldsTogether();
    }
    Refuse("edges of three or more triangles that cannot be split", "edges of two triangles");
  }

 private:
  [[noreturn]] void Refuse(const std::string& got, const std::string& expected) const {
    throw std::invalid_argument(name_ + ": got " + got + ", expected " + expected);
  }
  std::string Place(std::int32_t a, std::int32_t b) const {
    const auto point = [&](std::int32_t v) {
      std::string text;
      for (const double x : soup_.vertices[v]) {
        char word[32];
        std::snprintf(word, sizeof word, "%s%.6g", text.empty() ? "(" : ", ", x);
        text += word;
      }
      return text + ")";
    };
    return "the edge from " + point(a) + " to " + point(b);
  }
  int CornerOf(std::int32_t face, std::int32_t vertex) const {
    const Triangle& t = soup_.triangles[face];
    return t[0] == vertex ? 0 : (t[1] == vertex ? 1 : 2);
  }

  /// Joins the two faces of simple edges; returns how many edges have more.
  std::int64_t PairTwos() {
    beyond_.assign(soup_.triangles.size(), {kOpen, kOpen, kOpen});
    std::int64_t tangled = 0;
    ForEachPlace(SortedEdges(soup_.triangles), [&](auto first, auto end) {
      if (end - first == 2) {
        beyond_[first->face][first->edge] = first[1].face;
        beyond_[first[1].face][first[1].edge] = first->face;
      } else if (end - first > 2) {
        ++tangled;
        for (auto e = first; e != end; ++e) beyond_[e->face][e->edge] = kTangled;
      }
    });
    return tangled;
  }

  void TurnFace(std::int32_t f) {  // edges 0 and 2 change places
    std::swap(soup_.triangles[f][1], soup_.triangles[f][2]);
    std::swap(beyond_[f][0], beyond_[f][2]);
    turned_[f] ^= 1;
  }

  /// Finds patches, faces joined by simple edges, and gives each the winding of most of its faces.
  void TurnPatches() {
    const std::size_t faces = soup_.triangles.size();
    patch_of_.assign(faces, -1);
    open_edges_.clear();
    std::vector<char> against(faces, 0);  // wound against the first face of its patch
    std::vector<std::int32_t> patch;
    for (std::size_t first = 0; first < faces; ++first) {
      if (patch_of_[first] >= 0) continue;
      patch = {static_cast<std::int32_t>(first)};
      patch_of_[first] = static_cast<std::int32_t>(open_edges_.size());
      open_edges_.push_back(0);
      std::size_t others = 0;
      for (std::size_t k = 0; k < patch.size(); ++k) {
        Visit(patch[k], &against, &patch);
        others += against[patch[k]] != 0;
      }
      const bool turn_others = 2 * others <= patch.size();
      for (const std::int32_t f : patch) {
        if ((against[f] != 0) == turn_others) TurnFace(f);
      }
    }
  }
  void Visit(std::int32_t f, std::vector<char>* against, std::vector<std::int32_t>* patch) {
    for (int e = 0; e < 3; ++e) {
      const std::int32_t g = beyond_[f][e];
      if (g == kOpen) ++open_edges_[patch_of_[f]];
      if (g < 0) continue;
      const std::int32_t u = soup_.triangles[f][e], v = soup_.triangles[f][(e + 1) % 3];
      const bool same_way = soup_.triangles[g][(CornerOf(g, u) + 1) % 3] == v;
      const auto expected = static_cast<char>((*against)[f] ^ static_cast<char>(same_way));
      if (patch_of_[g] < 0) {
        patch_of_[g] = patch_of_[f];
        (*against)[g] = expected;
        patch->push_back(g);
      } else if ((*against)[g] != expected) {
        Refuse("a shell with one side only (a Moebius strip) at " + Place(u, v),
               "a shell whose triangles can all face one way");
      }
    }
  }

  bool OfSheet(const FaceEdge& e) const { return open_edges_[patch_of_[e.face]] > 0; }

  void PairTangled() {
    // Windings have changed since: edges once more.
    ForEachPlace(SortedEdges(soup_.triangles), [&](auto first, auto end) {
      if (end - first <= 2) return;
      std::vector<Spoke> solids, sheets;
      for (const Spoke& s : SpokesOf({first, end})) {
        (OfSheet(s.edge) ? sheets : solids).push_back(s);
      }
      const std::string count =
          std::to_string(end - first) + " triangles at " + Place(first->low, first->high);
      if (solids.size() % 2 != 0) {
        Refuse(count + ", where an inner wall ends", "solids without walls inside");
      }
      if (sheets.size() % 2 != 0) {
        if (solids.empty()) {
          Refuse(count + ", where an odd number of thin sheets meet",
                 "an even number, or sheets that end on a solid");
        }
        beyond_[sheets.back().edge.face][sheets.back().edge.edge] = kOpen;
        sheets.pop_back();
      }
      Pair(solids);
      Pair(sheets);
    });
  }

  /// In the order of their angles; of one angle those first that have their solid before them.
  std::vector<Spoke> SpokesOf(const std::vector<FaceEdge>& edges) const {
    const Vec3d &low = soup_.vertices[edges[0].low], &high = soup_.vertices[edges[0].high];
    const Vec3d along = Scale(1 / Norm(Sub(high, low)), Sub(high, low));
    Vec3d u = {0, 0, 0}, w = {0, 0, 0};
    std::vector<Spoke> out;
    for (const FaceEdge& e : edges) {
      const Vec3d to = Sub(soup_.vertices[soup_.triangles[e.face][(e.edge + 2) % 3]], low);
      const Vec3d d = Sub(to, Scale(DotD(to, along), along));
      if (out.empty()) {
        u = d;
        w = CrossD(along, u);
      }
      double angle = std::atan2(DotD(d, w), DotD(d, u));
      if (angle < -1e-9) angle += 2 * std::numbers::pi;
      out.push_back({e, angle});
    }
    std::sort(out.begin(), out.end(),
              [](const Spoke& a, const Spoke& b) { return a.angle_rad < b.angle_rad; });
    for (std::size_t k = 1; k < out.size(); ++k) {  // one angle but for rounding
      if (out[k].angle_rad - out[k - 1].angle_rad < 1e-9) out[k].angle_rad = out[k - 1].angle_rad;
    }
    std::sort(out.begin(), out.end(), [](const Spoke& a, const Spoke& b) {
      return std::tuple(a.angle_rad, !a.edge.rising, a.edge.face) <
             std::tuple(b.angle_rad, !b.edge.rising, b.edge.face);
    });
    return out;
  }

  void Pair(const std::vector<Spoke>& spokes) {
    if (spokes.empty()) return;
    const std::size_t n = spokes.size(), offset = Offset(spokes);
    for (std::size_t k = 0; k < n; k += 2) {
      const FaceEdge &a = spokes[k + offset].edge, &b = spokes[(k + offset + 1) % n].edge;
      beyond_[a.face][a.edge] = b.face;
      beyond_[b.face][b.edge] = a.face;
    }
  }
  /// 0: the first spoke is paired with the second; 1: the second with the third.
  std::size_t Offset(const std::vector<Spoke>& spokes) const {
    const std::size_t n = spokes.size();
    std::size_t facing[2] = {0, 0}, of_patch[2] = {0, 0};
    double between = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const Spoke &a = spokes[k], &b = spokes[(k + 1) % n];
      // A rising face looks to greater angles: its solid is before it.
      facing[k % 2] += !a.edge.rising && b.edge.rising;
      of_patch[k % 2] += patch_of_[a.edge.face] == patch_of_[b.edge.face];
      if (k % 2 == 0) between += b.angle_rad - a.angle_rad;
    }
    if (of_patch[0] != of_patch[1]) return of_patch[1] > of_patch[0] ? 1 : 0;
    for (const std::size_t offset : {0, 1}) {
      if (facing[offset] == n / 2) return offset;
    }
    return between > std::numbers::pi * (1 + 1e-9) ? 1 : 0;
  }

  /// Faces around a vertex of a tangled edge that are not joined get copies of it.
  void SplitVertices() {
    const std::size_t faces = soup_.triangles.size();
    std::vector<char> tangled(soup_.vertices.size(), 0);
    ForEachPlace(SortedEdges(soup_.triangles), [&](auto first, auto end) {
      if (end - first > 2) tangled[first->low] = tangled[first->high] = 1;
    });
    std::vector<std::int32_t> corners(3 * faces);
    std::iota(corners.begin(), corners.end(), 0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto f = static_cast<std::int32_t>(i / 3), e = static_cast<std::int32_t>(i % 3);
      const std::int32_t g = beyond_[f][e];
      if (g < 0) continue;
      for (const std::int32_t k : {e, (e + 1) % 3}) {
        Unite(&corners, 3 * f + k, 3 * g + CornerOf(g, soup_.triangles[f][k]));
      }
    }
    std::vector<std::int32_t> number(corners.size(), -1);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      std::int32_t& v = soup_.triangles[i / 3][i % 3];
      std::int32_t& given = number[RootOf(&corners, static_cast<std::int32_t>(i))];
      if (given < 0 && tangled[v] == 1) {  // the first of them keeps it
        tangled[v] = 2;
        given = v;
      } else if (given < 0 && tangled[v] == 2) {
        given = static_cast<std::int32_t>(soup_.vertices.size());
        soup_.vertices.push_back(Vec3d(soup_.vertices[v]));
      }
      if (given >= 0) v = given;
    }
  }

  /// Pairs whose ends are one vertex each after all (the solid goes on around both) get an edge of
  /// their own by a vertex in the middle.
  void CutWhatHoldsTogether() {
    std::vector<char> cut(soup_.triangles.size(), 0);
    ForEachPlace(SortedEdges(soup_.triangles), [&](auto first, auto end) {
      if (end - first <= 2) return;
      for (auto e = first + 1; e != end; ++e) {
        const std::int32_t f = e->face, g = beyond_[f][e->edge];
        if (f == first->face || g == first->face) continue;  // one pair stays
        if (cut[f] != 0 || (g >= 0 && (g < f || cut[g] != 0))) continue;
        const auto middle = static_cast<std::int32_t>(soup_.vertices.size());
        soup_.vertices.push_back(Scale(0.5, Add(soup_.vertices[e->low], soup_.vertices[e->high])));
        for (auto other = e; other != end; ++other) {
          if (other->face != f && other->face != g) continue;
          cut[other->face] = 1;
          Triangle half = soup_.triangles[other->face];
          soup_.triangles[other->face][(other->edge + 1) % 3] = middle;
          half[other->edge] = middle;
          soup_.triangles.push_back(half);
          turned_.push_back(char{turned_[other->face]});
        }
      }
    });
  }

  TriangleSoup& soup_;
  const std::string& name_;
  std::vector<std::array<std::int32_t, 3>> beyond_;
  std::vector<std::int32_t> patch_of_;
  std::vector<std::int64_t> open_edges_;  ///< of patches
  std::vector<char> turned_;
};

}  // namespace

JoinedFaces JoinFaces(TriangleSoup* soup, const std::string& source_name) {
  return Joiner(soup, source_name).Run();
}

}  // namespace grouser::dem

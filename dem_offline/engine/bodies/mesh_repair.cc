// Triangles dropped, shells turned outward, and what is said about it.
#include "dem_offline/engine/bodies/mesh_repair.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "dem_offline/engine/bodies/face_edges.h"
#include "dem_offline/engine/bodies/mesh_join.h"

namespace grouser::dem {
namespace {

constexpr double kFarthest = 1e30;  // volumes and areas stay finite
constexpr std::size_t kMostShells = 10'000;
constexpr double kMostLooks = 2e9;      // triangles seen from points: a minute
constexpr int kMostNeedlePasses = 200;  // needles side by side go one after another

[[noreturn]] void Refuse(const std::string& name, const std::string& got,
                         const std::string& expected) {
  throw std::invalid_argument(name + ": got " + got + ", expected " + expected);
}

bool Flat(const TriangleSoup& soup, const Triangle& t) {
  return !HasArea(soup.vertices[t[0]], soup.vertices[t[1]], soup.vertices[t[2]]);
}

void Erase(const std::vector<char>& gone, std::vector<Triangle>* triangles) {
  std::size_t kept = 0;
  for (std::size_t f = 0; f < triangles->size(); ++f) {
    if (gone[f] == 0) (*triangles)[kept++] = (*triangles)[f];
  }
  triangles->resize(kept);
}

std::int64_t DropPoints(TriangleSoup* soup) {
  return static_cast<std::int64_t>(std::erase_if(soup->triangles, [](const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
  }));
}

/// Needles: corners on one line. What is joined to the long side gets the third corner there.
std::int64_t DropNeedles(TriangleSoup* soup, const std::string& name) {
  const auto needles = std::count_if(soup->triangles.begin(), soup->triangles.end(),
                                     [&](const Triangle& t) { return Flat(*soup, t); });
  const auto square = [&](std::int32_t a, std::int32_t b) {
    const Vec3d d = Sub(soup->vertices[a], soup->vertices[b]);
    return DotD(d, d);
  };
  std::int64_t left = needles;
  const std::size_t most = 2 * soup->triangles.size() + 64;
  for (int pass = 0; left > 0; ++pass) {
    if (pass == kMostNeedlePasses)
      Refuse(name, "triangles without area that lean on each other", "area");
    const std::vector<FaceEdge> edges = SortedEdges(soup->triangles);
    std::vector<char> gone(soup->triangles.size(), 0), touched = gone;
    std::vector<Triangle> more;
    for (std::size_t f = 0; f < gone.size(); ++f) {
      const Triangle t = soup->triangles[f];
      if (touched[f] != 0 || !Flat(*soup, t)) continue;
      int e = 0;
      for (const int k : {1, 2}) {
        if (square(t[k], t[(k + 1) % 3]) > square(t[e], t[(e + 1) % 3])) e = k;
      }
      const std::int32_t u = t[e], v = t[(e + 1) % 3], middle = t[(e + 2) % 3];
      const auto at = std::lower_bound(edges.begin(), edges.end(),
                                       FaceEdge{std::min(u, v), std::max(u, v), -1, 0, false});
      auto end = at;
      bool busy = false;
      for (; end != edges.end() && end->SamePlace(*at); ++end) busy |= touched[end->face] != 0;
      if (busy) continue;
      for (auto other = at; other != end; ++other) {
        const std::int32_t g = other->face;
        touched[g] = 1;
        Triangle half = soup->triangles[g];
        if (half[(other->edge + 2) % 3] == middle) {  // itself, or one like it
          gone[g] = 1;
          continue;
        }
        if (more.size() > most) {
          Refuse(name, "triangles without area whose edges cut up more than there are", "area");
        }
        soup->triangles[g][(other->edge + 1) % 3] = middle;
        half[other->edge] = middle;
        more.push_back(half);
      }
    }
    Erase(gone, &soup->triangles);
    soup->triangles.insert(soup->triangles.end(), more.begin(), more.end());
    left = std::count_if(soup->triangles.begin(), soup->triangles.end(),
                         [&](const Triangle& t) { return Flat(*soup, t); });
  }
  return needles;
}

/// Faces that stood there an even number of times are walls between two solids where every edge of
/// the wall has the outer faces of both (an even number of single faces), and at least one has.
std::vector<char> WallsAmong(const std::vector<Triangle>& triangles,
                             const std::vector<char>& even) {
  std::vector<std::int32_t> wall(triangles.size());
  std::iota(wall.begin(), wall.end(), 0);
  const std::vector<FaceEdge> edges = SortedEdges(triangles);
  const auto for_walls = [&](auto&& f) {  // f(any face of the wall, its faces, single faces)
    ForEachPlace(edges, [&](auto first, auto end) {
      std::int32_t of_wall = -1;
      std::int64_t walls = 0;
      for (auto e = first; e != end; ++e) {
        if (even[e->face] == 0) continue;
        ++walls;
        if (of_wall >= 0) Unite(&wall, of_wall, e->face);
        of_wall = e->face;
      }
      if (walls > 0) f(of_wall, walls, end - first - walls);
    });
  };
  for_walls([](auto...) {});
  std::vector<char> open(triangles.size(), 0), held = open, out = open;
  for_walls([&](std::int32_t face, std::int64_t walls, std::int64_t single) {
    const std::int32_t root = RootOf(&wall, face);
    if (single % 2 != 0 || (walls == 1 && single == 0)) open[root] = 1;
    if (single > 0) held[root] = 1;
  });
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const std::int32_t root = RootOf(&wall, static_cast<std::int32_t>(f));
    out[f] = even[f] != 0 && open[root] == 0 && held[root] != 0;
  }
  return out;
}

void DropDoubled(TriangleSoup* soup, MeshReport* report) {
  std::vector<std::array<std::int32_t, 4>> named;  // corners in rising order, face
  for (std::size_t f = 0; f < soup->triangles.size(); ++f) {
    Triangle t = soup->triangles[f];
    std::sort(t.begin(), t.end());
    named.push_back({t[0], t[1], t[2], static_cast<std::int32_t>(f)});
  }
  std::sort(named.begin(), named.end());
  std::vector<char> gone(named.size(), 0), even(named.size(), 0);
  std::int64_t copies = 0;
  for (std::size_t i = 0; i < named.size();) {
    std::size_t k = i + 1;
    for (; k < named.size() && std::equal(&named[k][0], &named[k][3], &named[i][0]); ++k) {
      gone[named[k][3]] = 1;
    }
    even[named[i][3]] = (k - i) % 2 == 0;
    copies += static_cast<std::int64_t>(k - i - 1);
    i = k;
  }
  if (copies == 0) return;
  std::vector<char> even_kept;
  for (std::size_t f = 0; f < gone.size(); ++f) {
    if (gone[f] == 0) even_kept.push_back(even[f]);
  }
  Erase(gone, &soup->triangles);
  const std::vector<char> walls = WallsAmong(soup->triangles, even_kept);
  Erase(walls, &soup->triangles);
  const std::int64_t inner = std::count(walls.begin(), walls.end(), 1);
  report->inner_walls += 2 * inner;
  report->doubled += copies - inner;
}

/// Numbers the vertices that triangles use anew.
void DropUnused(TriangleSoup* soup) {
  std::vector<std::int32_t> number(soup->vertices.size(), -1);
  for (const Triangle& t : soup->triangles) {
    for (const std::int32_t v : t) number[v] = 0;
  }
  std::size_t used = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    soup->vertices[used] = Vec3d(soup->vertices[v]);
    number[v] = static_cast<std::int32_t>(used++);
  }
  soup->vertices.resize(used);
  for (Triangle& t : soup->triangles) {
    for (std::int32_t& v : t) v = number[v];
  }
}

void Reverse(TriangleSoup* soup) {
  for (Triangle& t : soup->triangles) std::swap(t[1], t[2]);
}

/// A closed shell.
struct Shell {
  std::vector<std::int32_t> faces;
  Vec3d low = {1e300, 1e300, 1e300}, high = {-1e300, -1e300, -1e300};
  double volume_m3 = 0;
  std::vector<std::size_t> outer;  ///< shells that hold it, by their places
  bool turn = false;
};

Shell ShellOf(const TriangleSoup& soup, std::vector<std::int32_t> faces) {
  Shell s;
  s.faces = std::move(faces);
  const Vec3d origin = soup.vertices[soup.triangles[s.faces[0]][0]];
  for (const std::int32_t f : s.faces) {
    Vec3d c[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3d& v = soup.vertices[soup.triangles[f][k]];
      c[k] = Sub(v, origin);
      for (int a = 0; a < 3; ++a) {
        s.low[a] = std::min(s.low[a], v[a]);
        s.high[a] = std::max(s.high[a], v[a]);
      }
    }
    s.volume_m3 += DotD(c[0], CrossD(c[1], c[2])) / 6;
  }
  const double size = Norm(Sub(s.high, s.low));
  if (std::abs(s.volume_m3) < 1e-13 * size * size * size) s.volume_m3 = 0;  // rounding
  return s;
}

/// How often a shell goes around a point: the solid angle of its triangles over 4 pi (van Oosterom
/// & Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125).
double TurnsAround(const TriangleSoup& soup, const Shell& shell, const Vec3d& p) {
  double sum = 0;
  for (const std::int32_t f : shell.faces) {
    const Triangle& t = soup.triangles[f];
    const Vec3d a = Sub(soup.vertices[t[0]], p), b = Sub(soup.vertices[t[1]], p),
                c = Sub(soup.vertices[t[2]], p);
    const double la = Norm(a), lb = Norm(b), lc = Norm(c);
    sum += std::atan2(DotD(a, CrossD(b, c)),
                      la * lb * lc + DotD(a, b) * lc + DotD(b, c) * la + DotD(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// Eight corners of it, spread over its faces, are inside the other.
bool Holds(const TriangleSoup& soup, const Shell& outer, const Shell& inner, double* looks) {
  for (int a = 0; a < 3; ++a) {
    if (!(outer.low[a] < inner.low[a] && inner.high[a] < outer.high[a])) return false;
  }
  const std::size_t n = inner.faces.size();
  for (std::size_t k = 0; k < 8; ++k) {
    const Triangle& t = soup.triangles[inner.faces[k * n / 8]];
    *looks += static_cast<double>(outer.faces.size());
    if (!(std::abs(TurnsAround(soup, outer, soup.vertices[t[0]])) > 0.5)) return false;
  }
  return true;
}

void FaceOutward(TriangleSoup* soup, const std::string& name, JoinedFaces* joined,
                 MeshReport* report) {
  std::vector<std::vector<std::int32_t>> faces(joined->open_edges.size());
  for (std::size_t f = 0; f < soup->triangles.size(); ++f) {
    faces[joined->shell_of[f]].push_back(static_cast<std::int32_t>(f));
  }
  std::vector<Shell> shells;
  for (std::size_t s = 0; s < faces.size(); ++s) {
    report->open_edges += joined->open_edges[s];
    report->open_shells += joined->open_edges[s] > 0;
    if (joined->open_edges[s] > 0) continue;
    shells.push_back(ShellOf(*soup, faces[s]));
  }
  report->closed_shells = static_cast<std::int64_t>(shells.size());
  const std::string many = std::to_string(shells.size()) + " closed shells";
  if (shells.size() > kMostShells) Refuse(name, many, "10000 at most: unite them");
  double looks = 0;
  for (Shell& inner : shells) {
    for (std::size_t k = 0; k < shells.size(); ++k) {
      if (Holds(*soup, shells[k], inner, &looks)) inner.outer.push_back(k);
      if (looks > kMostLooks) Refuse(name, many + " inside one another", "fewer, or united ones");
    }
    if (inner.outer.size() % 2 == 0) inner.turn = inner.volume_m3 < 0;
  }
  for (Shell& inner : shells) {
    if (inner.outer.size() % 2 == 0 || !(inner.volume_m3 > 0)) continue;
    for (const std::size_t k : inner.outer) {
      if (shells[k].outer.size() % 2 == 0 && shells[k].turn) inner.turn = true;
    }
  }
  for (const Shell& s : shells) {
    report->cavities += s.turn ? s.volume_m3 > 0 : s.volume_m3 < 0;
    for (const std::int32_t f : s.faces) {
      if (!s.turn) continue;
      std::swap(soup->triangles[f][1], soup->triangles[f][2]);
      joined->turned[f] ^= 1;
    }
  }
  for (const auto& of_shell : faces) {
    const auto turned = std::count_if(of_shell.begin(), of_shell.end(),
                                      [&](std::int32_t f) { return joined->turned[f] != 0; });
    if (turned == static_cast<std::int64_t>(of_shell.size())) {
      ++report->inside_out;
    } else {
      report->turned += turned;
    }
  }
}

/// "1 closed shell", "2 closed shells".
std::string Count(std::int64_t n, const std::string& one, const std::string& more = "") {
  return std::to_string(n) + " " + (n == 1 ? one : (more.empty() ? one + "s" : more));
}

}  // namespace

std::string MeshReport::Words() const {
  std::string out = Count(triangles, "triangle");
  const auto add = [&](std::int64_t n, const char* between, const std::string& words) {
    if (n > 0) out += between + words;
  };
  add(closed_shells, ", ", Count(closed_shells, "closed shell"));
  add(cavities, ", ", Count(cavities, "cavity of them", "cavities of them"));
  add(open_shells, ", ",
      Count(open_shells, "open shell (a thin sheet)", "open shells (thin sheets)") + " with " +
          Count(open_edges, "open edge"));
  add(without_area, "; ", Count(without_area, "triangle") + " without area dropped");
  add(doubled, "; ", Count(doubled, "copy dropped", "copies dropped"));
  add(inner_walls, "; ", Count(inner_walls, "triangle") + " of inner walls dropped");
  add(split_edges, "; ", Count(split_edges, "edge") + " of three or more triangles split");
  add(turned, "; ", Count(turned, "triangle") + " wound against the others turned");
  add(inside_out, "; ", Count(inside_out, "shell") + " inside-out turned");
  return out + (Changed() ? "" : "; nothing to repair");
}

MeshReport RepairMesh(TriangleSoup* soup, const std::string& source_name, SolidSide solid) {
  for (const Vec3d& v : soup->vertices) {
    for (const double x : v) {
      if (!(std::abs(x) <= kFarthest)) Refuse(source_name, "coordinates over 1e30", "less");
    }
  }
  MeshReport report;
  if (solid == SolidSide::kOutside) Reverse(soup);
  report.without_area = DropPoints(soup);
  DropDoubled(soup, &report);
  if (const std::int64_t needles = DropNeedles(soup, source_name); needles > 0) {
    report.without_area += needles;
    DropDoubled(soup, &report);
  }
  if (soup->triangles.empty()) Refuse(source_name, "no triangle with area", "at least one");
  JoinedFaces joined = JoinFaces(soup, source_name);
  report.split_edges = joined.split_edges;
  FaceOutward(soup, source_name, &joined, &report);
  DropUnused(soup);
  if (solid == SolidSide::kOutside) Reverse(soup);
  report.triangles = static_cast<std::int64_t>(soup->triangles.size());
  return report;
}

}  // namespace grouser::dem

// Exact mass properties of overlapping spheres.
#include "dem_offline/engine/bodies/clump.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/disc_union.h"
#include "dem_offline/engine/core/vec3d.h"

namespace grouser::dem {
namespace {

using Members = std::vector<ClumpTemplate::Member>;

constexpr std::size_t kMostMembers = 200;  // triples of spheres are looked at
constexpr int kPoints = 40;                // of Gauss-Legendre between two heights

Vec3d Along(const Vec3d& a, double s, const Vec3d& d) { return Add(a, Scale(s, d)); }

void Check(const Members& members) {
  if (members.empty()) throw std::invalid_argument("clump: got no member, expected at least one");
  if (members.size() > kMostMembers) {
    throw std::invalid_argument("clump: got " + std::to_string(members.size()) +
                                " members, expected at most " + std::to_string(kMostMembers));
  }
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto refuse = [i](const char* field, double got, const char* expected) {
      std::ostringstream out;
      out << "clump: member " << i << ": " << field << ": got " << got << ", expected " << expected;
      throw std::invalid_argument(out.str());
    };
    const double r = members[i].radius_m;
    if (!(r > 1e-12 && r < 1e6)) refuse("radius_m", r, "a length > 1e-12 m and < 1e6 m");
    for (const double x : members[i].offset_m) {
      if (!(std::abs(x) < 1e6)) refuse("offset_m", x, "finite coordinates within 1e6 m");
    }
  }
}

/// Heights where a slice changes its kind: discs appear, vanish, begin or cease
/// to overlap (extremes of the circle in which two spheres meet), or three
/// outlines meet in a point. Those hidden in a further sphere do not count.
class Heights {
 public:
  explicit Heights(const Members& members) : members_(members) {
    const int n = static_cast<int>(members.size());
    for (int i = 0; i < n; ++i) {
      Add(Along(At(i), R(i), {0, 0, 1}), i, i, i);
      Add(Along(At(i), -R(i), {0, 0, 1}), i, i, i);
      for (int j = i + 1; j < n; ++j) {
        if (!Overlap(i, j)) continue;
        AddPair(i, j);
        for (int k = j + 1; k < n; ++k) {
          if (Overlap(i, k) && Overlap(j, k)) AddTriple(i, j, k);
        }
      }
    }
    std::sort(heights_.begin(), heights_.end());
  }
  const std::vector<double>& sorted() const { return heights_; }

 private:
  const Vec3d& At(int i) const { return members_[static_cast<std::size_t>(i)].offset_m; }
  double R(int i) const { return members_[static_cast<std::size_t>(i)].radius_m; }

  bool Overlap(int i, int j) const {
    const Vec3d d = Sub(At(j), At(i));
    const double apart = std::sqrt(DotD(d, d));
    return apart < R(i) + R(j) && apart > std::abs(R(i) - R(j));
  }

  void Add(const Vec3d& p, int i, int j, int k) {
    for (int m = 0; m < static_cast<int>(members_.size()); ++m) {
      if (m == i || m == j || m == k) continue;
      const Vec3d d = Sub(p, At(m));
      if (DotD(d, d) < R(m) * R(m) * (1 - 1e-9)) return;
    }
    heights_.push_back(p[2]);
  }

  void AddPair(int i, int j) {
    const Vec3d d = Sub(At(j), At(i));
    const double d2 = DotD(d, d), t = 0.5 * (1 + (R(i) * R(i) - R(j) * R(j)) / d2);
    const Vec3d middle = Along(At(i), t, d);
    const double radius = std::sqrt(std::max(0.0, R(i) * R(i) - t * t * d2));
    const Vec3d up = Along({0, 0, 1}, -d[2] / d2, d);  // ez within the circle's plane
    const double steep = std::sqrt(DotD(up, up));
    if (steep < 1e-7) heights_.push_back(middle[2]);  // a level circle
    if (steep < 1e-12) return;
    Add(Along(middle, radius / steep, up), i, j, i);
    Add(Along(middle, -radius / steep, up), i, j, i);
  }

  /// Points on all three spheres, at At(i) + x e + y f +- z e x f with
  /// e along i-j and f the rest of i-k.
  void AddTriple(int i, int j, int k) {
    const Vec3d u = Sub(At(j), At(i)), v = Sub(At(k), At(i));
    const double a = std::sqrt(DotD(u, u));
    const Vec3d e = {u[0] / a, u[1] / a, u[2] / a};
    const double c = DotD(v, e);
    const Vec3d w = Along(v, -c, e);
    const double b = std::sqrt(DotD(w, w));
    if (b < 1e-12 * a) return;  // in line: they meet nowhere, or in a circle
    const Vec3d f = {w[0] / b, w[1] / b, w[2] / b};
    const double ri2 = R(i) * R(i);
    const double x = (ri2 - R(j) * R(j) + a * a) / (2 * a);
    const double y = (ri2 - R(k) * R(k) + c * c + b * b - 2 * c * x) / (2 * b);
    const double z2 = ri2 - x * x - y * y;
    if (z2 < 0) return;
    const Vec3d foot = Along(Along(At(i), x, e), y, f), g = CrossD(e, f);
    Add(Along(foot, std::sqrt(z2), g), i, j, k);
    Add(Along(foot, -std::sqrt(z2), g), i, j, k);
  }

  const Members& members_;
  std::vector<double> heights_;
};

/// Nodes and weights on [0, 1], by Newton on the Legendre polynomial.
struct Quadrature {
  double node[kPoints], weight[kPoints];
  Quadrature() {
    for (int i = 0; i < kPoints; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (kPoints + 0.5)), slope = 1;
      for (int round = 0; round < 50; ++round) {
        double p = 1, before = 0;
        for (int k = 1; k <= kPoints; ++k) {
          const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
          before = p;
          p = next;
        }
        slope = kPoints * (x * p - before) / (x * x - 1);
        x -= p / slope;
      }
      node[i] = 0.5 * (1 + x);
      weight[i] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

/// Volume, first and second moments about the origin.
struct Moments {
  double volume = 0;
  Vec3d first = {0, 0, 0};
  double second[3][3] = {};
};

Moments Integrate(const Members& members) {
  const Quadrature rule;
  const Heights heights(members);
  const std::vector<double>& h = heights.sorted();
  Moments m;
  std::vector<PlaneDisc> discs;
  for (std::size_t i = 0; i + 1 < h.size(); ++i) {
    const double low = h[i], span = h[i + 1] - h[i];
    if (!(span > 1e-14)) continue;
    for (int q = 0; q < kPoints; ++q) {
      // Areas start like (z - low)^(3/2) where discs begin to meet: with
      // z - low ~ t^2 at both ends the integrand is smooth in t.
      const double t = rule.node[q], z = low + span * t * t * (3 - 2 * t);
      const double weight = rule.weight[q] * span * 6 * t * (1 - t);
      discs.clear();
      for (const auto& s : members) {
        const double r2 = s.radius_m * s.radius_m - (z - s.offset_m[2]) * (z - s.offset_m[2]);
        if (r2 > 0) discs.push_back({s.offset_m[0], s.offset_m[1], std::sqrt(r2)});
      }
      const PlaneMoments p = UnionMoments(discs);
      m.volume += weight * p.area;
      m.first = {m.first[0] + weight * p.x, m.first[1] + weight * p.y,
                 m.first[2] + weight * z * p.area};
      const double second[3][3] = {
          {p.xx, p.xy, z * p.x}, {p.xy, p.yy, z * p.y}, {z * p.x, z * p.y, z * z * p.area}};
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) m.second[a][b] += weight * second[a][b];
      }
    }
  }
  return m;
}

/// Jacobi rotations until `a` is diagonal; the columns of `v` are its axes, a
/// right-handed set. What is diagonal to rounding stays as it is.
void Diagonalise(double a[3][3], double v[3][3]) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) v[i][j] = i == j ? 1 : 0;
  }
  const double small = 1e-12 * (a[0][0] + a[1][1] + a[2][2]);
  for (int sweep = 0; sweep < 50; ++sweep) {
    bool done = true;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (!(std::abs(a[p][q]) > small)) continue;
        done = false;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq;
          a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
          const double vp = v[k][p], vq = v[k][q];
          v[k][p] = c * vp - s * vq;
          v[k][q] = s * vp + c * vq;
        }
      }
    }
    if (done) return;
  }
}

/// Largest component first, so that nothing is divided by a small number.
Quatd ToQuaternion(const double m[3][3]) {
  double best = m[0][0] + m[1][1] + m[2][2];
  int i = -1;
  for (int k = 0; k < 3; ++k) {
    if (m[k][k] > best) best = m[i = k][k];
  }
  Quatd q;
  if (i < 0) {
    const double w = 0.5 * std::sqrt(1 + best), s = 0.25 / w;
    q = {w, s * (m[2][1] - m[1][2]), s * (m[0][2] - m[2][0]), s * (m[1][0] - m[0][1])};
  } else {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double x = 0.5 * std::sqrt(1 + m[i][i] - m[j][j] - m[k][k]), s = 0.25 / x;
    q[0] = s * (m[k][j] - m[j][k]);
    q[1 + static_cast<std::size_t>(i)] = x;
    q[1 + static_cast<std::size_t>(j)] = s * (m[j][i] + m[i][j]);
    q[1 + static_cast<std::size_t>(k)] = s * (m[k][i] + m[i][k]);
  }
  return q;
}

}  // namespace

Quatd ToPrincipalAxes(double tensor[3][3]) {
  double axes[3][3];
  Diagonalise(tensor, axes);
  return ToQuaternion(axes);
}

ClumpTemplate MakeClump(const Members& given) {
  Check(given);
  // About the first member, in units of the clump's size: well scaled.
  const Vec3d start = given[0].offset_m;
  double size = 0;
  for (const auto& m : given) {
    const Vec3d d = Sub(m.offset_m, start);
    size = std::max(size, std::sqrt(DotD(d, d)) + m.radius_m);
  }
  Members members = given;
  for (auto& m : members) {
    const Vec3d d = Sub(m.offset_m, start);
    m = {{d[0] / size, d[1] / size, d[2] / size}, m.radius_m / size};
  }
  const Moments m = Integrate(members);
  const Vec3d c = {m.first[0] / m.volume, m.first[1] / m.volume, m.first[2] / m.volume};
  double spread[3][3], inertia[3][3], axes[3][3], trace = 0;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) spread[a][b] = m.second[a][b] - m.volume * c[a] * c[b];
    trace += spread[a][a];
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) inertia[a][b] = (a == b ? trace : 0) - spread[a][b];
  }
  Diagonalise(inertia, axes);
  ClumpTemplate clump;
  const double size3 = size * size * size;
  clump.volume_m3 = m.volume * size3;
  clump.centre_m = Along(start, size, c);
  clump.turn = ToQuaternion(axes);
  for (int a = 0; a < 3; ++a) clump.inertia_per_density[a] = inertia[a][a] * size3 * size * size;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Vec3d d = Sub(members[i].offset_m, c);
    Vec3d offset;
    for (int a = 0; a < 3; ++a) {
      offset[a] = size * (axes[0][a] * d[0] + axes[1][a] * d[1] + axes[2][a] * d[2]);
    }
    clump.members.push_back({offset, given[i].radius_m});
  }
  return clump;
}

}  // namespace grouser::dem

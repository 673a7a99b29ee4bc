#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/bodies/shape.h"

namespace grouser::dem {

inline constexpr double kPi = 3.14159265358979323846;

inline float Length(Vec3f a) { return std::sqrt(Dot(a, a)); }

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float In(double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<double>(low, high)(engine_));
  }
  Vec3f Point(double half) { return {In(-half, half), In(-half, half), In(-half, half)}; }
  /// A rotation from a random quaternion.
  void Turn(Part* part) {
    double q[4], norm = 0;
    for (double& v : q) {
      v = std::normal_distribution<double>()(engine_);
      norm += v * v;
    }
    for (double& v : q) v /= std::sqrt(norm);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 9; ++i) part->axes[i] = static_cast<float>(m[i]);
  }

 private:
  std::mt19937 engine_;
};

/// n x n squares over [-1, 1]^2, each two triangles, lifted by z(x, y).
inline TriangleSoup Plate(int n, const std::function<double(double, double)>& z) {
  TriangleSoup s;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = -1 + 2.0 * i / n, y = -1 + 2.0 * j / n;
      s.vertices.push_back({x, y, z(x, y)});
    }
  }
  const auto at = [n](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

inline TriangleSoup BoxSoup(double a, double b, double c) {
  TriangleSoup s;
  for (int i = 0; i < 8; ++i) {
    s.vertices.push_back({i & 1 ? a : -a, i & 2 ? b : -b, i & 4 ? c : -c});
  }
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    s.triangles.push_back({q[0], q[1], q[2]});
    s.triangles.push_back({q[0], q[2], q[3]});
  }
  return s;
}

/// A closed surface of revolution about y through (rho, y) > 0, `n` around.
inline TriangleSoup Torus(int n, int m, double major, const std::function<double(double)>& minor) {
  TriangleSoup s;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double a = 2 * kPi * i / n, b = 2 * kPi * j / m;
      const double rho = major + minor(b) * std::cos(b);
      s.vertices.push_back({rho * std::cos(a), minor(b) * std::sin(b), rho * std::sin(a)});
    }
  }
  const auto at = [=](int i, int j) { return (i % n) * m + j % m; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      s.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return s;
}

inline double Volume(const TriangleSoup& s) {
  double sum = 0;
  for (const auto& t : s.triangles) {
    sum += DotD(s.vertices[t[0]], CrossD(s.vertices[t[1]], s.vertices[t[2]]));
  }
  return sum / 6;
}

}  // namespace grouser::dem

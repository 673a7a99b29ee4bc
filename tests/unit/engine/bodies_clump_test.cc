// Mass properties of overlapping spheres: closed forms, random points,
// invariance under motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/bodies/clump.h"

namespace grouser::dem {
namespace {

using Members = std::vector<ClumpTemplate::Member>;
constexpr double kPi = 3.14159265358979323846;

double Ball(double r) { return 4 * kPi / 3 * r * r * r; }

Vec3d Rotate(const Quatd& q, const Vec3d& a) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                       2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  return {m[0] * a[0] + m[1] * a[1] + m[2] * a[2], m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
          m[6] * a[0] + m[7] * a[1] + m[8] * a[2]};
}

Quatd RandomTurn(std::mt19937* random) {
  std::normal_distribution<double> normal;
  Quatd q = {normal(*random), normal(*random), normal(*random), normal(*random)};
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& v : q) v /= n;
  return q;
}

Vec3d Sorted(Vec3d v) {
  std::sort(v.begin(), v.end());
  return v;
}

TEST(MakeClump, OneSphere) {
  const ClumpTemplate c = MakeClump({{{3, -1, 2}, 0.5}});
  EXPECT_NEAR(c.volume_m3 / Ball(0.5), 1, 1e-12);
  for (const double i : c.inertia_per_density) EXPECT_NEAR(i / (0.4 * Ball(0.5) * 0.25), 1, 1e-12);
  EXPECT_NEAR(c.centre_m[0], 3, 1e-12);
  EXPECT_NEAR(c.members[0].offset_m[1], 0, 1e-12);
  EXPECT_EQ(c.turn, (Quatd{1, 0, 0, 0}));
}

/// Two unequal spheres on a line: the union is a body of revolution of two caps,
/// whose moments are integrals of polynomials.
struct Revolved {
  double volume = 0, first = 0, along = 0, second = 0;  ///< second: of x^2

  /// Adds the sphere about (x0, 0, 0) between x = from and x = to.
  void Add(double x0, double r, double from, double to) {
    const auto at = [&](double u, double sign) {
      const double r2 = r * r, u3 = u * u * u, u5 = u3 * u * u;
      const double area = kPi * (r2 * u - u3 / 3);                              // of pi rho^2
      const double area_u = kPi * (r2 * u * u / 2 - u3 * u / 4);                // times u
      const double area_uu = kPi * (r2 * u3 / 3 - u5 / 5);                      // times u^2
      const double polar = kPi / 2 * (r2 * r2 * u - 2 * r2 * u3 / 3 + u5 / 5);  // pi rho^4/2
      volume += sign * area;
      first += sign * (area_u + x0 * area);
      second += sign * (area_uu + 2 * x0 * area_u + x0 * x0 * area);
      along += sign * polar;
    };
    at(to - x0, 1);
    at(from - x0, -1);
  }
};

TEST(MakeClump, TwoSpheresAgainstCaps) {
  std::mt19937 random(1);
  for (const auto& [r1, r2, d] : {std::array<double, 3>{1, 1, 1},
                                  {1, 1, 0.1},
                                  {1, 1, 1.999},
                                  {1, 0.6, 0.9},
                                  {0.5, 0.05, 0.47},
                                  {1, 1, 2},
                                  {1, 0.5, 3}}) {
    Revolved truth;
    const double meet = d >= r1 + r2 ? r1 : (d * d + r1 * r1 - r2 * r2) / (2 * d);
    truth.Add(0, r1, -r1, meet);
    truth.Add(d, r2, d >= r1 + r2 ? d - r2 : meet, d + r2);
    if (d < r1 + r2 && r1 == r2) {  // the lens of two equal spheres
      const double lens = kPi * (4 * r1 + d) * (2 * r1 - d) * (2 * r1 - d) / 12;
      ASSERT_NEAR(truth.volume, 2 * Ball(r1) - lens, 1e-12);
    }
    const double across = truth.along / 2 + truth.second - truth.first * truth.first / truth.volume;
    for (int k = 0; k < 5; ++k) {  // k = 0: along x; then anyhow
      const Quatd q = k == 0 ? Quatd{1, 0, 0, 0} : RandomTurn(&random);
      const ClumpTemplate c = MakeClump({{{0, 0, 0}, r1}, {Rotate(q, {d, 0, 0}), r2}});
      EXPECT_NEAR(c.volume_m3 / truth.volume, 1, 1e-10);
      const Vec3d i = Sorted(c.inertia_per_density);
      EXPECT_NEAR(i[0] / truth.along, 1, 1e-9) << d;
      EXPECT_NEAR(i[1] / across, 1, 1e-9) << d;
      EXPECT_NEAR(i[2] / across, 1, 1e-9) << d;
      const Vec3d centre = Rotate(q, {truth.first / truth.volume, 0, 0});
      for (int a = 0; a < 3; ++a) EXPECT_NEAR(c.centre_m[a], centre[a], 1e-9);
    }
  }
}

TEST(MakeClump, HiddenAndRepeatedSpheresAddNothing) {
  const Members alone = {{{0, 0, 0}, 1}, {{1.2, 0.3, 0}, 0.8}};
  Members more = alone;
  more.push_back({{0.2, 0, 0.1}, 0.5});   // nested
  more.push_back({{0.5, 0, 0}, 0.5});     // nested, touching from inside
  more.push_back({{1.2, 0.3, 0}, 0.8});   // twice the same
  more.push_back({{0.65, 0.1, 0}, 0.3});  // within the two together
  const ClumpTemplate a = MakeClump(alone), b = MakeClump(more);
  EXPECT_NEAR(a.volume_m3 / b.volume_m3, 1, 1e-10);
  const Vec3d i = Sorted(a.inertia_per_density), j = Sorted(b.inertia_per_density);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(i[k] / j[k], 1, 1e-9);
}

Members Tetrahedron(double edge, double r) {
  const double h = edge / std::sqrt(8.0);
  return {{{h, h, h}, r}, {{h, -h, -h}, r}, {{-h, h, -h}, r}, {{-h, -h, h}, r}};
}

/// Random points in the bounding box; `volume` and the second moments about the
/// origin with their standard errors.
struct Sampled {
  double volume = 0, volume_error = 0;
  double second[6] = {}, second_error[6] = {};  ///< xx, yy, zz, xy, xz, yz
};

Sampled Sample(const Members& members, int points, unsigned seed) {
  std::mt19937_64 random(seed);
  Vec3d low = {1e9, 1e9, 1e9}, high = {-1e9, -1e9, -1e9};
  for (const auto& m : members) {
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], m.offset_m[a] - m.radius_m);
      high[a] = std::max(high[a], m.offset_m[a] + m.radius_m);
    }
  }
  const double box = (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]);
  double in = 0, sum[6] = {}, squares[6] = {};
  std::uniform_real_distribution<double> unit(0, 1);
  for (int k = 0; k < points; ++k) {
    Vec3d p;
    for (int a = 0; a < 3; ++a) p[a] = low[a] + (high[a] - low[a]) * unit(random);
    const bool hit = std::any_of(members.begin(), members.end(), [&](const auto& m) {
      double d2 = 0;
      for (int a = 0; a < 3; ++a) d2 += (p[a] - m.offset_m[a]) * (p[a] - m.offset_m[a]);
      return d2 < m.radius_m * m.radius_m;
    });
    if (!hit) continue;
    in += 1;
    const double value[6] = {p[0] * p[0], p[1] * p[1], p[2] * p[2],
                             p[0] * p[1], p[0] * p[2], p[1] * p[2]};
    for (int i = 0; i < 6; ++i) {
      sum[i] += value[i];
      squares[i] += value[i] * value[i];
    }
  }
  Sampled s;
  const double n = points, share = in / n;
  s.volume = box * share;
  s.volume_error = box * std::sqrt(share * (1 - share) / n);
  for (int i = 0; i < 6; ++i) {
    const double mean = sum[i] / n;
    s.second[i] = box * mean;
    s.second_error[i] = box * std::sqrt((squares[i] / n - mean * mean) / n);
  }
  return s;
}

/// Members as MakeClump placed them: principal axes mean that the products of
/// inertia vanish, and the diagonal is what it says.
void ExpectSampled(const ClumpTemplate& c, unsigned seed) {
  const Sampled s = Sample(c.members, 400000, seed);
  EXPECT_LT(s.volume_error / c.volume_m3, 3e-3);
  EXPECT_NEAR(c.volume_m3, s.volume, 4 * s.volume_error);
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, d = (a + 2) % 3;
    EXPECT_NEAR(c.inertia_per_density[a], s.second[b] + s.second[d],
                4 * (s.second_error[b] + s.second_error[d]));
    EXPECT_NEAR(s.second[3 + a], 0, 4 * s.second_error[3 + a]);
  }
}

/// Reference 1 (two sizes of 4-sphere clusters) prints 49,392 spheres' worth of
/// clusters for 31,329 spheres of the same solid volume: 2.54 member volumes a
/// cluster. A tetrahedron holds that at an edge of 0.929 radii.
TEST(MakeClump, FourSphereClusterOfReference1) {
  const double wanted = 31329.0 * 4 / 49392, r = 2.5e-3;
  double low = 0.5, high = 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (MakeClump(Tetrahedron(middle * r, r)).volume_m3 < wanted * Ball(r) ? low : high) = middle;
  }
  const ClumpTemplate c = MakeClump(Tetrahedron(low * r, r));
  RecordProperty("edge_over_radius", std::to_string(low));
  EXPECT_NEAR(c.volume_m3 / Ball(r), 2.537, 1e-3);
  EXPECT_NEAR(low, 0.929, 1e-3);
  const Vec3d& i = c.inertia_per_density;  // isotropic by symmetry
  EXPECT_NEAR(i[1] / i[0], 1, 1e-9);
  EXPECT_NEAR(i[2] / i[0], 1, 1e-9);
  EXPECT_EQ(c.turn, (Quatd{1, 0, 0, 0}));
  ExpectSampled(c, 2);
  // As spheres barely touch, four volumes; all in one, one.
  EXPECT_NEAR(MakeClump(Tetrahedron(2 * r, r)).volume_m3 / Ball(r), 4, 1e-9);
  EXPECT_NEAR(MakeClump(Tetrahedron(1e-6 * r, r)).volume_m3 / Ball(r), 1, 1e-5);
}

Members RandomMembers(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-1, 1), r(0.3, 0.9);
  Members members;
  for (int i = 0; i < n; ++i) members.push_back({{at(random), at(random), at(random)}, r(random)});
  return members;
}

TEST(MakeClump, AnyClusterAgainstRandomPoints) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    ExpectSampled(MakeClump(RandomMembers(3 + 2 * static_cast<int>(seed), seed)), 10 + seed);
  }
}

/// Slices in another direction see quite other discs, yet give the same body:
/// the strongest check of the quadrature.
TEST(MakeClump, TurningAndMovingChangeNothing) {
  std::mt19937 random(3);
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Members members =
        seed == 7 ? Tetrahedron(1.06, 1) : RandomMembers(2 + static_cast<int>(seed), seed);
    const ClumpTemplate a = MakeClump(members);
    Members turned = members;
    const Quatd q = RandomTurn(&random);
    for (auto& m : turned) {
      m.offset_m = Rotate(q, m.offset_m);
      for (int k = 0; k < 3; ++k) m.offset_m[k] += 5 + k;
    }
    const ClumpTemplate b = MakeClump(turned);
    EXPECT_NEAR(a.volume_m3 / b.volume_m3, 1, 1e-9) << seed;
    const Vec3d i = Sorted(a.inertia_per_density), j = Sorted(b.inertia_per_density);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(i[k] / j[k], 1, 1e-8) << seed;
  }
}

TEST(MakeClump, TurnAndCentreLeadBackToTheGivenMembers) {
  const Members members = RandomMembers(5, 4);
  const ClumpTemplate c = MakeClump(members);
  for (std::size_t m = 0; m < members.size(); ++m) {
    const Vec3d back = Rotate(c.turn, c.members[m].offset_m);  // right-handed, or it would fail
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(c.centre_m[a] + back[a], members[m].offset_m[a], 1e-12);
    EXPECT_EQ(c.members[m].radius_m, members[m].radius_m);
  }
  const ClumpTemplate again = MakeClump(c.members);  // principal axes stay
  EXPECT_NEAR(again.turn[0], 1, 1e-9);
}

TEST(MakeClump, Refuses) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(MakeClump({}), std::invalid_argument);
  EXPECT_THROW(MakeClump({{{0, 0, 0}, 0}}), std::invalid_argument);
  EXPECT_THROW(MakeClump({{{0, 0, 0}, -1}}), std::invalid_argument);
  EXPECT_THROW(MakeClump({{{0, 0, 0}, nan}}), std::invalid_argument);
  EXPECT_THROW(MakeClump({{{0, nan, 0}, 1}}), std::invalid_argument);
  EXPECT_THROW(MakeClump(Members(201, {{0, 0, 0}, 1})), std::invalid_argument);
  try {
    MakeClump({{{0, 0, 0}, 1}, {{0, 0, 0}, -2}});
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("member 1: radius_m"), std::string::npos);
  }
}

}  // namespace
}  // namespace grouser::dem

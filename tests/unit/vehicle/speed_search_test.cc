// The search of safe speeds against plain halving with all starts, point by point.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/count_allocations.h"

namespace grouser::vehicle {
namespace {

struct Case {
  const char* vehicle;
  double limit_m_per_s, curvature_per_m;
};

/// Waves of curvature, grade and bank; with a seed above 0 of other lengths, phases and heights.
std::vector<PathPoint> PathOf(const std::string& kind, double curvature, std::size_t soils,
                              unsigned seed) {
  std::mt19937 random(seed);
  const auto draw = [&](double low, double high) {
    return seed == 0 ? 1 : std::uniform_real_distribution<double>(low, high)(random);
  };
  struct Wave {
    double length, phase;
    double At(double s) const { return std::sin(6.2831853 * (s / length + phase)); }
  };
  const auto wave = [&](double length) { return Wave{length * draw(0.7, 1.3), draw(0, 1)}; };
  const Wave bend = wave(31), twist = wave(17), grade = wave(23), bank = wave(13);
  const double sharper = draw(0.7, 1.3), steeper = draw(0.7, 1.5);
  const auto run = static_cast<std::size_t>(23 * draw(0.6, 1.5));
  std::vector<PathPoint> path(200);
  for (std::size_t i = 0; i < path.size(); ++i) {
    PathPoint& p = path[i];
    p.s_m = 0.25 * static_cast<double>(i);
    p.curvature_per_m = sharper * curvature * bend.At(p.s_m) * twist.At(p.s_m);
    if (kind == "curvy") continue;
    p.grade_rad = steeper * 0.08 * grade.At(p.s_m);
    p.bank_rad = steeper * 0.05 * bank.At(p.s_m);
    if (kind == "mixed") p.soil = static_cast<std::uint8_t>((i / run + seed) % soils);
  }
  return path;
}

/// The highest speed by halving, each solve by itself from all starts.
class PlainSearch {
 public:
  PlainSearch(const VehicleFile& file, const SpeedOptions& options)
      : solver_(file.vehicle, file.grounds), options_(options) {}

  /// From what stands in `near`, if that balances, and there the solution after.
  bool Good(const PathPoint& p, double speed, Solution* near = nullptr, bool follows = false) {
    Motion m = Motion::OnPath(std::max(speed, 1e-9), p.curvature_per_m);
    m.grade_rad = p.grade_rad;
    m.bank_rad = p.bank_rad;
    m.worse_by_sd = options_.worse_by_sd;
    m.soil.fill(p.soil);
    Solution s;
    if (near != nullptr) s = *near;
    solver_.Solve({&m, 1}, {&s, 1}, Effort{.warm = near != nullptr, .follows = follows});
    if (!s.balanced) {  // once more from where it ended
      solver_.Solve({&m, 1}, {&s, 1},
                    Effort{.warm = true, .attempts = 1, .evaluations = 200, .from_least = true});
    }
    const bool good = s.balanced && s.reasons == 0 && s.tip_margin >= options_.tip_margin;
    if (near != nullptr && good) *near = s;
    if (!good) {
      binding_ = BindingOf(m, s, options_, solver_.vehicle().gravity_m_per_s2);
    }
    return good;
  }
  /// Whether it is good from some start: none, where the imbalance is least, the neighbour's in
  /// twenty steps, lower speeds, or by continuation (Effort::follows).
  bool Reached(const PathPoint& before, double speed_before, const PathPoint& p, double speed,
               Solution* near) {
    Solution own;
    if (Good(p, speed, near)) return true;
    if (Good(p, speed, &own)) {
      *near = own;
      return true;
    }
    const auto along = [&](const PathPoint& from, double speed_from, Solution start) {
      bool good = false;
      for (int i = 1; i <= 20; ++i) {
        const double share = i / 20.0;
        PathPoint q = p;
        q.curvature_per_m = std::lerp(from.curvature_per_m, p.curvature_per_m, share);
        q.grade_rad = std::lerp(from.grade_rad, p.grade_rad, share);
        q.bank_rad = std::lerp(from.bank_rad, p.bank_rad, share);
        good = Good(q, std::lerp(speed_from, speed, share), &start);
      }
      if (good) *near = start;
      return good;
    };
    return along(before, speed_before, *near) || along(p, speed / 3, Solution{}) ||
           Good(p, speed, nullptr, true);
  }
  /// The same from another motion, by itself.
  bool ReachedFrom(const PathPoint& other, double speed_other, const PathPoint& p, double speed) {
    Solution near;
    return Good(other, speed_other, &near) && Reached(other, speed_other, p, speed, &near);
  }
  double Safe(const PathPoint& p) {
    double low = 0, high = options_.speed_limit_m_per_s;
    binding_ = Binding::kSpeedLimit;
    if (Good(p, high)) return high;
    if (!Good(p, 0)) return 0;
    for (int i = 0; i < 8; ++i) {
      const double middle = (low + high) / 2;
      (Good(p, middle) ? low : high) = middle;
    }
    return low;
  }
  /// Of the lowest speed of the last Safe that failed.
  Binding binding() const { return binding_; }

 private:
  Solver solver_;
  SpeedOptions options_;
  Binding binding_ = Binding::kSpeedLimit;
};

struct Count {
  int points = 0, higher = 0, lower = 0;
  int alike = 0, other = 0;  ///< within a level of the plain one; of these bound by something else
  double worst = 0;          ///< what is lost, of the plain one
};

/// A path planned and compared point by point.
void Compare(const VehicleFile& file, const std::string& where, const SpeedOptions& options,
             const std::vector<PathPoint>& path, Count* count) {
  const double step = options.speed_limit_m_per_s / 256;
  PlainSearch plain(file, options);
  SpeedPlanner planner(file.vehicle, file.grounds, path.size());
  std::vector<SpeedPoint> out(path.size());
  const long before = g_allocations;
  planner.Plan(path, options, out);
  EXPECT_EQ(g_allocations, before);
  Solution near;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double expected = plain.Safe(path[i]), got = out[i].safe_m_per_s;
    if (std::fabs(got - expected) <= 1.001 * step) {
      ++count->alike;
      count->other += plain.binding() != out[i].safe_binding;
    }
    const std::string at = where + " point " + std::to_string(i) + " levels " +
                           std::to_string(got / step) + " " + std::to_string(expected / step) +
                           " " + NameOf(out[i].safe_binding);
    if (expected > 0) {
      EXPECT_GT(got, 0) << at;
      count->worst = std::max(count->worst, 1 - got / expected);
    }
    if (got < expected - 1.001 * step) {
      ++count->lower;
      std::cout << "lower: " << at << "\n";
    }
    // More than a step above: what was found balances, plain starts only did not find it. It is
    // reached from the motions of points around.
    const auto reached = [&] {
      const std::size_t last = i > 0 ? i - 1 : i;
      if (plain.Reached(path[last], out[last].safe_m_per_s, path[i], got, &near)) return true;
      if (plain.ReachedFrom(path[i], expected, path[i], got)) return true;
      for (std::size_t d = 1; d <= 16; ++d) {
        for (const std::size_t j : {i + d, i - d}) {
          if (j < path.size() && path[j].soil == path[i].soil &&
              plain.ReachedFrom(path[j], out[j].safe_m_per_s, path[i], got)) {
            return true;
          }
        }
      }
      return false;
    };
    if (got > 0) {
      EXPECT_TRUE(reached()) << at;
    }
    count->higher += got > expected + 1.001 * step;
    ++count->points;
  }
}

constexpr Case kCases[] = {
    {"husky", 1.5, 0.8}, {"cart", 6, 0.3}, {"rover", 0.1, 1}, {"atv", 3, 0.25}};

void CompareOne(const Case& c, const std::string& kind, unsigned seed, Count* count) {
  const VehicleFile file =
      ReadVehicle(std::string(GROUSER_VEHICLES) + "/" + c.vehicle + ".vehicle.yaml");
  SpeedOptions options;
  options.speed_limit_m_per_s = c.limit_m_per_s;
  const auto path = PathOf(kind, c.curvature_per_m, file.grounds.soils.size(), seed);
  const std::string where = c.vehicle + (" " + kind) + " " + std::to_string(seed);
  Compare(file, where, options, path, count);
}

/// Every vehicle on every kind of path.
Count CompareAll(unsigned seed) {
  Count count;
  for (const Case& c : kCases) {
    for (const char* kind : {"curvy", "hilly", "mixed"}) CompareOne(c, kind, seed, &count);
  }
  std::cout << "paths " << seed << ": " << count.points << " points, " << count.lower
            << " lower, at most by " << 100 * count.worst << " %, " << count.higher
            << " higher, of " << count.alike << " alike " << count.other
            << " bound by something else\n";
  return count;
}

// Where nothing balances near the limit it depends on the start which balance is found.
TEST(SpeedSearch, FindsWhatPlainHalvingFinds) {
  for (const unsigned seed : {0u, 1u, 2u, 3u, 4u}) {
    const Count count = CompareAll(seed);
    EXPECT_LE(count.worst, 0.2) << seed;
    EXPECT_LE(count.lower, count.points / 100) << seed;
    EXPECT_LE(count.higher, count.points / 20) << seed;
    EXPECT_GE(count.alike, count.points * 9 / 10) << seed;
    EXPECT_LE(count.other, count.points / 50) << seed;
  }
}

// Points between searched ones that reach the speed limit do so to the last bit.
TEST(SpeedSearch, ReachesTheLimitBetweenSearchedPoints) {
  const VehicleFile file = ReadVehicle(GROUSER_VEHICLES "/husky.vehicle.yaml");
  SpeedOptions options;
  options.speed_limit_m_per_s = 0.3;
  std::vector<PathPoint> path(1001);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i].s_m = 0.1 * static_cast<double>(i);
    path[i].grade_rad = 0.02 * std::sin(0.05 * path[i].s_m);
  }
  SpeedPlanner planner(file.vehicle, file.grounds, path.size());
  std::vector<SpeedPoint> out(path.size());
  planner.Plan(path, options, out);
  for (std::size_t i = 0; i < path.size(); ++i) {
    ASSERT_EQ(out[i].safe_m_per_s, options.speed_limit_m_per_s) << i;
    ASSERT_EQ(out[i].safe_binding, Binding::kSpeedLimit) << i;
  }
}

// Of no point it is said that nothing balances there because nothing is known of its like: straight
// ones uphill between curves that are too tight.
TEST(SpeedSearch, IsNotHopelessWhereNothingIsKnown) {
  const VehicleFile file = ReadVehicle(GROUSER_VEHICLES "/atv.vehicle.yaml");
  SpeedOptions options;
  options.speed_limit_m_per_s = 1;
  std::vector<PathPoint> path(5);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i].s_m = static_cast<double>(i);
    (i % 2 == 0 ? path[i].curvature_per_m : path[i].grade_rad) = i % 2 == 0 ? 3 : 0.1;
  }
  SpeedPlanner planner(file.vehicle, file.grounds, path.size());
  std::vector<SpeedPoint> out(path.size());
  planner.Plan(path, options, out);
  PlainSearch plain(file, options);
  for (const std::size_t i : {1, 3}) {
    ASSERT_GT(plain.Safe(path[i]), 0);
    EXPECT_GT(out[i].safe_m_per_s, 0) << i;
  }
}

// A stretch whose limit is that of a motor, below which nothing balances within it down to half of
// that: it is found on from a neighbour, level by level.
TEST(SpeedSearch, FindsALimitOverAGap) {
  Count count;
  CompareOne(kCases[0], "mixed", 16, &count);
  EXPECT_LE(count.worst, 0.2);
}

// A point that is driven fast and not slowly, after one with another limit.
TEST(SpeedSearch, FindsAPointThatIsDrivenFastAlone) {
  Count count;
  CompareOne(kCases[1], "mixed", 14, &count);
  EXPECT_LE(count.worst, 0.2);
}

/// A path whose curvature passes through zero with a corner, which lies between points that are
/// searched from nothing, and steps of soil; on ground as bad as `worse_by_sd`.
Count CompareCorners(const Case& c, double worse_by_sd) {
  const VehicleFile file =
      ReadVehicle(std::string(GROUSER_VEHICLES) + "/" + c.vehicle + ".vehicle.yaml");
  SpeedOptions options;
  options.speed_limit_m_per_s = c.limit_m_per_s;
  options.worse_by_sd = worse_by_sd;
  std::vector<PathPoint> path(150);
  for (std::size_t i = 0; i < path.size(); ++i) {
    PathPoint& p = path[i];
    p.s_m = 0.1 * static_cast<double>(i);
    const double turn = std::remainder(p.s_m, 5.2) / 2.6;  // a saw: -1 to 1, then a step
    p.curvature_per_m = c.curvature_per_m * turn;
    p.grade_rad = 0.02 * std::sin(p.s_m);
    p.soil = i / 29 % 2 == 0 ? 0 : static_cast<std::uint8_t>(file.grounds.soils.size() - 1);
  }
  Count count;
  const std::string where = std::string(c.vehicle) + " corners " + std::to_string(worse_by_sd);
  Compare(file, where, options, path, &count);
  std::cout << where << ": " << count.lower << " lower, at most by " << 100 * count.worst << " %, "
            << count.higher << " higher, of " << count.alike << " alike " << count.other
            << " bound by something else\n";
  return count;
}

// Ground from the mean to where little is driven: the borders of what goes lie between.
TEST(SpeedSearch, FindsCornersOfTheCurvatureAndStepsOfSoilOnAnyGround) {
  for (const Case& c : kCases) {
    for (const double worse_by_sd : {0.0, 1.645, 2.0}) {
      const Count count = CompareCorners(c, worse_by_sd);
      EXPECT_LE(count.worst, 0.2) << c.vehicle << worse_by_sd;
      EXPECT_LE(count.lower, count.points / 20) << c.vehicle << worse_by_sd;
      EXPECT_GE(count.alike, count.points * 9 / 10) << c.vehicle << worse_by_sd;
      EXPECT_LE(count.other, count.points / 20) << c.vehicle << worse_by_sd;
    }
  }
}

}  // namespace
}  // namespace grouser::vehicle

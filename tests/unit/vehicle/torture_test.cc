// Hard cases: a reason for each that does not balance, and no allocation in any.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/ground_spread.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::OnHard;
using testing::Skid;
using testing::WithFriction;

constexpr double kDegree = std::numbers::pi / 180;
const char* const kShipped[] = {"husky", "atv", "rover", "rover_lugged", "cart"};

VehicleFile Shipped(const std::string& name) {
  return ReadVehicle(std::string(GROUSER_VEHICLES) + "/" + name + ".vehicle.yaml");
}

// A solution is balanced, or says why not; its numbers are finite.
void ExpectSound(const VehicleFile& file, const Motion& motion, const Solution& s,
                 const std::string& what) {
  EXPECT_TRUE(s.balanced || s.reasons != 0) << what;
  EXPECT_EQ(s.balanced, s.residual <= Solution::kTolerance) << what;
  double load = 0, sum = 0;
  for (std::size_t i = 0; i < file.vehicle.wheels.size(); ++i) {
    const WheelSolution& w = s.wheel[i];
    EXPECT_GE(w.load_n, 0) << what;
    load += w.load_n;
    sum += w.shaft_power_w;
    for (const double x : {w.load_n, w.rim_speed_m_per_s, w.slip, w.slip_angle_rad, w.f_x_n,
                           w.f_y_n, w.torque_n_m, w.m_z_n_m, w.sinkage_m}) {
      EXPECT_TRUE(std::isfinite(x)) << what;
    }
  }
  const double weight = file.vehicle.mass_kg * file.vehicle.gravity_m_per_s2;
  EXPECT_NEAR(load, weight * std::cos(motion.grade_rad) * std::cos(motion.bank_rad), 1e-6 * weight)
      << what;
  EXPECT_NEAR(sum, s.shaft_power_w, 1e-9 * (1 + std::fabs(sum))) << what;
  EXPECT_TRUE(std::isfinite(s.electric_power_w)) << what;
}

std::vector<Motion> HardMotions(const VehicleFile& file) {
  std::vector<Motion> out;
  const auto soils = file.grounds.soils.size();
  for (const double speed : {0.0, 1e-9, 0.05, 0.5, -0.5, 3.0}) {
    for (const double yaw : {0.0, 0.05, -1.0, 4.0}) {
      for (const double grade : {0.0, 5.0, -10.0, 40.0}) {
        for (const double bank : {0.0, 8.0, -35.0}) {
          Motion m;
          m.v_x_m_per_s = speed;
          m.yaw_rate_rad_per_s = yaw;
          m.grade_rad = grade * kDegree;
          m.bank_rad = bank * kDegree;
          m.acceleration_m_per_s2 = out.size() % 5 == 4 ? 1.0 : 0;
          for (std::size_t i = 0; i < kMostWheels; ++i) {  // steps of soil under single wheels
            m.soil[i] =
                static_cast<std::uint8_t>(out.size() % 3 == 2 ? i % soils : out.size() % soils);
          }
          out.push_back(m);
        }
      }
    }
  }
  // Counter-rotation, one side stalled, all stalled.
  for (const auto& [left, right] : {std::pair{0.5, -0.5}, std::pair{0.5, 0.0}, std::pair{0.0, 0.0},
                                    std::pair{-1.0, 0.2}, std::pair{1e-9, 1e-9}}) {
    Motion m;
    m.given = Motion::Given::kControls;
    m.rim_speed_m_per_s = {left, right};
    m.steering_rad = 0.2;
    for (const double bank : {0.0, 6.0}) {
      m.bank_rad = bank * kDegree;
      out.push_back(m);
    }
  }
  return out;
}

TEST(VehicleTorture, EveryMotionOfEveryShippedVehicleIsSolvedOrHasAReason) {
  for (const char* name : kShipped) {
    const VehicleFile file = Shipped(name);
    Solver solver(file.vehicle, file.grounds);
    const std::vector<Motion> motions = HardMotions(file);
    std::vector<Solution> out(motions.size());
    const long before = g_allocations;
    solver.Solve(motions, out);
    EXPECT_EQ(g_allocations, before) << name;
    std::size_t balanced = 0;
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const Motion& m = motions[k];
      ExpectSound(file, m, out[k],
                  std::string(name) + " motion " + std::to_string(k) + ": v " +
                      std::to_string(m.v_x_m_per_s) + " yaw " +
                      std::to_string(m.yaw_rate_rad_per_s) + " " + NamesOf(out[k].reasons));
      balanced += out[k].balanced;
    }
    EXPECT_GT(balanced, motions.size() / 8) << name;
    RecordProperty(std::string(name) + "_balanced", static_cast<int>(balanced));
  }
}

TEST(VehicleTorture, DrawsAreSoundWithoutAllocation) {
  for (const char* name : kShipped) {
    const VehicleFile file = Shipped(name);
    const auto draws = std::make_shared<const GroundDraws>(file.grounds, 8);
    Solver solver(file.vehicle, file.grounds);
    solver.UseDraws(draws);
    SpeedPlanner planner(file.vehicle, file.grounds, 8);
    // No draws cannot fail: they are what destructors ask for.
    const long none = g_allocations;
    planner.UseDraws(nullptr);
    EXPECT_EQ(g_allocations, none);
    planner.UseDraws(draws);
    std::vector<Motion> motions = HardMotions(file);
    for (std::size_t k = 0; k < motions.size(); ++k) motions[k].draw = static_cast<int>(k % 9) - 1;
    std::vector<Solution> out(motions.size());
    std::vector<PathPoint> path(8);
    for (std::size_t i = 0; i < path.size(); ++i) path[i].s_m = static_cast<double>(i);
    const std::vector<SpeedPoint> plan(8, {.safe_m_per_s = 0.2, .speed_m_per_s = 0.2});
    SpeedOptions options;
    options.speed_limit_m_per_s = 1;
    const long before = g_allocations;
    solver.Solve(motions, out);
    planner.ProbabilityByDraws(motions[1], options);
    planner.PlanByDraws(path, options, plan, {});
    EXPECT_EQ(g_allocations, before) << name;
    std::size_t balanced = 0;
    for (std::size_t k = 0; k < motions.size(); ++k) {
      ExpectSound(file, motions[k], out[k], std::string(name) + " " + std::to_string(k));
      balanced += out[k].balanced;
    }
    EXPECT_GT(balanced, motions.size() / 8) << name;
  }
}

// The wheel at the same place on the other side.
std::size_t Opposite(const Vehicle& v, std::size_t wheel) {
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    if (v.wheels[i].x_m == v.wheels[wheel].x_m && v.wheels[i].y_m == -v.wheels[wheel].y_m) return i;
  }
  return v.wheels.size();
}

Motion Mirrored(const Vehicle& v, const Motion& m) {
  Motion mirrored = m;
  mirrored.yaw_rate_rad_per_s *= -1;
  mirrored.bank_rad *= -1;
  mirrored.steering_rad *= -1;
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    const std::size_t other = Opposite(v, i);
    mirrored.soil[other] = m.soil[i];
    if (v.wheels[i].drive < 0) continue;
    mirrored.rim_speed_m_per_s[static_cast<std::size_t>(v.wheels[other].drive)] =
        m.rim_speed_m_per_s[static_cast<std::size_t>(v.wheels[i].drive)];
  }
  return mirrored;
}

TEST(VehicleTorture, EveryMotionMirrors) {
  for (const char* name : kShipped) {
    const VehicleFile file = Shipped(name);
    Solver solver(file.vehicle, file.grounds);
    const std::vector<Motion> motions = HardMotions(file);
    std::vector<Motion> mirrored;
    for (const Motion& m : motions) mirrored.push_back(Mirrored(file.vehicle, m));
    std::vector<Solution> a(motions.size()), b(motions.size());
    solver.Solve(motions, a);
    solver.Solve(mirrored, b);
    std::size_t compared = 0, other = 0;
    const double weight = file.vehicle.mass_kg * file.vehicle.gravity_m_per_s2;
    for (std::size_t k = 0; k < motions.size(); ++k) {
      if (!a[k].balanced && !b[k].balanced) continue;
      ++compared;
      bool same = a[k].balanced == b[k].balanced && a[k].reasons == b[k].reasons;
      for (std::size_t i = 0; same && i < file.vehicle.wheels.size(); ++i) {
        const WheelSolution &l = a[k].wheel[i], &r = b[k].wheel[Opposite(file.vehicle, i)];
        same = std::fabs(l.load_n - r.load_n) < 1e-4 * weight &&
               std::fabs(l.f_y_n + r.f_y_n) < 1e-4 * weight &&
               std::fabs(l.torque_n_m - r.torque_n_m) < 1e-4 * weight;
      }
      other += !same;
    }
    EXPECT_EQ(other, 0u) << name << " of " << compared;
    EXPECT_GT(compared, motions.size() / 8) << name;
  }
}

// Near tipping: loads, torques and the margin go on continuously to the last milliradian, and
// beyond it the reason is TIP.
TEST(VehicleTorture, NearTippingIsContinuousAndThenTips) {
  for (const double way : {-1.0, 1.0}) {
    OnHard on(Skid(0.25, 0.28, 0.5), {WithFriction(2)});
    Motion motion = Motion::OnPath(0.3, 0);
    const double edge = std::atan(0.25 / 0.5);
    Solution before;
    for (int i = 0; i < 60; ++i) {
      motion.grade_rad = way * (edge - 1e-3 * (60 - i) - 0.03);
      const Solution s = on.Solve(motion);
      ASSERT_TRUE(s.balanced) << i << " " << NamesOf(s.reasons) << s.residual;
      EXPECT_GT(s.tip_margin, 0) << i;
      for (std::size_t w = 0; i > 0 && w < 4; ++w) {
        EXPECT_NEAR(s.wheel[w].load_n, before.wheel[w].load_n, 1) << i;
        EXPECT_NEAR(s.wheel[w].torque_n_m, before.wheel[w].torque_n_m, 0.3) << i;
      }
      before = s;
    }
    motion.grade_rad = way * (edge + 0.03);
    EXPECT_NE(on.Solve(motion).reasons & kTips, 0u);
  }
}

// In a curve on ice every speed up to 0.88 of what all of the friction would hold (from 0.89 on the
// tightest of these has no balance) is found from nothing, not only from a neighbour: where a free
// wheel was started off its heading, balances were missed from a quarter of it on.
TEST(VehicleTorture, ACurveOnIceIsFoundAtEverySpeed) {
  const VehicleFile file = Shipped("cart");
  Solver solver(file.vehicle, file.grounds);
  for (const double curvature : {0.1, 0.2, 0.3, 0.5}) {
    const double fastest = std::sqrt(0.88 * 0.15 * 9.81 / curvature);
    for (int i = 1; i <= 200; ++i) {
      Motion motion = Motion::OnPath(fastest * i / 200, curvature);
      motion.soil.fill(1);
      Solution s;
      solver.Solve({&motion, 1}, {&s, 1});
      EXPECT_TRUE(s.balanced) << curvature << " " << i << " residual " << s.residual;
    }
  }
}

TEST(VehicleTorture, AnswersDoNotDependOnTheBatch) {
  const VehicleFile file = Shipped("husky");
  Solver solver(file.vehicle, file.grounds);
  const std::vector<Motion> motions = HardMotions(file);
  std::vector<Solution> together(motions.size()), alone(1);
  solver.Solve(motions, together);
  for (std::size_t k = 0; k < motions.size(); k += 7) {
    solver.Solve({&motions[k], 1}, alone);
    EXPECT_EQ(alone[0].reasons, together[k].reasons) << k;
    EXPECT_EQ(alone[0].residual, together[k].residual) << k;
    EXPECT_EQ(alone[0].electric_power_w, together[k].electric_power_w) << k;
  }
}

TEST(VehicleTorture, OverloadIsNoLimitOfTheGroundButOfTheTraining) {
  VehicleFile file = Shipped("rover");
  file.vehicle.mass_kg *= 4;  // far beyond the loads of the runs
  Solver solver(file.vehicle, file.grounds);
  Motion motion = Motion::OnPath(0.05, 0);
  Solution s;
  solver.Solve({&motion, 1}, {&s, 1});
  EXPECT_NE(s.reasons & kModelDomain, 0u) << NamesOf(s.reasons);
  EXPECT_EQ(s.reasons & kNoBalance, 0u) << NamesOf(s.reasons);
}

TEST(VehicleTorture, TooFastIsAnUntrainedSpeed) {
  const VehicleFile file = Shipped("rover");
  Solver solver(file.vehicle, file.grounds);
  Motion motion = Motion::OnPath(1.0, 0);  // Froude number 1.6
  Solution s;
  solver.Solve({&motion, 1}, {&s, 1});
  EXPECT_NE(s.reasons & kUntrainedSpeed, 0u);
  EXPECT_EQ(s.reasons & kLimits, 0u) << NamesOf(s.reasons);
}

TEST(VehicleTorture, TurnsInPlaceOnASlope) {
  OnHard on{Skid()};
  Motion motion;
  motion.yaw_rate_rad_per_s = 0.5;
  for (const double bank : {0.0, 5.0, 15.0}) {
    motion.bank_rad = bank * kDegree;
    const Solution s = on.Solve(motion);
    ASSERT_TRUE(s.balanced) << bank << " " << NamesOf(s.reasons) << " " << s.residual;
    EXPECT_NEAR(s.f_y_n, 60 * 9.81 * std::sin(motion.bank_rad), 1e-3);
    EXPECT_LT(s.rim_speed_m_per_s[0], 0);
    EXPECT_GT(s.rim_speed_m_per_s[1], 0);
  }
}

TEST(VehicleTorture, AStepOfSoilUnderOneWheelIsContinuousInItsFriction) {
  Solution before;
  for (int i = 0; i <= 60; ++i) {
    OnHard on(Skid(), {testing::Asphalt(), WithFriction(0.8 - 0.012 * i)});
    Motion motion = Motion::OnPath(0.6, 0.5);
    motion.soil[1] = 1;
    const Solution s = on.Solve(motion);
    ASSERT_TRUE(s.balanced) << i << " " << NamesOf(s.reasons) << s.residual;
    if (i > 0) {
      for (std::size_t w = 0; w < 4; ++w) {
        EXPECT_NEAR(s.wheel[w].torque_n_m, before.wheel[w].torque_n_m, 1.0) << i << " " << w;
      }
    }
    before = s;
  }
}

// Where the mean ground balances, so do neighbouring grounds, and the ends of the interval go along
// with the radius. (A search from afar found no balance on the worse ground at three of these
// radii.)
TEST(VehicleTorture, IntervalsOfPowerHaveNoHolesAlongTheRadius) {
  for (const auto& [name, most_step] : {std::pair{"atv", 0.05}, std::pair{"husky", 0.2}}) {
    const VehicleFile file = Shipped(name);
    Solver solver(file.vehicle, file.grounds);
    PowerInterval before;
    for (int i = 0; i < 40; ++i) {
      const double radius = 2 * std::pow(1.05, i);
      const PowerInterval p = PowerOf(&solver, Motion::OnPath(0.5, 1 / radius));
      ASSERT_TRUE(p.solution.balanced) << name << radius;
      EXPECT_LT(p.electric_low, p.mean.electric) << name << radius;
      EXPECT_GT(p.electric_high, p.mean.electric) << name << radius;
      if (i > 0) {
        EXPECT_NEAR(p.electric_high / before.electric_high, 1, most_step) << name << radius;
        EXPECT_NEAR(p.electric_low / before.electric_low, 1, most_step) << name << radius;
      }
      before = p;
    }
  }
}

// A balance on better and worse ground is found from nothing at every radius at which it is there
// (neighbouring radii have one): in one call, and not only from the mean ground's solution. The
// solver's own starts alone miss some.
TEST(VehicleTorture, WorseGroundIsFoundFromNothingAtEveryRadius) {
  std::size_t missed = 0;
  for (const char* name : {"atv", "husky"}) {
    const VehicleFile file = Shipped(name);
    Solver solver(file.vehicle, file.grounds);
    std::vector<Motion> motions;
    for (int i = 0; i < 160; ++i) {
      for (const double worse_by_sd : {-1.645, 1.645, 2.0}) {
        motions.push_back(Motion::OnPath(0.5, 1 / (2 * std::pow(1.0125, i))));
        motions.back().worse_by_sd = worse_by_sd;
      }
    }
    std::vector<Solution> starts(motions.size()), all(motions.size());
    solver.Solve(motions, starts, Effort{});
    const long before = g_allocations;
    solver.Solve(motions, all);
    EXPECT_EQ(g_allocations, before) << name;
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const Motion& m = motions[k];
      EXPECT_TRUE(all[k].balanced) << name << " radius " << m.v_x_m_per_s / m.yaw_rate_rad_per_s
                                   << " sds " << m.worse_by_sd << " residual " << all[k].residual;
      ExpectSound(file, m, all[k], name);
      missed += !starts[k].balanced;
    }
  }
  EXPECT_GT(missed, 0u);
}

// The same of given rim speeds: from equal rims on.
TEST(VehicleTorture, RimSpeedsAreFollowedFromEqualOnes) {
  const VehicleFile file = Shipped("husky");
  Solver solver(file.vehicle, file.grounds);
  for (const double side : {-0.4, 0.1, 0.3, 0.7}) {
    Motion m;
    m.given = Motion::Given::kControls;
    m.rim_speed_m_per_s = {0.8, side};
    m.worse_by_sd = 1.645;
    Solution s, again;
    solver.Solve({&m, 1}, {&s, 1});
    ASSERT_TRUE(s.balanced) << side;
    // From its own solution, which a warm search of rim speeds begins at.
    again = s;
    solver.Solve({&m, 1}, {&again, 1}, Effort{.warm = true, .attempts = 1});
    ASSERT_TRUE(again.balanced) << side;
    EXPECT_LE(again.evaluations, 3) << side;
    EXPECT_NEAR(again.yaw_rate_rad_per_s, s.yaw_rate_rad_per_s, 1e-4) << side;
  }
}

TEST(VehicleTorture, AnIntervalWithAnUnknownEndIsUnknown) {
  const auto [low, high] = EndsOf(2, 1);
  EXPECT_EQ(low, 1);
  EXPECT_EQ(high, 2);
  for (const auto& ends : {EndsOf(1, NAN), EndsOf(NAN, 1), EndsOf(NAN, NAN)}) {
    EXPECT_TRUE(std::isnan(ends.first) && std::isnan(ends.second));
  }
}

}  // namespace
}  // namespace grouser::vehicle

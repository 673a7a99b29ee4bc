#include "surrogate/vehicle/solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::Asphalt;
using testing::Cart;
using testing::OnHard;
using testing::Rover;
using testing::Skid;
using testing::WithFriction;

constexpr double kDegree = std::numbers::pi / 180;

TEST(VehicleSolver, LoadsTransferByClosedForm) {
  // Level, straight, accelerating: N_front = W/4 - m a h/(2 L), rolling resistance besides.
  surrogate::HardGround ground = Asphalt();
  ground.rolling_resistance = 0;
  OnHard on(Skid(), {ground});
  Motion motion = Motion::OnPath(1, 0);
  motion.acceleration_m_per_s2 = 1.5;
  const Solution s = on.Solve(motion);
  ASSERT_TRUE(s.balanced) << NamesOf(s.reasons);
  const double weight = 60 * 9.81, transfer = 60 * 1.5 * 0.3 / (2 * 0.5);
  EXPECT_NEAR(s.wheel[0].load_n, weight / 4 - transfer, 1e-6 * weight);
  EXPECT_NEAR(s.wheel[3].load_n, weight / 4 + transfer, 1e-6 * weight);
  EXPECT_NEAR(s.f_x_n, 60 * 1.5, 1e-6 * weight);
  // All torque is pull times radius, in proportion to the load (one slip for all).
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(s.wheel[i].f_x_n / s.wheel[i].load_n, 60 * 1.5 / weight, 1e-6);
  }
}

TEST(VehicleSolver, ClimbsByWeightAndRollingResistance) {
  OnHard on{Skid()};
  Motion motion = Motion::OnPath(0.5, 0);
  motion.grade_rad = 20 * kDegree;
  const Solution s = on.Solve(motion);
  ASSERT_TRUE(s.balanced);
  EXPECT_EQ(s.reasons, 0u);
  const double weight = 60 * 9.81;
  EXPECT_NEAR(s.f_x_n, weight * std::sin(motion.grade_rad), 1e-6 * weight);
  double torque = 0;
  for (std::size_t i = 0; i < 4; ++i) torque += s.wheel[i].torque_n_m;
  const double resist = 0.02 * weight * std::cos(motion.grade_rad) * 0.165;
  EXPECT_NEAR(torque, 0.165 * s.f_x_n + resist, 1e-6 * weight);
  // Moment about the rear contact line, the shift by rolling resistance included.
  const double front = (s.wheel[0].load_n + s.wheel[1].load_n) * 0.5;
  EXPECT_NEAR(
      front,
      weight * (0.25 * std::cos(motion.grade_rad) - 0.3 * std::sin(motion.grade_rad)) - resist,
      1e-6 * weight);
}

TEST(VehicleSolver, SlidesWhereFrictionEnds) {
  OnHard on(Skid(), {WithFriction(0.3)});
  Motion motion = Motion::OnPath(0.5, 0);
  motion.grade_rad = std::atan(0.295);
  EXPECT_EQ(on.Solve(motion).reasons, 0u);
  motion.grade_rad = std::atan(0.305);
  const Solution s = on.Solve(motion);
  EXPECT_FALSE(s.balanced);
  EXPECT_EQ(s.reasons, std::uint32_t{kNoBalance});
  EXPECT_NEAR(s.f_x_n, 0.3 * 60 * 9.81 * std::cos(motion.grade_rad), 0.1);  // what there is
}

TEST(VehicleSolver, TipsWhereGravityLeavesTheWheels) {
  // Bank: tips at tan(bank) = b/h; on enough friction. Without aligning moment and rolling
  // resistance, which the two wheels of one side could not balance.
  surrogate::HardGround ground = WithFriction(1.5);
  ground.contact_length_m = 1e-9;
  ground.rolling_resistance = 0;
  OnHard on(Skid(0.25, 0.28, 0.5), {ground});
  Motion motion = Motion::OnPath(0.5, 0);
  motion.bank_rad = std::atan(0.28 / 0.5) - 1e-4;
  const Solution before = on.Solve(motion);
  EXPECT_EQ(before.reasons, 0u);
  EXPECT_NEAR(before.wheel[0].load_n, 0, 0.3);
  EXPECT_GT(before.tip_margin, 0);
  motion.bank_rad = std::atan(0.28 / 0.5) + 1e-4;
  const Solution after = on.Solve(motion);
  EXPECT_NE(after.reasons & kTips, 0u);
  EXPECT_NEAR(after.tip_margin, 0, 1e-3);
}

TEST(VehicleSolver, TipsInATurnAtTheRolloverSpeed) {
  // v^2 kappa h = g b, with Ackermann steering; the origin is under the rear axle, in the middle.
  Vehicle cart = Cart(Coupling::kLocked);  // a differential would spin the inner wheel before
  cart.centre_z_m = 0.6;
  cart.wheels[0].y_m = cart.wheels[2].y_m = 0.3;
  cart.wheels[1].y_m = cart.wheels[3].y_m = -0.3;
  OnHard on(cart, {WithFriction(2)});
  const double curvature = 0.1, rollover = std::sqrt(9.81 * 0.3 / (0.6 * curvature));
  EXPECT_EQ(on.Solve(Motion::OnPath(0.999 * rollover, curvature)).reasons, 0u);
  EXPECT_NE(on.Solve(Motion::OnPath(1.001 * rollover, curvature)).reasons & kTips, 0u);
}

TEST(VehicleSolver, MirrorsLeftAndRight) {
  for (const Vehicle& v : {Skid(), Cart(), Rover()}) {
    OnHard on{v};
    Motion left = Motion::OnPath(0.7, 0.4), right = Motion::OnPath(0.7, -0.4);
    left.bank_rad = 0.05;
    right.bank_rad = -0.05;
    const Solution a = on.Solve(left), b = on.Solve(right);
    ASSERT_TRUE(a.balanced && b.balanced) << v.name;
    for (std::size_t i = 0; i < v.wheels.size(); ++i) {  // left wheels before right ones
      EXPECT_NEAR(a.wheel[i].torque_n_m, b.wheel[i ^ 1].torque_n_m, 1e-5) << v.name;
      EXPECT_NEAR(a.wheel[i].f_y_n, -b.wheel[i ^ 1].f_y_n, 1e-4) << v.name;
    }
    EXPECT_NEAR(a.v_y_m_per_s, -b.v_y_m_per_s, 1e-6);
  }
}

TEST(VehicleSolver, ControlsAreTheInverseOfTwists) {
  for (const Vehicle& v : {Skid(), Cart(), Cart(Coupling::kLocked), Rover()}) {
    OnHard on{v};
    for (const double curvature : {0.0, 0.2, -0.6}) {
      const Solution s = on.Solve(Motion::OnPath(0.8, curvature));
      ASSERT_TRUE(s.balanced) << v.name << " " << curvature;
      Motion controls;
      controls.given = Motion::Given::kControls;
      controls.rim_speed_m_per_s = s.rim_speed_m_per_s;
      controls.steering_rad = s.steering_rad;
      const Solution back = on.Solve(controls);
      ASSERT_TRUE(back.balanced) << v.name << " " << curvature << " " << NamesOf(back.reasons);
      EXPECT_NEAR(back.v_x_m_per_s, 0.8, 1e-4) << v.name;
      EXPECT_NEAR(back.yaw_rate_rad_per_s, 0.8 * curvature, 1e-4) << v.name;
      EXPECT_NEAR(back.v_y_m_per_s, s.v_y_m_per_s, 1e-4) << v.name;
    }
  }
}

// The same vehicle, stepped in time by equations of motion that are written anew here.
struct Stepped {
  double u = 0, v = 0, r = 0;
};
Stepped StepInTime(const Vehicle& vehicle, const surrogate::WheelModel& model, double left,
                   double right, double bank) {
  Stepped s{(left + right) / 2, 0, 0};
  double a_x = 0, a_y = 0, pitch = 0;
  const double m = vehicle.mass_kg, g = vehicle.gravity_m_per_s2, h = vehicle.centre_z_m;
  const double a = vehicle.wheels[0].x_m, b = vehicle.wheels[0].y_m, dt = 2e-4;
  const double radius = vehicle.wheel_types[0].radius_m;
  for (int step = 0; step < 60000; ++step) {
    double f_x = 0, f_y = 0, m_z = 0, moment = 0;
    for (const Wheel& w : vehicle.wheels) {
      const double load = m * g * std::cos(bank) / 4 - (m * a_x * h - pitch) * w.x_m / (4 * a * a) -
                          m * (a_y + g * std::sin(bank)) * h * w.y_m / (4 * b * b);
      surrogate::WheelStatesView in;
      const double x = s.u - s.r * w.y_m, y = s.v + s.r * w.x_m, rim = w.y_m > 0 ? left : right;
      in.v_x = {&x, 1};
      in.v_y = {&y, 1};
      in.rim_speed = {&rim, 1};
      in.load = {&load, 1};
      in.yaw_rate = {&s.r, 1};
      double value[4];
      std::uint32_t flags;
      surrogate::ResponsesView out;
      out.flags = {&flags, 1};
      out.output[surrogate::kFx].value = {&value[0], 1};
      out.output[surrogate::kFy].value = {&value[1], 1};
      out.output[surrogate::kMz].value = {&value[2], 1};
      out.output[surrogate::kTorque].value = {&value[3], 1};
      model.Evaluate(in, out);
      f_x += value[0];
      f_y += value[1];
      m_z += w.x_m * value[1] - w.y_m * value[0] + value[2];
      moment += radius * value[0] - value[3];
    }
    // Loads follow slowly: the same end, without the wheels' bouncing.
    pitch += 0.01 * (moment - pitch);
    const double along = f_x / m, across = f_y / m - g * std::sin(bank);
    a_x += 0.01 * (along - a_x);
    a_y += 0.01 * (across - a_y);
    s.u += dt * (along + s.r * s.v);
    s.v += dt * (across - s.r * s.u);
    s.r += dt * m_z / vehicle.yaw_inertia_kg_m2;
  }
  return s;
}

TEST(VehicleSolver, FindsWhatSteppingInTimeEndsIn) {
  const Vehicle vehicle = Skid();
  for (const auto& [left, right, bank] :
       {std::array{0.8, 1.2, 0.0}, std::array{0.5, -0.5, 0.0}, std::array{0.7, 1.0, 0.1}}) {
    surrogate::HardGround ground = Asphalt();
    ground.slip_stiffness = 5;
    OnHard on(vehicle, {ground});
    const Stepped stepped = StepInTime(vehicle, *on.models[0], left, right, bank);
    Motion motion;
    motion.given = Motion::Given::kControls;
    motion.rim_speed_m_per_s = {left, right};
    motion.bank_rad = bank;
    const Solution s = on.Solve(motion);
    ASSERT_TRUE(s.balanced) << left << " " << right << " " << NamesOf(s.reasons) << s.residual;
    const double scale = 1e-3 * std::max(left, right);
    EXPECT_NEAR(s.v_x_m_per_s, stepped.u, scale);
    EXPECT_NEAR(s.v_y_m_per_s, stepped.v, scale);
    EXPECT_NEAR(s.yaw_rate_rad_per_s, stepped.r, 1e-3 * std::fabs(stepped.r));
  }
}

// What a search learned of other unknowns is of no use to the next.
TEST(VehicleSolver, GoesOnFromASolutionOfOtherUnknowns) {
  surrogate::HardGround ground = Asphalt();
  ground.friction_sd = 0.1;
  ground.rolling_resistance_sd = 0.01;
  OnHard on(Skid(), {ground});
  Motion controls;
  controls.given = Motion::Given::kControls;
  controls.rim_speed_m_per_s = {0.6, 0.9};
  controls.worse_by_sd = 1.645;
  const Solution found = on.Solve(controls);
  ASSERT_TRUE(found.balanced);
  Solution plain = found;
  plain.interval_slope = {};
  EXPECT_NE(found.interval_slope, plain.interval_slope);
  Motion twist =
      Motion::OnPath(1.2 * found.v_x_m_per_s, found.yaw_rate_rad_per_s / found.v_x_m_per_s);
  twist.grade_rad = 0.05;
  twist.worse_by_sd = 1.645;
  Solution warm = found;
  on.solver->Solve({&twist, 1}, {&warm, 1}, true);
  on.solver->Solve({&twist, 1}, {&plain, 1}, true);
  ASSERT_TRUE(warm.balanced);
  EXPECT_EQ(warm.evaluations, plain.evaluations);
  EXPECT_EQ(warm.shaft_power_w, plain.shaft_power_w);
  EXPECT_EQ(warm.interval_slope, plain.interval_slope);
  // Of the same unknowns it is.
  Solution again = warm, forgot = warm;
  forgot.interval_slope = {};
  EXPECT_NE(again.interval_slope, forgot.interval_slope);
  twist.grade_rad = 0.08;
  on.solver->Solve({&twist, 1}, {&again, 1}, true);
  on.solver->Solve({&twist, 1}, {&forgot, 1}, true);
  EXPECT_NE(again.interval_slope, forgot.interval_slope);
}

TEST(VehicleSolver, LiftsAWheelAndGoesOn) {
  // A tricycle of four: the centre near one corner; that one opposite lifts off.
  Vehicle v = Skid();
  v.centre_x_m = 0.15;
  v.centre_y_m = 0.18;
  OnHard on{v};
  const Solution s = on.Solve(Motion::OnPath(0.5, 0));
  ASSERT_TRUE(s.balanced);
  EXPECT_EQ(s.wheel[3].load_n, 0);
  EXPECT_EQ(s.wheel[3].flags, surrogate::kAirborne);
  double sum = 0, by_x = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += s.wheel[i].load_n;
    by_x += s.wheel[i].load_n * v.wheels[i].x_m;
  }
  EXPECT_NEAR(sum, 60 * 9.81, 1e-9 * sum);
  EXPECT_NEAR(by_x, sum * 0.15, 0.01 * sum);
}

TEST(VehicleSolver, IsContinuousThroughLiftOff) {
  OnHard on(Skid(0.25, 0.28, 0.5), {WithFriction(1.5)});
  Motion motion = Motion::OnPath(0.5, 0);
  motion.grade_rad = 0.2;
  Solution before = on.Solve(motion);
  for (int i = 1; i <= 200; ++i) {
    motion.bank_rad = 0.0024 * i;
    const Solution s = on.Solve(motion);
    ASSERT_TRUE(s.balanced) << i << " " << NamesOf(s.reasons);
    for (std::size_t w = 0; w < 4; ++w) {
      EXPECT_NEAR(s.wheel[w].load_n, before.wheel[w].load_n, 3) << i;
      EXPECT_NEAR(s.wheel[w].torque_n_m, before.wheel[w].torque_n_m, 0.5) << i;
    }
    before = s;
  }
}

TEST(VehicleSolver, TellsATorqueLimit) {
  Vehicle v = Skid();
  for (Drive& d : v.drives) d.motor.torque_limit_n_m = 10;
  OnHard on{v};
  const double weight = 60 * 9.81;
  // Two drives of 10 N m at 0.165 m, less rolling resistance.
  const double steepest = std::asin((2 * 10 / 0.165 - 0.02 * weight) / weight);
  Motion motion = Motion::OnPath(0.5, 0);
  motion.grade_rad = steepest - 0.002;
  EXPECT_EQ(on.Solve(motion).reasons, 0u);
  motion.grade_rad = steepest + 0.002;
  const Solution s = on.Solve(motion);
  EXPECT_EQ(s.reasons, std::uint32_t{kOverTorque});
  EXPECT_TRUE(s.balanced);
  EXPECT_LT(s.torque_margin, 0);
}

TEST(VehicleSolver, DrawsCurrentByTheMotorsConstants) {
  Vehicle v = Skid();
  for (Drive& d : v.drives) {
    d.motor = {.torque_constant_n_m_per_a = 0.044,
               .resistance_ohm = 0.46,
               .no_load_current_a = 1.3,
               .gear = 78.7,
               .efficiency = 0.7};
  }
  OnHard on{v};
  const Solution s = on.Solve(Motion::OnPath(0.8, 0));
  ASSERT_EQ(s.reasons, 0u);
  const double torque = s.wheel[0].torque_n_m + s.wheel[2].torque_n_m;
  const double spin = s.wheel[0].rim_speed_m_per_s / 0.165;
  const double current = torque / (0.7 * 78.7 * 0.044) + 1.3;
  EXPECT_NEAR(s.electric_power_w, 2 * current * (0.46 * current + 0.044 * 78.7 * spin), 1e-3);
}

TEST(VehicleSolver, StandsStillAtTheLimitOfCreeping) {
  OnHard on{Skid()};
  Motion motion;
  motion.grade_rad = 0.2;
  const Solution still = on.Solve(motion);
  motion.v_x_m_per_s = 1e-6;
  const Solution creeping = on.Solve(motion);
  ASSERT_EQ(still.reasons, 0u);
  EXPECT_EQ(still.v_x_m_per_s, 0);
  EXPECT_EQ(still.shaft_power_w, 0);
  EXPECT_NEAR(still.wheel[0].torque_n_m, creeping.wheel[0].torque_n_m, 1e-9);
}

TEST(VehicleSolver, NamesWhatCannotBeSolved) {
  OnHard on{Skid()};
  Motion motion = Motion::OnPath(NAN, 0);
  EXPECT_EQ(on.Solve(motion).reasons, std::uint32_t{kBadInput});
  motion = Motion::OnPath(1, 0);
  motion.soil[2] = 9;
  EXPECT_EQ(on.Solve(motion).reasons, std::uint32_t{kBadInput});
  motion.soil[2] = 0;
  motion.grade_rad = std::numbers::pi / 2;
  EXPECT_EQ(on.Solve(motion).reasons, std::uint32_t{kBadInput});
  EXPECT_EQ(NamesOf(kTips | kModelDomain), "TIP|MODEL_DOMAIN");
}

// Two wheel types on 200 soils, a model for each: the last one answers for its soil.
TEST(VehicleSolver, TellsMoreModelsApartThanAByteCounts) {
  Vehicle v = Skid();
  v.wheel_types.push_back(v.wheel_types[0]);
  for (Wheel& w : v.wheels) w.type = 1;
  std::vector<surrogate::HardGround> grounds(200, Asphalt());
  for (std::size_t i = 0; i < grounds.size(); ++i) {
    grounds[i].rolling_resistance = 0.001 * static_cast<double>(i);
  }
  OnHard on(v, grounds);
  for (const std::uint8_t soil : {55, 56, 199}) {  // the 256th model, the one after it, the last
    Motion motion = Motion::OnPath(0.5, 0);
    motion.soil.fill(soil);
    const Solution s = on.Solve(motion);
    ASSERT_TRUE(s.balanced);
    double torque = 0;
    for (std::size_t i = 0; i < 4; ++i) torque += s.wheel[i].torque_n_m;
    EXPECT_NEAR(torque, 0.001 * soil * 60 * 9.81 * 0.165, 1e-5 * 60 * 9.81) << int{soil};
  }
}

std::string Refusal(const Vehicle& v) {
  try {
    Check(v);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Vehicle, RefusesWhatNoSolveCanUse) {
  EXPECT_EQ(Refusal(Skid()), "");
  EXPECT_EQ(Refusal(Cart()), "");
  EXPECT_EQ(Refusal(Rover()), "");
  Vehicle v = Skid();
  v.wheels.clear();
  EXPECT_EQ(Refusal(v), "wheels: got none, expected 3 to 8");
  v = Skid();
  v.mass_kg = -1;
  EXPECT_NE(Refusal(v).find("mass_kg: got -1"), std::string::npos);
  v = Skid();
  for (Wheel& w : v.wheels)
    w.y_m = 0.1 + 0.3 * w.x_m, w.x_m += w.drive * 0.01, w.y_m += w.drive * 0.003;
  EXPECT_EQ(Refusal(v), "wheels: got all on one line, expected wheels that span an area");
  v = Skid();
  v.centre_x_m = NAN;
  EXPECT_NE(Refusal(v).find("centre_x_m: got nan"), std::string::npos);
  v = Skid();
  v.centre_x_m = 0.3;
  EXPECT_NE(Refusal(v).find("centre: got"), std::string::npos);
  v = Skid();
  v.drives.pop_back();
  for (Wheel& w : v.wheels) w.drive = 0;
  EXPECT_NE(Refusal(v).find("drives: got 1, expected 2"), std::string::npos);
  v = Skid();
  v.drives[0].motor.efficiency = 0;
  EXPECT_NE(Refusal(v).find("drives[0].motor.efficiency"), std::string::npos);
  v = Skid();
  v.wheels[1] = v.wheels[0];
  EXPECT_NE(Refusal(v).find("wheels[1]: got the place of wheels[0]"), std::string::npos);
}

}  // namespace
}  // namespace grouser::vehicle

#pragma once

#include <array>
#include <memory>
#include <vector>

#include "surrogate/models/hard_ground.h"
#include "surrogate/vehicle/speed_plan.h"

/// Vehicles and grounds of the tests.
namespace grouser::vehicle::testing {

inline surrogate::HardGround Asphalt() {
  return {.friction = 0.8,
          .slip_stiffness = 12,
          .rolling_resistance = 0.02,
          .contact_length_m = 0.06,
          .contact_width_m = 0.1};
}
inline surrogate::HardGround WithFriction(double friction) {
  surrogate::HardGround ground = Asphalt();
  ground.friction = friction;
  return ground;
}

/// Four wheels in two chains, symmetric: half length a, half track b, centre at (0, 0, h).
inline Vehicle Skid(double a = 0.25, double b = 0.28, double h = 0.3) {
  Vehicle v;
  v.name = "skid";
  v.mass_kg = 60;
  v.centre_z_m = h;
  v.yaw_inertia_kg_m2 = 4;
  v.wheel_types = {{"wheel", 0.165, 0.1}};
  v.wheels = {{.name = "fl", .x_m = a, .y_m = b, .drive = 0},
              {.name = "fr", .x_m = a, .y_m = -b, .drive = 1},
              {.name = "rl", .x_m = -a, .y_m = b, .drive = 0},
              {.name = "rr", .x_m = -a, .y_m = -b, .drive = 1}};
  v.drives.resize(2);
  v.drives[0].name = "left";
  v.drives[1].name = "right";
  return v;
}

/// Two steered wheels in front, the rear ones driven; the origin under the rear axle.
inline Vehicle Cart(Coupling coupling = Coupling::kDifferential) {
  Vehicle v;
  v.name = "cart";
  v.mass_kg = 120;
  v.centre_x_m = 0.4;
  v.centre_z_m = 0.35;
  v.yaw_inertia_kg_m2 = 12;
  v.wheel_types = {{"wheel", 0.2, 0.1}};
  v.wheels = {{.name = "fl", .x_m = 1.0, .y_m = 0.35, .steered = true},
              {.name = "fr", .x_m = 1.0, .y_m = -0.35, .steered = true},
              {.name = "rl", .x_m = 0, .y_m = 0.35, .drive = 0},
              {.name = "rr", .x_m = 0, .y_m = -0.35, .drive = 0}};
  v.drives.resize(1);
  v.drives[0].name = "axle";
  v.drives[0].coupling = coupling;
  v.steering = {.centre_x_m = 0, .length_m = 1.0, .limit_rad = 0.7};
  return v;
}

/// Six wheels, a motor at each, the four corners steered.
inline Vehicle Rover() {
  Vehicle v;
  v.name = "rover";
  v.mass_kg = 15;
  v.centre_z_m = 0.2;
  v.yaw_inertia_kg_m2 = 0.6;
  v.wheel_types = {{"wheel", 0.0625, 0.05}};
  for (const double x : {0.25, 0.0, -0.25}) {
    for (const double y : {0.2, -0.2}) {
      v.wheels.push_back({.name = "w", .x_m = x, .y_m = y, .drive = 0, .steered = x != 0});
    }
  }
  v.drives.resize(1);
  v.drives[0].name = "all";
  v.drives[0].coupling = Coupling::kIndependent;
  v.steering = {.centre_x_m = 0, .length_m = 0.25};
  return v;
}

/// A vehicle on hard grounds, its solver, and one solve.
struct OnHard {
  OnHard(const Vehicle& v, const std::vector<surrogate::HardGround>& grounds) {
    Grounds table;
    for (std::size_t s = 0; s < grounds.size(); ++s) table.soils.push_back(std::to_string(s));
    for (const WheelType& type : v.wheel_types) {
      for (const surrogate::HardGround& ground : grounds) {
        models.push_back(std::make_unique<surrogate::HardGroundModel>(ground, type.radius_m));
        table.models.push_back(models.back().get());
      }
    }
    solver = std::make_unique<Solver>(v, table);
  }
  explicit OnHard(const Vehicle& v) : OnHard(v, {Asphalt()}) {}

  Solution Solve(const Motion& motion) {
    Solution s;
    solver->Solve({&motion, 1}, {&s, 1});
    return s;
  }

  std::vector<std::unique_ptr<surrogate::WheelModel>> models;
  std::unique_ptr<Solver> solver;
};

/// A planner on hard grounds.
struct Planning {
  Planning(const Vehicle& v, const std::vector<surrogate::HardGround>& grounds) : on(v, grounds) {
    for (std::size_t s = 0; s < grounds.size(); ++s) table.soils.push_back(std::to_string(s));
    for (const auto& model : on.models) table.models.push_back(model.get());
    planner = std::make_unique<SpeedPlanner>(v, table, 500);
  }
  OnHard on;
  Grounds table;
  std::unique_ptr<SpeedPlanner> planner;
};

}  // namespace grouser::vehicle::testing

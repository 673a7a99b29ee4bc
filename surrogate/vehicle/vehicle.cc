#include "surrogate/vehicle/vehicle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/vehicle/support.h"

namespace grouser::vehicle {
namespace {

[[noreturn]] void Fail(const std::string& field, const std::string& got,
                       const std::string& expected) {
  throw std::invalid_argument(field + ": got " + got + ", expected " + expected);
}

std::string Text(double value) {
  std::string text = std::to_string(value);
  return text;
}

void Finite(const std::string& field, double value) {
  if (!std::isfinite(value)) Fail(field, Text(value), "a finite number");
}
void Positive(const std::string& field, double value) {
  if (!std::isfinite(value) || !(value > 0)) Fail(field, Text(value), "a finite number above 0");
}
// Limits may be infinite.
void Limit(const std::string& field, double value) {
  if (!(value > 0)) Fail(field, Text(value), "a number above 0");
}

void CheckWheels(const Vehicle& v) {
  if (v.wheels.size() < 3 || v.wheels.size() > kMostWheels) {
    Fail("wheels", v.wheels.empty() ? "none" : std::to_string(v.wheels.size()),
         "3 to " + std::to_string(kMostWheels));
  }
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    const Wheel& w = v.wheels[i];
    const std::string at = "wheels[" + std::to_string(i) + "]";
    if (w.type >= v.wheel_types.size()) Fail(at + ".type", "none", "a wheel type of the vehicle");
    Finite(at + ".x_m", w.x_m);
    Finite(at + ".y_m", w.y_m);
    Positive(at + ".stiffness", w.stiffness);
    Positive(at + ".roll_share", w.roll_share);
    if (w.drive >= static_cast<int>(v.drives.size())) {
      Fail(at + ".drive", std::to_string(w.drive), "a drive of the vehicle");
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (v.wheels[k].x_m == w.x_m && v.wheels[k].y_m == w.y_m) {
        Fail(at, "the place of wheels[" + std::to_string(k) + "]", "a place of its own");
      }
    }
  }
  // The largest triangle against the largest distance.
  double area = 0, longest = 0;
  for (const Wheel& a : v.wheels) {
    for (const Wheel& b : v.wheels) {
      longest = std::max(longest, std::hypot(b.x_m - a.x_m, b.y_m - a.y_m));
      for (const Wheel& c : v.wheels) {
        area = std::max(
            area, std::fabs((b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m)));
      }
    }
  }
  if (!(area > 1e-6 * longest * longest)) {
    Fail("wheels", "all on one line", "wheels that span an area");
  }
}

void CheckMotor(const std::string& at, const Motor& m) {
  if (m.torque_constant_n_m_per_a != 0) {
    Positive(at + ".torque_constant_n_m_per_a", m.torque_constant_n_m_per_a);
  }
  for (const auto& [field, value] : {std::pair("resistance_ohm", m.resistance_ohm),
                                     std::pair("no_load_current_a", m.no_load_current_a)}) {
    if (!std::isfinite(value) || value < 0) {
      Fail(at + "." + field, Text(value), "a finite number from 0 on");
    }
  }
  Positive(at + ".gear", m.gear);
  if (!(m.efficiency > 0) || !(m.efficiency <= 1)) {
    Fail(at + ".efficiency", Text(m.efficiency), "above 0 and at most 1");
  }
  Limit(at + ".torque_limit_n_m", m.torque_limit_n_m);
  Limit(at + ".current_limit_a", m.current_limit_a);
  Limit(at + ".voltage_limit_v", m.voltage_limit_v);
  Limit(at + ".power_limit_w", m.power_limit_w);
}

void CheckDrives(const Vehicle& v) {
  const std::size_t expected = v.steered() ? 1 : 2;
  if (v.drives.size() != expected) {
    Fail("drives", std::to_string(v.drives.size()),
         v.steered() ? "1, as wheels are steered" : "2 (a side each), as no wheel is steered");
  }
  double middle[2] = {0, 0};
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    const std::string at = "drives[" + std::to_string(d) + "]";
    CheckMotor(at + ".motor", v.drives[d].motor);
    double count = 0, radius = 0;
    for (const Wheel& w : v.wheels) {
      if (w.drive != static_cast<int>(d)) continue;
      const double r = v.wheel_types[w.type].radius_m;
      if (radius != 0 && r != radius) {
        Fail(at, "wheels of radius " + Text(radius) + " and " + Text(r), "wheels of one radius");
      }
      radius = r;
      middle[d] += w.y_m;
      ++count;
    }
    if (count == 0) Fail(at, "no wheel", "a wheel that it drives");
    middle[d] /= count;
  }
  if (expected == 2 && !(std::fabs(middle[0] - middle[1]) > 0)) {
    Fail("drives", "two in one line", "one to the left of the other");
  }
}

}  // namespace

bool Vehicle::steered() const {
  return std::any_of(wheels.begin(), wheels.end(), [](const Wheel& w) { return w.steered; });
}

void Check(const Vehicle& v) {
  Positive("mass_kg", v.mass_kg);
  Finite("centre_x_m", v.centre_x_m);
  Finite("centre_y_m", v.centre_y_m);
  Positive("centre_z_m", v.centre_z_m);
  Positive("yaw_inertia_kg_m2", v.yaw_inertia_kg_m2);
  Positive("gravity_m_per_s2", v.gravity_m_per_s2);
  Positive("sinkage_limit", v.sinkage_limit);
  for (std::size_t i = 0; i < v.wheel_types.size(); ++i) {
    const std::string at = "wheel_types[" + std::to_string(i) + "]";
    Positive(at + ".radius_m", v.wheel_types[i].radius_m);
    Positive(at + ".width_m", v.wheel_types[i].width_m);
  }
  CheckWheels(v);
  CheckDrives(v);
  Finite("steering.centre_x_m", v.steering.centre_x_m);
  Positive("steering.length_m", v.steering.length_m);
  Positive("steering.limit_rad", v.steering.limit_rad);
  if (!(Support(v).TipMargin(v.centre_x_m, v.centre_y_m) > 0)) {
    Fail("centre", "(" + Text(v.centre_x_m) + ", " + Text(v.centre_y_m) + ")",
         "a centre of gravity between the wheels");
  }
}

}  // namespace grouser::vehicle

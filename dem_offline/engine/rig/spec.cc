#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/isa/kernels.h"
#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {
namespace {

void Require(bool ok, const std::string& field, double got, const char* expected) {
  if (!ok) {
    throw std::invalid_argument(field + ": " + std::to_string(got) + ", expected " + expected);
  }
}

void Positive(const std::string& field, double v) {
  Require(std::isfinite(v) && v > 0, field, v, "finite and > 0");
}

void Share(const std::string& field, double v, double low, double high) {
  Require(v >= low && v <= high, field, v,
          ("in [" + std::to_string(low) + ", " + std::to_string(high) + "]").c_str());
}

void CheckContact(const std::string& at, const InterfaceChoice& c) {
  Share(at + ".rolling_damping", c.rolling_damping.value_or(0), 0, 10);
  Share(at + ".surface_energy_j_per_m2", c.surface_energy_j_per_m2.value_or(0), 0, 1e3);
  for (const NamedSetting& n : c.settings) {
    Require(std::isfinite(n.value), at + ".settings." + n.law + "." + n.name, n.value, "finite");
  }
}

void CheckSoil(const GrainSoil& s) {
  Positive("soil.grain_density_kg_per_m3", s.density_kg_per_m3);
  Positive("soil.youngs_modulus_pa", s.youngs_modulus_pa);
  Share("soil.poisson_ratio", s.poisson_ratio, 0, 0.5);
  Share("soil.restitution", s.restitution, 1e-3, 1);
  Share("soil.friction", s.friction, 0, 10);
  Share("soil.rolling_friction", s.rolling_friction, 0, 10);
  Share("soil.solid_fraction", s.solid_fraction, 0.5, 0.7);
  Positive("soil.gravity_m_per_s2", s.gravity_m_per_s2);
  const ContactChoice& c = s.contact;
  CheckContact("soil.contact", {c.rolling_damping, c.surface_energy_j_per_m2, c.settings});
  CheckContact("soil.contact.wheel", c.wheel);
  CheckContact("soil.contact.floor", c.floor);
  Require(!s.sizes.empty(), "soil.sizes", 0, "at least one size");
  double sum = 0;
  for (std::size_t i = 0; i < s.sizes.size(); ++i) {
    const std::string at = "soil.sizes[" + std::to_string(i) + "]";
    Positive(at + ".diameter_m", s.sizes[i].diameter_m);
    Positive(at + ".mass_fraction", s.sizes[i].mass_fraction);
    sum += s.sizes[i].mass_fraction;
  }
  Require(std::abs(sum - 1) < 1e-6, "soil.sizes: sum of mass_fraction", sum, "1");
}

void CheckRig(const RigSettings& r) {
  Positive("rig.bed_length_m", r.bed_length_m);
  Positive("rig.bed_width_m", r.bed_width_m);
  Positive("rig.bed_depth_m", r.bed_depth_m);
  Positive("rig.speed_m_per_s", r.speed_m_per_s);
  Positive("rig.max_time_s", r.max_time_s);
  Share("rig.rayleigh_fraction", r.rayleigh_fraction, 1e-3, 0.4);
  Positive("rig.target_relative_error", r.target_relative_error);
  Share("rig.stress_bin_rad", r.stress_bin_rad, 0.01, 0.5);
  Share("rig.width_bins", r.width_bins, 1, 100);
  const SceneSettings& s = r.scene;
  Share("rig.scene.window_length_m", s.window_length_m, 0, 1e3);
  Share("rig.scene.window_ahead", s.window_ahead, 0.2, 0.8);
  Share("rig.scene.freeze_box", s.freeze_box, 1, 100);
  Share("rig.scene.freeze_speed", s.freeze_speed, 1e-6, 1);
  Share("rig.scene.look_steps", s.look_steps, 1, 10000);
}

}  // namespace

void ValidateSpec(const WheelTestSpec& spec) {
  CheckSoil(spec.soil);
  CheckRig(spec.rig);
  Positive("wheel.radius_m", spec.wheel.radius_m);
  Positive("wheel.width_m", spec.wheel.width_m);
  Share("wheel.restitution", spec.wheel.restitution, 1e-3, 1);
  Share("wheel.friction", spec.wheel.friction, 0, 10);
  Share("wheel.rolling_friction", spec.wheel.rolling_friction, 0, 10);
  RigContacts(spec.soil, spec.soil.friction,
              spec.wheel);  // the laws agree, their settings make sense
  if (!spec.wheel.treads.empty()) {
    TreadedWheel(spec.wheel.radius_m, spec.wheel.width_m, spec.wheel.treads);
  }
  Positive("state.load_n", spec.state.load_n);
  Require(std::isfinite(spec.state.drawbar_n), "state.drawbar_n", spec.state.drawbar_n, "finite");
  Share("state.attack_angle_rad", spec.state.attack_angle_rad, -M_PI, M_PI);
  if (spec.state.mode == RigMode::kRimSpeed) {
    MotionAt(spec.state.slip, spec.state.attack_angle_rad, spec.rig.speed_m_per_s);
  }
  if (spec.rig.scene.bed == SceneBed::kWindow && spec.rig.scene.window_length_m > 0) {
    Require(spec.rig.scene.window_length_m >= LeastWindow(spec), "rig.scene.window_length_m",
            spec.rig.scene.window_length_m,
            ("0 (by rule) or at least " + std::to_string(LeastWindow(spec))).c_str());
  }
  const double wheel_space = 2 * std::max(spec.wheel.radius_m, 0.5 * spec.wheel.width_m);
  Require(spec.rig.bed_length_m > 1.5 * wheel_space, "rig.bed_length_m", spec.rig.bed_length_m,
          "more than 1.5 wheel diameters");
  Require(spec.rig.bed_width_m > 1.2 * spec.wheel.width_m, "rig.bed_width_m", spec.rig.bed_width_m,
          "more than 1.2 wheel widths");
}

SceneSettings EverythingSimulated() {
  SceneSettings s;
  s.bed = SceneBed::kFull;
  return s;
}

SceneSettings OnlyWhatIsNeeded() {
  SceneSettings s;
  s.bed = SceneBed::kWindow;
  s.freeze = true;
  s.freeze_box = 1.25;
  s.freeze_speed = 0.01;
  s.largest_step = true;
  return s;
}

const char* Explain(StopCause cause) {
  switch (cause) {
    case StopCause::kTimeUp:
      return "time is up";
    case StopCause::kPrecise:
      return "precise enough";
    case StopCause::kBedEnd:
      return "end of the bed";
    case StopCause::kOverload:
      return "overload";
    case StopCause::kFault:
      return "fault";
    case StopCause::kCaller:
      return "stopped by caller";
  }
  return "";
}

const char* EngineVersion() { return "4"; }
const char* EngineIsa() { return BestIsa(); }

}  // namespace grouser::dem

#include "dem_offline/scenes/experiment_motion_yaml.h"

#include <fmt/format.h>

#include <initializer_list>

namespace grouser::campaign {

namespace dx = dem::experiment;
using dem::Vec3d;

namespace {

Vec3d AxisOf(int axis, double length) {
  Vec3d out = {0, 0, 0};
  out[static_cast<std::size_t>(axis)] = length;
  return out;
}

void ReadFreedoms(KeyedSection& s, dx::MotionStep* m) {
  if (s.Has("free")) {
    for (const int choice : s.Choices("free")) {
      if (choice < 3) m->free_axes[static_cast<std::size_t>(choice)] = true;
      if (choice == 3) m->free_spin = true;
    }
  }
  if (s.Has("applied_force_n")) m->applied_force_n = ToVec3(s.Vector("applied_force_n"));
  m->applied_torque_n_m = s.NumberOr("applied_torque_n_m", 0);
}

bool HasAny(KeyedSection& s, std::initializer_list<const char*> keys) {
  bool any = false;
  for (const char* key : keys) any = s.Has(key) || any;
  return any;
}

}  // namespace

dx::Preparation ReadPreparation(KeyedSection& s) {
  dx::Preparation p;
  p.kind = static_cast<dx::Preparation::Kind>(s.Choice("do"));
  const bool shake = p.kind == dx::Preparation::Kind::kShake,
             cut = p.kind == dx::Preparation::Kind::kCut,
             turn = p.kind == dx::Preparation::Kind::kTurn;
  if (!shake && !cut && !turn) {
    p.rest = s.NumberOr("rest", p.rest);
    p.most_s = s.NumberOr("most_s", 0);
  }
  if (p.kind == dx::Preparation::Kind::kSettle && s.Has("solid_fraction")) {
    p.solid_fraction = s.yaml().Number("solid_fraction", kPositive);
  }
  for (const auto& [key, value] :
       {std::pair{"friction", &p.friction}, std::pair{"rolling_friction", &p.rolling_friction},
        std::pair{"surface_energy_j_per_m2", &p.surface_energy_j_per_m2}}) {
    if (cut || turn || !s.Has(key)) continue;
    *value = s.Number(key);
    if (*value < 0) s.yaml().Fail(key, fmt::format("{}", *value), "a number >= 0");
  }
  if (shake) {
    p.amplitude_m = ToVec3(s.Vector("amplitude_m"));
    p.frequency_hz = s.Number("frequency_hz");
    p.for_s = s.Number("for_s");
  }
  if (cut || turn) p.height_m = s.Number("height_m");
  if (turn) {
    p.turns = static_cast<int>(s.Count("turns", 1000));
    p.rate_rad_per_s = s.Number("rate_deg_per_s");
    p.about_x = s.ChoiceOr("axis", 1) == 0;
  }
  s.Finish();
  return p;
}

dx::MotionStep ReadStep(KeyedSection& s) {
  dx::MotionStep m;
  m.verb = s.Text("do");
  const std::string& verb = m.verb;
  if (verb == "move" || verb == "turn") {
    if (verb == "move" || s.Has("velocity_m_per_s")) {
      m.velocity_m_per_s = ToVec3(s.Vector("velocity_m_per_s"));
    }
    if (verb == "turn" || s.Has("rate_deg_per_s") || s.Has("axis")) {
      const int axis = s.ChoiceOr("axis", 2);
      m.about_axle = axis == 3;
      m.spin_rad_per_s = AxisOf(m.about_axle ? 1 : axis, s.Number("rate_deg_per_s"));
    }
  }
  if (verb == "lower" || verb == "lift") {
    const double speed = s.yaml().Number("speed_m_per_s", {0.0, 1e6, true});
    m.velocity_m_per_s = {0, 0, verb == "lower" ? -speed : speed};
  }
  if (verb == "shake") {
    m.amplitude_m = ToVec3(s.Vector("amplitude_m"));
    m.frequency_hz = s.Number("frequency_hz");
  }
  m.free = verb == "release";
  if (verb == "hold_force" ||
      HasAny(s, {"hold_force_n", "hold_axis", "hold_mass_kg", "hold_damper_s"})) {
    m.hold = true;
    m.hold_force_n = s.Number("hold_force_n");
    const int axis = s.ChoiceOr("hold_axis", 0);
    static constexpr int kAxes[] = {2, 2, 0, 0, 1, 1};
    static constexpr int kSigns[] = {-1, 1, 1, -1, 1, -1};
    m.direction = AxisOf(kAxes[axis], kSigns[axis]);
    m.hold_mass_kg = s.NumberOr("hold_mass_kg", 0);
    if (s.Has("hold_damper_s")) {
      m.hold_damper_s = s.yaml().Number("hold_damper_s", kNonNegative);
    }
  }
  ReadFreedoms(s, &m);
  if (s.Has("ramp_s")) m.ramp_s = s.Number("ramp_s");
  if (s.Has("for_s")) m.for_s = s.Number("for_s");
  if (s.Has("distance_m")) m.distance_m = s.Number("distance_m");
  if (s.Has("angle_deg")) m.angle_rad = s.Number("angle_deg");
  if (s.Has("force_n")) m.force_n = s.Number("force_n");
  m.touch = s.Switch("touch", false);
  m.rest = s.Has("rest") ? s.yaml().Number("rest", kPositive) : 0;
  m.until_done = s.TextOr("until_done", "");
  m.most_s = s.NumberOr("most_s", 0);
  s.Finish();
  return m;
}

}  // namespace grouser::campaign

// Joints and springs of an experiment file.
#include "dem_offline/scenes/experiment_joints_yaml.h"

#include <cmath>
#include <limits>

#ifdef GROUSER_MULTIBODY
#include "dem_offline/multibody/experiment_mechanism.h"
#endif

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;
using dem::Vec3d;

Vec3d VectorOr(KeyedSection& s, const char* key, const Vec3d& otherwise) {
  if (!s.Has(key)) return otherwise;
  const auto v = s.Vector(key);
  return {v[0], v[1], v[2]};
}

std::string BodyOr(KeyedSection& s, const char* key) {
  const std::string name = s.TextOr(key, "world");
  return name == "world" ? "" : name;
}

/// value: the key of this joint or spring; the other ones of the section are refused.
std::vector<dx::ProgrammePart> ReadProgramme(KeyedSection& at, const char* key, const char* value) {
  std::vector<dx::ProgrammePart> out;
  if (!at.Has(key)) return out;
  for (KeyedSection& s : at.Sections(key)) {
    dx::ProgrammePart p;
    p.value = s.Number(value);
    p.ramp_s = s.NumberOr("ramp_s", 0);
    p.for_s = s.NumberOr("for_s", std::numeric_limits<double>::infinity());
    s.Finish();
    out.push_back(p);
  }
  return out;
}

}  // namespace

dx::Joint ReadJoint(KeyedSection& s) {
  using K = dx::Joint::Kind;
  dx::Joint j;
  j.name = s.Text("name");
  j.kind = static_cast<K>(s.Choice("kind"));
  j.parent = BodyOr(s, "parent");
  j.child = s.Text("child");
  j.at_m = VectorOr(s, "at_m", j.at_m);
  j.axis = VectorOr(s, "axis", j.axis);
  if (j.kind != K::kSpherical && j.kind != K::kWeld) j.locked = s.Switch("locked", false);
  if (j.kind == K::kRevolute) j.drive = ReadProgramme(s, "drive", "rate_deg_per_s");
  if (j.kind == K::kTranslational) j.drive = ReadProgramme(s, "drive", "speed_m_per_s");
  s.Finish();
  return j;
}

dx::Spring ReadSpring(KeyedSection& s) {
  dx::Spring r;
  r.name = s.Text("name");
  r.rotational = s.Choice("kind") == 1;
  if (r.rotational) {
    r.joint = s.Text("joint");
    r.stiffness = s.NumberOr("stiffness_n_m_per_rad", 0);
    r.damping = s.NumberOr("damping_n_m_s_per_rad", 0);
    r.rest = s.NumberOr("free_angle_deg", 0);
    r.force = ReadProgramme(s, "torque", "torque_n_m");
  } else {
    r.a = BodyOr(s, "body_a");
    r.b = s.Text("body_b");
    r.at_a_m = VectorOr(s, "at_a_m", r.at_a_m);
    r.at_b_m = VectorOr(s, "at_b_m", r.at_b_m);
    r.stiffness = s.NumberOr("stiffness_n_per_m", 0);
    r.damping = s.NumberOr("damping_n_s_per_m", 0);
    r.rest = s.Has("free_length_m") ? s.yaml().Number("free_length_m", kNonNegative) : -1;
    r.force = ReadProgramme(s, "force", "force_n");
  }
  s.Finish();
  return r;
}

dx::MechanismFn JointMechanism() {
#ifdef GROUSER_MULTIBODY
  return dem::SimbodyMechanism();
#else
  return nullptr;
#endif
}

}  // namespace grouser::campaign

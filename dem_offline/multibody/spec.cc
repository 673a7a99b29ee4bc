#include "dem_offline/multibody/spec.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <set>
#include <stdexcept>

#include "dem_offline/engine/core/rotation.h"

namespace grouser::dem {
namespace {

constexpr double kUnitSlack = 1e-6;  // of a quaternion's length
constexpr double kMassSlack = 1e-9;  // of the triangle inequality: flat bodies reach it

std::string Text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

/// Where in the spec a message speaks of: "body 'wheel'".
class Place {
 public:
  Place(const std::string& kind, const std::string& name) : where_(kind + " '" + name + "'") {}
  [[noreturn]] void Bad(const std::string& field, const std::string& got,
                        const std::string& expected) const {
    throw std::invalid_argument("multibody: " + where_ + ": " + field + ": " + got + ", expected " +
                                expected);
  }
  void Finite(const std::string& field, double x) const {
    if (!std::isfinite(x)) Bad(field, Text(x), "a finite number");
  }
  void Finite(const std::string& field, const Vec3d& v) const {
    for (const double x : v) Finite(field, x);
  }
  void NotNegative(const std::string& field, double x) const {
    if (!(std::isfinite(x) && x >= 0)) Bad(field, Text(x), "a finite number >= 0");
  }
  void UnitQuaternion(const std::string& field, const Quatd& q) const {
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(n - 1) <= kUnitSlack)) {
      Bad(field, "a quaternion of length " + Text(n), "length 1");
    }
  }
  void Frame(const std::string& field, const JointFrame& f) const {
    Finite(field + ".position_m", f.position_m);
    UnitQuaternion(field + ".orientation", f.orientation);
  }

 private:
  std::string where_;
};

std::string Listed(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& n : names) text += (text.empty() ? "'" : ", '") + n + "'";
  return text.empty() ? "none" : text;
}

/// Takes a name that must be new.
void Take(const std::string& kind, const std::string& name, std::set<std::string>* taken) {
  const Place at(kind, name);
  if (name.empty()) at.Bad("name", "empty", "a name");
  if (!taken->insert(name).second) at.Bad("name", "taken", "a name of its own");
}

void CheckInertia(const Place& at, const MultibodyBody& b) {
  at.Finite("inertia_kg_m2", b.inertia_kg_m2);
  at.Finite("inertia_off_kg_m2", b.inertia_off_kg_m2);
  const Vec3d &d = b.inertia_kg_m2, &o = b.inertia_off_kg_m2;
  Eigen::Matrix3d tensor;
  tensor << d[0], o[0], o[1], o[0], d[1], o[2], o[1], o[2], d[2];
  const Eigen::Vector3d p =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor, Eigen::EigenvaluesOnly).eigenvalues();
  const std::string got =
      "principal moments " + Text(p[0]) + ", " + Text(p[1]) + ", " + Text(p[2]) + " kg m^2";
  if (!(p[0] > 0)) at.Bad("inertia_kg_m2", got, "all > 0");
  if (!(p[2] <= (p[0] + p[1]) * (1 + kMassSlack))) {
    at.Bad("inertia_kg_m2", got, "none above the sum of the two others (no mass has such)");
  }
}

void CheckBody(const MultibodyBody& b) {
  const Place at("body", b.name);
  if (b.name == kGround) at.Bad("name", "that of what does not move", "another name");
  if (!(std::isfinite(b.mass_kg) && b.mass_kg > 0)) at.Bad("mass_kg", Text(b.mass_kg), "> 0");
  at.Finite("centre_of_mass_m", b.centre_of_mass_m);
  CheckInertia(at, b);
  at.Finite("position_m", b.position_m);
  at.UnitQuaternion("orientation", b.orientation);
  at.Finite("velocity_m_per_s", b.velocity_m_per_s);
  at.Finite("spin_rad_per_s", b.spin_rad_per_s);
}

void CheckKnown(const Place& at, const std::string& field, const std::string& name,
                const std::set<std::string>& names) {
  if (names.count(name) == 0) at.Bad(field, "'" + name + "'", "one of " + Listed(names));
}

std::size_t MotionsOf(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kTranslational:
      return 1;
    case JointType::kUniversal:
      return 2;
    case JointType::kPlanar:
      return 3;
    case JointType::kSpherical:
    case JointType::kWeld:
      break;
  }
  return 0;
}

void CheckJoint(const JointSpec& j, const std::set<std::string>& bodies) {
  const Place at("joint", j.name);
  CheckKnown(at, "parent", j.parent, bodies);
  CheckKnown(at, "child", j.child, bodies);
  if (j.parent == j.child) at.Bad("child", "'" + j.child + "', which is the parent", "another");
  at.Frame("in_parent", j.in_parent);
  at.Frame("in_child", j.in_child);
  if (!j.coordinate.empty() && !j.rate.empty()) {
    at.Bad("rate", "given beside coordinate", "one of both");
  }
  if (j.locked && MotionsOf(j.type) == 0) {
    at.Bad("locked", "true", "false for a spherical joint and a weld");
  }
  const bool by_rate = !j.rate.empty();
  const auto& motion = by_rate ? j.rate : j.coordinate;
  if (motion.empty()) return;
  const std::string field = by_rate ? "rate" : "coordinate";
  const std::size_t free = MotionsOf(j.type);
  if (free == 0) at.Bad(field, "given", "none: such a joint can not be driven");
  if (motion.size() != free) {
    at.Bad(field, std::to_string(motion.size()) + " functions", std::to_string(free));
  }
  for (const TimeFunction& f : motion) {
    if (!f) at.Bad(field, "an empty function", "one for each free coordinate");
  }
  if (j.locked) at.Bad("locked", "true", "false for a driven joint");
}

void CheckLinearSpring(const LinearSpringSpec& s, const std::set<std::string>& bodies) {
  const Place at("spring", s.name);
  CheckKnown(at, "body_a", s.body_a, bodies);
  CheckKnown(at, "body_b", s.body_b, bodies);
  if (s.body_a == s.body_b) at.Bad("body_b", "'" + s.body_b + "', which is body_a", "another");
  at.Finite("point_a_m", s.point_a_m);
  at.Finite("point_b_m", s.point_b_m);
  at.NotNegative("stiffness_n_per_m", s.stiffness_n_per_m);
  at.NotNegative("damping_n_s_per_m", s.damping_n_s_per_m);
  at.NotNegative("free_length_m", s.free_length_m);
}

void CheckRotationalSpring(const RotationalSpringSpec& s, const MultibodySpec& spec) {
  const Place at("spring", s.name);
  const JointSpec* joint = nullptr;
  std::set<std::string> names;
  for (const JointSpec& j : spec.joints) {
    names.insert(j.name);
    if (j.name == s.joint) joint = &j;
  }
  CheckKnown(at, "joint", s.joint, names);
  const int angles = joint->type == JointType::kUniversal                                       ? 2
                     : joint->type == JointType::kRevolute || joint->type == JointType::kPlanar ? 1
                                                                                                : 0;
  if (angles == 0) at.Bad("joint", "'" + s.joint + "'", "a revolute, planar or universal joint");
  if (s.coordinate < 0 || s.coordinate >= angles) {
    at.Bad("coordinate", std::to_string(s.coordinate), angles == 1 ? "0" : "0 or 1");
  }
  at.NotNegative("stiffness_n_m_per_rad", s.stiffness_n_m_per_rad);
  at.NotNegative("damping_n_m_s_per_rad", s.damping_n_m_s_per_rad);
  at.Finite("free_angle_rad", s.free_angle_rad);
}

/// A frame of the world as one of a body.
JointFrame Seen(const MultibodySpec& spec, const Place& at, const std::string& field,
                const std::string& body, const JointFrame& f) {
  if (body == kGround) return f;
  for (const MultibodyBody& b : spec.bodies) {
    if (b.name != body) continue;
    return {MatrixOf(b.orientation).Back(Sub(f.position_m, b.position_m)),
            Unit(Mul(Conj(b.orientation), f.orientation))};
  }
  std::set<std::string> names = {kGround};
  for (const MultibodyBody& b : spec.bodies) names.insert(b.name);
  at.Bad(field, "'" + body + "'", "one of " + Listed(names));
}

/// The rotation whose matrix has these columns, an orthonormal right-handed set.
Quatd QuaternionOf(const Vec3d& x, const Vec3d& y, const Vec3d& z) {
  Eigen::Matrix3d m;
  m << x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2];
  const Eigen::Quaterniond q(m);
  return Unit({q.w(), q.x(), q.y(), q.z()});
}

}  // namespace

JointSpec JointAt(const MultibodySpec& spec, const std::string& name, JointType type,
                  const std::string& parent, const std::string& child, const Vec3d& point_m,
                  const Vec3d& axis, const Vec3d& across) {
  const Place at("joint", name);
  at.Finite("axis", axis);
  at.Finite("across", across);
  if (!(Norm(axis) > 0)) at.Bad("axis", "null", "a direction");
  const Vec3d z = Scale(1 / Norm(axis), axis);
  const auto normal = [&](const Vec3d& a) { return Sub(a, Scale(DotD(a, z), z)); };
  Vec3d x = normal(across);
  if (Norm(x) <= 1e-6 * Norm(across)) {
    x = normal(std::abs(z[0]) < 0.8 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0});
  }
  x = Scale(1 / Norm(x), x);
  const JointFrame world = {point_m, QuaternionOf(x, CrossD(z, x), z)};
  JointSpec j;
  j.name = name;
  j.type = type;
  j.parent = parent;
  j.child = child;
  j.in_parent = Seen(spec, at, "parent", parent, world);
  j.in_child = Seen(spec, at, "child", child, world);
  return j;
}

void CheckMultibody(const MultibodySpec& spec) {
  std::set<std::string> bodies = {kGround}, joints, springs;
  for (const double g : spec.gravity_m_per_s2) Place("field", "gravity").Finite("m_per_s2", g);
  for (const MultibodyBody& b : spec.bodies) {
    CheckBody(b);
    Take("body", b.name, &bodies);
  }
  for (const JointSpec& j : spec.joints) {
    Take("joint", j.name, &joints);
    CheckJoint(j, bodies);
  }
  for (const LinearSpringSpec& s : spec.linear_springs) {
    Take("spring", s.name, &springs);
    CheckLinearSpring(s, bodies);
  }
  for (const RotationalSpringSpec& s : spec.rotational_springs) {
    Take("spring", s.name, &springs);
    CheckRotationalSpring(s, spec);
  }
}

}  // namespace grouser::dem

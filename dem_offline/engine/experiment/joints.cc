#include "dem_offline/engine/experiment/joints.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/shapes.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kMostJoints = 1000;  // loops among them are solved together
constexpr double kSpringShare = 0.1;  // time step over 1/omega: frequency within 0.05 %
constexpr double kDamperShare = 0.2;  // time step over m/c
constexpr double kStableShare = 1.0;  // over 1/omega with the turn of the bodies; 2 is the limit

std::string At(const char* list, std::size_t i, const char* key = "") {
  return std::string(list) + "[" + std::to_string(i) + "]" + key;
}

std::size_t Find(const Experiment& e, const std::string& name) {
  std::size_t k = 0;
  while (k < e.bodies.size() && e.bodies[k].name != name) ++k;
  return k;
}

void CheckBodyName(const Experiment& e, const std::string& field, const std::string& name,
                   bool world) {
  if ((world && name.empty()) || Find(e, name) < e.bodies.size()) return;
  throw SpecError(field, "'" + name + "'",
                  world ? "the name of a body, or world" : "that of a body");
}

void CheckProgramme(const std::string& field, const std::vector<ProgrammePart>& parts) {
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string at = field + "[" + std::to_string(k) + "]";
    const ProgrammePart& p = parts[k];
    if (!std::isfinite(p.value)) throw SpecError(at, Short(p.value), "a finite number");
    CheckWithin(at + ".ramp_s", p.ramp_s, 0, 1e300);
    if (!(p.for_s > 0)) throw SpecError(at + ".for_s", Short(p.for_s), "a number > 0");
    if (p.ramp_s > p.for_s) throw SpecError(at + ".ramp_s", Short(p.ramp_s), "at most for_s");
  }
}

void CheckJoint(const Experiment& e, std::size_t i) {
  const Joint& j = e.joints[i];
  CheckBodyName(e, At("joints", i, ".child"), j.child, false);
  CheckBodyName(e, At("joints", i, ".parent"), j.parent, true);
  if (j.parent == j.child) {
    throw SpecError(At("joints", i, ".parent"), "'" + j.parent + "', which is the child",
                    "another");
  }
  for (const double v : j.at_m) CheckWithin(At("joints", i, ".at_m"), v, -1e4, 1e4);
  if (!(std::isfinite(Norm(j.axis)) && Norm(j.axis) > 0)) {
    throw SpecError(At("joints", i, ".axis"), "no direction", "a vector that is not 0");
  }
  CheckProgramme(At("joints", i, ".drive"), j.drive);
  const bool one = j.kind == Joint::Kind::kRevolute || j.kind == Joint::Kind::kTranslational;
  if (!j.drive.empty() && !one) {
    throw SpecError(At("joints", i, ".drive"), "it at another joint",
                    "a revolute or translational");
  }
  if (j.locked && (j.kind == Joint::Kind::kSpherical || j.kind == Joint::Kind::kWeld)) {
    throw SpecError(At("joints", i, ".locked"), "it at a spherical joint or a weld",
                    "another joint");
  }
  if (j.locked && !j.drive.empty()) {
    throw SpecError(At("joints", i, ".locked"), "it beside drive", "one of them");
  }
}

void CheckSpring(const Experiment& e, std::size_t i) {
  const Spring& s = e.springs[i];
  CheckWithin(At("springs", i, s.rotational ? ".stiffness_n_m_per_rad" : ".stiffness_n_per_m"),
              s.stiffness, 0, 1e300);
  CheckWithin(At("springs", i, s.rotational ? ".damping_n_m_s_per_rad" : ".damping_n_s_per_m"),
              s.damping, 0, 1e300);
  CheckProgramme(At("springs", i, s.rotational ? ".torque" : ".force"), s.force);
  if (!s.rotational) {
    CheckBodyName(e, At("springs", i, ".body_a"), s.a, true);
    CheckBodyName(e, At("springs", i, ".body_b"), s.b, false);
    if (s.a == s.b) throw SpecError(At("springs", i, ".body_b"), "'" + s.b + "' twice", "another");
    return;
  }
  const auto joint = std::find_if(e.joints.begin(), e.joints.end(),
                                  [&](const Joint& j) { return j.name == s.joint; });
  if (joint == e.joints.end() || joint->kind != Joint::Kind::kRevolute) {
    throw SpecError(At("springs", i, ".joint"), "'" + s.joint + "'", "a revolute joint");
  }
}

void CheckNames(const Experiment& e) {
  CheckWithin("joints", static_cast<double>(e.joints.size()), 0, kMostJoints);
  CheckWithin("springs", static_cast<double>(e.springs.size()), 0, kMostJoints);
  std::set<std::string> taken = {"", "world", "ground", "series"};
  for (const BodySpec& b : e.bodies) taken.insert(b.name);
  const auto take = [&](const std::string& field, const std::string& name) {
    if (!taken.insert(name).second) {
      throw SpecError(field, "'" + name + "'", "a name of its own, and not world");
    }
  };
  for (std::size_t i = 0; i < e.joints.size(); ++i)
    take(At("joints", i, ".name"), e.joints[i].name);
  for (std::size_t i = 0; i < e.springs.size(); ++i) {
    take(At("springs", i, ".name"), e.springs[i].name);
  }
}

void CheckJointedBodies(const Experiment& e) {
  for (std::size_t i = 0; i < e.bodies.size(); ++i) {
    const BodySpec& b = e.bodies[i];
    if (!IsJointed(e, b.name)) continue;
    if (b.name == "world" || b.name == "ground") {
      throw SpecError(At("bodies", i, ".name"), "'" + b.name + "' in a joint", "another name");
    }
    if (!b.motion.empty()) {
      throw SpecError(At("bodies", i, ".motion"), "it for a body in a joint or at a spring",
                      "none: `drive` of a joint moves it");
    }
  }
}

BuiltBody BuiltOf(const Experiment& e, std::size_t b) {
  const BodySpec& spec = e.bodies[b];
  return BuildBody(spec, MaterialOf(e, spec.material), 0, true, At("bodies", b));
}

/// How much a unit of force between two points, or of torque about an axis, accelerates [1/kg].
struct Mobility {
  double along = 0, with_turn = 0;
};

}  // namespace

double ValueAt(const std::vector<ProgrammePart>& programme, double time_s) {
  double begin = 0, before = 0;
  for (const ProgrammePart& p : programme) {
    const double t = time_s - begin;
    if (t < p.for_s) {
      if (t >= p.ramp_s) return p.value;
      return before +
             (p.value - before) * (0.5 - 0.5 * std::cos(M_PI * std::max(0.0, t) / p.ramp_s));
    }
    begin += p.for_s;
    before = p.value;
  }
  return 0;
}

bool IsJointed(const Experiment& e, const std::string& body) {
  return std::any_of(e.joints.begin(), e.joints.end(),
                     [&](const Joint& j) { return j.parent == body || j.child == body; }) ||
         std::any_of(e.springs.begin(), e.springs.end(), [&](const Spring& s) {
           return !s.rotational && (s.a == body || s.b == body);
         });
}

std::vector<std::string> CoordinateNames(Joint::Kind kind) {
  switch (kind) {
    case Joint::Kind::kRevolute:
      return {"angle_rad"};
    case Joint::Kind::kTranslational:
      return {"way_m"};
    case Joint::Kind::kSpherical:
      return {"turn_w", "turn_x", "turn_y", "turn_z"};
    case Joint::Kind::kUniversal:
      return {"angle_1_rad", "angle_2_rad"};
    case Joint::Kind::kPlanar:
      return {"angle_rad", "way_1_m", "way_2_m"};
    case Joint::Kind::kWeld:
      break;
  }
  return {};
}

void CheckJoints(const Experiment& e) {
  if (e.joints.empty() && e.springs.empty()) return;
  const char* first = e.joints.empty() ? "springs" : "joints";
  if (!e.mechanism) {
    throw SpecError(first, "joints or springs, but this program was built without Simbody",
                    "libsimbody-dev installed, and a new build");
  }
  if (e.box.planar) throw SpecError(first, "it in a planar box", "a box that is not planar");
  CheckNames(e);
  for (std::size_t i = 0; i < e.joints.size(); ++i) CheckJoint(e, i);
  for (std::size_t i = 0; i < e.springs.size(); ++i) CheckSpring(e, i);
  CheckJointedBodies(e);
  std::vector<BuiltBody> built(e.bodies.size());
  for (std::size_t b = 0; b < e.bodies.size(); ++b) {
    if (IsJointed(e, e.bodies[b].name)) built[b] = BuiltOf(e, b);
  }
  MakeMechanism(e, nullptr, built, std::vector<int>(e.bodies.size(), 0));
}

double SpringStep(const Experiment& e) {
  double step = kNever;
  std::map<std::string, BuiltBody> built;
  const auto of = [&](const std::string& name) -> const BuiltBody& {
    const auto [at, fresh] = built.try_emplace(name);
    if (fresh) at->second = BuiltOf(e, Find(e, name));
    return at->second;
  };
  // Of a body for a force along a line through a point, or for a torque about an axis.
  const auto linear = [&](const std::string& name, const Vec3d& at) -> Mobility {
    if (name.empty()) return {};
    const BuiltBody& b = of(name);
    const Vec3d& i = b.body.inertia_kg_m2;
    const double lever = Norm(Sub(at, b.centre_m)), one = 1 / b.body.mass_kg;
    return {one, one + lever * lever / std::min({i[0], i[1], i[2]})};
  };
  const auto turn = [&](const std::string& name, const Vec3d& axis) {
    if (name.empty()) return 0.0;
    const BuiltBody& b = of(name);
    const Vec3d own = MatrixOf(b.body.orientation).Back(Scale(1 / Norm(axis), axis));
    double inertia = 0;
    for (int k = 0; k < 3; ++k) inertia += b.body.inertia_kg_m2[k] * own[k] * own[k];
    return 1 / inertia;
  };
  for (const Spring& s : e.springs) {
    Mobility m;
    if (s.rotational) {
      const auto joint = std::find_if(e.joints.begin(), e.joints.end(),
                                      [&](const Joint& j) { return j.name == s.joint; });
      m.along = m.with_turn = turn(joint->parent, joint->axis) + turn(joint->child, joint->axis);
    } else {
      const Mobility a = linear(s.a, s.at_a_m), b = linear(s.b, s.at_b_m);
      m = {a.along + b.along, a.with_turn + b.with_turn};
    }
    if (s.stiffness > 0) {
      step = std::min({step, kSpringShare / std::sqrt(s.stiffness * m.along),
                       kStableShare / std::sqrt(s.stiffness * m.with_turn)});
    }
    if (s.damping > 0) step = std::min(step, kDamperShare / (s.damping * m.with_turn));
  }
  return step;
}

std::unique_ptr<Mechanism> MakeMechanism(const Experiment& e, World* world,
                                         const std::vector<BuiltBody>& built,
                                         const std::vector<int>& numbers) {
  if (e.joints.empty() && e.springs.empty()) return nullptr;
  std::vector<JointedBody> bodies;
  for (std::size_t b = 0; b < e.bodies.size(); ++b) {
    if (IsJointed(e, e.bodies[b].name)) bodies.push_back({b, &built[b], numbers[b]});
  }
  try {
    return e.mechanism(e, world, bodies);
  } catch (const std::invalid_argument& error) {
    throw SpecError(e.joints.empty() ? "springs" : "joints", error.what(),
                    "bodies, joints and springs that go together");
  }
}

}  // namespace grouser::dem::experiment

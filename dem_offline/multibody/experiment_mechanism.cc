#include "dem_offline/multibody/experiment_mechanism.h"

#include <cmath>
#include <optional>
#include <stdexcept>

#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/world/world.h"
#include "dem_offline/multibody/coupling.h"

namespace grouser::dem {
namespace {

namespace dx = experiment;

JointType TypeOf(dx::Joint::Kind kind) {
  switch (kind) {
    case dx::Joint::Kind::kRevolute:
      return JointType::kRevolute;
    case dx::Joint::Kind::kTranslational:
      return JointType::kTranslational;
    case dx::Joint::Kind::kSpherical:
      return JointType::kSpherical;
    case dx::Joint::Kind::kUniversal:
      return JointType::kUniversal;
    case dx::Joint::Kind::kPlanar:
      return JointType::kPlanar;
    case dx::Joint::Kind::kWeld:
      break;
  }
  return JointType::kWeld;
}

std::string NameOf(const std::string& body) { return body.empty() ? kGround : body; }

/// From a point in the file's body coordinates to the body's own, and to the world.
Vec3d InBody(const dx::BuiltBody& b, const Vec3d& at) {
  return MatrixOf(b.turn).Back(Sub(at, b.centre_m));
}
Vec3d InWorld(const dx::BuiltBody& b, const Vec3d& at) {
  return Add(b.body.position_m, MatrixOf(b.body.orientation) * InBody(b, at));
}

TimeFunction FunctionOf(const std::vector<dx::ProgrammePart>& programme) {
  if (programme.empty()) return nullptr;
  return [programme](double time_s) { return dx::ValueAt(programme, time_s); };
}

class SpecMaker {
 public:
  SpecMaker(const dx::Experiment& e, const std::vector<dx::JointedBody>& bodies)
      : e_(e), bodies_(bodies) {}

  MultibodySpec Make() {
    spec_.gravity_m_per_s2 = {0, 0, -e_.gravity_m_per_s2};
    for (const dx::JointedBody& j : bodies_) {
      MultibodyBody b;
      b.name = e_.bodies[j.body].name;
      b.mass_kg = j.built->body.mass_kg;
      b.inertia_kg_m2 = j.built->body.inertia_kg_m2;
      b.position_m = j.built->body.position_m;
      b.orientation = j.built->body.orientation;
      spec_.bodies.push_back(b);
    }
    for (const dx::Joint& j : e_.joints) {
      JointSpec joint = JointAt(spec_, j.name, TypeOf(j.kind), NameOf(j.parent), NameOf(j.child),
                                InWorld(BuiltOf(j.child), j.at_m), j.axis);
      joint.locked = j.locked;
      if (!j.drive.empty()) joint.rate = {FunctionOf(j.drive)};
      spec_.joints.push_back(joint);
    }
    for (const dx::Spring& s : e_.springs) AddSpring(s);
    return spec_;
  }

 private:
  const dx::BuiltBody& BuiltOf(const std::string& name) const {
    for (const dx::JointedBody& j : bodies_) {
      if (e_.bodies[j.body].name == name) return *j.built;
    }
    throw std::invalid_argument("'" + name + "': no such body");
  }

  void AddSpring(const dx::Spring& s) {
    if (s.rotational) {
      RotationalSpringSpec r;
      r.name = s.name;
      r.joint = s.joint;
      r.stiffness_n_m_per_rad = s.stiffness;
      r.damping_n_m_s_per_rad = s.damping;
      r.free_angle_rad = s.rest;
      r.torque_n_m = FunctionOf(s.force);
      spec_.rotational_springs.push_back(r);
      return;
    }
    const auto own = [&](const std::string& body, const Vec3d& at) {
      return body.empty() ? at : InBody(BuiltOf(body), at);
    };
    const auto world = [&](const std::string& body, const Vec3d& at) {
      return body.empty() ? at : InWorld(BuiltOf(body), at);
    };
    LinearSpringSpec l;
    l.name = s.name;
    l.body_a = NameOf(s.a);
    l.body_b = NameOf(s.b);
    l.point_a_m = own(s.a, s.at_a_m);
    l.point_b_m = own(s.b, s.at_b_m);
    l.stiffness_n_per_m = s.stiffness;
    l.damping_n_s_per_m = s.damping;
    l.free_length_m = s.rest >= 0 ? s.rest : Norm(Sub(world(s.a, s.at_a_m), world(s.b, s.at_b_m)));
    l.force_n = FunctionOf(s.force);
    spec_.linear_springs.push_back(l);
  }

  const dx::Experiment& e_;
  const std::vector<dx::JointedBody>& bodies_;
  MultibodySpec spec_;
};

class Simbody : public dx::Mechanism {
 public:
  Simbody(const dx::Experiment& e, World* world, const std::vector<dx::JointedBody>& bodies)
      : world_(world), system_(SpecMaker(e, bodies).Make()) {
    for (const dx::Spring& s : e.springs) springs_.push_back(s.name);
    if (!world) return;
    std::vector<BodyLink> links;
    for (const dx::JointedBody& j : bodies) links.push_back({e.bodies[j.body].name, j.in_world});
    for (const BodyLink& l : links) numbers_.push_back(l.world_body);
    both_.emplace(world, &system_, links);
  }

  void Advance() override { both_->Advance(); }
  Wrench Reaction(std::size_t joint) const override {
    return system_.Reaction(system_.spec().joints[joint].name);
  }
  dx::JointReading ReadJoint(std::size_t joint) const override {
    const std::string& name = system_.spec().joints[joint].name;
    return {system_.Coordinates(name), system_.Rates(name), Gap(system_.spec().joints[joint])};
  }
  dx::SpringReading ReadSpring(std::size_t spring) const override {
    return {system_.SpringForce(springs_[spring]), system_.SpringLength(springs_[spring])};
  }

 private:
  /// Of the bodies in the world, by which the grains go.
  JointFrame In(const std::string& body, const JointFrame& frame) const {
    if (body == kGround) return frame;
    const Body& b = world_->body(numbers_[system_.BodyNumber(body)]);
    return {Add(b.position_m, MatrixOf(b.orientation) * frame.position_m),
            Mul(b.orientation, frame.orientation)};
  }
  double Gap(const JointSpec& j) const {
    const JointFrame parent = In(j.parent, j.in_parent), child = In(j.child, j.in_child);
    Vec3d apart = MatrixOf(parent.orientation).Back(Sub(child.position_m, parent.position_m));
    if (j.type == JointType::kTranslational) apart[2] = 0;
    if (j.type == JointType::kPlanar) apart[0] = apart[1] = 0;
    return Norm(apart);
  }

  World* world_;
  MultibodySystem system_;
  std::vector<std::string> springs_;
  std::vector<int> numbers_;  ///< in the world, by number of the system
  std::optional<CoupledBodies> both_;
};

}  // namespace

experiment::MechanismFn SimbodyMechanism() {
  return [](const dx::Experiment& e, World* world, const std::vector<dx::JointedBody>& bodies) {
    return std::make_unique<Simbody>(e, world, bodies);
  };
}

}  // namespace grouser::dem

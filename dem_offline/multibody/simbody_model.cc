#include "dem_offline/multibody/simbody_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grouser::dem {
namespace {

using SimTK::MobilizedBody;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

constexpr double kFitSlack = 1e-6;  // [m], [rad], [m/s], [rad/s]
constexpr double kProjection = 1e-12;
constexpr double kMeetingEnds = 1e-12;  // [m] below it a spring has no direction

const char* NameOf(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kTranslational:
      return "translational";
    case JointType::kSpherical:
      return "spherical";
    case JointType::kUniversal:
      return "universal";
    case JointType::kPlanar:
      return "planar";
    case JointType::kWeld:
      break;
  }
  return "fixed";  // ("weld" is a word of the graph maker)
}

/// From our joint axes to those of Simbody's mobilizer: its slider goes along x.
Transform JointToMobilizer(JointType type) {
  if (type != JointType::kTranslational) return {};
  return Transform(Rotation(-SimTK::Pi / 2, SimTK::YAxis));
}

MobilizedBody MakeMobilizer(JointType type, MobilizedBody& inboard, const Transform& in_inboard,
                            const SimTK::Body& body, const Transform& in_outboard, bool reversed) {
  const auto direction = reversed ? MobilizedBody::Reverse : MobilizedBody::Forward;
  switch (type) {
    case JointType::kRevolute:
      return MobilizedBody::Pin(inboard, in_inboard, body, in_outboard, direction);
    case JointType::kTranslational:
      return MobilizedBody::Slider(inboard, in_inboard, body, in_outboard, direction);
    case JointType::kSpherical:
      return MobilizedBody::Ball(inboard, in_inboard, body, in_outboard, direction);
    case JointType::kUniversal:
      return MobilizedBody::Universal(inboard, in_inboard, body, in_outboard, direction);
    case JointType::kPlanar:
      return MobilizedBody::Planar(inboard, in_inboard, body, in_outboard, direction);
    case JointType::kWeld:
      break;
  }
  return MobilizedBody::Weld(inboard, in_inboard, body, in_outboard);
}

/// A share of a body's mass, about the origin of its frame.
SimTK::Body::Rigid PartOf(const MultibodyBody& b, int parts) {
  const Vec3d &d = b.inertia_kg_m2, &o = b.inertia_off_kg_m2;
  const double mass = b.mass_kg / parts;
  const SimTK::Inertia central(d[0] / parts, d[1] / parts, d[2] / parts, o[0] / parts, o[1] / parts,
                               o[2] / parts);
  const Vec3 centre = ToSimbody(b.centre_of_mass_m);
  return SimTK::Body::Rigid(
      SimTK::MassProperties(mass, centre, central.shiftFromMassCenter(centre, mass)));
}

class Interactions : public SimTK::Force::Custom::Implementation {
 public:
  explicit Interactions(const Model& model) : model_(model) {}
  void calcForce(const SimTK::State& state, SimTK::Vector_<SpatialVec>& forces,
                 SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    for (std::size_t b = 0; b < model_.wrenches.size(); ++b) {
      const Wrench& w = model_.wrenches[b];
      forces[model_.bodies[b].getMobilizedBodyIndex()] +=
          SpatialVec(Vec3(w.tx, w.ty, w.tz), Vec3(w.fx, w.fy, w.fz));
    }
    for (const ModelSpring& s : model_.springs) s.Apply(state, forces);
  }
  double calcPotentialEnergy(const SimTK::State& state) const override {
    double sum = 0;
    for (const ModelSpring& s : model_.springs) {
      const double d = s.Load(state).extent - s.Free();
      sum += 0.5 * s.Stiffness() * d * d;
    }
    return sum;
  }

 private:
  const Model& model_;
};

/// Hands Simbody what the step has chosen for a joint.
class Driven : public SimTK::Motion::Custom::Implementation {
 public:
  explicit Driven(const DrivenMotion& drive) : drive_(drive) {}
  SimTK::Motion::Level getLevel(const SimTK::State&) const override {
    return SimTK::Motion::Position;
  }
  void calcPrescribedPosition(const SimTK::State&, int n, double* q) const override {
    std::copy_n(drive_.coordinate.begin(), n, q);
  }
  void calcPrescribedPositionDot(const SimTK::State&, int n, double* rate) const override {
    std::copy_n(drive_.rate.begin(), n, rate);
  }
  void calcPrescribedPositionDotDot(const SimTK::State&, int n, double* a) const override {
    std::copy_n(drive_.acceleration.begin(), n, a);
  }

 private:
  const DrivenMotion& drive_;
};

SpatialVec RelativeVelocity(const Transform& x_gf, const SpatialVec& f, const Transform& x_gm,
                            const SpatialVec& m) {
  const Vec3 spin = m[0] - f[0];
  const Vec3 velocity = m[1] - f[1] - f[0] % (x_gm.p() - x_gf.p());
  return SpatialVec(~x_gf.R() * spin, ~x_gf.R() * velocity);
}

std::string Apart(double length, const char* unit, double angle, const char* angle_unit) {
  char text[96];
  std::snprintf(text, sizeof text, "%.3g %s and %.3g %s apart", length, unit, angle, angle_unit);
  return text;
}

}  // namespace

/// A mobilizer with the bodies (-1: ground) on its sides, for the initial state.
struct Model::Placed {
  MobilizedBody mobilizer;
  int inboard = -1, outboard = -1;
  const JointSpec* joint = nullptr;  ///< null: a free body
};

double ModelSpring::Stiffness() const {
  return linear ? linear->stiffness_n_per_m : rotational->stiffness_n_m_per_rad;
}
double ModelSpring::Damping() const {
  return linear ? linear->damping_n_s_per_m : rotational->damping_n_m_s_per_rad;
}
double ModelSpring::Free() const {
  return linear ? linear->free_length_m : rotational->free_angle_rad;
}

SpringLoad ModelSpring::Load(const SimTK::State& state) const {
  SpringLoad load;
  if (linear) {
    Vec3 at_a, at_b, v_a, v_b;
    a.findStationLocationAndVelocityInGround(state, ToSimbody(linear->point_a_m), at_a, v_a);
    b.findStationLocationAndVelocityInGround(state, ToSimbody(linear->point_b_m), at_b, v_b);
    load.extent = (at_b - at_a).norm();
    if (!(load.extent > kMeetingEnds)) {
      throw std::runtime_error("multibody: spring '" + linear->name +
                               "': its ends meet, expected a distance between them");
    }
    load.rate = ~(v_b - v_a) * (at_b - at_a) / load.extent;
  } else {
    load.extent = joint->mobilizer.getOneQ(state, rotational->coordinate);
    load.rate = joint->mobilizer.getOneU(state, rotational->coordinate);
  }
  const double pull = Stiffness() * (load.extent - Free()) + Damping() * load.rate - actuator;
  load.force = linear ? pull : -pull;
  return load;
}

void ModelSpring::Apply(const SimTK::State& state, SimTK::Vector_<SpatialVec>& forces) const {
  const double force = Load(state).force;
  if (linear) {
    const Vec3 point_a = ToSimbody(linear->point_a_m), point_b = ToSimbody(linear->point_b_m);
    const Vec3 along = b.findStationLocationInGround(state, point_b) -
                       a.findStationLocationInGround(state, point_a);
    const Vec3 on_a = force / along.norm() * along;
    a.applyForceToBodyPoint(state, point_a, on_a, forces);
    b.applyForceToBodyPoint(state, point_b, -on_a, forces);
    return;
  }
  const MobilizedBody& m = joint->mobilizer;
  const MobilizedBody& inboard = m.getParentMobilizedBody();
  const MobilizedBody& child = joint->reversed ? inboard : m;
  const MobilizedBody& parent = joint->reversed ? m : inboard;
  const JointSpec& spec = *joint->spec;
  const bool second = rotational->coordinate == 1;
  const JointFrame& frame = second ? spec.in_child : spec.in_parent;
  const Vec3 axis = second                               ? Vec3(0, 1, 0)
                    : spec.type == JointType::kUniversal ? Vec3(1, 0, 0)
                                                         : Vec3(0, 0, 1);
  const Rotation& body = (second ? child : parent).getBodyRotation(state);
  const Vec3 torque = force * (body * (ToSimbody({}, frame.orientation).R() * axis));
  child.applyBodyTorque(state, torque, forces);
  parent.applyBodyTorque(state, -torque, forces);
}

MobilizedBody Model::BodyOf(const std::string& name) {
  return name == kGround ? MobilizedBody(matter.Ground()) : bodies[body_numbers.at(name)];
}

void Model::AddMobilizers(std::vector<Placed>* placed) {
  SimTK::MultibodyGraphMaker graph;
  for (const auto& [type, n] :
       std::initializer_list<std::pair<JointType, int>>{{JointType::kRevolute, 1},
                                                        {JointType::kTranslational, 1},
                                                        {JointType::kSpherical, 3},
                                                        {JointType::kUniversal, 2},
                                                        {JointType::kPlanar, 3},
                                                        {JointType::kWeld, 0}}) {
    graph.addJointType(NameOf(type), n);
  }
  graph.addBody(kGround, 0, false);
  const auto number = [](void* p) { return static_cast<int>(reinterpret_cast<std::intptr_t>(p)); };
  const auto pointer = [](std::size_t k) {
    return reinterpret_cast<void*>(static_cast<std::intptr_t>(k + 1));
  };
  for (std::size_t b = 0; b < spec.bodies.size(); ++b) {
    graph.addBody(spec.bodies[b].name, spec.bodies[b].mass_kg, false, pointer(b));
  }
  for (std::size_t j = 0; j < spec.joints.size(); ++j) {
    const JointSpec& s = spec.joints[j];
    graph.addJoint(s.name, NameOf(s.type), s.parent, s.child, false, pointer(j));
  }
  graph.generateGraph();
  bodies.resize(spec.bodies.size());
  std::vector<Placed> cut;  // second parts of bodies, which come before the first at times
  for (int k = 0; k < graph.getNumMobilizers(); ++k) {
    const auto& m = graph.getMobilizer(k);
    if (m.getLevel() == 0) continue;  // ground itself
    Placed p;
    p.inboard = number(m.getInboardBodyRef()) - 1;
    p.outboard = number(m.getOutboardMasterBodyRef()) - 1;
    const MultibodyBody& outboard = spec.bodies[p.outboard];
    const SimTK::Body body = PartOf(outboard, m.getNumFragments());
    MobilizedBody from = p.inboard < 0 ? MobilizedBody(matter.Ground()) : bodies[p.inboard];
    if (m.isAddedBaseMobilizer()) {  // at its mass centre: the speeds are momenta per mass
      p.mobilizer = MobilizedBody::Free(from, Transform(), body,
                                        Transform(ToSimbody(outboard.centre_of_mass_m)));
    } else {
      ModelJoint& joint = joints[number(m.getJointRef()) - 1];
      p.joint = joint.spec;
      joint.reversed = m.isReversedFromJoint();
      const JointFrame& in = joint.reversed ? p.joint->in_child : p.joint->in_parent;
      const JointFrame& out = joint.reversed ? p.joint->in_parent : p.joint->in_child;
      const Transform turn = JointToMobilizer(p.joint->type);
      p.mobilizer =
          MakeMobilizer(p.joint->type, from, ToSimbody(in.position_m, in.orientation) * turn, body,
                        ToSimbody(out.position_m, out.orientation) * turn, joint.reversed);
      joint.mobilizer = p.mobilizer;
      if (p.joint->type != JointType::kSpherical && p.joint->type != JointType::kWeld) {
        joint.motion = SimTK::Motion::Custom(joint.mobilizer, new Driven(*joint.drive));
        joint.motion.setDisabledByDefault(!joint.Driven());
      }
    }
    if (m.isSlaveMobilizer()) {
      cut.push_back(p);
    } else {
      bodies[p.outboard] = p.mobilizer;
    }
    placed->push_back(p);
  }
  loops = !cut.empty();
  for (Placed& p : cut) SimTK::Constraint::Weld(bodies[p.outboard], p.mobilizer);
}

void Model::AddSprings() {
  for (const LinearSpringSpec& s : spec.linear_springs) {
    spring_numbers[s.name] = static_cast<int>(springs.size());
    springs.push_back({&s, nullptr, BodyOf(s.body_a), BodyOf(s.body_b)});
  }
  for (const RotationalSpringSpec& s : spec.rotational_springs) {
    spring_numbers[s.name] = static_cast<int>(springs.size());
    springs.push_back({nullptr, &s, {}, {}, &joints[joint_numbers.at(s.joint)]});
  }
  SimTK::Force::Custom(forces, new Interactions(*this));
}

void Model::FitInitialState(const std::vector<Placed>& placed) {
  const auto pose = [&](int b) {
    return b < 0 ? Transform() : ToSimbody(spec.bodies[b].position_m, spec.bodies[b].orientation);
  };
  const auto velocity = [&](int b, const Vec3& arm) {
    if (b < 0) return SpatialVec(Vec3(0), Vec3(0));
    const Vec3 spin = ToSimbody(spec.bodies[b].spin_rad_per_s);
    return SpatialVec(spin, ToSimbody(spec.bodies[b].velocity_m_per_s) + spin % arm);
  };
  const auto bad = [](const Placed& p, const std::string& what) {
    throw std::invalid_argument("multibody: joint '" + p.joint->name + "': " + what +
                                " beyond what a " + NameOf(p.joint->type) +
                                " joint leaves free, expected at most 1e-6");
  };
  for (const Placed& p : placed) {
    const Transform x_gf = pose(p.inboard) * p.mobilizer.getDefaultInboardFrame();
    const Transform x_gm = pose(p.outboard) * p.mobilizer.getDefaultOutboardFrame();
    const Transform wanted = ~x_gf * x_gm;
    p.mobilizer.setQToFitTransform(initial, wanted);
    system.realize(initial, SimTK::Stage::Position);
    const Transform rest = ~p.mobilizer.getMobilizerTransform(initial) * wanted;
    const double angle = std::abs(rest.R().convertRotationToAngleAxis()[0]);
    if (!(rest.p().norm() <= kFitSlack && angle <= kFitSlack)) {
      bad(p, "its frames are " + Apart(rest.p().norm(), "m", angle, "rad"));
    }
    const SpatialVec relative =
        RelativeVelocity(x_gf, velocity(p.inboard, x_gf.p() - pose(p.inboard).p()), x_gm,
                         velocity(p.outboard, x_gm.p() - pose(p.outboard).p()));
    p.mobilizer.setUToFitVelocity(initial, relative);
    system.realize(initial, SimTK::Stage::Velocity);
    const SpatialVec left = relative - p.mobilizer.getMobilizerVelocity(initial);
    if (!(left[1].norm() <= kFitSlack && left[0].norm() <= kFitSlack)) {
      bad(p, "the velocities of its frames are " +
                 Apart(left[1].norm(), "m/s", left[0].norm(), "rad/s"));
    }
  }
}

Model::Model(const MultibodySpec& given) : spec((CheckMultibody(given), given)) {
  matter.setShowDefaultGeometry(false);
  gravity = SimTK::Force::Gravity(forces, matter, ToSimbody(spec.gravity_m_per_s2));
  joints.resize(spec.joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joints[j].spec = &spec.joints[j];
    joints[j].locked = spec.joints[j].locked;
    joint_numbers[spec.joints[j].name] = static_cast<int>(j);
    for (auto* v :
         {&joints[j].drive->coordinate, &joints[j].drive->rate, &joints[j].drive->acceleration}) {
      v->assign(3, 0.0);
    }
  }
  for (std::size_t b = 0; b < spec.bodies.size(); ++b) {
    body_numbers[spec.bodies[b].name] = static_cast<int>(b);
  }
  std::vector<Placed> placed;
  AddMobilizers(&placed);
  AddSprings();
  initial = system.realizeTopology();
  system.realizeModel(initial);
  FitInitialState(placed);
  if (!loops) return;
  for (ModelJoint& j : joints) {
    for (int k = 0; j.Driven() && k < j.mobilizer.getNumU(initial); ++k) {
      j.drive->coordinate[k] = j.mobilizer.getOneQ(initial, k);
      j.drive->rate[k] = j.mobilizer.getOneU(initial, k);
    }
  }
  system.projectQ(initial, kProjection);  // of the slack of the fit
  system.projectU(initial, kProjection);
}

}  // namespace grouser::dem

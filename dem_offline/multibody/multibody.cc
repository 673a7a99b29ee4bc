#include "dem_offline/multibody/multibody.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/multibody/simbody_model.h"

namespace grouser::dem {
namespace {

using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;

constexpr double kLoopAccuracy = 1e-12;   // [m], and of the axes of a weld
constexpr double kSpeedAccuracy = 1e-14;  // of the largest speed
constexpr int kMostRounds = 50;

[[noreturn]] void Bad(const std::string& what, const std::string& expected) {
  throw std::invalid_argument("multibody: " + what + ", expected " + expected);
}

int Find(const std::map<std::string, int>& numbers, const char* kind, const std::string& name) {
  const auto at = numbers.find(name);
  if (at != numbers.end()) return at->second;
  std::string known;
  for (const auto& [n, k] : numbers) known += (known.empty() ? "'" : ", '") + n + "'";
  Bad(std::string(kind) + " '" + name + "'",
      known.empty() ? "none: there is none" : "one of " + known);
}

double Largest(const Vector& v) { return v.size() > 0 ? v.normInf() : 0.0; }

Vector VectorOf(const std::vector<double>& v) {
  Vector out(static_cast<int>(v.size()));
  for (int k = 0; k < out.size(); ++k) out[k] = v[k];
  return out;
}
std::vector<double> ValuesOf(const Vector& v) {
  std::vector<double> out(v.size());
  for (int k = 0; k < v.size(); ++k) out[k] = v[k];
  return out;
}

Wrench WrenchOf(const SimTK::SpatialVec& f) {
  return {f[1][0], f[1][1], f[1][2], f[0][0], f[0][1], f[0][2]};
}

}  // namespace

Wrench WrenchIn(const Wrench& w, const Vec3d& p, const Quatd& q) {
  const Mat3d r = MatrixOf(q);
  const Vec3d force = {w.fx, w.fy, w.fz};
  const Vec3d f = r.Back(force), m = r.Back(Sub({w.tx, w.ty, w.tz}, CrossD(p, force)));
  return {f[0], f[1], f[2], m[0], m[1], m[2]};
}

struct MultibodySystem::Impl {
  explicit Impl(const MultibodySpec& spec) : model(spec) {
    state.coordinates = ValuesOf(model.initial.getQ());
    state.speeds = ValuesOf(model.initial.getU());
    Allocate();
    model.system.realize(kick, Stage::Dynamics);
    BookEnergy();
  }

  Model model;
  MultibodyState state;  ///< but for `locked`, which the joints know
  State kick;            ///< of the last forces
  State place;           ///< of time_s()
  bool forces_known = false;

  /// States for the joints that are driven now.
  void Allocate() {
    place = model.initial;
    for (const ModelJoint& j : model.joints) {
      if (j.motion.isEmptyHandle()) continue;
      if (j.Driven() == !j.motion.isDisabled(place)) continue;
      j.Driven() ? j.motion.enable(place) : j.motion.disable(place);
    }
    place.updTime() = state.time_s;
    place.updQ() = VectorOf(state.coordinates);
    place.updU() = VectorOf(state.speeds);
    kick = place;
    model.system.realize(place, Stage::Position);
    forces_known = false;
  }

  /// What driven joints do in a step of length dt with kicks of length h: their speeds.
  void Aim(double dt, double h, Vector* speeds) {
    for (ModelJoint& j : model.joints) {
      if (!j.Driven()) continue;
      const int first_q = j.mobilizer.getFirstQIndex(kick),
                first_u = j.mobilizer.getFirstUIndex(kick);
      for (int k = 0; k < j.mobilizer.getNumU(kick); ++k) {
        const double q = state.coordinates[first_q + k];
        double rate = 0;
        if (!j.spec->rate.empty()) rate = j.spec->rate[k](state.time_s + 0.5 * dt);
        if (!j.spec->coordinate.empty()) {
          rate = (j.spec->coordinate[k](state.time_s + dt) - q) / dt;
        }
        if (!std::isfinite(rate)) {
          throw std::runtime_error("multibody: joint '" + j.spec->name +
                                   "': its motion is not finite at " +
                                   std::to_string(state.time_s) + " s");
        }
        j.drive->coordinate[k] = q;
        j.drive->rate[k] = rate;
        // It begins with its motion, as if it had always moved so.
        j.drive->acceleration[k] =
            state.last_dt_s > 0 || j.locked ? (rate - (*speeds)[first_u + k]) / h : 0.0;
        if (state.last_dt_s == 0 && !j.locked) (*speeds)[first_u + k] = rate;
      }
    }
  }

  /// Forces at the present pose; the speeds of the half step that follows.
  Vector Kick(double dt) {
    const double h = 0.5 * (state.last_dt_s + dt);
    Vector before = VectorOf(state.speeds);
    kick.updTime() = state.time_s;
    kick.updQ() = VectorOf(state.coordinates);
    Aim(dt, h, &before);
    if (state.last_dt_s == 0 && model.loops) {
      kick.updU() = before;
      model.system.projectU(kick, kLoopAccuracy);
      before = kick.getU();
    }
    for (ModelSpring& s : model.springs) {
      const TimeFunction& f = s.linear ? s.linear->force_n : s.rotational->torque_n_m;
      s.actuator = f ? f(state.time_s) : 0.0;
    }
    Vector now = before;
    for (int round = 0; round < kMostRounds; ++round) {
      kick.updU() = now;
      model.system.realize(kick, Stage::Acceleration);
      const Vector& a = kick.getUDot();
      const Vector next = before + 0.5 * state.last_dt_s * a;
      const double change = Largest(next - now);
      if (!std::isfinite(change)) break;
      if (change <= kSpeedAccuracy * (Largest(next) + h * Largest(a))) return before + h * a;
      now = next;
    }
    throw std::runtime_error("multibody: no speeds found at " + std::to_string(state.time_s) +
                             " s: the step is too long for the dampers or the spins, or a force "
                             "is not finite");
  }

  /// The pose at the end of the step; corrects the speeds where it is put back onto loops.
  void Drift(double dt, Vector* speeds) {
    const Vector q = VectorOf(state.coordinates);
    Vector rate(q.size()), correction(speeds->size());
    place.updTime() = state.time_s + dt;
    place.updQ() = q;
    model.system.realize(place, Stage::Position);
    model.matter.multiplyByN(place, false, *speeds, rate);
    if (model.matter.getNumQuaternionsInUse(place) > 0) {
      for (int round = 0; round < 3; ++round) {
        place.updQ() = q + 0.5 * dt * rate;
        model.system.realize(place, Stage::Position);
        model.matter.multiplyByN(place, false, *speeds, rate);
      }
    }
    place.updQ() = q + dt * rate;
    if (model.matter.getNumQuaternionsInUse(place) > 0) model.matter.normalizeQuaternions(place);
    if (model.loops) {
      const Vector open = place.getQ();
      for (ModelJoint& j : model.joints) {
        for (int k = 0; j.Driven() && k < j.mobilizer.getNumU(place); ++k) {
          j.drive->coordinate[k] = j.mobilizer.getOneQ(place, k);
        }
      }
      place.updTime() = state.time_s + dt;  // prescribed positions are kept since the time was set
      model.system.projectQ(place, kLoopAccuracy);
      model.matter.multiplyByNInv(place, false, place.getQ() - open, correction);
      *speeds += correction / dt;
    }
    model.system.realize(place, Stage::Position);
  }

  MultibodyEnergy Power() const {
    MultibodyEnergy p;
    for (std::size_t b = 0; b < model.wrenches.size(); ++b) {
      const Wrench& w = model.wrenches[b];
      const SimTK::SpatialVec v = model.bodies[b].getBodyVelocity(kick);
      p.grains += w.tx * v[0][0] + w.ty * v[0][1] + w.tz * v[0][2] + w.fx * v[1][0] +
                  w.fy * v[1][1] + w.fz * v[1][2];
    }
    for (const ModelSpring& s : model.springs) {
      const SpringLoad load = s.Load(kick);
      p.actuators += s.actuator * load.rate;
      p.dissipated += s.Damping() * load.rate * load.rate;
    }
    p.drives = model.matter.calcMotionPower(kick);
    return p;
  }

  /// Energies of the kick.
  void BookEnergy() {
    state.energy.kinetic = model.matter.calcKineticEnergy(kick);
    state.energy.gravity = model.gravity.calcPotentialEnergyContribution(kick);
    state.energy.springs = model.system.calcPotentialEnergy(kick) - state.energy.gravity;
  }
  /// And the works up to it, by the trapezoidal rule.
  void BookWork(const MultibodyEnergy& now) {
    const double half = 0.5 * state.last_dt_s;
    MultibodyEnergy &e = state.energy, &was = state.power;
    e.grains += half * (was.grains + now.grains);
    e.drives += half * (was.drives + now.drives);
    e.actuators += half * (was.actuators + now.actuators);
    e.dissipated += half * (was.dissipated + now.dissipated);
    was = now;
  }

  /// Pose and speeds half a step before time_s().
  State Half() const {
    State half = place;
    half.updU() = VectorOf(state.speeds);
    if (state.last_dt_s > 0) {
      Vector rate(half.getNQ());
      model.system.realize(half, Stage::Position);
      model.matter.multiplyByN(half, false, half.getU(), rate);
      half.updQ() -= 0.5 * state.last_dt_s * rate;
      model.matter.normalizeQuaternions(half);
    }
    model.system.realize(half, Stage::Velocity);
    return half;
  }

  const ModelJoint& Joint(const std::string& name) const {
    return model.joints[Find(model.joint_numbers, "joint", name)];
  }
  SpringLoad Spring(const std::string& name) const {
    const ModelSpring& s = model.springs[Find(model.spring_numbers, "spring", name)];
    return forces_known ? s.Load(kick) : SpringLoad{};
  }
};

MultibodySystem::MultibodySystem(const MultibodySpec& spec) : impl_(std::make_unique<Impl>(spec)) {
  for (const ModelJoint& j : impl_->model.joints) {
    for (std::size_t k = 0; k < j.spec->coordinate.size(); ++k) {
      const double q = j.mobilizer.getOneQ(impl_->place, static_cast<int>(k));
      const double p = j.spec->coordinate[k](0);
      if (!(std::abs(p - q) <= 1e-6)) {
        Bad("joint '" + j.spec->name + "': coordinate: " + std::to_string(p) + " at time zero",
            std::to_string(q) + ", that of the bodies' poses");
      }
    }
  }
}
MultibodySystem::~MultibodySystem() = default;
MultibodySystem::MultibodySystem(MultibodySystem&&) noexcept = default;
MultibodySystem& MultibodySystem::operator=(MultibodySystem&&) noexcept = default;

void MultibodySystem::Advance(double dt_s, const std::vector<Wrench>& wrenches) {
  Impl& m = *impl_;
  if (!(std::isfinite(dt_s) && dt_s > 0)) Bad("dt_s: " + std::to_string(dt_s), "> 0");
  if (!wrenches.empty() && wrenches.size() != m.model.bodies.size()) {
    Bad("wrenches: " + std::to_string(wrenches.size()),
        "one a body: " + std::to_string(m.model.bodies.size()));
  }
  m.model.wrenches = wrenches;
  m.forces_known = false;
  Vector speeds;
  try {
    speeds = m.Kick(dt_s);
    m.Drift(dt_s, &speeds);
  } catch (const SimTK::Exception::Base& e) {
    m.Allocate();
    throw std::runtime_error("multibody: no state follows that of " +
                             std::to_string(m.state.time_s) + " s: " + e.getMessageText());
  } catch (...) {
    m.Allocate();
    throw;
  }
  m.BookWork(m.Power());
  m.BookEnergy();
  m.forces_known = true;
  m.state.coordinates = ValuesOf(m.place.getQ());
  m.state.speeds = ValuesOf(speeds);
  m.state.time_s += dt_s;
  m.state.last_dt_s = dt_s;
}

const MultibodySpec& MultibodySystem::spec() const { return impl_->model.spec; }
double MultibodySystem::time_s() const { return impl_->state.time_s; }
int MultibodySystem::bodies() const { return static_cast<int>(impl_->model.bodies.size()); }
int MultibodySystem::BodyNumber(const std::string& name) const {
  return Find(impl_->model.body_numbers, "body", name);
}

BodyPlacement MultibodySystem::Placement(int body) const {
  const SimTK::Transform& x = impl_->model.bodies.at(body).getBodyTransform(impl_->place);
  const SimTK::Quaternion q = x.R().convertRotationToQuaternion();
  return {FromSimbody(x.p()), {q[0], q[1], q[2], q[3]}};
}

BodyVelocity MultibodySystem::Velocity(int body) const {
  // A copy: the state of the half step is gone after this line.
  const SimTK::SpatialVec v = impl_->model.bodies.at(body).getBodyVelocity(impl_->Half());
  return {FromSimbody(v[1]), FromSimbody(v[0])};
}

std::vector<double> MultibodySystem::Coordinates(const std::string& joint) const {
  return ValuesOf(impl_->Joint(joint).mobilizer.getQAsVector(impl_->place));
}

std::vector<double> MultibodySystem::Rates(const std::string& joint) const {
  const ModelJoint& j = impl_->Joint(joint);
  const auto first = impl_->state.speeds.begin() + j.mobilizer.getFirstUIndex(impl_->place);
  return {first, first + j.mobilizer.getNumU(impl_->place)};
}

Wrench MultibodySystem::Reaction(const std::string& joint) const {
  const ModelJoint& j = impl_->Joint(joint);
  if (!impl_->forces_known) return {};
  return WrenchOf(j.reversed ? j.mobilizer.findMobilizerReactionOnParentAtFInGround(impl_->kick)
                             : j.mobilizer.findMobilizerReactionOnBodyAtMInGround(impl_->kick));
}

Wrench MultibodySystem::ReactionIn(const std::string& joint, const std::string& body,
                                   const JointFrame& frame) const {
  const ModelJoint& j = impl_->Joint(joint);
  const State& kick = impl_->kick;
  SimTK::Transform to;
  if (body != kGround) to = impl_->model.bodies[BodyNumber(body)].getBodyTransform(kick);
  to = to * ToSimbody(frame.position_m, frame.orientation);
  const SimTK::MobilizedBody& child = j.reversed
                                          ? j.mobilizer.getParentMobilizedBody()
                                          : static_cast<const SimTK::MobilizedBody&>(j.mobilizer);
  const SimTK::Vec3 from =
      child.findStationLocationInGround(kick, ToSimbody(j.spec->in_child.position_m));
  const SimTK::Quaternion q = to.R().convertRotationToQuaternion();
  return WrenchIn(Reaction(joint), FromSimbody(to.p() - from), {q[0], q[1], q[2], q[3]});
}

double MultibodySystem::SpringForce(const std::string& spring) const {
  return impl_->Spring(spring).force;
}
double MultibodySystem::SpringLength(const std::string& spring) const {
  return impl_->Spring(spring).extent;
}
MultibodyEnergy MultibodySystem::Energy() const { return impl_->state.energy; }

std::array<Vec3d, 2> MultibodySystem::Momentum() const {
  const SimTK::SpatialVec p =
      impl_->model.matter.calcSystemMomentumAboutGroundOrigin(impl_->Half());
  return {FromSimbody(p[1]), FromSimbody(p[0])};
}

double MultibodySystem::Gap() const {
  const Vector& error = impl_->place.getQErr();
  const int loops = error.size() - impl_->model.matter.getNumQuaternionsInUse(impl_->place);
  double gap = 0;
  for (int k = 0; k < loops; ++k) gap = std::max(gap, std::abs(error[k]));
  return gap;
}

void MultibodySystem::SetLocked(const std::string& joint, bool locked) {
  ModelJoint& j = impl_->model.joints[Find(impl_->model.joint_numbers, "joint", joint)];
  if (j.motion.isEmptyHandle() || !j.spec->rate.empty() || !j.spec->coordinate.empty()) {
    Bad("joint '" + joint + "': locked",
        "a joint that is not driven; revolute, translational, universal or planar");
  }
  if (j.locked == locked) return;
  j.locked = locked;
  impl_->Allocate();
}

MultibodyState MultibodySystem::Save() const {
  MultibodyState state = impl_->state;
  state.locked.clear();
  for (const ModelJoint& j : impl_->model.joints) state.locked.push_back(j.locked);
  return state;
}

void MultibodySystem::Restore(const MultibodyState& state) {
  Impl& m = *impl_;
  const auto same = [](const char* what, std::size_t got, std::size_t expected) {
    if (got == expected) return;
    Bad(std::string("state: ") + what + ": " + std::to_string(got),
        std::to_string(expected) + ", those of this system");
  };
  same("coordinates", state.coordinates.size(), m.state.coordinates.size());
  same("speeds", state.speeds.size(), m.state.speeds.size());
  same("locked", state.locked.size(), m.model.joints.size());
  m.state = state;
  for (std::size_t j = 0; j < m.model.joints.size(); ++j) {
    m.model.joints[j].locked = state.locked[j] != 0;
  }
  m.Allocate();
}

}  // namespace grouser::dem

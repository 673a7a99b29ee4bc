#include "dem_offline/multibody/coupling.h"

#include <set>
#include <stdexcept>

namespace grouser::dem {
namespace {

[[noreturn]] void Bad(const std::string& what) {
  throw std::invalid_argument("coupled bodies: " + what);
}

/// The spin that Turn needs to lead from one orientation to the other in dt.
Vec3d SpinBetween(const Quatd& from, const Quatd& to, double dt) {
  const Quatd d = Mul(to, Conj(from));
  return Scale(2 / (dt * d[0]), {d[1], d[2], d[3]});
}

}  // namespace

CoupledBodies::CoupledBodies(World* world, MultibodySystem* bodies,
                             const std::vector<BodyLink>& links)
    : world_(world), bodies_(bodies) {
  const WorldConfig& config = world->config();
  if (config.stepper) Bad("the world is stepped by a device, expected the CPU's engine");
  if (config.gravity_m_per_s2 != bodies->spec().gravity_m_per_s2) {
    Bad("gravity_m_per_s2: the world's is not that of the bodies, expected the same");
  }
  std::set<int> linked;
  for (const BodyLink& l : links) {
    if (l.world_body < 0 || l.world_body >= world->bodies()) {
      Bad("world_body: " + std::to_string(l.world_body) + " for '" + l.body + "', expected 0 to " +
          std::to_string(world->bodies() - 1));
    }
    if (!linked.insert(l.world_body).second) {
      Bad("world_body: " + std::to_string(l.world_body) + " is linked twice, expected once");
    }
    links_.push_back({bodies->BodyNumber(l.body), l.world_body});
    Body& b = world->body(l.world_body);
    if (b.motion != BodyMotion::kPrescribed) {
      Bad("world_body: " + std::to_string(l.world_body) + " for '" + l.body +
          "' does not move by prescription, expected BodyMotion::kPrescribed");
    }
    const BodyPlacement at = bodies->Placement(links_.back().body);
    const BodyVelocity v = bodies->Velocity(links_.back().body);
    b.position_m = at.position_m;
    b.orientation = at.orientation;
    b.velocity_m_per_s = v.velocity_m_per_s;
    b.spin_rad_per_s = v.spin_rad_per_s;
  }
}

void CoupledBodies::Steer() {
  const double dt = world_->config().dt_s;
  for (const Link& l : links_) {
    Body& b = world_->body(l.world_body);
    const BodyPlacement to = bodies_->Placement(l.body);
    b.velocity_m_per_s = Scale(1 / dt, Sub(to.position_m, b.position_m));
    b.spin_rad_per_s = SpinBetween(b.orientation, to.orientation, dt);
  }
}

void CoupledBodies::Advance() {
  if (world_->fault() != StepFault::kNone) return;
  world_->Start();
  std::vector<Wrench> wrenches(bodies_->bodies());
  for (const Link& l : links_) wrenches[l.body].Add(world_->wrench(l.world_body));
  bodies_->Advance(world_->config().dt_s, wrenches);
  Steer();
}

StepFault CoupledBodies::Step() {
  Advance();
  return world_->Step();
}

}  // namespace grouser::dem

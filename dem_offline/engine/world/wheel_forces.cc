// Grain-wheel contacts of a World: one contact and one history per grain.
#include <cmath>

#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

/// The wheel as the contact loop needs it: fixed point and float.
struct WheelView {
  std::int32_t x, y, z;
  float q[3];
  float cos_yaw, sin_yaw, radius, half_width;

  Vec3f Relative(const Grain& g) const {  // wheel frame [m]
    const auto diff = [](std::int32_t a, std::int32_t b) {
      return static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(a) -
                                                          static_cast<std::uint32_t>(b)));
    };
    const float dx = diff(g.x, x) * q[0], dy = diff(g.y, y) * q[1], dz = diff(g.z, z) * q[2];
    return ToWheel({dx, dy, dz});
  }
  Vec3f ToWheel(Vec3f a) const {
    return {cos_yaw * a.x + sin_yaw * a.y, -sin_yaw * a.x + cos_yaw * a.y, a.z};
  }
  Vec3f ToWorld(Vec3f a) const {
    return {cos_yaw * a.x - sin_yaw * a.y, sin_yaw * a.x + cos_yaw * a.y, a.z};
  }
};

WheelView View(const WheelBody& w, const Frame& frame) {
  WheelView v;
  v.x = frame.FixX(w.x_m);
  v.y = frame.FixY(w.y_m);
  v.z = frame.FixZ(w.z_m);
  const auto q = frame.Quantum();
  for (int a = 0; a < 3; ++a) v.q[a] = q[a];
  v.cos_yaw = static_cast<float>(std::cos(w.yaw_rad));
  v.sin_yaw = static_cast<float>(std::sin(w.yaw_rad));
  v.radius = static_cast<float>(w.radius_m);
  v.half_width = static_cast<float>(0.5 * w.width_m);
  return v;
}

}  // namespace

void World::FindWheelNeighbours() {
  const WheelView view = View(wheel_, config_.frame);
  wheel_contacts_.near.clear();
  wheel_moved_m_ = 0;
  for (std::int64_t i = 0; i < count_; ++i) {
    const Grain& g = grains_[i];
    const float gap =
        WheelDistance(view.radius, view.half_width, view.Relative(g)).distance - g.radius;
    if (gap < wheel_margin_m_) {
      wheel_contacts_.near.push_back(static_cast<std::int32_t>(i));
    } else {
      wheel_contacts_.history[i] = ContactHistory{};
    }
  }
}

void World::WheelForces() {
  const WheelView view = View(wheel_, config_.frame);
  const float dt = static_cast<float>(config_.dt_s);
  const Vec3f hub = {static_cast<float>(wheel_.v_x), static_cast<float>(wheel_.v_y),
                     static_cast<float>(wheel_.v_z)};
  const Vec3f spin = view.ToWorld({0, static_cast<float>(wheel_.spin), 0});
  wrench_ = Wrench{};
  for (const std::int32_t i : wheel_contacts_.near) {
    const Grain& g = grains_[i];
    const Vec3f local = view.Relative(g);
    const SignedDistance sd = WheelDistance(view.radius, view.half_width, local);
    ContactHistory& h = wheel_contacts_.history[i];
    const float overlap = g.radius - sd.distance;
    if (overlap <= 0.0f) {
      h = ContactHistory{};
      continue;
    }
    const float lever = g.radius - 0.5f * overlap;  // the middle of the overlap, as for pairs
    ContactGeometry c;
    c.n = view.ToWorld(sd.normal);
    c.overlap = overlap;
    const Vec3f at = view.ToWorld(local - lever * sd.normal);  // from the centre
    const Vec3f w = {g.wx, g.wy, g.wz};
    const Vec3f grain_v = Vec3f{g.vx, g.vy, g.vz} - lever * Cross(w, c.n);
    c.v_rel = grain_v - (hub + Cross(spin, at));
    c.w_rel = w - spin;
    c.r_eff = g.radius;
    c.m_eff = g.mass;
    c.roll_inertia = 1.4f * g.mass * g.radius * g.radius;
    const ContactResult r = HertzMindlinEpsd::Evaluate(config_.grain_wheel, c, h, dt);
    h = r.history;
    Apply(i, r, c.n, lever);
    wrench_.fx -= r.force.x;
    wrench_.fy -= r.force.y;
    wrench_.fz -= r.force.z;
    const Vec3f moment = Cross(at, r.force);
    wrench_.tx -= moment.x + r.moment.x;
    wrench_.ty -= moment.y + r.moment.y;
    wrench_.tz -= moment.z + r.moment.z;
    if (sink_) {
      const Vec3f force = view.ToWheel(-1.0f * r.force);
      sink_({view.ToWheel(at), force, sd.normal.y == 0.0f});
    }
  }
}

}  // namespace grouser::dem

#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "dem_offline/engine/laws/contact_model.h"

// One contact driven from a test through the generic path: along a path, or
// between two bodies that collide. Work and energy are summed in double.

namespace grouser::dem {

/// Laws by name, and the numbers they get.
struct Pairing {
  std::string normal = "hertz_restitution", tangential = "mindlin", rolling = "none",
              cohesion = "none";
  Elastic a = {1e8, 0.3}, b = {1e8, 0.3};
  ContactProperties face = {};
  LawSettings settings = {};
  float r = 0.005f, m = 1e-3f;  ///< of either grain; the partner is a body if wall
  bool wall = false;
};

class Contact {
 public:
  explicit Contact(const Pairing& s)
      : laws_(LawsByName(s.normal, s.tangential, s.rolling, s.cohesion)), at_(LayoutOf(laws_)) {
    ContactModel model(laws_);
    model.AddMaterial(s.a);
    model.AddMaterial(s.b);
    model.SetContactProperties(0, 0, s.face, s.settings);
    model.SetContactProperties(0, 1, s.face, s.settings);
    if (s.b.youngs_modulus_pa != kRigid) model.SetContactProperties(1, 1, s.face, s.settings);
    params = model.Table()[1];
    g = {};
    g.n = {0.0f, 0.0f, 1.0f};
    g.r_own = g.r_other = s.r;
    g.r_eff = s.wall ? s.r : s.r / 2;
    g.m_own = s.m;
    g.m_eff = s.wall ? s.m : s.m / 2;
    g.roll_inertia = 1.4f * g.m_eff * s.r * s.r;
  }

  /// Steps the contact as it stands in g.
  const ContactResult& Step(float dt) {
    last = EvaluateGeneric(at_, params, g, words, dt);
    lost += double(last.normal_damping) + last.tangent_damping + last.slip + last.rolling +
            last.plastic + last.cohesion;
    return last;
  }
  /// To this overlap in `steps`, quasi-statically (rate too small to damp), in
  /// the mean of the end forces: adds to work. Returns the last normal force.
  double PressTo(double overlap, int steps) {
    const double from = g.overlap;
    for (int s = 1; s <= steps; ++s) {
      const double before = last.force.z, was = g.overlap;
      g.overlap = static_cast<float>(from + (overlap - from) * s / steps);
      Step(1.0f);
      work += 0.5 * (before + last.force.z) * (g.overlap - was);
    }
    return last.force.z;
  }
  /// Slides i by `x` metres along x (and `y`) in `steps` of dt; returns the force.
  Vec3f SlideBy(double x, double y, int steps, double dt = 1e-6) {
    for (int s = 0; s < steps; ++s) {
      g.v_rel = {static_cast<float>(x / steps / dt), static_cast<float>(y / steps / dt), 0.0f};
      const Vec3f before = last.force;
      Step(static_cast<float>(dt));
      work -= 0.5 * dt *
              (double(before.x + last.force.x) * g.v_rel.x +
               double(before.y + last.force.y) * g.v_rel.y);
      g.v_rel = {0.0f, 0.0f, 0.0f};
    }
    return last.force;
  }

  ContactGeometry g;
  PairParams params;
  ContactResult last = {};
  float words[kMaxHistoryWords] = {};
  double work = 0, lost = 0;

 private:
  LawChoice laws_;
  WordLayout at_;
};

/// A head-on or oblique collision of a grain with its partner (leapfrog).
struct Rebound {
  double restitution = 0, tangential = 0;
  double peak_force = 0, peak_overlap = 0;
  double balance = 0;  ///< (energy in - out - lost)/energy in
};
inline Rebound Collide(const Pairing& s, double v_n, double v_t, double dt) {
  Contact c(s);
  // Two equal grains, or a grain at a wall, in relative coordinates: m* along
  // n; along t the spin makes it 2/7 m*. w: of the surface, from the spin.
  const double m = c.g.m_eff;
  double z = 1e-12, vz = -v_n, vx = v_t, w = 0;
  const double before = 0.5 * m * (v_n * v_n + v_t * v_t);
  Rebound out;
  double overlap = 0;
  bool touched = false;
  for (long i = 0; i < 100000000; ++i) {
    z += vz * dt;
    overlap = -z;
    c.g.overlap = static_cast<float>(overlap);
    c.g.v_rel = {static_cast<float>(vx + w), 0.0f, static_cast<float>(vz)};
    const ContactResult r = c.Step(static_cast<float>(dt));
    if (!r.active || (overlap <= 0 && vz > 0 && r.force.z == 0)) {
      if (touched) break;
      if (vz > 0) break;
      continue;
    }
    touched = true;
    vz += r.force.z / m * dt;
    vx += r.force.x / m * dt;
    w += 2.5 * r.force.x / m * dt;
    out.peak_force = std::max(out.peak_force, double(r.force.z));
    out.peak_overlap = std::max(out.peak_overlap, overlap);
  }
  const double after = 0.5 * m * (vz * vz + vx * vx) + 0.2 * m * w * w;
  out.restitution = vz / v_n;
  out.tangential = v_t != 0 ? vx / v_t : 0;
  out.balance = (before - after - c.lost) / before;
  return out;
}

}  // namespace grouser::dem

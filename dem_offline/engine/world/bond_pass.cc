// Bonds of a World: see contact/bond.h for the law.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

[[noreturn]] void Bad(std::size_t n, const std::string& what) {
  throw std::invalid_argument("bond " + std::to_string(n) + ": " + what);
}

Vec3d Apart(const Grain& a, const Grain& b, const Frame& f) {  // from a to b
  return {WrapDiff(b.x, a.x) * (f.length_m / 4294967296.0),
          WrapDiff(b.y, a.y) * (f.width_m / 4294967296.0),
          WrapDiff(b.z, a.z) * (f.z_span_m / 4294967296.0)};
}
Vec3d VelocityOf(const Grain& g) { return {g.vx, g.vy, g.vz}; }
Vec3d SpinOfGrain(const Grain& g) { return {g.wx, g.wy, g.wz}; }

/// Springs and dashpots of one bond at this moment.
struct Strain {
  Vec3d axis;
  double u_n;          ///< elongation
  Vec3d u_t;           ///< shear displacement of b against a
  double th_t;         ///< twist
  Vec3d th_b;          ///< bending
  Vec3d arm_a, arm_b;  ///< from the grains' centres to the bond's middle
};

Strain Measure(const BondEntry& e, const Quatd& qa, const Quatd& qb, const Vec3d& apart) {
  const Mat3d ra = MatrixOf(qa), rb = MatrixOf(qb);
  const Vec3d pa = ra * e.arm_a, pb = rb * e.arm_b;
  const Vec3d axis = Add(ra * e.axis_a, rb * e.axis_b);
  Strain s;
  s.axis = Scale(1 / Norm(axis), axis);
  const Vec3d u = Sub(Add(apart, pb), pa);
  s.u_n = DotD(u, s.axis);
  s.u_t = Sub(u, Scale(s.u_n, s.axis));
  const Quatd turn = Mul(Mul(Conj(qa), qb), Conj(e.rest));
  const double sign = turn[0] < 0 ? -2.0 : 2.0;
  const Vec3d theta = ra * Vec3d{sign * turn[1], sign * turn[2], sign * turn[3]};
  s.th_t = DotD(theta, s.axis);
  s.th_b = Sub(theta, Scale(s.th_t, s.axis));
  // Both act at one point, so that angular momentum is kept.
  s.arm_a = Add(pa, Scale(0.5, u));
  s.arm_b = Sub(s.arm_a, apart);
  return s;
}

void AddLoad(GrainLoad& f, const Vec3d& force, const Vec3d& moment) {
  f.fx += static_cast<float>(force[0]);
  f.fy += static_cast<float>(force[1]);
  f.fz += static_cast<float>(force[2]);
  f.tx += static_cast<float>(moment[0]);
  f.ty += static_cast<float>(moment[1]);
  f.tz += static_cast<float>(moment[2]);
}

}  // namespace

void BondPass::Add(World& w, const Contents& c) {
  World::Parts& parts = *w.parts_;
  parts.bond_laws = c.bond_laws;
  if (c.bonds.empty()) return;
  parts.bonded.resize(w.grains_.size());
  parts.orientation.assign(w.grains_.size(), {1, 0, 0, 0});
  for (std::size_t n = 0; n < c.bonds.size(); ++n) {
    const BondState& s = c.bonds[n];
    for (const std::int32_t id : {s.grain_a, s.grain_b}) {
      if (id < 0 || id >= w.count_) Bad(n, "grain " + std::to_string(id) + ": no such grain");
      if (w.grains_[w.index_of_[id]].kind & kMember)
        Bad(n, "member of a clump, expected a single grain");
    }
    if (s.grain_a == s.grain_b) Bad(n, "both ends are one grain, expected two");
    if (s.law < 0 || s.law >= static_cast<int>(c.bond_laws.size())) Bad(n, "law: no such bond law");
    if (!(s.radius_m > 0)) Bad(n, "radius_m: expected > 0");
    BondEntry e;
    e.a = w.index_of_[s.grain_a];
    e.b = w.index_of_[s.grain_b];
    e.law = s.law;
    const Grain &a = w.grains_[e.a], &b = w.grains_[e.b];
    const Vec3d apart = Apart(a, b, w.config_.frame);
    const double length = Norm(apart);
    if (!(length > 0)) Bad(n, "the two grains share one place");
    const double share = a.radius / (static_cast<double>(a.radius) + b.radius);
    e.arm_a = Scale(share, apart);
    e.arm_b = Scale(share - 1, apart);
    e.axis_a = e.axis_b = Scale(1 / length, apart);
    e.rest = {1, 0, 0, 0};
    const double r2 = s.radius_m * s.radius_m;
    e.area = M_PI * r2;
    e.bending = M_PI * r2 * r2 / 4;
    e.polar = M_PI * r2 * r2 / 2;
    e.radius = s.radius_m;
    parts.bonds.push_back(e);
    parts.bonded[e.a].push_back(e.b);
    parts.bonded[e.b].push_back(e.a);
  }
  for (auto& list : parts.bonded) std::sort(list.begin(), list.end());
  parts.bond_statistics.intact = static_cast<std::int64_t>(parts.bonds.size());
}

void BondPass::Turn(World& w) {
  World::Parts& parts = *w.parts_;
  for (std::size_t i = 0; i < parts.bonded.size(); ++i) {
    if (parts.bonded[i].empty()) continue;
    parts.orientation[i] =
        dem::Turn(parts.orientation[i], SpinOfGrain(w.grains_[i]), w.config_.dt_s);
  }
}

void BondPass::Forces(World& w) {
  World::Parts& parts = *w.parts_;
  BondStatistics& stat = parts.bond_statistics;
  stat.stored_j = 0;
  const double dt = w.config_.dt_s;
  for (BondEntry& e : parts.bonds) {
    if (!e.intact) continue;
    const BondLaw& law = parts.bond_laws[e.law];
    const Grain &a = w.grains_[e.a], &b = w.grains_[e.b];
    const Strain s =
        Measure(e, parts.orientation[e.a], parts.orientation[e.b], Apart(a, b, w.config_.frame));
    const double kn = law.normal_stiffness_n_per_m3 * e.area;
    const double kt = law.shear_stiffness_n_per_m3 * e.area;
    const double kb = law.normal_stiffness_n_per_m3 * e.bending;
    const double kw = law.shear_stiffness_n_per_m3 * e.polar;
    const Vec3d shear = Scale(-kt, s.u_t), bend = Scale(-kb, s.th_b);
    const double pull = kn * s.u_n, twist = -kw * s.th_t;
    const double before = e.stored;
    e.stored = 0.5 * (kn * s.u_n * s.u_n + kt * DotD(s.u_t, s.u_t) + kb * DotD(s.th_b, s.th_b) +
                      kw * s.th_t * s.th_t);
    const bool torn = pull / e.area + Norm(bend) * e.radius / e.bending > law.tensile_strength_pa;
    const bool cut =
        Norm(shear) / e.area + std::abs(twist) * e.radius / e.polar > law.shear_strength_pa;
    if (torn || cut) {
      e.intact = false;
      --stat.intact;
      ++(torn ? stat.broken_in_tension : stat.broken_in_shear);
      // This step's motion still worked against half of the force before.
      stat.broken_j += 0.5 * (before + e.stored);
      for (const auto& [from, to] : {std::pair{e.a, e.b}, std::pair{e.b, e.a}}) {
        auto& list = parts.bonded[from];
        list.erase(std::lower_bound(list.begin(), list.end(), to));
      }
      w.stale_ = true;  // the pair may touch from now on
      continue;
    }
    Vec3d force = dem::Add(Scale(-pull, s.axis), shear);  // on b
    Vec3d moment = dem::Add(bend, Scale(twist, s.axis));
    if (law.damping_ratio > 0) {
      const double m = 1 / (1.0 / a.mass + 1.0 / b.mass), f = w.config_.inertia_factor;
      const double ia = f * a.mass * a.radius * a.radius, ib = f * b.mass * b.radius * b.radius;
      const double inertia = 1 / (1 / ia + 1 / ib), z = 2 * law.damping_ratio;
      const Vec3d v = Sub(dem::Add(VelocityOf(b), CrossD(SpinOfGrain(b), s.arm_b)),
                          dem::Add(VelocityOf(a), CrossD(SpinOfGrain(a), s.arm_a)));
      const Vec3d o = Sub(SpinOfGrain(b), SpinOfGrain(a));
      const double v_n = DotD(v, s.axis), o_n = DotD(o, s.axis);
      const Vec3d drag = dem::Add(Scale(-z * std::sqrt(kn * m) * v_n, s.axis),
                                  Scale(-z * std::sqrt(kt * m), Sub(v, Scale(v_n, s.axis))));
      const Vec3d brake = dem::Add(Scale(-z * std::sqrt(kw * inertia) * o_n, s.axis),
                                   Scale(-z * std::sqrt(kb * inertia), Sub(o, Scale(o_n, s.axis))));
      force = dem::Add(force, drag);
      moment = dem::Add(moment, brake);
      stat.damped_j -= dt * (DotD(drag, v) + DotD(brake, o));
    }
    stat.stored_j += e.stored;
    AddLoad(w.loads_[e.b], force, dem::Add(moment, CrossD(s.arm_b, force)));
    AddLoad(w.loads_[e.a], Scale(-1, force), Scale(-1, dem::Add(moment, CrossD(s.arm_a, force))));
  }
}

const BondStatistics& World::bond_statistics() const { return parts_->bond_statistics; }
bool World::BondIntact(std::int64_t b) const { return parts_->bonds.at(b).intact; }

}  // namespace grouser::dem

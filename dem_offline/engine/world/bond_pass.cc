// Bonds of a World: see contact/bond.h for the law.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

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

/// Of the four modes: stretching and shear [N/m], bending and twisting [N m/rad].
struct BondSprings {
  double normal, shear, bending, twist;
};
BondSprings SpringsOf(const BondLaw& law, double area, double bending, double polar) {
  return {law.normal_stiffness_n_per_m3 * area, law.shear_stiffness_n_per_m3 * area,
          law.normal_stiffness_n_per_m3 * bending, law.shear_stiffness_n_per_m3 * polar};
}
BondSprings SpringsOf(const BondLaw& law, const BondEntry& e) {
  return SpringsOf(law, e.area, e.bending, e.polar);
}

/// Reduced mass [kg] and moment of inertia [kg m^2] of two grains.
std::pair<double, double> ReducedOf(const Grain& a, const Grain& b, double inertia_factor) {
  const double ia = inertia_factor * a.mass * a.radius * a.radius,
               ib = inertia_factor * b.mass * b.radius * b.radius;
  return {1 / (1.0 / a.mass + 1.0 / b.mass), 1 / (1 / ia + 1 / ib)};
}

}  // namespace

double BondStepOf(const BondLaw& law, double disk_radius_m, double length_m, double mass,
                  double inertia) {
  const double r2 = disk_radius_m * disk_radius_m;
  const BondSprings k = SpringsOf(law, M_PI * r2, M_PI * r2 * r2 / 4, M_PI * r2 * r2 / 2);
  // Shear also turns the grains, with half the bond's length as its lever.
  const double turning = std::max(k.bending, k.twist) + 0.25 * length_m * length_m * k.shear;
  const auto limit = [&](double m, double spring) {
    return 0.1 * LeapfrogLimit(m, {spring, 2 * law.damping_ratio * std::sqrt(spring * m)});
  };
  return std::min(limit(mass, std::max(k.normal, k.shear)), limit(inertia, turning));
}

void BondPass::Add(SimulationState& w, const Contents& c) {
  w.bond_laws = c.bond_laws;
  if (c.bonds.empty()) return;
  w.bonded.resize(w.grains.size());
  w.turns.assign(w.grains.size(), 0);
  w.orientation.assign(w.grains.size(), {1, 0, 0, 0});
  for (std::size_t n = 0; n < c.bonds.size(); ++n) {
    const BondState& s = c.bonds[n];
    for (const std::int32_t id : {s.grain_a, s.grain_b}) {
      if (id < 0 || id >= w.count) Bad(n, "grain " + std::to_string(id) + ": no such grain");
      if (w.grains[w.index_of[id]].kind & kMember)
        Bad(n, "member of a clump, expected a single grain");
    }
    if (s.grain_a == s.grain_b) Bad(n, "both ends are one grain, expected two");
    if (s.law < 0 || s.law >= static_cast<int>(c.bond_laws.size())) Bad(n, "law: no such bond law");
    if (!(s.radius_m > 0)) Bad(n, "radius_m: expected > 0");
    const BondLaw& law = c.bond_laws[s.law];
    if (!(law.largest_stretch > 0)) Bad(n, "largest_stretch: expected > 0");
    if (!(law.largest_length_m > 0)) Bad(n, "largest_length_m: expected > 0");
    BondEntry e;
    e.a = w.index_of[s.grain_a];
    e.b = w.index_of[s.grain_b];
    ++w.turns[e.a];
    ++w.turns[e.b];
    e.law = s.law;
    const Grain &a = w.grains[e.a], &b = w.grains[e.b];
    const Vec3d apart = Apart(a, b, w.config.frame);
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
    e.length = length;
    w.bonds.push_back(e);
    if (law.beside_contact) continue;
    w.bonded[e.a].push_back(e.b);
    w.bonded[e.b].push_back(e.a);
  }
  for (auto& list : w.bonded) std::sort(list.begin(), list.end());
  w.bond_statistics.intact = static_cast<std::int64_t>(w.bonds.size());
}

void BondPass::Turn(SimulationState& w) {
  for (std::size_t i = 0; i < w.turns.size(); ++i) {
    if (!w.turns[i]) continue;
    w.orientation[i] = dem::Turn(w.orientation[i], SpinOfGrain(w.grains[i]), w.config.dt_s);
  }
}

void BondPass::Forces(SimulationState& w) {
  BondStatistics& stat = w.bond_statistics;
  stat.stored_j = 0;
  const double dt = w.config.dt_s;
  for (BondEntry& e : w.bonds) {
    if (!e.intact) continue;
    const BondLaw& law = w.bond_laws[e.law];
    const Grain &a = w.grains[e.a], &b = w.grains[e.b];
    const Vec3d apart = Apart(a, b, w.config.frame);
    const Strain s = Measure(e, w.orientation[e.a], w.orientation[e.b], apart);
    const auto [kn, kt, kb, kw] = SpringsOf(law, e);
    const Vec3d shear = Scale(-kt, s.u_t), bend = Scale(-kb, s.th_b);
    const double pull = kn * s.u_n, twist = -kw * s.th_t;
    const double before = e.stored;
    e.stored = 0.5 * (kn * s.u_n * s.u_n + kt * DotD(s.u_t, s.u_t) + kb * DotD(s.th_b, s.th_b) +
                      kw * s.th_t * s.th_t);
    const bool torn = pull / e.area + Norm(bend) * e.radius / e.bending > law.tensile_strength_pa;
    const bool cut =
        Norm(shear) / e.area + std::abs(twist) * e.radius / e.polar > law.shear_strength_pa;
    const bool parted =
        Norm(apart) > std::min((1 + law.largest_stretch) * e.length, law.largest_length_m);
    if (torn || cut || parted) {
      e.intact = false;
      --stat.intact;
      --w.turns[e.a];
      --w.turns[e.b];
      ++(torn ? stat.broken_in_tension : cut ? stat.broken_in_shear : stat.broken_by_stretch);
      // This step's motion still worked against half of the force before.
      stat.broken_j += 0.5 * (before + e.stored);
      if (law.beside_contact) continue;
      for (const auto& [from, to] : {std::pair{e.a, e.b}, std::pair{e.b, e.a}}) {
        auto& list = w.bonded[from];
        list.erase(std::lower_bound(list.begin(), list.end(), to));
      }
      w.stale = true;  // the pair may touch from now on
      continue;
    }
    Vec3d force = dem::Add(Scale(-pull, s.axis), shear);  // on b
    Vec3d moment = dem::Add(bend, Scale(twist, s.axis));
    if (law.damping_ratio > 0) {
      const auto [m, inertia] = ReducedOf(a, b, w.config.inertia_factor);
      const double z = 2 * law.damping_ratio;
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
    w.loads[e.b].Add(ToFloat(force), ToFloat(dem::Add(moment, CrossD(s.arm_b, force))));
    w.loads[e.a].Add(ToFloat(Scale(-1, force)),
                     ToFloat(Scale(-1, dem::Add(moment, CrossD(s.arm_a, force)))));
  }
}

std::vector<BondLoad> BondPass::Loads(const SimulationState& w) {
  std::vector<BondLoad> out;
  out.reserve(w.bonds.size());
  for (const BondEntry& e : w.bonds) {
    const Grain &a = w.grains[e.a], &b = w.grains[e.b];
    BondLoad load = {a.id, b.id, e.intact};
    if (e.intact) {
      const Strain s =
          Measure(e, w.orientation[e.a], w.orientation[e.b], Apart(a, b, w.config.frame));
      const BondSprings k = SpringsOf(w.bond_laws[e.law], e);
      load.tension_n = k.normal * s.u_n;
      load.shear_n = k.shear * Norm(s.u_t);
    }
    out.push_back(load);
  }
  return out;
}

double BondPass::CriticalStep(const SimulationState& w) {
  double least = 1e300;
  for (const BondEntry& e : w.bonds) {
    if (!e.intact) continue;
    const BondLaw& law = w.bond_laws[e.law];
    const auto [m, inertia] = ReducedOf(w.grains[e.a], w.grains[e.b], w.config.inertia_factor);
    least = std::min(least, BondStepOf(law, e.radius, e.length, m, inertia));
  }
  return least;
}

}  // namespace grouser::dem

// Rigid clumps of a World.
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

void ClumpPass::Add(SimulationState& w, const Contents& c, std::vector<GrainState>* grains) {
  w.templates = c.templates;
  for (std::size_t n = 0; n < c.clumps.size(); ++n) {
    const ClumpState& s = c.clumps[n];
    if (s.shape < 0 || s.shape >= static_cast<int>(c.templates.size())) {
      throw std::invalid_argument("clump " + std::to_string(n) + ": shape: " +
                                  std::to_string(s.shape) + ", expected a template's number");
    }
    if (!(s.density_kg_per_m3 > 0)) {
      throw std::invalid_argument("clump " + std::to_string(n) +
                                  ": density_kg_per_m3: expected > 0");
    }
    const ClumpTemplate& shape = c.templates[s.shape];
    ClumpEntry e;
    e.state = s;
    e.state.orientation = Unit(s.orientation);
    e.state.position_m = Sub(s.position_m, w.config.origin_m);
    e.mass_kg = s.density_kg_per_m3 * shape.volume_m3;
    e.inertia = Scale(s.density_kg_per_m3, shape.inertia_per_density);
    e.angular_momentum = MomentumOf(e.state.orientation, s.spin_rad_per_s, e.inertia);
    e.first_id = static_cast<std::int32_t>(grains->size());
    const Mat3d turn = MatrixOf(e.state.orientation);
    for (const auto& m : shape.members) {
      const Vec3d off = turn * m.offset_m;
      const Vec3d at = dem::Add(s.position_m, off);
      const Vec3d v = dem::Add(s.velocity_m_per_s, CrossD(s.spin_rad_per_s, off));
      GrainState g = {};
      g.x_m = at[0], g.y_m = at[1], g.z_m = at[2];
      g.radius_m = m.radius_m;
      g.v_x = v[0], g.v_y = v[1], g.v_z = v[2];
      g.w_x = s.spin_rad_per_s[0], g.w_y = s.spin_rad_per_s[1], g.w_z = s.spin_rad_per_s[2];
      g.material = s.material;
      g.mass_kg = e.mass_kg;  // a contact feels the whole clump
      grains->push_back(g);
    }
    w.clumps.push_back(e);
  }
}

void ClumpPass::Index(SimulationState& w) {
  if (w.clumps.empty()) return;
  w.clump_of.assign(w.grains.size(), -1);
  for (std::size_t c = 0; c < w.clumps.size(); ++c) {
    const ClumpEntry& e = w.clumps[c];
    const auto members = w.templates[e.state.shape].members.size();
    for (std::size_t k = 0; k < members; ++k) {
      const std::int32_t i = w.index_of[e.first_id + k];
      w.clump_of[i] = static_cast<std::int32_t>(c);
      w.grains[i].kind |= kMember;
    }
  }
}

ClumpSurroundings ClumpPass::Around(const SimulationState& w) {
  return {w.config.gravity_m_per_s2, w.config.dt_s, w.drag, w.config.planar, w.config.frame};
}

void ClumpPass::Gather(SimulationState& w) {
  const ClumpSurroundings around = Around(w);
  for (ClumpEntry& e : w.clumps) {
    const auto& members = w.templates[e.state.shape].members;
    GatherClump(
        around, members.data(), static_cast<int>(members.size()),
        [&](int k) -> const GrainLoad& { return w.loads[w.index_of[e.first_id + k]]; }, &e);
  }
}

void ClumpPass::Move(SimulationState& w) {
  const ClumpSurroundings around = Around(w);
  for (ClumpEntry& e : w.clumps) {
    const auto& members = w.templates[e.state.shape].members;
    MoveClump(around, &e);
    const bool there = PlaceClump(
        around, members.data(), static_cast<int>(members.size()),
        [&](int k) -> Grain& { return w.grains[w.index_of[e.first_id + k]]; }, e);
    if (!there) w.fault = StepFault::kNonFinite;
  }
}

void ClumpPass::StepBack(SimulationState& w) {
  const ClumpSurroundings around = Around(w);
  for (ClumpEntry& e : w.clumps) StepClumpBack(around, &e);
}

double ClumpPass::Kinetic(const SimulationState& w) {
  const double half = w.started ? 0.5 * w.config.dt_s : 0.0;
  double sum = 0;
  for (const ClumpEntry& e : w.clumps) {
    const Vec3d v = dem::Add(e.state.velocity_m_per_s, Scale(half / e.mass_kg, e.force));
    const Vec3d l = dem::Add(e.angular_momentum, Scale(half, e.moment));
    sum += 0.5 * e.mass_kg * DotD(v, v) + 0.5 * DotD(l, SpinOf(e.state.orientation, l, e.inertia));
  }
  return sum;
}

ClumpState World::Clump(std::int64_t c) const {
  const ClumpEntry& e = state_.clumps.at(c);
  const double half = state_.started ? 0.5 * state_.config.dt_s : 0.0;
  ClumpState s = e.state;
  s.position_m = Add(e.state.position_m, state_.config.origin_m);
  s.velocity_m_per_s = Add(s.velocity_m_per_s, Scale(half / e.mass_kg, e.force));
  s.spin_rad_per_s =
      SpinOf(s.orientation, Add(e.angular_momentum, Scale(half, e.moment)), e.inertia);
  return s;
}

}  // namespace grouser::dem

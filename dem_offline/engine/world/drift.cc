// Kick and drift of a World's grains, and the start of its leapfrog.
#include "dem_offline/engine/core/drift_body.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

DriftView DriftNumbers(const SimulationState& w) {
  DriftView v = {};
  v.dt = static_cast<float>(w.config.dt_s);
  v.drag = w.drag;
  v.planar = w.config.planar;
  const auto q = w.config.frame.Quantum();
  for (int a = 0; a < 3; ++a) {
    v.quantum[a] = q[a];
    v.per_quantum[a] = v.dt / q[a];
    v.gravity_dt[a] = static_cast<float>(w.config.gravity_m_per_s2[a]) * v.dt;
  }
  return v;
}

StepFault World::Drift() {
  ClumpPass::Move(state_);
  if (state_.count == 0) return StepFault::kNone;
  DriftView v = DriftNumbers(state_);
  v.grains = state_.grains.data();
  v.loads = state_.loads.data();
  v.kinetics = state_.kinetics.data();
  v.bounds = state_.bounds.data();
  v.idle = state_.idle.empty() ? nullptr : state_.idle.data();
  const DriftKernelFn drift = KernelsFor(nullptr, state_.combination, false).drift;
  const int size = state_.team.size();
  std::vector<DriftFound> found(size);
  const auto tiles = static_cast<std::int64_t>(state_.grains.size()) / kLanes;
  state_.team.Run([&](int part) {
    DriftFound f;
    drift(v, tiles * part / size, tiles * (part + 1) / size, &f);
    found[part] = f;
  });
  for (const DriftFound& f : found) {
    if (!f.finite) return StepFault::kNonFinite;
  }
  for (const DriftFound& f : found) {
    if (!f.apart) return StepFault::kOverlap;
    if (!f.slow) return StepFault::kTooFast;
    state_.inner_stale |= f.beyond;
  }
  return state_.fault;
}

void World::Start() {
  if (state_.started) return;
  state_.started = true;
  Forces();
  state_.energy = EnergySums{};
  state_.energy.stored = state_.step_energy.stored;
  StepAllBack();
}

/// Velocities of the present time to the half step before.
void World::StepAllBack() {
  const float half = 0.5f * static_cast<float>(state_.config.dt_s);
  float gravity[3];
  for (int a = 0; a < 3; ++a) gravity[a] = static_cast<float>(state_.config.gravity_m_per_s2[a]);
  for (std::int64_t i = 0; i < state_.count; ++i) {
    Grain& g = state_.grains[i];
    if (g.kind & kHeld) continue;
    StepBack(gravity, half, static_cast<float>(state_.config.inertia_factor), state_.config.planar,
             state_.loads[i], &g);
  }
  ClumpPass::StepBack(state_);
  BodyPass::StepBack(state_);
}

void World::SetTimeStep(double dt_s) {
  if (!(dt_s > 0)) throw std::invalid_argument("dt_s: expected > 0");
  const double before = state_.config.dt_s;
  state_.earlier_s += static_cast<double>(state_.steps) * (before - dt_s);
  if (state_.started) {
    state_.config.dt_s = dt_s - before;  // from one half step to the other
    StepAllBack();
  }
  state_.config.dt_s = dt_s;
  CheckGuard();
}

}  // namespace grouser::dem

// Kick and drift of a World's grains, and the start of its leapfrog.
#include "dem_offline/engine/core/drift_body.h"
#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {

StepFault World::Drift() {
  ClumpPass::Move(*this);
  if (count_ == 0) return StepFault::kNone;
  DriftView v = {};
  v.grains = grains_.data();
  v.loads = loads_.data();
  v.kinetics = kinetics_.data();
  v.bounds = bounds_.data();
  v.idle = idle_.empty() ? nullptr : idle_.data();
  v.dt = static_cast<float>(config_.dt_s);
  v.drag = drag_;
  const auto q = config_.frame.Quantum();
  for (int a = 0; a < 3; ++a) {
    v.quantum[a] = q[a];
    v.per_quantum[a] = v.dt / q[a];
    v.gravity_dt[a] = static_cast<float>(config_.gravity_m_per_s2[a]) * v.dt;
  }
  v.planar = config_.planar;
  const DriftKernelFn drift = KernelsFor(nullptr, combination_, false).drift;
  const int size = parts_->team.size();
  std::vector<DriftFound> found(size);
  const auto tiles = static_cast<std::int64_t>(grains_.size()) / kLanes;
  parts_->team.Run([&](int part) {
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
    inner_stale_ |= f.beyond;
  }
  return fault_;
}

void World::Start() {
  if (started_) return;
  started_ = true;
  Forces();
  energy_ = EnergySums{};
  energy_.stored = step_energy_.stored;
  const float half = 0.5f * static_cast<float>(config_.dt_s);
  float gravity[3];
  for (int a = 0; a < 3; ++a) gravity[a] = static_cast<float>(config_.gravity_m_per_s2[a]);
  for (std::int64_t i = 0; i < count_; ++i) {
    Grain& g = grains_[i];
    if (g.kind & kHeld) continue;
    StepBack(gravity, half, static_cast<float>(config_.inertia_factor), config_.planar, loads_[i],
             &g);
  }
  ClumpPass::StepBack(*this);
  BodyPass::StepBack(*this);
}

}  // namespace grouser::dem

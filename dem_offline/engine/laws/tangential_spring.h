#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// One step of a tangential spring kept as a force, with a dashpot beside it
/// and a cap on the whole.
///   held <- held min(1, k_t/k_t_old) - k_t v_t dt
///   |held| > cap: held <- cap held/|held| (sliding: no damping)
///   else force = held - c v_t, cut to the cap
/// A spring that softens keeps its stretch, one that stiffens its force: a
/// contact pressed and released can then only lose energy.
/// held: on i [N]; k_t, k_t_old [N/m] now and a step ago (0: new contact);
/// cap [N]; c [N s/m].
GROUSER_HD TangentialTerms StepSpring(float kt, float kt_old, float cap, float c,
                                      const ContactGeometry& g, Vec3f v_t, float dt, Vec3f& held) {
  const float ratio = kt_old > 0.0f ? kt / Max(kt_old, 1e-30f) : 1.0f;
  const Vec3f turned = TurnIntoPlane(held, g.n);
  const Vec3f kept = Min(ratio, 1.0f) * turned;
  const Vec3f trial = kept - (kt * dt) * v_t;
  // Either the spring slides, and no dashpot acts, or spring and dashpot
  // together are cut: one root and one division serve both.
  const bool slides = Dot(trial, trial) > cap * cap;
  const Vec3f both = trial - (slides ? 0.0f : c) * v_t;
  const float size2 = Dot(both, both);
  const float cut = size2 > cap * cap ? cap / Max(Sqrt(size2), 1e-30f) : 1.0f;
  const float scale = slides ? cut : 1.0f;
  const Vec3f elastic = scale * trial;
  TangentialTerms out;
  out.force = cut * both;
  // Bookkeeping. Work put in by v_t dt, against the mean of the force before
  // and after (the leapfrog's own work), goes to storage, to sliding, and to
  // the spring's change of stiffness (the whole store where a neck snaps).
  // With the force after alone, slip that comes while a contact lets go, as it
  // mostly does, would be booked too low by a share of the order of dt.
  const float flex = 1.0f / Max(kt, 1e-30f);
  const float before = kt_old > 0.0f ? 0.5f * Dot(turned, turned) / Max(kt_old, 1e-30f) : 0.0f;
  const float change = before * (1.0f - (ratio < 1.0f ? ratio : 1.0f / ratio));
  out.stored = 0.5f * flex * Dot(elastic, elastic);
  out.slip_work =
      0.5f * flex *
          ((1.0f - scale) * Dot(trial, kept + elastic) + Dot(turned - kept, trial - kept)) +
      change;
  out.damping_power = Dot(elastic - out.force, v_t);
  held = elastic;
  return out;
}

}  // namespace grouser::dem

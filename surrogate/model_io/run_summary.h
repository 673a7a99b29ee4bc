#pragma once

#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// How near a new run counts as near a state: on the unit sphere of (v_x, v_y, r w), and in ln load
/// (ln 1.5). Beyond, a refit may not change the answers (gate.h).
inline constexpr double kNearDirection = 0.3, kNearLogLoad = 0.405;

/// TRAIN where the summary names none.
v1alpha1::RunRole RoleOf(const v1alpha1::RunSummary& run);

/// Whether the means count as a sample: steady, or not steady and the means of the window to its
/// end are known (which summaries of before those were kept do not say).
bool HasUsableMeans(const v1alpha1::RunSummary& run);

/// The motion of a run; a run without a speed is taken at `otherwise` [m/s]. NaN: of a damaged one.
VelocityState MotionOf(const v1alpha1::RunSummary& run, double otherwise);

/// What is wrong with a summary: "FIELD: what, expected ..."; empty: nothing. It has six finite
/// means and standard errors, a motion, a positive load, and stresses that are none or a profile.
std::string DamageOf(const v1alpha1::RunSummary& run);
/// The same of its stresses alone: as many bins of either, all finite, a positive step, once round
/// the wheel at most. No bins are no damage.
std::string StressDamageOf(const v1alpha1::RunSummary& run);

/// Whether there are bins, with stress in any. Precondition: no StressDamageOf.
bool HasStress(const v1alpha1::RunSummary& run);

/// The stresses as seen when forward is where backward was: angles and tangential stresses change
/// sign.
void MirrorStress(v1alpha1::StressSummary* stress);

}  // namespace grouser::surrogate

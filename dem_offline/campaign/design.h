#pragma once

#include <functional>
#include <string>

#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Reads a campaign file (*.campaign.yaml) and expands it into runs:
///
///   name: demo
///   scene: cmu_smooth_demo.scene.yaml   # beside this file, or a mapping
///   mode: rim                           # rim (default), towed or free
///   seeds: [1]                          # of grid, extra and held_out
///   grid:                               # one mapping or a list; TRAIN
///     slip: [-0.2, 0.2]                 # rim only; free: drawbar_n
///     attack_angle_deg: [0, 30]         # rim, towed
///     load_n: [24]
///   extra:                              # further TRAIN states
///     - {slip: 0.5, attack_angle_deg: 90, load_n: 24, seed: 2}
///   held_out:                           # TEST states, never shown to a fitter
///     - {slip: 0.3, attack_angle_deg: 15, load_n: 20}
///   patch:                              # PATCH: one state, further seeds
///     - {slip: 0.2, attack_angle_deg: 30, load_n: 24, seeds: [2, 3]}
///
/// A list entry may name its own mode, seed and speed (speed_m_per_s, instead of the
/// rig's; grids too). Run ids depend on
/// `engine_version`. Throws InputError "FILE:LINE: key 'a.b': got X, expected
/// Y", also for a run that is planned twice and for a held-out state that is
/// trained on. `within`: the folder that scene and soil may not leave; empty: none.
v1alpha1::Campaign LoadCampaign(const std::string& file, const std::string& engine_version,
                                const std::string& within = "");

/// What one planned run asks of the engine.
v1alpha1::WheelTestSpec SpecOf(const v1alpha1::Campaign& campaign, const v1alpha1::PlannedRun& run);

/// For people: "slip 0.3, 30 deg, 24 N, seed 1".
std::string Describe(const v1alpha1::TestState& state, std::uint64_t seed);

/// "rim", "towed", "free" -> mode; false for anything else.
bool ParseMode(const std::string& text, v1alpha1::RigMode* mode);

}  // namespace grouser::campaign

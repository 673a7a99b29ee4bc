#pragma once

#include <functional>
#include <string>

#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Reads a campaign file (*.campaign.yaml, docs/scene-files.md) and expands it into runs: of `grid`
/// and `extra` to train on, of `held_out` for tests, of `patch`. Run ids depend on
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

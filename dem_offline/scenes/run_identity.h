#pragma once

#include <string>

#include "grouser/v1alpha1/run.pb.h"

namespace grouser::campaign {

/// First 16 hex digits of the SHA-256 of everything that determines a run's
/// result: the spec without names, sources and Bekker numbers, and the
/// engine's version. Equal physics has one id, whatever people call it.
std::string RunId(const v1alpha1::WheelTestSpec& spec, const std::string& engine_version);

/// The same, all 64 digits, of what determines the settled tile: grains,
/// gravity, bed sizes, time-step fraction, seed, engine version.
std::string TileKey(const v1alpha1::WheelTestSpec& spec, const std::string& engine_version);

}  // namespace grouser::campaign

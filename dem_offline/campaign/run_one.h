#pragma once

#include <optional>
#include <string>

#include "dem_offline/campaign/backend.h"
#include "dem_offline/campaign/tile_store.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {

/// A result with all that belongs into its file.
records::RunFile FileOf(const Backend& backend, const v1alpha1::WheelTestSpec& spec,
                        const StoredTile& tile, const dem::WheelTestResult& result);

/// Runs one wheel test on a settled tile. Nothing when `progress` asked to
/// stop before the run had ended.
std::optional<records::RunFile> RunOnTile(const Backend& backend,
                                          const v1alpha1::WheelTestSpec& spec,
                                          const StoredTile& tile, const dem::ProgressFn& progress);

}  // namespace grouser::campaign

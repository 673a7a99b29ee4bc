#pragma once

#include <atomic>
#include <string>

#include "dem_offline/campaign/backend.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// How fast one core of this machine is at a campaign's first run.
struct Pace {
  double tile_s = 0;             ///< to settle its tile
  double grain_steps_per_s = 0;  ///< of the wheel test, all grains present
};
/// Settles the run's tile and runs it for so many seconds. Throws Stopped, std::runtime_error for a
/// run that fails within that time, and what the engine throws.
Pace MeasurePace(const Backend& backend, const v1alpha1::WheelTestSpec& spec, double seconds,
                 const std::atomic<bool>& stop);

/// What a campaign takes at most: runs end earlier where their means are precise.
struct CampaignCost {
  int runs = 0, held_out = 0, tiles = 0;
  double grains = 0, bytes = 0;  ///< of the largest run
  double grain_steps = 0, longest = 0;

  /// On so many cores [s]: tiles and runs, no less than the longest with its tile.
  double Seconds(const Pace& pace, int cores) const;
};
CampaignCost CostOf(const v1alpha1::Campaign& campaign);

/// For people, several lines.
std::string CostText(const v1alpha1::Campaign& campaign, const Pace& pace, int cores);

}  // namespace grouser::campaign

#include "dem_offline/campaign/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <stdexcept>

#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/campaign/tile_store.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/run_identity.h"

namespace grouser::campaign {

Pace MeasurePace(const Backend& backend, const v1alpha1::WheelTestSpec& spec, double seconds,
                 const std::atomic<bool>& stop) {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  const dem::WheelTestSpec test = ToEngine(spec);
  backend.validate(test);
  Pace pace;
  dem::Tile tile;
  auto begin = Clock::now();
  try {
    tile = backend.prepare_bed(dem::BedOf(test),
                               [&](double, const std::string&) { return !stop.load(); });
  } catch (const std::exception&) {
    if (stop) throw Stopped{};  // the engine throws where it is stopped in a bed
    throw;
  }
  if (stop) throw Stopped{};
  pace.tile_s = since(begin);
  begin = Clock::now();
  const dem::WheelTestResult result = backend.run(test, tile, [&](double, const std::string&) {
    return !stop.load() && since(begin) < seconds;
  });
  if (stop) throw Stopped{};
  if (!(result.particle_steps > 0)) {
    throw std::runtime_error("the first run gave no pace: " + result.reason);
  }
  pace.grain_steps_per_s = result.particle_steps / since(begin);
  return pace;
}

CampaignCost CostOf(const v1alpha1::Campaign& campaign) {
  CampaignCost cost;
  std::set<std::string> tiles;
  for (const v1alpha1::PlannedRun& run : campaign.runs()) {
    const v1alpha1::WheelTestSpec spec = SpecOf(campaign, run);
    const dem::Work work = dem::WorkOf(ToEngine(spec));
    ++cost.runs;
    cost.held_out += run.role() == v1alpha1::RUN_ROLE_TEST;
    tiles.insert(TileKey(spec, ""));
    cost.grains = std::max(cost.grains, work.grains);
    cost.bytes = std::max(cost.bytes, work.bytes);
    cost.grain_steps += work.grains * work.steps;
    cost.longest = std::max(cost.longest, work.grains * work.steps);
  }
  cost.tiles = static_cast<int>(tiles.size());
  return cost;
}

double CampaignCost::Seconds(const Pace& pace, int cores) const {
  const double all = tiles * pace.tile_s + grain_steps / pace.grain_steps_per_s;
  return std::max(all / cores, pace.tile_s + longest / pace.grain_steps_per_s);
}

std::string CostText(const v1alpha1::Campaign& campaign, const Pace& pace, int cores) {
  const CampaignCost cost = CostOf(campaign);
  std::string text = fmt::format("campaign     {}\n", campaign.name());
  text += fmt::format("runs         {}, {} of them held out, on {} tiles\n", cost.runs,
                      cost.held_out, cost.tiles);
  text += fmt::format("grains       {:.0f} at most\n", cost.grains);
  text += fmt::format("memory       {:.0f} MiB at most, each run\n", cost.bytes / 1048576.0);
  text += fmt::format("speed here   {:.3g} grain-steps/s, a tile in {}, one core (the first run)\n",
                      pace.grain_steps_per_s, ForPeople(pace.tile_s));
  text += fmt::format("time         {} on {} cores, {} on one; the longest run {}; at most\n",
                      ForPeople(cost.Seconds(pace, cores)), cores, ForPeople(cost.Seconds(pace, 1)),
                      ForPeople(cost.longest / pace.grain_steps_per_s));
  return text;
}

}  // namespace grouser::campaign

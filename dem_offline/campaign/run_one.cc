#include "dem_offline/campaign/run_one.h"

#include <google/protobuf/util/time_util.h>

#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/run_identity.h"

namespace grouser::campaign {

records::RunFile FileOf(const Backend& backend, const v1alpha1::WheelTestSpec& spec,
                        const StoredTile& tile, const dem::WheelTestResult& result) {
  RunContext context;
  context.spec = spec;
  context.run_id = RunId(spec, backend.engine_version);
  context.tile_sha256 = tile.sha256;
  context.engine_version = backend.engine_version;
  context.isa = backend.isa;
  context.created = google::protobuf::util::TimeUtil::GetCurrentTime();
  return ToRunFile(context, tile.tile, result);
}

std::optional<records::RunFile> RunOnTile(const Backend& backend,
                                          const v1alpha1::WheelTestSpec& spec,
                                          const StoredTile& tile, const dem::ProgressFn& progress) {
  bool stopped = false;
  const dem::ProgressFn watched = [&](double fraction, const std::string& stage) {
    stopped = stopped || !progress(fraction, stage);
    return !stopped;
  };
  const dem::WheelTestResult result = backend.run(ToEngine(spec), tile.tile, watched);
  // FAILED "stopped by caller" says nothing about the soil: it is not a result.
  if (stopped && result.status == dem::RunStatus::kFailed) return std::nullopt;
  return FileOf(backend, spec, tile, result);
}

}  // namespace grouser::campaign

#include "dem_offline/campaign/tile_store.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <utility>

#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/run_identity.h"
#include "proto/records/os/regular_file.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {

TileStore::TileStore(std::string folder, const Backend* backend)
    : folder_(std::move(folder)), backend_(backend) {
  if (!folder_.empty()) std::filesystem::create_directories(folder_);
}

std::shared_ptr<const StoredTile> TileStore::Get(const v1alpha1::WheelTestSpec& spec,
                                                 const dem::ProgressFn& progress) {
  const std::string key = TileKey(spec, backend_->engine_version);
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !busy_.count(key); });
  if (const auto found = ready_.find(key); found != ready_.end()) return found->second;
  busy_.insert(key);
  lock.unlock();
  std::shared_ptr<const StoredTile> tile;
  std::exception_ptr error;
  try {
    tile = LoadOrPrepare(key, spec, progress);
  } catch (...) {
    error = std::current_exception();
  }
  lock.lock();
  busy_.erase(key);
  if (tile) ready_[key] = tile;
  changed_.notify_all();
  if (error) std::rethrow_exception(error);
  return tile;
}

std::shared_ptr<const StoredTile> TileStore::LoadOrPrepare(const std::string& key,
                                                           const v1alpha1::WheelTestSpec& spec,
                                                           const dem::ProgressFn& progress) {
  const std::string path = folder_ + "/" + key + ".tile.h5";
  if (folder_.empty() || !std::filesystem::exists(path)) return Prepare(spec, key, progress);
  try {
    auto stored = std::make_shared<StoredTile>();
    stored->tile = ToTile(records::ReadTileFile(path), key, path);
    stored->sha256 = records::Sha256OfFile(path);
    return stored;
  } catch (const std::exception& error) {
    spdlog::warn("{}; set aside as {}, settling this tile again", error.what(), os::SetAside(path));
  }
  return Prepare(spec, key, progress);
}

std::shared_ptr<const StoredTile> TileStore::Prepare(const v1alpha1::WheelTestSpec& spec,
                                                     const std::string& key,
                                                     const dem::ProgressFn& progress) {
  bool stopped = false;
  const dem::ProgressFn watched = [&](double fraction, const std::string& stage) {
    stopped = stopped || !progress(fraction, stage);
    return !stopped;
  };
  auto stored = std::make_shared<StoredTile>();
  try {
    stored->tile = backend_->prepare_bed(dem::BedOf(ToEngine(spec)), watched);
  } catch (const std::exception&) {
    if (stopped) throw Stopped{};
    throw;
  }
  if (stopped) throw Stopped{};
  if (folder_.empty()) return stored;
  const std::string path = folder_ + "/" + key + ".tile.h5";
  records::WriteTileFile(path, ToTileFile(stored->tile, key));
  stored->sha256 = records::Sha256OfFile(path);
  return stored;
}

}  // namespace grouser::campaign

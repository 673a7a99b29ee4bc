#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "dem_offline/campaign/backend.h"
#include "grouser/v1alpha1/run.pb.h"

namespace grouser::campaign {

/// A settled tile and the hash of the file that it is kept in.
struct StoredTile {
  dem::Tile tile;
  std::string sha256;
};

/// The work was stopped by the caller; nothing was stored.
struct Stopped {};

/// Settled tiles by key (TileKey), in memory and as FOLDER/KEY.tile.h5. Each is
/// prepared once, by the first who asks; others wait for it. An unreadable
/// tile file is set aside. Thread-safe.
class TileStore {
 public:
  /// Creates `folder` if need be. An empty name keeps tiles in memory only.
  TileStore(std::string folder, const Backend* backend);

  /// Throws Stopped when `progress` returned false while settling, and what
  /// the engine or the disk throws.
  std::shared_ptr<const StoredTile> Get(const v1alpha1::WheelTestSpec& spec,
                                        const dem::ProgressFn& progress);

 private:
  std::shared_ptr<const StoredTile> LoadOrPrepare(const std::string& key,
                                                  const v1alpha1::WheelTestSpec& spec,
                                                  const dem::ProgressFn& progress);
  std::shared_ptr<const StoredTile> Prepare(const v1alpha1::WheelTestSpec& spec,
                                            const std::string& key,
                                            const dem::ProgressFn& progress);
  std::string folder_;
  const Backend* backend_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::shared_ptr<const StoredTile>> ready_;
  std::set<std::string> busy_;
};

}  // namespace grouser::campaign

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/campaign.pb.h"
#include "proto/records/os/unique_fd.h"

namespace grouser::campaign {

/// The layout of a campaign folder: campaign.json, runs/RUNID.run.h5,
/// tiles/KEY.tile.h5, index.sqlite, lock.
class RunFolder {
 public:
  explicit RunFolder(std::string path) : path_(std::move(path)) {}

  /// Makes the sub-folders (tiles: of beds as well). Throws std::runtime_error naming the path.
  void Create(bool tiles = true) const;
  /// One campaign run at a time. Throws std::runtime_error "PATH: in use by
  /// process N ..." when another process holds the lock.
  os::UniqueFd Lock() const;
  /// Removes what killed writers left behind. Only under the lock.
  void RemoveTemporaries() const;

  /// InputError when there is no campaign.json, or one that is not readable.
  v1alpha1::Campaign ReadCampaign() const;
  bool HasCampaign() const;
  void WriteCampaign(const v1alpha1::Campaign& campaign) const;

  std::string RunPath(const std::string& run_id) const;
  /// Base names in runs/ that end in .run.h5, sorted.
  std::vector<std::string> RunFiles() const;
  std::string TileFolder() const { return path_ + "/tiles"; }
  std::string IndexPath() const { return path_ + "/index.sqlite"; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace grouser::campaign

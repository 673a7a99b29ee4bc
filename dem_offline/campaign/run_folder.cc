#include "dem_offline/campaign/run_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "proto/records/os/file_lock.h"

namespace grouser::campaign {
namespace {

namespace fs = std::filesystem;

constexpr char kRunEnding[] = ".run.h5";

void RemoveTemporariesIn(const fs::path& folder, std::chrono::hours older_than) {
  std::error_code ignored;
  const auto now = fs::file_time_type::clock::now();
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (!entry.path().filename().string().ends_with(records::kTemporarySuffix)) continue;
    const auto written = entry.last_write_time(ignored);
    if (!ignored && now - written >= older_than) fs::remove(entry.path(), ignored);
  }
}

}  // namespace

void RunFolder::Create(bool tiles) const {
  std::error_code error;
  for (const char* name : {"runs", "tiles"}) {
    if (!tiles && std::string_view(name) == "tiles") continue;
    fs::create_directories(fs::path(path_) / name, error);
    if (error) {
      throw std::runtime_error(
          fmt::format("{}/{}: cannot create: {}", path_, name, error.message()));
    }
  }
}

os::UniqueFd RunFolder::Lock() const {
  const std::string path = path_ + "/lock";
  os::UniqueFd lock = os::LockWithin(path, os::kSpawnS);
  if (!lock.valid()) {
    throw std::runtime_error(
        fmt::format("{}: in use by another campaign run (process {}); wait for it, stop it, or "
                    "choose another --out",
                    path_, fmt::join(os::HoldersOf(path), " ")));
  }
  return lock;
}

void RunFolder::RemoveTemporaries() const {
  RemoveTemporariesIn(path_, std::chrono::hours(0));
  RemoveTemporariesIn(fs::path(path_) / "runs", std::chrono::hours(0));
  // Single runs may write to the tiles of a campaign without its lock.
  RemoveTemporariesIn(TileFolder(), std::chrono::hours(1));
}

bool RunFolder::HasCampaign() const { return fs::exists(path_ + "/campaign.json"); }

v1alpha1::Campaign RunFolder::ReadCampaign() const {
  const std::string path = path_ + "/campaign.json";
  if (!HasCampaign()) {
    throw InputError(path + ": no such file; expected a folder made by 'grouser-dem campaign run'");
  }
  try {
    v1alpha1::Campaign campaign;
    records::FromJson(records::ReadFileBytes(path), path, &campaign, /*earlier=*/true);
    return campaign;
  } catch (const std::exception& error) {
    throw InputError(error.what());
  }
}

void RunFolder::WriteCampaign(const v1alpha1::Campaign& campaign) const {
  records::WriteFileDurably(path_ + "/campaign.json", records::ToJson(campaign, /*indented=*/true));
}

std::string RunFolder::RunPath(const std::string& run_id) const {
  return path_ + "/runs/" + run_id + kRunEnding;
}

std::vector<std::string> RunFolder::RunFiles() const {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path_ + "/runs", error)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(kRunEnding)) names.push_back(name);
  }
  if (error) throw InputError(fmt::format("{}/runs: {}", path_, error.message()));
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace grouser::campaign

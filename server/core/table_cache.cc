#include "server/core/table_cache.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "proto/records/durable_file.h"
#include "proto/records/os/file_lock.h"
#include "proto/records/os/regular_file.h"
#include "proto/records/sha256.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "GROUSERTABLE\n001";
constexpr std::size_t kHex = 64, kHeader = kMagic.size() + 2 * kHex;
constexpr double kAbandonedS = 3600;  // writers take less than a second

struct File {
  fs::path path;
  std::uint64_t bytes;
  double modified_s;
};

/// Regular files of a folder, the oldest first; none where it cannot be read.
std::vector<File> FilesOf(const std::string& folder) {
  std::vector<File> files;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    struct stat info {};
    if (::lstat(it->path().c_str(), &info) != 0 || !S_ISREG(info.st_mode)) continue;
    files.push_back({it->path(), static_cast<std::uint64_t>(info.st_size),
                     static_cast<double>(info.st_mtim.tv_sec) + 1e-9 * info.st_mtim.tv_nsec});
  }
  std::ranges::sort(files, {}, &File::modified_s);
  return files;
}

std::uint64_t BytesOf(const std::vector<File>& files) {
  std::uint64_t sum = 0;
  for (const File& file : files) sum += file.bytes;
  return sum;
}

}  // namespace

TableCache::TableCache(std::string folder, std::uint64_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {}

surrogate::KeptTable TableCache::Of(const std::string& digest) {
  if (max_bytes_ == 0) return {};
  return {
      [this, digest](const std::string& key, std::size_t size) { return Read(digest, key, size); },
      [this, digest](const std::string& key, const std::string& bytes) {
        Keep(digest, key, bytes);
      }};
}

std::string TableCache::Read(const std::string& digest, const std::string& key, std::size_t size) {
  Use();
  const std::string path = PathOf(digest);
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return "";
  try {
    std::string file = records::ReadFileBytes(path, kHeader + size);
    const std::string_view all = file;
    const std::string of_key = records::Sha256OfString(key);
    const bool ours = all.starts_with(kMagic) && all.substr(kMagic.size()).starts_with(of_key);
    // Of another version, or of a message that is read otherwise today.
    if (!ours && all.starts_with(kMagic.substr(0, kMagic.size() - 3))) return "";
    if (!ours) throw std::runtime_error(path + ": no table of this program");
    if (all.size() != kHeader + size) throw std::runtime_error(path + ": truncated");
    const std::string_view bytes = all.substr(kHeader);
    if (records::Sha256OfString(bytes) != all.substr(kMagic.size() + kHex, kHex)) {
      throw std::runtime_error(path + ": its checksum does not hold");
    }
    file.erase(0, kHeader);
    return file;
  } catch (const std::exception& e) {
    Tell(path, std::string("table: ") + e.what() + "; made anew");
    return "";
  }
}

void TableCache::Keep(const std::string& digest, const std::string& key, const std::string& bytes) {
  const std::string path = PathOf(digest);
  try {
    std::vector<File> others = FilesOf(folder_);
    std::erase_if(others, [&](const File& file) { return file.path == path; });
    if (BytesOf(others) + kHeader + bytes.size() > max_bytes_) {
      return Tell("room", "tables: no room in " + folder_ + " for all models within " +
                              std::to_string(max_bytes_ / 1'000'000) +
                              " MB: others are made at every start");
    }
    fs::create_directories(folder_);
    Use();
    std::string file(kMagic);
    file.append(records::Sha256OfString(key)).append(records::Sha256OfString(bytes)).append(bytes);
    records::WriteFileUnsynced(path, file);
  } catch (const std::exception& e) {
    Tell("write", std::string("tables: cannot be kept, and are made at every start: ") + e.what());
  }
}

void TableCache::Use() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (lock_.valid()) return;
  try {
    lock_ = os::OpenRegular(folder_ + "/.lock", O_RDWR | O_CREAT);
    if (::flock(lock_.get(), LOCK_SH | LOCK_NB) != 0) lock_.Reset();  // another prunes just now
  } catch (const std::exception&) {
    // No folder yet, or no right to write there: then nothing of it is used, or nothing is pruned.
  }
}

/// Valid where no other server has the lock; from then on none can take it. Held until this server
/// shares the lock again: flock(2) gives the shared lock up before it asks for the other, so that
/// of two that did so at once one would find nobody.
os::UniqueFd TableCache::ClaimAlone() {
  Use();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!lock_.valid()) return {};
  os::UniqueFd claim;
  try {
    claim = os::TryLock(folder_ + "/.pruning");
  } catch (const std::exception&) {
    // No right to write there: then nothing can be removed either.
  }
  if (!claim.valid()) return {};
  if (::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0) return claim;
  // What was shared before may be gone now.
  if (::flock(lock_.get(), LOCK_SH | LOCK_NB) != 0) lock_.Reset();
  return {};
}

void TableCache::Prune(const std::set<std::string>& digests) {
  std::vector<File> files = FilesOf(folder_);
  if (files.empty()) return;
  const os::UniqueFd claim = ClaimAlone();
  if (!claim.valid()) return;
  const auto now = static_cast<double>(std::time(nullptr));
  std::uint64_t bytes = BytesOf(files);
  // First what is of no model, then the oldest.
  const auto useless = [&](const File& file) {
    if (file.path.extension() == ".table") return !digests.contains(file.path.stem().string());
    return file.path.extension() == records::kTemporarySuffix &&
           file.modified_s < now - kAbandonedS;
  };
  std::ranges::stable_partition(files, useless);
  for (const File& file : files) {
    if (!useless(file) && (bytes <= max_bytes_ || file.path.extension() != ".table")) continue;
    std::error_code error;
    if (fs::remove(file.path, error)) bytes -= file.bytes;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (max_bytes_ == 0 || ::flock(lock_.get(), LOCK_SH | LOCK_NB) != 0) lock_.Reset();
}

void TableCache::Tell(const std::string& about, const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (told_.insert(about).second) news_.push_back(what);
}

std::vector<std::string> TableCache::TakeNews() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(news_, {});
}

}  // namespace grouser::server

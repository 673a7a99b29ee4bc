#pragma once

#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "proto/records/os/unique_fd.h"
#include "surrogate/model_io/load_model.h"

namespace grouser::server {

/// Tables that models answer with (surrogate::KeptTable), kept in a folder as DIGEST.table so that
/// a start need not make them. Anybody may delete the folder or a file at any time. Header: magic
/// and version (16 bytes), SHA-256 of the key and of the numbers (64 hex digits each). What is
/// damaged or of another key is made anew and replaced; where nothing can be written all is made
/// anew. Read into memory and not mapped: a file that somebody truncates would end the program. Any
/// thread.
class TableCache {
 public:
  /// `max_bytes` of all files; 0: keeps nothing and reads nothing. Touches no file.
  TableCache(std::string folder, std::uint64_t max_bytes);

  surrogate::KeptTable Of(const std::string& digest);

  /// Removes tables of models other than `digests`, what killed writers left, and the oldest beyond
  /// max_bytes; nothing while another server uses the folder, whose models may be others.
  void Prune(const std::set<std::string>& digests);

  /// What went wrong since the last call, worth a log line each: each damaged file, no room and no
  /// right to write are told once.
  std::vector<std::string> TakeNews();

 private:
  std::string PathOf(const std::string& digest) const { return folder_ + "/" + digest + ".table"; }
  std::string Read(const std::string& digest, const std::string& key, std::size_t size);
  void Keep(const std::string& digest, const std::string& key, const std::string& bytes);
  void Tell(const std::string& about, const std::string& what);
  void Use();
  os::UniqueFd ClaimAlone();

  std::string folder_;
  std::uint64_t max_bytes_;
  std::mutex mutex_;   // guards what follows
  os::UniqueFd lock_;  // of the folder's ".lock": shared while this server uses the tables
  std::vector<std::string> news_;
  std::set<std::string> told_;
};

}  // namespace grouser::server

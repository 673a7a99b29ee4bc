#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "grouser/v1alpha1/query_log.pb.h"
#include "proto/records/os/unique_fd.h"
#include "server/query/log/query_log_format.h"

namespace grouser::server {

struct QueryLogOptions {
  std::string file;                       ///< empty: nothing is logged
  std::uint64_t max_bytes = 100'000'000;  ///< of a file; a larger record has one of its own
  /// FILE, and those before it, FILE.1 the latest, to FILE.(files - 1).
  int files = 5;
  std::size_t most_waiting_bytes = std::size_t{64} << 20;  ///< of queries that wait to be written
};

/// A log that cannot be as it was asked for.
struct QueryLogRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes logged queries to FILE, mode 0600. When it would grow too large it becomes FILE.1, FILE.1
/// becomes FILE.2, and the oldest goes; so at the start as well, where a FILE has queries, for a
/// killed writer may have left half a record at its end. The header of a file is synced, once, and
/// nothing else: what was handed over survives the program's death, not a power cut. One thread.
class QueryLogFile {
 public:
  /// Each file's header says when that was begun. Throws QueryLogRefused "PATH: cause", and has
  /// changed no log, where FILE or one of the numbered ones is no query log, its folder is none, or
  /// another process writes it; std::runtime_error (os::NoSpace: the disk is full) where the system
  /// fails.
  QueryLogFile(QueryLogOptions options, v1alpha1::QueryLogHeader header);

  /// Adds a record: kFrameBytes of room, which it fills, then the message. Throws as Flush.
  void Append(std::span<std::uint8_t> framed);
  /// Hands all records to the system. Where that fails the file is cut back to the whole records
  /// that are there, what waited is lost, and std::runtime_error (os::NoSpace) is thrown.
  void Flush();

  std::uint64_t records() const { return records_; }  ///< that the system has
  std::uint64_t bytes() const { return all_bytes_; }  ///< of all files

 private:
  std::string Name(int age) const;
  void CheckNames() const;
  void Open();
  void MakeRoom();
  void Write(std::span<const std::uint8_t> bytes);

  QueryLogOptions options_;
  v1alpha1::QueryLogHeader header_;
  std::vector<std::uint8_t> head_;  ///< of FILE: magic and header
  os::UniqueFd lock_, fd_;
  std::vector<std::uint8_t> waiting_;
  std::uint64_t waiting_records_ = 0, records_ = 0, all_bytes_ = 0;
  std::uint64_t size_ = 0;  ///< of FILE: of whole records
};

}  // namespace grouser::server

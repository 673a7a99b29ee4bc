#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "grouser/v1alpha1/query_log.pb.h"
#include "proto/records/os/unique_fd.h"
#include "server/query/log/query_log_format.h"

namespace grouser::server {

/// Reads one file of logged queries, record by record.
class QueryLogReader {
 public:
  /// Throws std::runtime_error "PATH: cause, expected ..." for what is no query log, or has no
  /// whole header.
  explicit QueryLogReader(const std::string& path);

  const v1alpha1::QueryLogHeader& header() const { return header_; }

  /// How a file ends.
  enum class End {
    kWhole,    ///< after a whole record
    kCutOff,   ///< in the middle of one, as a kill or a full disk leaves it
    kDamaged,  ///< at one whose checksum is wrong, or that is no message
  };
  /// The next query; false at the end. Throws std::runtime_error where the file cannot be read.
  bool Next(v1alpha1::LoggedQuery* query);
  End end() const { return end_; }
  /// What is wrong where it ends otherwise than kWhole: "PATH: byte N: ...", and how many bytes
  /// were not read.
  const std::string& problem() const { return problem_; }

 private:
  bool ReadRecord(google::protobuf::Message* message);
  std::size_t Read(std::uint8_t* to, std::size_t bytes);
  bool Stop(End end, const std::string& why);

  std::string path_;
  os::UniqueFd fd_;
  std::uint64_t at_ = 0;  ///< of the record that is read next
  std::vector<std::uint8_t> bytes_;
  v1alpha1::QueryLogHeader header_;
  End end_ = End::kWhole;
  std::string problem_;
};

}  // namespace grouser::server

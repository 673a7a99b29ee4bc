#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace grouser::server {

/// A line `progress FRACTION [eta=SECONDS] STAGE` of a worker's standard error.
struct ProgressLine {
  double fraction = 0;
  std::string stage;
  std::optional<double> eta_s = std::nullopt;  ///< as the worker expects it
  bool operator==(const ProgressLine&) const = default;
};

/// Nothing where the line is none of those or the fraction is not in [0, 1].
std::optional<ProgressLine> ParseProgress(const std::string& line);

/// Follows a growing log file: a file, unlike a pipe, neither blocks the
/// worker nor is lost with its reader.
class ProgressTail {
 public:
  explicit ProgressTail(std::string path) : path_(std::move(path)) {}
  /// The last complete progress line that was not seen before, if any.
  std::optional<ProgressLine> Poll();

 private:
  std::string path_, partial_;
  std::int64_t offset_ = 0;
};

/// The last words of a log that are not progress, in printable ASCII, at most
/// `most` characters: why a worker failed.
std::string LastWords(const std::string& log_path, std::size_t most = 400);

}  // namespace grouser::server

#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/core/metric_page.h"
#include "server/core/metrics.h"
#include "server/core/status.h"
#include "surrogate/models/outputs.h"

namespace grouser::server {

class Snapshot;

/// Queries by how many states they have: classes 1, 2 to 16, 17 to 256, more.
inline constexpr std::array<int, 3> kSizeClassEnds = {1, 16, 256};
inline constexpr std::array<const char*, 4> kSizeClassNames = {"1", "2-16", "17-256", "257-10000"};

/// What one model answered. Any thread adds; no lock, no allocation.
class ModelCounters {
 public:
  void Add(std::span<const std::uint32_t> flags, std::chrono::nanoseconds spent);
  /// What another one counted.
  void Add(const ModelCounters& other);

 private:
  friend class QueryMetrics;

  std::array<DurationHistogram, kSizeClassNames.size()> spent_;  // its counts are the queries
  Counter states_;
  std::array<Counter, std::size(surrogate::kFlagFields)> flagged_;  // states with the flag
};

/// How a query came in.
enum class Transport { kUnary, kStream, kLcm };

/// Queries of wheel states: by model, flag and size, and what was refused. Answered() and
/// Refused() belong to the path of a query: any thread, no lock, no allocation.
class QueryMetrics {
 public:
  /// Names of models that have metrics of their own; further ones share the name "other".
  static constexpr std::size_t kMostModels = 64;

  void Answered(Transport transport, ModelCounters& model, std::span<const std::uint32_t> flags,
                std::chrono::nanoseconds spent) {
    Count(transport, StatusCode::kOk);
    model.Add(flags, spent);
  }
  void Refused(Transport transport, StatusCode code) { Count(transport, code); }

  /// What the models of a new snapshot counted is told from then on, also when they are gone.
  /// Not on the path of a query.
  void Adopt(const Snapshot& snapshot);

  void AddTo(MetricPage* page) const;

 private:
  static constexpr std::size_t kTransports = 3, kCodes = 17;

  void Count(Transport transport, StatusCode code) {
    by_code_[static_cast<std::size_t>(transport)][static_cast<std::size_t>(code)].Add();
  }

  std::array<std::array<Counter, kCodes>, kTransports> by_code_;
  mutable std::mutex mutex_;
  struct OfName {
    std::vector<std::shared_ptr<ModelCounters>> served;
    ModelCounters gone;  // the sum of those that nobody can ask any more
  };
  std::map<std::string, OfName> models_;
};

}  // namespace grouser::server

#pragma once

#include <grpcpp/server_context.h>

#include <array>
#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "server/core/metric_page.h"
#include "server/core/metrics.h"
#include "server/net/log_settings.h"

namespace grouser::server {

/// Why work was refused before it began.
enum class Refusal {
  kDraining,
  kCancelled,
  kTooLate,
  kQueueFull,
  kNoMemory,
  kConnectionFull,
  kBusy,
  kHttpBusy,
  kNoRights
};

/// Counts the unary calls of a program by method and outcome, and logs those that failed or
/// were slow, so few a second that no flood of bad requests fills a disk. Thread-safe.
class CallRecords {
 public:
  /// Lines a second on average, and at once.
  static constexpr double kLinesPerSecond = 5, kBurst = 50;

  struct Method {
    std::string name;  ///< "TerrainService/GetModel"
    std::array<Counter, 17> by_code;
    DurationHistogram spent;
  };

  CallRecords();

  /// All unary methods of a service, by its full name. Before any call.
  void AddService(const std::string& full_name);
  void SetLog(const LogSettings& settings) { log_ = settings; }

  /// By its name as above; one that was not added: "other". No lock, no allocation.
  Method& Of(std::string_view name);

  /// A call of `method` ends. Where it failed or was slow it is logged with its request id,
  /// which the client is told in the trailing metadata "x-request-id".
  void Ended(Method& method, grpc::CallbackServerContext& context, const grpc::Status& status,
             std::chrono::nanoseconds spent);
  void Refused(Refusal reason) { refused_[static_cast<std::size_t>(reason)].Add(); }

  /// A call of "/SERVICE/METHOD" that AccessPolicy refused before its service saw it.
  /// `peer`: where it came from; empty: not known.
  void NoRights(std::string_view path, const std::string& peer, std::string_view request_id,
                const grpc::Status& status);

  void AddTo(MetricPage* page) const;

 private:
  static constexpr std::size_t kRefusals = 9;

  void Log(const std::string& method, const std::string& peer, const std::string& request_id,
           const grpc::Status& status, std::chrono::nanoseconds spent, const char* reason);
  /// Whether a line may be written now; `left_out`: how many were not since the last one.
  bool MayLog(std::uint64_t* left_out);

  std::map<std::string, Method, std::less<>> methods_;
  Method* other_;
  std::array<Counter, kRefusals> refused_;
  LogSettings log_;
  Counter not_logged_;

  std::mutex mutex_;  // guards the rest
  double lines_ = kBurst;
  std::uint64_t left_out_ = 0;
  std::chrono::steady_clock::time_point refilled_ = std::chrono::steady_clock::now();
};

/// What a client gave as its id of a request, where that is 1 to 64 of A-Z a-z 0-9 . _ : -;
/// else 16 random hexadecimal digits.
std::string RequestIdOf(std::string_view given);

}  // namespace grouser::server

#include "server/net/call_records.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <random>

#include "proto/records/status_code.h"

namespace grouser::server {
namespace {

constexpr const char* kRequestId = "x-request-id";
constexpr std::size_t kMaxRequestId = 64;
constexpr std::size_t kMaxMessage = 500;
constexpr std::array<const char*, 9> kRefusalNames = {"draining",   "cancelled", "deadline",
                                                      "queue_full", "memory",    "connection",
                                                      "overload",   "http_busy", "rights"};

bool IsClientsFault(grpc::StatusCode code) {
  return code == grpc::StatusCode::INVALID_ARGUMENT || code == grpc::StatusCode::NOT_FOUND ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::ALREADY_EXISTS ||
         code == grpc::StatusCode::FAILED_PRECONDITION;
}

bool IsOfRequestId(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == ':' || c == '-';
}

}  // namespace

std::string RequestIdOf(std::string_view given) {
  if (!given.empty() && given.size() <= kMaxRequestId &&
      std::ranges::all_of(given, IsOfRequestId)) {
    return std::string(given);
  }
  thread_local std::mt19937_64 random{std::random_device{}()};
  return fmt::format("{:016x}", random());
}

CallRecords::CallRecords() {
  other_ = &methods_["other"];
  other_->name = "other";
}

void CallRecords::AddService(const std::string& full_name) {
  const auto* service =
      google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(full_name);
  for (int i = 0; service != nullptr && i < service->method_count(); ++i) {
    const auto& method = *service->method(i);
    if (method.client_streaming() || method.server_streaming()) continue;
    const std::string name = service->name() + "/" + method.name();
    methods_[name].name = name;
  }
}

CallRecords::Method& CallRecords::Of(std::string_view name) {
  const auto found = methods_.find(name);
  return found == methods_.end() ? *other_ : found->second;
}

void CallRecords::Ended(Method& method, grpc::CallbackServerContext& context,
                        const grpc::Status& status, std::chrono::nanoseconds spent) {
  method.by_code[std::min<std::size_t>(status.error_code(), method.by_code.size() - 1)].Add();
  method.spent.Add(spent);
  const bool slow = std::chrono::duration<double>(spent).count() > log_.slow_s;
  if (status.ok() && !slow) return;
  const auto& metadata = context.client_metadata();
  const auto given = metadata.find(kRequestId);
  const std::string request_id = RequestIdOf(
      given == metadata.end() ? std::string_view()
                              : std::string_view(given->second.data(), given->second.size()));
  context.AddTrailingMetadata(kRequestId, request_id);
  const std::string peer = context.peer();
  Log(method.name, peer.find(':') == std::string::npos ? "http" : peer, request_id, status, spent,
      nullptr);
}

void CallRecords::NoRights(std::string_view path, const std::string& peer,
                           std::string_view request_id, const grpc::Status& status) {
  Refused(Refusal::kNoRights);
  const auto package = path.rfind('.', path.find('/', 1));
  Log(Of(path.substr(package == std::string_view::npos ? 0 : package + 1)).name, peer,
      RequestIdOf(request_id), status, std::chrono::nanoseconds(0), "rights");
}

bool CallRecords::MayLog(std::uint64_t* left_out) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const double passed_s = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  lines_ = std::min(kBurst, lines_ + kLinesPerSecond * passed_s);
  if (lines_ < 1) {
    ++left_out_;
    not_logged_.Add();
    return false;
  }
  lines_ -= 1;
  *left_out = std::exchange(left_out_, 0);
  return true;
}

void CallRecords::Log(const std::string& method, const std::string& peer,
                      const std::string& request_id, const grpc::Status& status,
                      std::chrono::nanoseconds spent, const char* reason) {
  std::uint64_t left_out = 0;
  if (!MayLog(&left_out)) return;
  LogLine line(status.ok() || IsClientsFault(status.error_code()) ? spdlog::level::info
                                                                  : spdlog::level::warn);
  line.Add("method", method)
      .Add("code", records::StatusCodeName(status.error_code()))
      .Add("request_id", request_id);
  if (!peer.empty()) line.Add("peer", peer);
  if (reason != nullptr) {
    line.Add("reason", reason);
  } else {
    line.Add("duration_s", 1e-9 * static_cast<double>(spent.count()));
  }
  if (left_out > 0) line.Add("lines_left_out", static_cast<double>(left_out));
  line.Write(status.ok() ? "slow call" : status.error_message().substr(0, kMaxMessage));
}

void CallRecords::AddTo(MetricPage* page) const {
  const char* calls = "grouser_rpc_total";
  const char* calls_help = "Unary calls that ended, also those that came as JSON.";
  const char* spent = "grouser_rpc_duration_seconds";
  const char* spent_help = "Time from a call's start to its end in the server.";
  page->AddFamily(calls, calls_help, prometheus::MetricType::Counter);
  page->AddFamily(spent, spent_help, prometheus::MetricType::Histogram);
  for (const auto& [name, method] : methods_) {
    if (method.spent.count() == 0) continue;
    for (std::size_t c = 0; c < method.by_code.size(); ++c) {
      const auto count = method.by_code[c].value();
      if (count == 0) continue;
      page->AddCounter(calls, calls_help, static_cast<double>(count),
                       {{"method", name}, {"code", records::StatusCodeName(static_cast<int>(c))}});
    }
    page->AddDurations(spent, spent_help, method.spent, {{"method", name}});
  }
  for (std::size_t r = 0; r < kRefusals; ++r) {
    page->AddCounter("grouser_refusals_total", "Work that was refused before it began.",
                     static_cast<double>(refused_[r].value()), {{"reason", kRefusalNames[r]}});
  }
  page->AddCounter("grouser_log_lines_left_out_total",
                   "Lines about calls that were not logged, since too many came at once.",
                   static_cast<double>(not_logged_.value()));
}

}  // namespace grouser::server

#include "clients/cpp/client_error.h"

#include <charconv>

#include "clients/cpp/credentials.h"
#include "google/rpc/error_details.pb.h"
#include "proto/records/status_code.h"

namespace grouser::client {
namespace {

std::optional<Milliseconds> PushbackOf(const grpc::ClientContext& context) {
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto found = trailers.find("grpc-retry-pushback-ms");
  if (found == trailers.end()) return std::nullopt;
  const auto text = found->second;
  int ms = -1;  // negative: do not try again
  std::from_chars(text.data(), text.data() + text.size(), ms);
  if (ms < 0) return std::nullopt;
  return Milliseconds(ms);
}

}  // namespace

ClientError::ClientError(grpc::StatusCode code, const std::string& text,
                         std::optional<Milliseconds> retry_after)
    : std::runtime_error(records::StatusCodeName(code) + ": " + text),
      code_(code),
      retry_after_(retry_after) {}

std::optional<Milliseconds> RetryAfter(const google::rpc::Status& error) {
  google::rpc::RetryInfo retry;
  for (const auto& detail : error.details()) {
    if (!detail.UnpackTo(&retry)) continue;
    return Milliseconds(retry.retry_delay().seconds() * 1000 +
                        retry.retry_delay().nanos() / 1'000'000);
  }
  return std::nullopt;
}

void ThrowUnlessOk(const grpc::Status& status, const Server& server,
                   const grpc::ClientContext* context) {
  if (status.ok()) return;
  std::string text = status.error_message();
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    const std::string problem = TlsProblem(server);
    text += " (server " + server.address + "; " +
            (problem.empty() ? "is it running? ./grouser serve starts it" : problem) + ")";
  }
  if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED) {
    text += " (a caller shows who it is by --token-file, or by --tls-cert and --tls-key)";
  }
  throw ClientError(status.error_code(), text,
                    context != nullptr ? PushbackOf(*context) : std::nullopt);
}

}  // namespace grouser::client

#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "grouser/v1alpha1/operator_service.pb.h"
#include "server/net/grpc_server.h"
#include "server/net/http/http_options.h"
#include "server/net/http/http_server.h"
#include "server/net/http/json_calls.h"

namespace grouser::server {

/// What a program tells its operators of itself. Each is called on the loop and may answer
/// later, from any thread, once.
struct OperatorView {
  /// Why it is not ready; none: it is.
  std::function<void(std::function<void(std::vector<std::string>)> tell)> readiness;
  /// Its own metrics.
  std::function<void(std::function<void(MetricPage)> tell)> metrics;
  std::function<bool()> draining;
  JsonCalls::Admit admit;
  v1alpha1::GetBuildInfoResponse build;
};

/// The HTTP side of both programs:
///   GET  /healthz    200 as long as the loop runs
///   GET  /readyz     200 or 503, {"ready": false, "reasons": [...]}
///   GET  /metrics    in Prometheus's text format
///   GET  /buildinfo  as OperatorService.GetBuildInfo
///   POST /v1alpha1/SERVICE/METHOD  unary calls as JSON, where only this machine reaches it
/// What the program does not tell within 2 s is 503.
class OperatorEndpoint {
 public:
  /// Serves on `loop` while that runs. `server` and `gate` outlive it. Throws std::runtime_error
  /// "http: ADDR: ..." when it cannot listen.
  OperatorEndpoint(boost::asio::io_context& loop, const HttpOptions& options, GrpcServer& server,
                   CallGate& gate, const std::vector<std::string>& services, OperatorView view);

  std::string address() const { return http_.address(); }

 private:
  using Page = void (OperatorEndpoint::*)(HttpReply);

  void Handle(const HttpRequest& request, HttpReply reply);
  bool IsKnownHost(const std::string& host) const;
  void Health(HttpReply reply);
  void Readiness(HttpReply reply);
  void Metrics(HttpReply reply);
  void BuildInfo(HttpReply reply);
  void AddOwn(MetricPage* page);
  template <class Told>
  void Ask(const std::function<void(std::function<void(Told)>)>& question, HttpReply reply,
           std::function<HttpAnswer(Told)> answer);

  boost::asio::io_context& loop_;
  GrpcServer& server_;
  CallGate& gate_;
  OperatorView view_;
  bool local_;
  JsonCalls calls_;
  HttpServer http_;
};

}  // namespace grouser::server

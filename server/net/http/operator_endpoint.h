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
///   GET  /ui/        the web page, where only this machine reaches it
///   POST /v1alpha1/SERVICE/METHOD  unary calls as JSON, there too
/// What the program does not tell within 2 s is 503. With a rights file /metrics, /buildinfo and
/// the reasons of /readyz are for who may call GetBuildInfo.
class OperatorEndpoint {
 public:
  /// Serves on `loop` while that runs. `server` and `gate` outlive it. Throws std::runtime_error
  /// "http: ADDR: ..." when it cannot listen.
  OperatorEndpoint(boost::asio::io_context& loop, const HttpOptions& options, GrpcServer& server,
                   CallGate& gate, const std::vector<std::string>& services, OperatorView view);

  std::string address() const { return http_.address(); }

 private:
  using Page = void (OperatorEndpoint::*)(const HttpRequest&, HttpReply);
  /// A question to the program that may be under way, and who waits for its answer.
  template <class Told>
  struct Question;

  void Handle(const HttpRequest& request, HttpReply reply);
  bool IsKnownHost(const std::string& host) const;
  /// The role that pages need where there is a rights file.
  grpc::Status AdmitToPage(const HttpRequest& request) const;
  void Health(const HttpRequest& request, HttpReply reply);
  void Readiness(const HttpRequest& request, HttpReply reply);
  void Metrics(const HttpRequest& request, HttpReply reply);
  void BuildInfo(const HttpRequest& request, HttpReply reply);
  void AddOwn(MetricPage* page);
  template <class Told>
  void Ask(const std::function<void(std::function<void(Told)>)>& ask,
           std::shared_ptr<Question<Told>> question, HttpReply reply,
           std::function<HttpAnswer(const Told&)> answer);

  boost::asio::io_context& loop_;
  GrpcServer& server_;
  CallGate& gate_;
  OperatorView view_;
  bool local_;
  // The programs may answer when this is gone.
  std::shared_ptr<Question<std::vector<std::string>>> readiness_;
  std::shared_ptr<Question<MetricPage>> metrics_;
  JsonCalls calls_;
  HttpServer http_;
};

}  // namespace grouser::server

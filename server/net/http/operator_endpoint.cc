#include "server/net/http/operator_endpoint.h"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/records/message_json.h"
#include "server/net/address.h"
#include "server/net/build_info.h"

namespace grouser::server {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::seconds kTellLimit(2);

HttpAnswer Unavailable(const std::string& message) {
  return HttpError(grpc::StatusCode::UNAVAILABLE, message);
}

HttpAnswer ReadinessAnswer(const std::vector<std::string>& reasons) {
  HttpAnswer answer;
  answer.status = reasons.empty() ? 200 : 503;
  const nlohmann::json body = {{"ready", reasons.empty()}, {"reasons", reasons}};
  answer.body = body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  return answer;
}

}  // namespace

OperatorEndpoint::OperatorEndpoint(asio::io_context& loop, const HttpOptions& options,
                                   GrpcServer& server, CallGate& gate,
                                   const std::vector<std::string>& services, OperatorView view)
    : loop_(loop),
      server_(server),
      gate_(gate),
      view_(std::move(view)),
      local_(ParseAddress(options.http, "http").is_local()),
      calls_(loop, server.InProcessChannel(), services, gate.records(), view_.admit),
      http_(loop, options.http, [this](const HttpRequest& request, HttpReply reply) {
        Handle(request, std::move(reply));
      }) {}

// A name of another site that was made to point here is refused: a browser would let that
// site's pages read what is told.
bool OperatorEndpoint::IsKnownHost(const std::string& host) const {
  return !local_ || host.empty() || host == "[::1]" || Address{host, 0, ""}.is_local();
}

void OperatorEndpoint::Handle(const HttpRequest& request, HttpReply reply) {
  static const std::map<std::string, Page> kPages = {{"/healthz", &OperatorEndpoint::Health},
                                                     {"/readyz", &OperatorEndpoint::Readiness},
                                                     {"/metrics", &OperatorEndpoint::Metrics},
                                                     {"/buildinfo", &OperatorEndpoint::BuildInfo}};
  if (!IsKnownHost(request.host)) {
    return reply(HttpError(grpc::StatusCode::PERMISSION_DENIED,
                           "host: '" + request.host + "', expected localhost or its address"));
  }
  if (request.path.starts_with(JsonCalls::kPrefix)) {
    if (local_) return calls_.Answer(request, std::move(reply));
    // gRPC would take the call for one from this machine.
    return reply(HttpError(grpc::StatusCode::PERMISSION_DENIED,
                           "calls as JSON are answered on an address of this machine alone"));
  }
  const auto page = kPages.find(request.path);
  if (page == kPages.end()) {
    return reply(HttpError(grpc::StatusCode::NOT_FOUND,
                           "path: expected /healthz, /readyz, /metrics, /buildinfo or "
                           "/v1alpha1/SERVICE/METHOD"));
  }
  if (request.method != "GET") {
    HttpAnswer answer = HttpError(grpc::StatusCode::INVALID_ARGUMENT,
                                  "method: '" + request.method + "', expected GET");
    answer.status = 405;
    answer.allow = "GET, HEAD";
    return reply(std::move(answer));
  }
  (this->*page->second)(std::move(reply));
}

/// Has a question answered on the loop, or 503 after kTellLimit.
template <class Told>
void OperatorEndpoint::Ask(const std::function<void(std::function<void(Told)>)>& question,
                           HttpReply reply, std::function<HttpAnswer(Told)> answer) {
  struct Asked {
    explicit Asked(asio::io_context& loop) : timer(loop) {}
    asio::steady_timer timer;
    HttpReply reply;
  };
  const auto asked = std::make_shared<Asked>(loop_);
  asked->reply = std::move(reply);
  asked->timer.expires_after(kTellLimit);
  asked->timer.async_wait([asked](const boost::system::error_code& error) {
    if (error || !asked->reply) return;
    std::exchange(asked->reply, nullptr)(Unavailable("the program did not tell within 2 s"));
  });
  question([this, asked, answer = std::move(answer)](Told told) {
    asio::post(loop_, [asked, answer, told = std::move(told)]() mutable {
      if (!asked->reply) return;
      asked->timer.cancel();
      std::exchange(asked->reply, nullptr)(answer(std::move(told)));
    });
  });
}

void OperatorEndpoint::Health(HttpReply reply) { reply({200, "text/plain", "ok\n", ""}); }

void OperatorEndpoint::Readiness(HttpReply reply) {
  if (view_.draining()) return reply(ReadinessAnswer({"draining: the program was told to end"}));
  Ask<std::vector<std::string>>(view_.readiness, std::move(reply), ReadinessAnswer);
}

void OperatorEndpoint::BuildInfo(HttpReply reply) {
  reply({200, "application/json", records::ToJson(view_.build, true), ""});
}

void OperatorEndpoint::AddOwn(MetricPage* page) {
  AddBuildInfo(view_.build, page);
  AddProcessMetrics(page);
  gate_.AddTo(page);
  page->AddGauge("grouser_grpc_connections", "Open connections of gRPC.",
                 static_cast<double>(server_.CountConnections()));
  http_.AddTo(page);
}

void OperatorEndpoint::Metrics(HttpReply reply) {
  Ask<MetricPage>(view_.metrics, std::move(reply), [this](MetricPage page) {
    AddOwn(&page);
    return HttpAnswer{200, "text/plain; version=0.0.4; charset=utf-8", page.Text(), ""};
  });
}

}  // namespace grouser::server

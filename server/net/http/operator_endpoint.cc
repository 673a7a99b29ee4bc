#include "server/net/http/operator_endpoint.h"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/records/message_json.h"
#include "server/net/address.h"
#include "server/net/build_info.h"
#include "server/net/http/web_page.h"

namespace grouser::server {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::seconds kTellLimit(2);
// Pages tell what this method does, and more of its kind.
constexpr const char* kPagesAs = "/grouser.v1alpha1.OperatorService/GetBuildInfo";

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

template <class Told>
struct OperatorEndpoint::Question {
  struct Asked {
    Asked(asio::io_context& loop, HttpReply to, std::function<HttpAnswer(const Told&)> as)
        : timer(loop), reply(std::move(to)), answer(std::move(as)) {}
    asio::steady_timer timer;
    HttpReply reply;  // null: answered
    std::function<HttpAnswer(const Told&)> answer;
  };
  bool under_way = false;
  std::vector<std::shared_ptr<Asked>> waiting;
};

OperatorEndpoint::OperatorEndpoint(asio::io_context& loop, const HttpOptions& options,
                                   GrpcServer& server, CallGate& gate,
                                   const std::vector<std::string>& services, OperatorView view)
    : loop_(loop),
      server_(server),
      gate_(gate),
      view_(std::move(view)),
      local_(ParseAddress(options.http, "http").is_local()),
      readiness_(std::make_shared<Question<std::vector<std::string>>>()),
      metrics_(std::make_shared<Question<MetricPage>>()),
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
  const bool web = IsOfWebPage(request.path);
  if (page == kPages.end() && !web) {
    return reply(HttpError(grpc::StatusCode::NOT_FOUND,
                           "path: expected /ui/, /healthz, /readyz, /metrics, /buildinfo or "
                           "/v1alpha1/SERVICE/METHOD"));
  }
  if (request.method != "GET") {
    HttpAnswer answer = HttpError(grpc::StatusCode::INVALID_ARGUMENT,
                                  "method: '" + request.method + "', expected GET");
    answer.status = 405;
    answer.allow = "GET, HEAD";
    return reply(std::move(answer));
  }
  if (web) {
    if (local_) return reply(WebPage(request.path));
    // It could call nothing there, and would ask for tokens over plaintext.
    return reply(HttpError(grpc::StatusCode::PERMISSION_DENIED,
                           "the web page is served on an address of this machine alone"));
  }
  const bool open = page->first == "/healthz" || page->first == "/readyz";
  if (const grpc::Status status = open ? grpc::Status::OK : AdmitToPage(request); !status.ok()) {
    gate_.records().NoRights(kPagesAs, "http", request.request_id, status);
    return reply(HttpError(status.error_code(), request.path + ": " + status.error_message()));
  }
  (this->*page->second)(request, std::move(reply));
}

grpc::Status OperatorEndpoint::AdmitToPage(const HttpRequest& request) const {
  return view_.admit(kPagesAs, request);
}

/// Has a question answered on the loop, or 503 after kTellLimit. One of its kind is under way at
/// a time; what is asked meanwhile gets its answer.
template <class Told>
void OperatorEndpoint::Ask(const std::function<void(std::function<void(Told)>)>& ask,
                           std::shared_ptr<Question<Told>> question, HttpReply reply,
                           std::function<HttpAnswer(const Told&)> answer) {
  using Asked = typename Question<Told>::Asked;
  const auto asked = std::make_shared<Asked>(loop_, std::move(reply), std::move(answer));
  asked->timer.expires_after(kTellLimit);
  asked->timer.async_wait([asked](const boost::system::error_code& error) {
    if (error || !asked->reply) return;
    std::exchange(asked->reply, nullptr)(Unavailable("the program did not tell within 2 s"));
  });
  std::erase_if(question->waiting, [](const auto& earlier) { return !earlier->reply; });
  question->waiting.push_back(asked);
  if (std::exchange(question->under_way, true)) return;
  ask([&loop = loop_, question](Told told) {  // this may be gone
    asio::post(loop, [question, told = std::move(told)] {
      question->under_way = false;
      for (const auto& one : std::exchange(question->waiting, {})) {
        if (!one->reply) continue;
        one->timer.cancel();
        std::exchange(one->reply, nullptr)(one->answer(told));
      }
    });
  });
}

void OperatorEndpoint::Health(const HttpRequest&, HttpReply reply) {
  reply({200, "text/plain", "ok\n", ""});
}

void OperatorEndpoint::Readiness(const HttpRequest& request, HttpReply reply) {
  if (view_.draining()) return reply(ReadinessAnswer({"draining: the program was told to end"}));
  const bool open = AdmitToPage(request).ok();
  Ask<std::vector<std::string>>(view_.readiness, readiness_, std::move(reply),
                                [open](const std::vector<std::string>& reasons) {
                                  if (open || reasons.empty()) return ReadinessAnswer(reasons);
                                  return ReadinessAnswer({"told to who has the role read"});
                                });
}

void OperatorEndpoint::BuildInfo(const HttpRequest&, HttpReply reply) {
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

void OperatorEndpoint::Metrics(const HttpRequest&, HttpReply reply) {
  Ask<MetricPage>(view_.metrics, metrics_, std::move(reply), [this](MetricPage page) {
    AddOwn(&page);
    return HttpAnswer{200, "text/plain; version=0.0.4; charset=utf-8", page.Text(), ""};
  });
}

}  // namespace grouser::server

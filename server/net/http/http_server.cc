#include "server/net/http/http_server.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "server/net/http/http_session.h"

namespace grouser::server {

HttpServer::HttpServer(boost::asio::io_context& loop, const std::string& address,
                       HttpHandler handler)
    : loop_(loop), handler_(std::move(handler)) {
  const Address parsed = ParseAddress(address, "http");
  // The sessions are bounded here: the listener is to let a new one in.
  listener_ = std::make_unique<Listener>(
      loop, parsed, 2 * kMostConnections, [this](int, int fd) { Accept(fd); }, "http");
  listener_->Start();
}

HttpServer::~HttpServer() {
  listener_->Stop();
  for (const auto& session : std::exchange(sessions_, {})) {
    session->Detach();
    session->Close();
  }
}

void HttpServer::Accept(int fd) {
  accepted_.Add();
  while (sessions_.size() >= kMostConnections) {
    const auto oldest = std::ranges::min_element(sessions_, {}, [](const auto& session) {
      return std::pair(!session->waits(), session->waits_since());
    });
    // All are being answered: one more, as far as the listener goes; the rest wait with the kernel.
    if (!(*oldest)->waits()) break;
    closed_for_others_.Add();
    const auto session = *oldest;
    session->Close();
  }
  sockaddr_storage local{};
  socklen_t length = sizeof local;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&local), &length);
  const int protocol = local.ss_family == AF_UNIX ? 0 : static_cast<int>(IPPROTO_TCP);
  HttpSession::Socket socket(loop_);
  boost::system::error_code error;
  socket.assign({local.ss_family, protocol}, fd, error);
  if (error) {
    ::close(fd);
    return;
  }
  sessions_.push_back(std::make_shared<HttpSession>(*this, std::move(socket)));
  sessions_.back()->Read();
}

HttpReach HttpServer::reach() const {
  if (listener_->address().is_unix()) return HttpReach::kUser;
  return listener_->address().is_local() ? HttpReach::kMachine : HttpReach::kNetwork;
}

void HttpServer::Forget(const HttpSession* session) {
  std::erase_if(sessions_, [session](const auto& s) { return s.get() == session; });
}

void HttpServer::AddTo(MetricPage* page) const {
  page->AddGauge("grouser_http_connections", "Open connections of HTTP.",
                 static_cast<double>(sessions_.size()));
  page->AddCounter("grouser_http_connections_total", "Connections of HTTP that were accepted.",
                   static_cast<double>(accepted_.value()));
  page->AddCounter("grouser_http_connections_displaced_total",
                   "Connections of HTTP that were closed since too many were open.",
                   static_cast<double>(closed_for_others_.value()));
  page->AddCounter("grouser_http_malformed_requests_total",
                   "Requests of HTTP that were none, or too large.",
                   static_cast<double>(malformed_.value()));
  page->AddFamily("grouser_http_answers_total", "Answers of HTTP by status.",
                  prometheus::MetricType::Counter);
  for (const auto& [status, count] : by_status_) {
    page->AddCounter("grouser_http_answers_total", "", static_cast<double>(count),
                     {{"status", std::to_string(status)}});
  }
}

}  // namespace grouser::server

#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "server/core/metric_page.h"
#include "server/net/http/http_message.h"
#include "server/net/listener.h"

namespace grouser::server {

class HttpSession;

/// HTTP/1.1 on the program's loop, for a few operators: everything is bounded. A request has a
/// header of 8 KiB and a body of 1 MiB at most and must be there within 20 s of the last answer;
/// an answer must be taken within 10 s. Beyond kMostConnections a new one takes the place of the
/// one that has said nothing for longest, so that idle or slow clients keep nobody out; while all
/// are being answered there may be twice as many, and further ones wait.
class HttpServer {
 public:
  static constexpr std::size_t kMostConnections = 24;

  /// Serves on `loop`, whose only thread runs all of it; no member function may run beside it.
  /// Throws std::runtime_error "http: ADDR: ..." when it cannot listen.
  HttpServer(boost::asio::io_context& loop, const std::string& address, HttpHandler handler);
  /// When the loop does not run any more.
  ~HttpServer();

  /// With the port that was taken.
  std::string address() const { return listener_->address().Text(); }

  void AddTo(MetricPage* page) const;

 private:
  friend class HttpSession;

  void Accept(int fd);
  HttpReach reach() const;
  void Forget(const HttpSession* session);

  boost::asio::io_context& loop_;
  HttpHandler handler_;
  std::list<std::shared_ptr<HttpSession>> sessions_;
  Counter accepted_, closed_for_others_, malformed_;
  std::map<int, std::uint64_t> by_status_;
  std::unique_ptr<Listener> listener_;
};

}  // namespace grouser::server

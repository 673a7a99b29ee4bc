#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <memory>
#include <optional>

#include "server/net/http/http_message.h"

namespace grouser::server {

class HttpServer;

/// One connection of an HttpServer: reads a request, has it answered, writes, and again.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;

  HttpSession(HttpServer& server, Socket socket);

  void Read();
  void Close();
  /// The server is gone.
  void Detach() { server_ = nullptr; }

  /// Nothing is under way for it but reading.
  bool waits() const { return waits_; }
  std::chrono::steady_clock::time_point waits_since() const { return waits_since_; }

 private:
  using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;

  void OnRead(boost::beast::error_code error);
  void Refuse(boost::beast::error_code error);
  void RefuseCoding();
  void Answer(HttpAnswer answer, const std::string& request_id, bool keep_alive, bool head);
  void OnWritten(boost::beast::error_code error);
  void Drop();

  HttpServer* server_;
  boost::beast::basic_stream<boost::asio::generic::stream_protocol> stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  std::optional<Response> response_;
  std::shared_ptr<void> place_;  // of the response
  bool waits_ = false;
  std::chrono::steady_clock::time_point waits_since_;
  std::size_t dropped_ = 0;
};

}  // namespace grouser::server

#include "server/net/http/http_session.h"

#include <algorithm>
#include <boost/asio/socket_base.hpp>
#include <iterator>
#include <utility>

#include "server/net/call_records.h"
#include "server/net/http/http_server.h"

namespace grouser::server {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;

constexpr std::size_t kMostHeaderBytes = 8 * 1024;
constexpr std::size_t kMostBodyBytes = 1024 * 1024;
constexpr std::size_t kMostBufferBytes = 64 * 1024;
constexpr std::chrono::seconds kReadLimit(20);
constexpr std::chrono::seconds kWriteLimit(10);
// After a refusal the rest of a request is read and dropped, so that the client gets to read why.
constexpr std::chrono::seconds kDropLimit(1);
constexpr std::size_t kMostDroppedBytes = 2 * kMostBodyBytes;

std::string Lower(beast::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return lower;
}

std::string WithoutPort(const std::string& host) {
  const std::size_t bracket = host.rfind(']');
  const std::size_t colon = host.rfind(':');
  const bool has_port =
      colon != std::string::npos && (bracket == std::string::npos || colon > bracket);
  return has_port ? host.substr(0, colon) : host;
}

HttpRequest ToRequest(http::request<http::string_body>&& message) {
  HttpRequest request;
  request.method = std::string(message.method_string());
  const std::string target(message.target());
  request.path = target.substr(0, target.find('?'));
  request.host = WithoutPort(Lower(message[http::field::host]));
  const std::string type = Lower(message[http::field::content_type]);
  request.content_type = type.substr(0, type.find_first_of("; "));
  const auto [begin, end] = message.equal_range(http::field::authorization);
  for (auto header = begin; header != end; ++header) {
    request.authorization.emplace_back(header->value());
  }
  const auto id = message["x-request-id"];
  request.request_id = RequestIdOf({id.data(), id.size()});
  request.body = std::move(message.body());
  return request;
}

/// A body in a coding that is not read here would be taken for the next request.
bool HasOtherCoding(const http::request<http::string_body>& message) {
  const auto [begin, end] = message.equal_range(http::field::transfer_encoding);
  if (begin == end) return false;
  return std::next(begin) != end || Lower(begin->value()) != "chunked";
}

}  // namespace

HttpSession::HttpSession(HttpServer& server, Socket socket)
    : server_(&server), stream_(std::move(socket)), buffer_(kMostBufferBytes) {}

void HttpSession::Read() {
  parser_.emplace();
  parser_->header_limit(kMostHeaderBytes);
  parser_->body_limit(kMostBodyBytes);
  waits_ = true;
  waits_since_ = std::chrono::steady_clock::now();
  stream_.expires_after(kReadLimit);  // of the whole request
  http::async_read(
      stream_, buffer_, *parser_,
      [self = shared_from_this()](beast::error_code error, std::size_t) { self->OnRead(error); });
}

void HttpSession::OnRead(beast::error_code error) {
  waits_ = false;
  if (server_ == nullptr) return;
  if (error) return Refuse(error);
  stream_.expires_never();  // the handler has limits of its own
  if (HasOtherCoding(parser_->get())) return RefuseCoding();
  const bool keep_alive = parser_->get().keep_alive();
  HttpRequest request = ToRequest(parser_->release());
  request.reach = server_->reach();
  const bool head = request.method == "HEAD";
  if (head) request.method = "GET";
  server_->handler_(
      request, [self = shared_from_this(), keep_alive, head, id = request.request_id](
                   HttpAnswer answer) { self->Answer(std::move(answer), id, keep_alive, head); });
}

void HttpSession::Refuse(beast::error_code error) {
  HttpAnswer answer;
  if (error == http::error::body_limit) {
    answer = HttpError(8, "body: more than 1 MiB, expected less");
    answer.status = 413;
  } else if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    answer = HttpError(8, "header: more than 8 KiB, expected less");
    answer.status = 431;
  } else if (error.category() == make_error_code(http::error::bad_method).category() &&
             error != http::error::end_of_stream && error != http::error::partial_message) {
    answer = HttpError(3, "not a request of HTTP/1.1: " + error.message());
  } else {
    return Close();  // gone, or too slow
  }
  server_->malformed_.Add();
  Answer(std::move(answer), RequestIdOf(""), false, false);
}

void HttpSession::RefuseCoding() {
  server_->malformed_.Add();
  Answer(HttpError(12, "transfer-encoding: expected chunked or none"), RequestIdOf(""), false,
         false);
}

void HttpSession::Answer(HttpAnswer answer, const std::string& request_id, bool keep_alive,
                         bool head) {
  if (server_ == nullptr) return;
  ++server_->by_status_[answer.status];
  response_.emplace();
  response_->result(static_cast<unsigned>(answer.status));
  response_->version(11);
  response_->keep_alive(keep_alive);
  response_->set(http::field::content_type, answer.content_type);
  response_->set(http::field::cache_control, "no-store");
  response_->set("X-Content-Type-Options", "nosniff");
  response_->set("X-Request-Id", request_id);
  if (!answer.allow.empty()) response_->set(http::field::allow, answer.allow);
  for (const auto& [name, value] : answer.headers) response_->set(name, value);
  if (answer.status == 429 || answer.status == 503) response_->set(http::field::retry_after, "1");
  response_->content_length(answer.body.size());
  if (!head) response_->body() = std::move(answer.body);
  place_ = std::move(answer.place);
  stream_.expires_after(kWriteLimit);
  http::async_write(stream_, *response_,
                    [self = shared_from_this()](beast::error_code error, std::size_t) {
                      self->OnWritten(error);
                    });
}

void HttpSession::OnWritten(beast::error_code error) {
  const bool again = !error && response_->keep_alive();
  response_.reset();
  place_.reset();
  if (again && server_ != nullptr) return Read();
  if (error) return Close();
  stream_.socket().shutdown(boost::asio::socket_base::shutdown_send, error);
  waits_ = true;  // its place may be taken
  stream_.expires_after(kDropLimit);
  Drop();
}

void HttpSession::Drop() {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(kMostBufferBytes),
                          [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
                            self->dropped_ += bytes;
                            if (error || self->dropped_ > kMostDroppedBytes) return self->Close();
                            self->Drop();
                          });
}

void HttpSession::Close() {
  stream_.close();
  if (auto* server = std::exchange(server_, nullptr)) server->Forget(this);
}

}  // namespace grouser::server

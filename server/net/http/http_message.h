#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace grouser::server {

/// Who reaches the address that a request came to.
enum class HttpReach {
  kUser,     ///< a Unix socket of mode 0600
  kMachine,  ///< all users of this machine
  kNetwork   ///< other machines, in plaintext
};

/// A request that was read whole, within all limits.
struct HttpRequest {
  std::string method;                      ///< "GET", "POST", ...
  std::string path;                        ///< without what follows '?'
  std::string host;                        ///< of the Host header, without a port
  std::string content_type;                ///< without parameters, lower case
  std::vector<std::string> authorization;  ///< all values, passed on to gRPC as they are
  std::string request_id;                  ///< x-request-id, as RequestIdOf() has it
  std::string body;
  HttpReach reach = HttpReach::kNetwork;
};

struct HttpAnswer {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::string allow = "";  ///< of 405: the methods that are taken
  std::vector<std::pair<std::string, std::string>> headers = {};  ///< further ones
  /// Kept until the answer has been written, or cannot be any more.
  std::shared_ptr<void> place = nullptr;
};

/// Call it once, on the loop's thread.
using HttpReply = std::function<void(HttpAnswer)>;
using HttpHandler = std::function<void(const HttpRequest&, HttpReply)>;

/// {"code": "NOT_FOUND", "message": "..."} with the status that HTTP has for a code of gRPC.
HttpAnswer HttpError(int grpc_code, const std::string& message);

}  // namespace grouser::server

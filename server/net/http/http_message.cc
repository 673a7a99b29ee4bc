#include "server/net/http/http_message.h"

#include <array>
#include <nlohmann/json.hpp>

#include "proto/records/status_code.h"

namespace grouser::server {

HttpAnswer HttpError(int grpc_code, const std::string& message) {
  // As google.rpc.Code maps its codes, 0 to 16.
  static constexpr std::array<int, 17> kStatus = {200, 499, 500, 400, 504, 404, 409, 403, 429,
                                                  400, 409, 400, 501, 500, 503, 500, 401};
  HttpAnswer answer;
  const bool known = grpc_code >= 0 && grpc_code < static_cast<int>(kStatus.size());
  answer.status = known ? kStatus[static_cast<std::size_t>(grpc_code)] : 500;
  const nlohmann::json body = {{"code", records::StatusCodeName(grpc_code)}, {"message", message}};
  answer.body = body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  return answer;
}

}  // namespace grouser::server

#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/net/access_policy.h"
#include "server/net/call_records.h"
#include "server/net/http/http_message.h"

namespace grouser::server {

/// Unary calls as JSON: POST /v1alpha1/SERVICE/METHOD with the request message as the body. They
/// are made over a channel within the program, so that all checks, limits and answers are gRPC's,
/// but for what gRPC asks of a connection: rights are for `admit` to judge. A thread of its own
/// reads and writes JSON; at most kMostCalls are under way, those whose answers are still to be
/// written among them, since answers are large.
class JsonCalls {
 public:
  static constexpr std::size_t kMostCalls = 8;
  static constexpr const char* kPrefix = "/v1alpha1/";

  /// Whether a request may call "/SERVICE/METHOD".
  using Admit = std::function<grpc::Status(const std::string& path, const HttpRequest& request)>;

  /// `services` by their full names; replies come on `loop`.
  JsonCalls(boost::asio::io_context& loop, std::shared_ptr<grpc::Channel> channel,
            const std::vector<std::string>& services, CallRecords& records, Admit admit);
  /// Cancels what is under way and waits for it. The gRPC server still runs.
  ~JsonCalls();

  void Answer(const HttpRequest& request, HttpReply reply);

 private:
  struct Call;

  /// Null: none is free.
  std::shared_ptr<void> TakePlace();
  void Start(Call* call);
  void End(Call* call, const grpc::Status& status);
  void Reply(Call* call, HttpAnswer answer);

  boost::asio::io_context& loop_;
  CallRecords& records_;
  Admit admit_;
  grpc::GenericStub stub_;
  std::map<std::string, const google::protobuf::MethodDescriptor*> methods_;  // by path
  std::mutex mutex_;                                                          // guards calls_
  std::condition_variable ended_;
  std::set<Call*> calls_;
  // Places taken; answers may outlive this.
  std::shared_ptr<std::atomic<std::size_t>> taken_ = std::make_shared<std::atomic<std::size_t>>(0);
  boost::asio::thread_pool worker_{1};
};

/// What AccessPolicy says of a request that comes over HTTP, with its header `authorization`: a
/// call as JSON, or a page that needs the role of the method `path`, which a rights file alone
/// closes. Without a rights file calls are not admitted where more users reach --http than --grpc.
grpc::Status AdmitOverHttp(AccessPolicy& policy, std::string_view path, const HttpRequest& request);

}  // namespace grouser::server

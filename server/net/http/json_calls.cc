#include "server/net/http/json_calls.h"

#include <google/protobuf/message.h>
#include <grpcpp/client_context.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <utility>

#include "proto/records/message_json.h"
#include "server/net/header_text.h"

namespace grouser::server {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::seconds kCallLimit(30);

std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor& type) {
  const auto* prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  return std::unique_ptr<google::protobuf::Message>(prototype->New());
}

std::string GrpcPath(const google::protobuf::MethodDescriptor& method) {
  return "/" + method.service()->full_name() + "/" + method.name();
}

grpc::Status NoHeaderText() {
  return {grpc::StatusCode::UNAUTHENTICATED, "authorization: expected printable ASCII"};
}

}  // namespace

struct JsonCalls::Call {
  const google::protobuf::MethodDescriptor* method;
  HttpRequest http;
  HttpReply reply;
  std::shared_ptr<void> place;
  grpc::ClientContext context;
  grpc::ByteBuffer request, response;
};

JsonCalls::JsonCalls(asio::io_context& loop, std::shared_ptr<grpc::Channel> channel,
                     const std::vector<std::string>& services, CallRecords& records, Admit admit)
    : loop_(loop), records_(records), admit_(std::move(admit)), stub_(std::move(channel)) {
  for (const std::string& name : services) {
    const auto* service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; service != nullptr && i < service->method_count(); ++i) {
      methods_[kPrefix + service->name() + "/" + service->method(i)->name()] = service->method(i);
    }
  }
}

JsonCalls::~JsonCalls() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    for (Call* call : calls_) call->context.TryCancel();
    ended_.wait(lock, [this] { return calls_.empty(); });
  }
  worker_.join();
}

void JsonCalls::Answer(const HttpRequest& request, HttpReply reply) {
  const auto found = methods_.find(request.path);
  if (found == methods_.end()) {
    return reply(HttpError(grpc::StatusCode::NOT_FOUND,
                           "path: no such method, expected /v1alpha1/SERVICE/METHOD"));
  }
  if (found->second->client_streaming() || found->second->server_streaming()) {
    return reply(HttpError(grpc::StatusCode::UNIMPLEMENTED, "a stream; only gRPC has those"));
  }
  if (request.method != "POST") {
    HttpAnswer answer = HttpError(grpc::StatusCode::INVALID_ARGUMENT,
                                  "method: '" + request.method + "', expected POST");
    answer.status = 405;
    answer.allow = "POST";
    return reply(std::move(answer));
  }
  // A page of another site can have a browser post other types, but not this one.
  if (request.content_type != "application/json") {
    HttpAnswer answer =
        HttpError(grpc::StatusCode::INVALID_ARGUMENT,
                  "content-type: '" + request.content_type + "', expected application/json");
    answer.status = 415;
    return reply(std::move(answer));
  }
  const std::string path = GrpcPath(*found->second);
  const grpc::Status admitted = std::ranges::all_of(request.authorization, IsHeaderText)
                                    ? admit_(path, request)
                                    : NoHeaderText();
  if (!admitted.ok()) {
    records_.NoRights(path, "http", request.request_id, admitted);
    return reply(HttpError(admitted.error_code(), admitted.error_message()));
  }
  auto call = std::make_unique<Call>();
  call->method = found->second;
  call->http = request;
  call->reply = std::move(reply);
  call->place = TakePlace();
  if (!call->place) {
    records_.Refused(Refusal::kHttpBusy);
    return call->reply(HttpError(grpc::StatusCode::RESOURCE_EXHAUSTED,
                                 "calls: " + std::to_string(kMostCalls) +
                                     " are under way over HTTP, expected fewer; try again later"));
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  calls_.insert(call.get());
  asio::post(worker_, [this, started = call.release()] { Start(started); });
}

std::shared_ptr<void> JsonCalls::TakePlace() {
  if (taken_->fetch_add(1) < kMostCalls) {
    return {taken_.get(), [taken = taken_](void*) { --*taken; }};
  }
  --*taken_;
  return nullptr;
}

void JsonCalls::Start(Call* call) {
  try {
    const auto message = MakeMessage(*call->method->input_type());
    records::FromJson(call->http.body, "body", message.get());
    const grpc::Slice slice(message->SerializeAsString());
    call->request = grpc::ByteBuffer(&slice, 1);
  } catch (const std::exception& e) {
    return Reply(call, HttpError(grpc::StatusCode::INVALID_ARGUMENT, e.what()));
  }
  call->http.body.clear();
  call->context.set_deadline(std::chrono::system_clock::now() + kCallLimit);
  call->context.AddMetadata("x-request-id", call->http.request_id);
  for (const std::string& value : call->http.authorization) {
    call->context.AddMetadata("authorization", value);
  }
  stub_.UnaryCall(&call->context, GrpcPath(*call->method), {}, &call->request, &call->response,
                  [this, call](const grpc::Status& status) {
                    asio::post(worker_, [this, call, status] { End(call, status); });
                  });
}

void JsonCalls::End(Call* call, const grpc::Status& status) {
  if (!status.ok()) return Reply(call, HttpError(status.error_code(), status.error_message()));
  const auto message = MakeMessage(*call->method->output_type());
  std::string bytes;
  {
    std::vector<grpc::Slice> slices;
    call->response.Dump(&slices);
    for (const grpc::Slice& slice : slices) {
      bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
  }
  try {
    HttpAnswer answer;
    if (!message->ParseFromString(bytes)) throw std::runtime_error("the answer does not parse");
    answer.body = records::ToJson(*message) + "\n";
    Reply(call, std::move(answer));
  } catch (const std::exception& e) {
    Reply(call, HttpError(grpc::StatusCode::INTERNAL, e.what()));
  }
}

void JsonCalls::Reply(Call* call, HttpAnswer answer) {
  answer.place = std::move(call->place);
  asio::post(loop_, [reply = std::move(call->reply), answer = std::move(answer)]() mutable {
    reply(std::move(answer));
  });
  const std::lock_guard<std::mutex> lock(mutex_);
  calls_.erase(call);
  delete call;
  ended_.notify_all();
}

grpc::Status AdmitOverHttp(AccessPolicy& policy, std::string_view path,
                           const HttpRequest& request) {
  const bool page = !request.path.starts_with(JsonCalls::kPrefix);
  if (page && !policy.has_file()) return grpc::Status::OK;
  if (!page && !policy.has_file() && policy.is_of_user() && request.reach != HttpReach::kUser) {
    return {grpc::StatusCode::PERMISSION_DENIED,
            "calls as JSON: --grpc is a Unix socket, but all users of this machine reach this "
            "address; expected --http unix:PATH, or a file --rights"};
  }
  if (!policy.restricts()) return grpc::Status::OK;
  if (!request.authorization.empty() && request.reach == HttpReach::kNetwork) {
    return {grpc::StatusCode::UNAUTHENTICATED,
            "token: came in plaintext over an address that other machines reach, so others may "
            "know it: replace it"};
  }
  Evidence evidence;
  evidence.authorization.assign(request.authorization.begin(), request.authorization.end());
  return policy.Admit(path, evidence);
}

}  // namespace grouser::server

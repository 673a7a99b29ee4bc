#include "server/vehicle/vehicle_service.h"

#include <fmt/format.h>

#include <atomic>

#include "server/net/grpc_status.h"
#include "server/vehicle/vehicle_answer.h"
#include "server/vehicle/vehicle_check.h"

namespace grouser::server {
namespace {

// Of the threads: wheel queries, which take microseconds, go first where processors are short.
constexpr int kNice = 5;

}  // namespace

/// A call that another thread finishes, or that is cancelled while it waits for one.
class LaterCall final : public UnaryCall {
 public:
  LaterCall(CallGate& gate, grpc::CallbackServerContext& context, std::string_view method,
            const google::protobuf::MessageLite& request, WorkQueue& queue)
      : UnaryCall(gate, context, method, request), queue_(queue) {}

  // gRPC calls it after the reactor was returned, and OnDone after it.
  void OnCancel() override {
    cancelled_ = true;
    if (queue_.Remove(this)) Finish(grpc::Status::CANCELLED);
  }
  const std::atomic<bool>& cancelled() const { return cancelled_; }

 private:
  WorkQueue& queue_;
  std::atomic<bool> cancelled_{false};
};

VehicleService::VehicleService(const Fleet& fleet, CallGate& gate, int threads)
    : fleet_(fleet), gate_(gate), queue_(threads, kMostWaiting, kNice) {
  for (int t = 0; t < threads; ++t) benches_.emplace_back(fleet);
}
VehicleService::~VehicleService() = default;

void VehicleService::AddTo(MetricPage* page) const {
  page->AddGauge("grouser_vehicle_queue_depth", "Calls about vehicles that wait for a thread.",
                 static_cast<double>(queue_.waiting()));
}

template <class Request, class Response>
grpc::ServerUnaryReactor* VehicleService::Later(grpc::CallbackServerContext& context,
                                                std::string_view method, const Request& request,
                                                Response* response) {
  auto* call = new LaterCall(gate_, context, method, request, queue_);
  if (!call->admitted()) return call;
  const auto work = [this, call, &request, response](int worker) {
    VehicleBench& bench = benches_[static_cast<std::size_t>(worker)];
    const Status status = Answer({fleet_, bench, call->cancelled()}, request, response);
    call->FinishWith(call->cancelled() ? grpc::Status::CANCELLED : ToGrpcStatus(status), *response);
  };
  grpc::Status refusal;
  const Status status = Guarded([&] {
    Status checked = Check(fleet_, request);
    if (!checked.ok()) return checked;
    refusal = call->Expect(MostAnswerBytes(request));
    if (refusal.ok() && !queue_.Post(call, work, context.peer())) {
      gate_.records().Refused(Refusal::kQueueFull);
      HintRetry(context);  // not for a request that is too large: that never fits
      checked = Status::ResourceExhausted(fmt::format(
          "calls: {} wait already, expected fewer of one connection", queue_.waiting()));
    }
    return checked;
  });
  if (status.ok() && refusal.ok()) return call;
  call->Finish(status.ok() ? refusal : ToGrpcStatus(status));
  return call;
}

grpc::ServerUnaryReactor* VehicleService::Solve(grpc::CallbackServerContext* context,
                                                const v1alpha1::SolveRequest* request,
                                                v1alpha1::SolveResponse* response) {
  return Later(*context, "VehicleService/Solve", *request, response);
}
grpc::ServerUnaryReactor* VehicleService::Energy(grpc::CallbackServerContext* context,
                                                 const v1alpha1::EnergyRequest* request,
                                                 v1alpha1::EnergyResponse* response) {
  return Later(*context, "VehicleService/Energy", *request, response);
}
grpc::ServerUnaryReactor* VehicleService::EvaluateTrajectories(
    grpc::CallbackServerContext* context, const v1alpha1::EvaluateTrajectoriesRequest* request,
    v1alpha1::EvaluateTrajectoriesResponse* response) {
  return Later(*context, "VehicleService/EvaluateTrajectories", *request, response);
}
grpc::ServerUnaryReactor* VehicleService::PlanSpeed(grpc::CallbackServerContext* context,
                                                    const v1alpha1::PlanSpeedRequest* request,
                                                    v1alpha1::PlanSpeedResponse* response) {
  return Later(*context, "VehicleService/PlanSpeed", *request, response);
}
grpc::ServerUnaryReactor* VehicleService::Grades(grpc::CallbackServerContext* context,
                                                 const v1alpha1::GradesRequest* request,
                                                 v1alpha1::GradesResponse* response) {
  return Later(*context, "VehicleService/Grades", *request, response);
}
grpc::ServerUnaryReactor* VehicleService::Constants(grpc::CallbackServerContext* context,
                                                    const v1alpha1::ConstantsRequest* request,
                                                    v1alpha1::ConstantsResponse* response) {
  return Later(*context, "VehicleService/Constants", *request, response);
}

grpc::ServerUnaryReactor* VehicleService::ListVehicles(grpc::CallbackServerContext* context,
                                                       const v1alpha1::ListVehiclesRequest* request,
                                                       v1alpha1::ListVehiclesResponse* response) {
  return AnswerNow(gate_, *context, "VehicleService/ListVehicles", *request, *response,
                   [&] { return ToGrpcStatus(fleet_.List(*request, response)); });
}

grpc::ServerUnaryReactor* VehicleService::GetVehicle(grpc::CallbackServerContext* context,
                                                     const v1alpha1::GetVehicleRequest* request,
                                                     v1alpha1::GetVehicleResponse* response) {
  return AnswerNow(gate_, *context, "VehicleService/GetVehicle", *request, *response, [&] {
    const ServedVehicle* served = nullptr;
    const Status status = fleet_.Find(request->vehicle(), &served);
    if (status.ok()) vehicle::ToMessage(served->described, response->mutable_vehicle());
    return ToGrpcStatus(status);
  });
}

}  // namespace grouser::server

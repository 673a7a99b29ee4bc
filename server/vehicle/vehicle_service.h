#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "grouser/v1alpha1/vehicle_service.grpc.pb.h"
#include "server/net/call_gate.h"
#include "server/vehicle/fleet.h"
#include "server/vehicle/vehicle_bench.h"
#include "server/vehicle/work_queue.h"

namespace grouser::server {

/// grouser.v1alpha1.VehicleService. Lists are answered on gRPC's threads; all else on `threads`
/// threads of its own, 5 nicer than the others, so that wheel queries are not queued behind plans.
/// Requests are checked (see vehicle_check.h) before they wait. At most kMostWaiting calls wait, in
/// 128 MiB, of one connection at most as many as leave as many places free; further ones get
/// RESOURCE_EXHAUSTED. A call that is cancelled (its deadline and the
/// server's end among the reasons) gives its place up at once, and its work ends at the next round
/// of solves; so does work of more than kMostCallTime, with RESOURCE_EXHAUSTED. Answers that are
/// large beside their requests are counted before they are made. `fleet` and `gate` must outlive
/// the service.
class VehicleService final : public v1alpha1::VehicleService::CallbackService {
 public:
  static constexpr std::size_t kMostWaiting = 64;

  VehicleService(const Fleet& fleet, CallGate& gate, int threads);
  ~VehicleService() override;

  /// How many calls wait.
  void AddTo(MetricPage* page) const;

  grpc::ServerUnaryReactor* Solve(grpc::CallbackServerContext* context,
                                  const v1alpha1::SolveRequest* request,
                                  v1alpha1::SolveResponse* response) override;
  grpc::ServerUnaryReactor* Energy(grpc::CallbackServerContext* context,
                                   const v1alpha1::EnergyRequest* request,
                                   v1alpha1::EnergyResponse* response) override;
  grpc::ServerUnaryReactor* EvaluateTrajectories(
      grpc::CallbackServerContext* context, const v1alpha1::EvaluateTrajectoriesRequest* request,
      v1alpha1::EvaluateTrajectoriesResponse* response) override;
  grpc::ServerUnaryReactor* PlanSpeed(grpc::CallbackServerContext* context,
                                      const v1alpha1::PlanSpeedRequest* request,
                                      v1alpha1::PlanSpeedResponse* response) override;
  grpc::ServerUnaryReactor* Grades(grpc::CallbackServerContext* context,
                                   const v1alpha1::GradesRequest* request,
                                   v1alpha1::GradesResponse* response) override;
  grpc::ServerUnaryReactor* Constants(grpc::CallbackServerContext* context,
                                      const v1alpha1::ConstantsRequest* request,
                                      v1alpha1::ConstantsResponse* response) override;
  grpc::ServerUnaryReactor* ListVehicles(grpc::CallbackServerContext* context,
                                         const v1alpha1::ListVehiclesRequest* request,
                                         v1alpha1::ListVehiclesResponse* response) override;
  grpc::ServerUnaryReactor* GetVehicle(grpc::CallbackServerContext* context,
                                       const v1alpha1::GetVehicleRequest* request,
                                       v1alpha1::GetVehicleResponse* response) override;

 private:
  template <class Request, class Response>
  grpc::ServerUnaryReactor* Later(grpc::CallbackServerContext& context, std::string_view method,
                                  const Request& request, Response* response);

  const Fleet& fleet_;
  CallGate& gate_;
  std::vector<VehicleBench> benches_;  // one a thread
  WorkQueue queue_;                    // last: its threads use all the rest
};

}  // namespace grouser::server

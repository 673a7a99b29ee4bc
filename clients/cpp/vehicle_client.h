#pragma once

#include <memory>
#include <string>
#include <utility>

#include "clients/cpp/channel.h"
#include "grouser/v1alpha1/vehicle_service.grpc.pb.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::client {

/// Vehicles over gRPC; thread-safe. Every call throws ClientError with status and text when it
/// fails. surrogate/vehicle/messages.h makes motions and paths messages, and answers plain structs.
class VehicleClient {
 public:
  explicit VehicleClient(std::string address, Milliseconds deadline = Milliseconds(10000))
      : VehicleClient(Server{std::move(address), {}}, deadline) {}
  /// Throws as MakeCredentials.
  explicit VehicleClient(Server server, Milliseconds deadline = Milliseconds(10000));

  v1alpha1::SolveResponse Solve(const v1alpha1::SolveRequest& request) const;
  v1alpha1::EnergyResponse Energy(const v1alpha1::EnergyRequest& request) const;
  /// surrogate/vehicle/trajectory_messages.h appends trajectories, and reads costs.
  v1alpha1::EvaluateTrajectoriesResponse EvaluateTrajectories(
      const v1alpha1::EvaluateTrajectoriesRequest& request) const;
  v1alpha1::PlanSpeedResponse PlanSpeed(const v1alpha1::PlanSpeedRequest& request) const;
  /// The same, reusing the memory of `response`.
  void PlanSpeed(const v1alpha1::PlanSpeedRequest& request,
                 v1alpha1::PlanSpeedResponse* response) const;
  v1alpha1::GradesResponse Grades(const v1alpha1::GradesRequest& request) const;
  v1alpha1::ConstantsResponse Constants(const v1alpha1::ConstantsRequest& request) const;
  /// All vehicles, of all pages.
  v1alpha1::ListVehiclesResponse ListVehicles() const;
  v1alpha1::GetVehicleResponse GetVehicle(const std::string& vehicle) const;

  const std::string& address() const { return server_.address; }

 private:
  Server server_;
  Milliseconds deadline_;
  std::unique_ptr<v1alpha1::VehicleService::Stub> stub_;
};

/// All options of a plan into a request.
void SetOptions(const vehicle::SpeedOptions& options, v1alpha1::PlanSpeedRequest* request);

}  // namespace grouser::client

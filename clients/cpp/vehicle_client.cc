#include "clients/cpp/vehicle_client.h"

#include <utility>

#include "clients/cpp/client_error.h"
#include "surrogate/vehicle/messages.h"

namespace grouser::client {
namespace {

using VehicleStub = v1alpha1::VehicleService::Stub;

}  // namespace

VehicleClient::VehicleClient(Server server, Milliseconds deadline)
    : server_(std::move(server)),
      deadline_(deadline),
      stub_(v1alpha1::VehicleService::NewStub(MakeChannel(server_))) {}

v1alpha1::SolveResponse VehicleClient::Solve(const v1alpha1::SolveRequest& request) const {
  return Call(*stub_, &VehicleStub::Solve, request, server_, deadline_);
}
v1alpha1::EnergyResponse VehicleClient::Energy(const v1alpha1::EnergyRequest& request) const {
  return Call(*stub_, &VehicleStub::Energy, request, server_, deadline_);
}
v1alpha1::EvaluateTrajectoriesResponse VehicleClient::EvaluateTrajectories(
    const v1alpha1::EvaluateTrajectoriesRequest& request) const {
  return Call(*stub_, &VehicleStub::EvaluateTrajectories, request, server_, deadline_);
}
v1alpha1::PlanSpeedResponse VehicleClient::PlanSpeed(
    const v1alpha1::PlanSpeedRequest& request) const {
  return Call(*stub_, &VehicleStub::PlanSpeed, request, server_, deadline_);
}
void VehicleClient::PlanSpeed(const v1alpha1::PlanSpeedRequest& request,
                              v1alpha1::PlanSpeedResponse* response) const {
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline_));
  ThrowUnlessOk(stub_->PlanSpeed(&context, request, response), server_, &context);
}
v1alpha1::GradesResponse VehicleClient::Grades(const v1alpha1::GradesRequest& request) const {
  return Call(*stub_, &VehicleStub::Grades, request, server_, deadline_);
}
v1alpha1::ConstantsResponse VehicleClient::Constants(
    const v1alpha1::ConstantsRequest& request) const {
  return Call(*stub_, &VehicleStub::Constants, request, server_, deadline_);
}

v1alpha1::ListVehiclesResponse VehicleClient::ListVehicles() const {
  v1alpha1::ListVehiclesResponse all;
  v1alpha1::ListVehiclesRequest request;
  do {
    const auto page = Call(*stub_, &VehicleStub::ListVehicles, request, server_, deadline_);
    request.set_page_token(page.next_page_token());
    all.MergeFrom(page);
  } while (!request.page_token().empty());
  all.clear_next_page_token();
  return all;
}

v1alpha1::GetVehicleResponse VehicleClient::GetVehicle(const std::string& vehicle) const {
  v1alpha1::GetVehicleRequest request;
  request.set_vehicle(vehicle);
  return Call(*stub_, &VehicleStub::GetVehicle, request, server_, deadline_);
}

void SetOptions(const vehicle::SpeedOptions& options, v1alpha1::PlanSpeedRequest* request) {
  request->set_speed_limit_m_per_s(options.speed_limit_m_per_s);
  request->set_worse_by_sd(options.worse_by_sd);
  vehicle::ToMessage(options, request->mutable_margins());
  request->set_acceleration_m_per_s2(options.acceleration_m_per_s2);
  request->set_braking_m_per_s2(options.braking_m_per_s2);
  request->set_start_m_per_s(options.start_m_per_s);
  request->set_end_m_per_s(options.end_m_per_s);
}

}  // namespace grouser::client

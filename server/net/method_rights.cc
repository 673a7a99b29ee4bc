#include "server/net/method_rights.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace grouser::server {
namespace {

constexpr std::string_view kTerrain = "grouser.v1alpha1.TerrainService";
constexpr std::string_view kVehicle = "grouser.v1alpha1.VehicleService";
constexpr std::string_view kJobs = "grouser.v1alpha1.JobsService";
constexpr std::string_view kOperator = "grouser.v1alpha1.OperatorService";
constexpr std::string_view kHealth = "grpc.health.v1.Health";
constexpr std::string_view kReflection = "grpc.reflection.v1alpha.ServerReflection";

constexpr MethodRight kRights[] = {
    {kTerrain, "EvaluateWheels", Role::kRead},
    {kTerrain, "StreamWheels", Role::kRead},
    {kTerrain, "ListModels", Role::kRead},
    {kTerrain, "GetModel", Role::kRead},
    {kTerrain, "Explain", Role::kRead},
    {kVehicle, "Solve", Role::kRead},
    {kVehicle, "Energy", Role::kRead},
    {kVehicle, "EvaluateTrajectories", Role::kRead},
    {kVehicle, "PlanSpeed", Role::kRead},
    {kVehicle, "Grades", Role::kRead},
    {kVehicle, "Constants", Role::kRead},
    {kVehicle, "ListVehicles", Role::kRead},
    {kVehicle, "GetVehicle", Role::kRead},
    {kJobs, "SubmitRefinement", Role::kSubmit},
    {kJobs, "SubmitCampaign", Role::kSubmit},
    {kJobs, "SubmitCalibration", Role::kSubmit},
    {kJobs, "GetJob", Role::kRead},
    {kJobs, "ReadJobFile", Role::kRead},
    {kJobs, "ListJobs", Role::kRead},
    {kJobs, "WatchJob", Role::kRead},
    {kJobs, "CancelJob", Role::kSubmit},
    {kJobs, "Promote", Role::kPromote},    // with override_gate: kAdmin
    {kJobs, "MoveAlias", Role::kPromote},  // the same
    {kJobs, "RollbackAlias", Role::kPromote},
    {kJobs, "ListAliasMoves", Role::kRead},
    {kJobs, "Prune", Role::kAdmin},
    {kOperator, "GetBuildInfo", Role::kRead},
    // Asked by what watches a program, and by the program itself.
    {kHealth, "Check", Role::kNone},
    {kHealth, "Watch", Role::kNone},
    {kReflection, "ServerReflectionInfo", Role::kRead},
};

constexpr std::array kRoleNames = {"none", "read", "submit", "promote", "admin"};

const MethodRight* Find(std::string_view service, std::string_view method) {
  const auto* found = std::find_if(
      std::begin(kRights), std::end(kRights),
      [&](const MethodRight& r) { return r.method == method && r.service == service; });
  return found == std::end(kRights) ? nullptr : found;
}

}  // namespace

const char* NameOf(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

std::optional<Role> RoleNamed(std::string_view name) {
  for (std::size_t i = 1; i < kRoleNames.size(); ++i) {
    if (name == kRoleNames[i]) return static_cast<Role>(i);
  }
  return std::nullopt;
}

std::span<const MethodRight> MethodRights() { return kRights; }

std::optional<Role> RoleNeeded(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos || slash == 0 || path[0] != '/') return std::nullopt;
  const MethodRight* found = Find(path.substr(1, slash - 1), path.substr(slash + 1));
  if (found == nullptr) return std::nullopt;
  return found->role;
}

void CheckTableCovers(const std::string& service) {
  const auto* known =
      google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
  if (known == nullptr) throw std::logic_error("rights: no such service: " + service);
  std::string missing;
  for (int i = 0; i < known->method_count(); ++i) {
    const std::string& method = known->method(i)->name();
    if (Find(service, method) == nullptr) missing += " " + service + "/" + method;
  }
  if (!missing.empty()) throw std::logic_error("rights: the table lacks" + missing);
}

}  // namespace grouser::server

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "grouser/v1alpha1/vehicle_service.pb.h"
#include "server/core/status.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::server {

inline constexpr int kMaxVehiclesPageSize = 1000;

/// A vehicle of a server with its models.
struct ServedVehicle {
  vehicle::VehicleFile file;
  vehicle::DescribedVehicle described;
  std::size_t index = 0;  ///< in the fleet
};

/// The vehicles of a server: read once, at start, and immutable.
class Fleet {
 public:
  /// Vehicle files, and folders of which every *.vehicle.yaml is read. What cannot be read, and a
  /// second vehicle of one name, is left out and named in problems().
  explicit Fleet(const std::vector<std::string>& files_and_folders);

  /// By name, ascending.
  const std::vector<std::unique_ptr<ServedVehicle>>& vehicles() const { return vehicles_; }
  const std::vector<std::string>& problems() const { return problems_; }

  /// Empty: the only vehicle. NOT_FOUND, INVALID_ARGUMENT.
  Status Find(const std::string& name, const ServedVehicle** vehicle) const;

  /// One page; the token is the name of the last vehicle of the page before.
  Status List(const v1alpha1::ListVehiclesRequest& request,
              v1alpha1::ListVehiclesResponse* response) const;

 private:
  void AddFolder(const std::string& folder);
  void Add(const std::string& file);

  std::vector<std::unique_ptr<ServedVehicle>> vehicles_;
  std::vector<std::string> problems_;
};

}  // namespace grouser::server

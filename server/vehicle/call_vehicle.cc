#include "server/vehicle/call_vehicle.h"

#include <stdexcept>
#include <string>

#include "server/vehicle/vehicle_check.h"
#include "surrogate/vehicle/mixture_ground.h"

namespace grouser::server {

CallVehicle::CallVehicle(const ServedVehicle& served, const Mixtures& mixtures, VehicleBench& bench)
    : vehicle_(&served), bench_(&bench) {
  if (mixtures.empty()) return;
  ServedVehicle& own = own_.emplace();
  own.file.vehicle = served.file.vehicle;
  own.file.grounds = served.file.grounds;  // its models are those of `served`
  own.file.sources = served.file.sources;
  for (int i = 0; i < mixtures.size(); ++i) {
    const std::string field = "mixtures[" + std::to_string(i) + "]";
    const vehicle::NamedWeights weights =
        Reading([&] { return vehicle::FromMessage(field, mixtures[i]); });
    try {
      vehicle::AddMixture(mixtures[i].name(), weights, &own.file);
    } catch (const std::invalid_argument& error) {
      throw StatusError(StatusCode::kInvalidArgument, field + ": " + error.what());
    }
  }
  own.described = {own.file.vehicle, own.file.grounds.soils, own.file.sources};
  vehicle_ = &own;
  bench_ = &own_bench_.emplace(1);
}

}  // namespace grouser::server

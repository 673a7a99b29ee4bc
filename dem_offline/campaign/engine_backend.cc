#include <memory>
#include <stdexcept>

#include "dem_offline/campaign/backend.h"

namespace grouser::campaign {
namespace {

/// Null: the cores.
std::shared_ptr<dem::gpu::Device> Choose(const std::string& name) {
  if (name == "cpu") return nullptr;
  if (name != "auto") return dem::gpu::OpenDevice(name);
  try {
    return dem::gpu::OpenDevice("cuda");
  } catch (const std::exception&) {
    return nullptr;
  }
}

}  // namespace

Backend EngineBackend(const std::string& device_name) {
  Backend backend{.validate = dem::ValidateSpec,
                  .prepare_tile = dem::PrepareTile,
                  .run = dem::RunWheelTest,
                  .run_many = {},
                  .engine_version = dem::EngineVersion(),
                  .isa = dem::EngineIsa()};
  const std::shared_ptr<dem::gpu::Device> device = Choose(device_name);
  if (!device) return backend;
  backend.isa = device->name();
  backend.run = [device](const dem::WheelTestSpec& spec, const dem::Tile& tile,
                         const dem::ProgressFn& progress) {
    return dem::gpu::RunWheelTests({{spec, &tile}}, *device, progress)[0];
  };
  backend.run_many = [device](const std::vector<dem::gpu::WheelJob>& jobs,
                              const dem::ProgressFn& progress, const Backend::Done& done) {
    dem::gpu::RunWheelTests(jobs, *device, progress, done);
  };
  return backend;
}

}  // namespace grouser::campaign

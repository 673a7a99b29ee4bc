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

Backend EngineBackend(const std::string& device_name, const dem::WorkLimits& limits) {
  Backend backend;
  backend.limits = limits;
  backend.engine_version = dem::EngineVersion();
  backend.isa = dem::EngineIsa();
  backend.validate = [limits](const dem::WheelTestSpec& spec) { dem::ValidateSpec(spec, limits); };
  backend.prepare_bed = [limits](const dem::BedSpec& bed, const dem::ProgressFn& progress) {
    return dem::PrepareBed(bed, progress, limits);
  };
  backend.run = [limits](const dem::WheelTestSpec& spec, const dem::Tile& tile,
                         const dem::ProgressFn& progress) {
    return dem::RunWheelTest(spec, tile, progress, limits);
  };
  const std::shared_ptr<dem::gpu::Device> device = Choose(device_name);
  if (!device) return backend;
  backend.isa = device->name();
  backend.run = [device, limits](const dem::WheelTestSpec& spec, const dem::Tile& tile,
                                 const dem::ProgressFn& progress) {
    return dem::gpu::RunWheelTests({{spec, &tile}}, *device, progress, {}, limits)[0];
  };
  backend.run_many = [device, limits](const std::vector<dem::gpu::WheelJob>& jobs,
                                      const dem::ProgressFn& progress, const Backend::Done& done) {
    dem::gpu::RunWheelTests(jobs, *device, progress, done, limits);
  };
  return backend;
}

}  // namespace grouser::campaign

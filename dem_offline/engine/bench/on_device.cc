// Beds on a device: all worlds of a repetition in one ensemble.
#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>

#include "dem_offline/engine/bench/workload.h"
#include "dem_offline/engine/gpu/ensemble.h"

namespace grouser::dem::bench {
namespace {

constexpr std::size_t kCopyBytes = std::size_t{1} << 30;
constexpr std::size_t kEmulatedCopyBytes = std::size_t{1} << 26;

void RunTimed(gpu::Ensemble& all, std::int64_t steps, double* wall_s) {
  const auto begin = std::chrono::steady_clock::now();
  all.Run(steps);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  *wall_s += took.count();
  for (int w = 0; w < all.size(); ++w) {
    if (all.fault(w) != StepFault::kNone) {
      throw std::runtime_error(std::string("bench: ") + Explain(all.fault(w)));
    }
  }
}

}  // namespace

void RunOnDevice(const Bed& bed, gpu::Device& device, BenchResult* out) {
  const BenchOptions& o = out->options;
  WorldConfig config = BenchConfig(bed, 1, o.laws);
  config.skin_m = o.skin_m;
  std::vector<std::unique_ptr<World>> worlds;
  std::vector<World*> pointers;
  for (int w = 0; w < o.worlds; ++w) {
    worlds.push_back(std::make_unique<World>(config, BenchContents(bed)));
    pointers.push_back(worlds.back().get());
  }
  gpu::Ensemble all(pointers, device);
  double wall = 0, untimed = 0;
  RunTimed(all, o.warmup, &untimed);
  const std::int32_t rebuilds = all.rebuilds(0);
  RunTimed(all, o.steps, &wall);
  out->wall_s.push_back(wall);
  out->cpu_s.push_back(wall);
  out->rates.push_back(static_cast<double>(out->particles) * o.worlds *
                       static_cast<double>(o.steps) / wall);
  out->rebuilds = all.rebuilds(0) - rebuilds;
  double touching = 0;
  for (const GrainLoad& f : all.Loads(0)) touching += f.touching;
  out->contacts_per_particle = touching / static_cast<double>(out->particles);
  out->bytes_per_particle_step =
      all.BytesPerStep() / (static_cast<double>(out->particles) * o.worlds);
  out->device_bytes = static_cast<double>(all.Plan().Total());
  all.Pull(0);
  out->physics = Measure(*worlds[0], StressVolume(bed));
}

double DeviceCopyRate(gpu::Device& device, const std::string& name) {
  const std::size_t most = name == "cuda" ? kCopyBytes : kEmulatedCopyBytes;
  return gpu::CopyRate(device, std::min(most, device.FreeBytes() / 4));
}

}  // namespace grouser::dem::bench

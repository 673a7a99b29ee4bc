#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "dem_offline/engine/gpu/device.h"

namespace grouser::dem::gpu {

std::unique_ptr<Device> OpenDevice(const std::string& name) {
  if (name == "emulated") return EmulatedDevice();
  if (name == "cuda") {
#if defined(GROUSER_HAS_CUDA)
    return CudaDevice();
#else
    throw std::invalid_argument(
        "device: cuda: this build has no CUDA (GROUSER_CUDA=ON), "
        "expected cpu or emulated");
#endif
  }
  throw std::invalid_argument("device: " + name + ", expected cuda or emulated");
}

double CopyRate(Device& device, std::size_t bytes) {
  constexpr int kTries = 10;
  const Buffer<char> a(device, bytes), b(device, bytes);
  double best = 0;
  for (int k = 0; k <= kTries; ++k) {  // the first one warms up
    const auto begin = std::chrono::steady_clock::now();
    device.Copy(b.data(), a.data(), bytes);
    device.Finish();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    if (k > 0) best = std::max(best, 2.0 * static_cast<double>(bytes) / took.count());
  }
  return best;
}

}  // namespace grouser::dem::gpu

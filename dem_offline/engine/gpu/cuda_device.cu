// Launches of the ensemble's bodies on a CUDA card, and nothing else.
#include <stdexcept>
#include <string>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/gpu/step_body.h"

namespace grouser::dem::gpu {
namespace {

constexpr int kThreads = 128;

void Check(cudaError_t error, const char* what) {
  if (error != cudaSuccess) {
    throw std::runtime_error(std::string("cuda: ") + what + ": " + cudaGetErrorString(error));
  }
}

template <class Body>
__global__ void Run(std::int64_t count, Body body) {
  const std::int64_t i = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < count) body(i);
}

struct Threads {
  template <class Body>
  void operator()(std::int64_t count, const Body& body) const {
    if (count == 0) return;
    Run<<<static_cast<unsigned>((count + kThreads - 1) / kThreads), kThreads>>>(count, body);
  }
};

class Cuda : public Device {
 public:
  Cuda() {
    cudaDeviceProp properties;
    Check(cudaGetDeviceProperties(&properties, 0), "no device");
    name_ = properties.name;
  }
  const char* name() const override { return name_.c_str(); }
  void* Allocate(std::size_t bytes) override {
    void* p = nullptr;
    if (cudaMalloc(&p, bytes) != cudaSuccess) throw std::bad_alloc();
    return p;
  }
  void Free(void* p) override { cudaFree(p); }
  void Upload(void* to, const void* from, std::size_t bytes) override {
    Check(cudaMemcpy(to, from, bytes, cudaMemcpyHostToDevice), "upload");
  }
  void Download(void* to, const void* from, std::size_t bytes) override {
    Check(cudaMemcpy(to, from, bytes, cudaMemcpyDeviceToHost), "download");
  }
  void Copy(void* to, const void* from, std::size_t bytes) override {
    Check(cudaMemcpy(to, from, bytes, cudaMemcpyDeviceToDevice), "copy");
  }
  void Finish() override { Check(cudaDeviceSynchronize(), "finish"); }
  std::size_t FreeBytes() const override {
    std::size_t free = 0, total = 0;
    Check(cudaMemGetInfo(&free, &total), "memory");
    return free;
  }
  void Start(const EnsembleView& v, int recipe, const PairParams& first) override {
    WithRecipe(recipe, v, first, Recipes{},
               [&](const auto& law) { gpu::Start(Threads{}, v, law); });
    Check(cudaDeviceSynchronize(), "start");
  }
  void Steps(const EnsembleView& v, int recipe, const PairParams& first, int steps) override {
    WithRecipe(recipe, v, first, Recipes{}, [&](const auto& law) {
      for (int s = 0; s < steps; ++s) gpu::Step(Threads{}, v, law);
    });
    Check(cudaGetLastError(), "launch");
    Check(cudaDeviceSynchronize(), "steps");
  }

 private:
  std::string name_;
};

}  // namespace

std::unique_ptr<Device> CudaDevice() { return std::make_unique<Cuda>(); }

}  // namespace grouser::dem::gpu

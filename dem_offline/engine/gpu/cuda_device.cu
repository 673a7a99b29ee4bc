// Launches of the ensemble's bodies on a CUDA card, and nothing else.
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/gpu/sort_body.h"
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
  cudaStream_t stream;
  template <class Body>
  void operator()(std::int64_t count, const Body& body) const {
    if (count == 0) return;
    const auto blocks = static_cast<unsigned>((count + kThreads - 1) / kThreads);
    Run<<<blocks, kThreads, 0, stream>>>(count, body);
  }
};

/// The launches of one step as a graph, as long as nothing moves in memory.
class StepGraph {
 public:
  StepGraph() = default;
  StepGraph(const StepGraph&) = delete;
  StepGraph& operator=(const StepGraph&) = delete;
  ~StepGraph() { Drop(); }

  void Launch(cudaStream_t stream, const EnsembleView& v, int combination, int steps) {
    if (!graph_ || combination != combination_ || std::memcmp(&v, &view_, sizeof(v)) != 0) {
      Record(stream, v, combination);
    }
    for (int s = 0; s < steps; ++s) Check(cudaGraphLaunch(graph_, stream), "graph launch");
  }

 private:
  void Drop() {
    if (graph_) cudaGraphExecDestroy(graph_);
    graph_ = nullptr;
  }
  void Record(cudaStream_t stream, const EnsembleView& v, int combination) {
    Drop();
    cudaGraph_t recorded = nullptr;
    Check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capture");
    WithCombination(combination, CompiledCombinations{},
                    [&](auto laws) { gpu::Step<decltype(laws)>(Threads{stream}, v); });
    Check(cudaStreamEndCapture(stream, &recorded), "end of capture");
    const cudaError_t made = cudaGraphInstantiate(&graph_, recorded, 0);
    cudaGraphDestroy(recorded);
    Check(made, "graph");
    std::memcpy(&view_, &v, sizeof(v));
    combination_ = combination;
  }

  cudaGraphExec_t graph_ = nullptr;
  EnsembleView view_ = {};
  int combination_ = -1;
};

class Cuda : public Device {
 public:
  Cuda() {
    cudaDeviceProp properties;
    Check(cudaGetDeviceProperties(&properties, 0), "no device");
    name_ = properties.name;
    Check(cudaStreamCreate(&stream_), "stream");
  }
  ~Cuda() override { cudaStreamDestroy(stream_); }
  Cuda(const Cuda&) = delete;
  Cuda& operator=(const Cuda&) = delete;
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
  void Start(const EnsembleView& v, int combination) override {
    WithCombination(combination, CompiledCombinations{},
                    [&](auto laws) { gpu::Start<decltype(laws)>(Threads{stream_}, v); });
    Check(cudaGetLastError(), "launch");
    Check(cudaStreamSynchronize(stream_), "start");
  }
  void Steps(const EnsembleView& v, int combination, int steps) override {
    step_.Launch(stream_, v, combination, steps);
    Check(cudaStreamSynchronize(stream_), "steps");
  }
  void Sort(const EnsembleView& v, const SortArrays& a) override {
    const auto radix = [&](const SortArrays& s, std::int64_t n) {
      std::size_t bytes = 0;
      const auto pass = [&](void* room) {
        Check(cub::DeviceRadixSort::SortPairs(room, bytes, s.key, s.key_sorted, s.place,
                                              s.place_sorted, n, 0, 64, stream_),
              "sort");
      };
      pass(nullptr);
      void* room = nullptr;
      Check(cudaMallocAsync(&room, bytes, stream_), "room to sort in");
      pass(room);
      Check(cudaFreeAsync(room, stream_), "room to sort in");
    };
    SortGrains(Threads{stream_}, radix, v, a);
    Check(cudaStreamSynchronize(stream_), "sort");
  }

 private:
  std::string name_;
  cudaStream_t stream_ = nullptr;
  StepGraph step_;
};

}  // namespace

std::unique_ptr<Device> CudaDevice() { return std::make_unique<Cuda>(); }

}  // namespace grouser::dem::gpu

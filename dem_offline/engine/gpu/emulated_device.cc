// The ensemble's bodies, index by index, by one thread: what every machine can
// test.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/gpu/sort_body.h"
#include "dem_offline/engine/gpu/step_body.h"

namespace grouser::dem::gpu {
namespace {

struct OneThread {
  template <class Body>
  void operator()(std::int64_t count, const Body& body) const {
    for (std::int64_t i = 0; i < count; ++i) body(i);
  }
};

class Emulated : public Device {
 public:
  explicit Emulated(std::size_t memory_bytes) : free_(memory_bytes) {}
  const char* name() const override { return "emulated"; }
  void* Allocate(std::size_t bytes) override {
    if (bytes > free_) throw std::bad_alloc();
    void* p = std::aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (!p) throw std::bad_alloc();
    std::memset(p, 0xa5, bytes);  // nobody relies on what was never written
    free_ -= bytes;
    sizes_[p] = bytes;
    return p;
  }
  void Free(void* p) override {
    free_ += sizes_.at(p);
    sizes_.erase(p);
    std::free(p);
  }
  void Finish() override {}
  std::size_t FreeBytes() const override { return free_; }
  void Upload(void* to, const void* from, std::size_t bytes) override {
    if (bytes > 0) std::memcpy(to, from, bytes);
  }
  void Download(void* to, const void* from, std::size_t bytes) override { Upload(to, from, bytes); }
  void Copy(void* to, const void* from, std::size_t bytes) override { Upload(to, from, bytes); }
  void Start(const EnsembleView& v, int combination) override {
    WithCombination(combination, CompiledCombinations{},
                    [&](auto laws) { gpu::Start<decltype(laws)>(OneThread{}, v); });
  }
  void Steps(const EnsembleView& v, int combination, int steps) override {
    WithCombination(combination, CompiledCombinations{}, [&](auto laws) {
      for (int s = 0; s < steps; ++s) gpu::Step<decltype(laws)>(OneThread{}, v);
    });
  }
  void Sort(const EnsembleView& v, const SortArrays& a) override {
    const auto stable = [](const SortArrays& s, std::int64_t n) {
      std::vector<std::int64_t> order(static_cast<std::size_t>(n));
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(),
                       [&](std::int64_t x, std::int64_t y) { return s.key[x] < s.key[y]; });
      for (std::int64_t i = 0; i < n; ++i) {
        s.key_sorted[i] = s.key[order[i]];
        s.place_sorted[i] = s.place[order[i]];
      }
    };
    SortGrains(OneThread{}, stable, v, a);
  }

 private:
  std::size_t free_;
  std::unordered_map<void*, std::size_t> sizes_;
};

}  // namespace

std::unique_ptr<Device> EmulatedDevice(std::size_t memory_bytes) {
  return std::make_unique<Emulated>(memory_bytes);
}

}  // namespace grouser::dem::gpu

#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dem_offline/engine/gpu/ensemble_view.h"

namespace grouser::dem::gpu {

struct SortArrays;

/// Where an ensemble lives and is worked on: a card, or this process, where one
/// thread runs the same bodies index by index.
class Device {
 public:
  virtual ~Device() = default;
  virtual const char* name() const = 0;
  virtual void* Allocate(std::size_t bytes) = 0;  ///< throws std::bad_alloc
  virtual void Free(void* p) = 0;
  virtual void Upload(void* to, const void* from, std::size_t bytes) = 0;
  virtual void Download(void* to, const void* from, std::size_t bytes) = 0;
  virtual void Copy(void* to, const void* from, std::size_t bytes) = 0;  ///< within the device
  virtual void Finish() = 0;                  ///< waits for all that was asked for
  virtual std::size_t FreeBytes() const = 0;  ///< that can still be had
  /// Lists where they are stale; of worlds that have not started also forces at
  /// the present positions, and velocities set back by half a step. combination:
  /// number of the compiled law combination; -1: the generic path.
  virtual void Start(const EnsembleView& v, int combination) = 0;
  virtual void Steps(const EnsembleView& v, int combination, int steps) = 0;
  /// Grains of the wanted worlds in the order of space; see sort_body.h. A start
  /// with EnsembleView::was must follow.
  virtual void Sort(const EnsembleView& v, const SortArrays& a) = 0;
};

/// memory_bytes: what it may take.
std::unique_ptr<Device> EmulatedDevice(std::size_t memory_bytes = ~std::size_t{0});
/// The CUDA card of this process. Throws std::runtime_error without one. Only
/// in builds with GROUSER_CUDA.
std::unique_ptr<Device> CudaDevice();
/// "emulated" or "cuda". Throws std::invalid_argument for another name, and for
/// "cuda" in a build without it.
std::unique_ptr<Device> OpenDevice(const std::string& name);

/// Bytes read and written per second when the device copies far more than its
/// caches hold.
double CopyRate(Device& device, std::size_t bytes);

/// Memory of a device.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(Device& device, std::size_t count)
      : device_(&device), count_(count), data_(static_cast<T*>(device.Allocate(Bytes()))) {}
  Buffer(Buffer&& o) noexcept { *this = std::move(o); }
  Buffer& operator=(Buffer&& o) noexcept {
    std::swap(device_, o.device_);
    std::swap(count_, o.count_);
    std::swap(data_, o.data_);
    return *this;
  }
  ~Buffer() {
    if (data_) device_->Free(data_);
  }
  T* data() const { return data_; }
  std::size_t size() const { return count_; }
  std::size_t Bytes() const { return (count_ > 0 ? count_ : 1) * sizeof(T); }
  void Upload(const std::vector<T>& from, std::int64_t first = 0) {
    device_->Upload(data_ + first, from.data(), from.size() * sizeof(T));
  }
  std::vector<T> Download() const { return Download(0, static_cast<std::int64_t>(count_)); }
  std::vector<T> Download(std::int64_t first, std::int64_t count) const {
    std::vector<T> out(static_cast<std::size_t>(count));
    device_->Download(out.data(), data_ + first, out.size() * sizeof(T));
    return out;
  }
  void CopyFrom(const Buffer& o) {
    if (device_) device_->Copy(data_, o.data_, count_ * sizeof(T));
  }

 private:
  Device* device_ = nullptr;
  std::size_t count_ = 0;
  T* data_ = nullptr;
};

}  // namespace grouser::dem::gpu

#include "dem_offline/engine/gpu/ensemble_memory.h"

namespace grouser::dem::gpu {
namespace {

/// What was there before goes first.
template <class T>
void Make(Device& device, std::int64_t count, Buffer<T>* array) {
  *array = Buffer<T>();
  *array = Buffer<T>(device, static_cast<std::size_t>(count));
}
template <class T>
void Make(Device& device, std::int64_t count, Kept<T>* array) {
  Make(device, count, &array->now);
  Make(device, count, &array->then);
}

template <class T>
constexpr std::size_t SizeOf(const Buffer<T>&) {
  return sizeof(T);
}
template <class T>
constexpr std::size_t SizeOf(const Kept<T>&) {
  return sizeof(T);
}

template <class Array>
concept HasCheckpoint = requires(Array a) {
  a.then;
};

template <class F>
void ForKept(EnsembleMemory& memory, F&& f) {
  memory.ForEach([&](auto& array, const Extent&, auto) {
    if constexpr (HasCheckpoint<decltype(array)>) f(array);
  });
  f(memory.wheels);
  f(memory.stress);
}

}  // namespace

void EnsembleMemory::Allocate(Device& device, const Layout& layout, int words) {
  ForEach([&](auto& array, const Extent& extent, auto) {
    Make(device, ElementsOf(extent, layout, words), &array);
  });
}

void EnsembleMemory::Relayout(Device& device, const Layout& from, const Layout& to, int words) {
  ForEach([&](auto& array, const Extent& extent, auto) {
    const std::int64_t count = ElementsOf(extent, to, words);
    if constexpr (HasCheckpoint<decltype(array)>) {
      const auto state = Moved(array.now.Download(), extent, from, to, words);
      Make(device, count, &array);
      array.now.Upload(state);
    } else {
      Make(device, count, &array);
    }
  });
}

MemoryPlan PlanOf(const Layout& layout, int words) {
  MemoryPlan plan;
  EnsembleMemory none;
  none.ForEach([&](auto& array, const Extent& extent, auto use) {
    const std::size_t bytes = ElementsOf(extent, layout, words) * SizeOf(array);
    plan.*use += bytes;
    if constexpr (HasCheckpoint<decltype(array)>) plan.checkpoint += bytes;
  });
  plan.grains += layout.clump_members * sizeof(std::int32_t);
  return plan;
}

std::string ToText(const MemoryPlan& p) {
  const auto mib = [](std::size_t bytes) { return std::to_string((bytes + (1u << 20) - 1) >> 20); };
  return mib(p.Total()) + " MiB: grains " + mib(p.grains) + ", lists " + mib(p.lists) +
         ", histories " + mib(p.histories) + ", cells " + mib(p.cells) + ", bodies " +
         mib(p.bodies) + ", checkpoint " + mib(p.checkpoint);
}

void EnsembleMemory::AllocateWheels(Device& device, std::size_t worlds_count, std::size_t bins) {
  Make(device, static_cast<std::int64_t>(worlds_count), &wheels);
  Make(device, static_cast<std::int64_t>(3 * bins), &stress);
}

void EnsembleMemory::Checkpoint() {
  ForKept(*this, [](auto& a) { a.then.CopyFrom(a.now); });
}
void EnsembleMemory::Restore() {
  ForKept(*this, [](auto& a) { a.now.CopyFrom(a.then); });
}

}  // namespace grouser::dem::gpu

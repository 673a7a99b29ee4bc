#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace grouser::server {

/// A number that only grows, or one that is set. Any thread; for counting, not for
/// ordering: no lock, no allocation.
class Counter {
 public:
  void Add(std::uint64_t n = 1) { value_.fetch_add(n, std::memory_order_relaxed); }
  void Set(std::uint64_t n) { value_.store(n, std::memory_order_relaxed); }
  std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

/// How long things took, in buckets of half a decade from 1 us to 30 s. As Counter.
class DurationHistogram {
 public:
  /// Upper bounds [ns]; what took longer is in one bucket more.
  static constexpr std::array<std::int64_t, 16> kBoundsNs = {
      1'000,         3'000,         10'000,         30'000,        100'000,     300'000,
      1'000'000,     3'000'000,     10'000'000,     30'000'000,    100'000'000, 300'000'000,
      1'000'000'000, 3'000'000'000, 10'000'000'000, 30'000'000'000};

  void Add(std::chrono::nanoseconds spent) {
    const std::int64_t ns = spent.count();
    std::size_t i = 0;
    while (i < kBoundsNs.size() && ns > kBoundsNs[i]) ++i;
    buckets_[i].Add();
    sum_ns_.Add(ns > 0 ? static_cast<std::uint64_t>(ns) : 0);
  }
  /// What another one counted.
  void Add(const DurationHistogram& other) {
    for (std::size_t i = 0; i < buckets_.size(); ++i) buckets_[i].Add(other.buckets_[i].value());
    sum_ns_.Add(other.sum_ns_.value());
  }
  /// Of bucket i alone; kBoundsNs.size(): beyond the last bound.
  std::uint64_t in_bucket(std::size_t i) const { return buckets_[i].value(); }
  double sum_s() const { return 1e-9 * static_cast<double>(sum_ns_.value()); }
  std::uint64_t count() const {
    std::uint64_t all = 0;
    for (const Counter& bucket : buckets_) all += bucket.value();
    return all;
  }

 private:
  std::array<Counter, kBoundsNs.size() + 1> buckets_;
  Counter sum_ns_;
};

}  // namespace grouser::server

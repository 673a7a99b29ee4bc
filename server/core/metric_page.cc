#include "server/core/metric_page.h"

#include <malloc.h>
#include <prometheus/check_names.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace grouser::server {
namespace {

using prometheus::MetricType;

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Fields of /proc/self/stat behind the program's name, which may hold spaces; from state on.
std::vector<std::string> ProcessStat() {
  std::ifstream file("/proc/self/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream rest(text.substr(std::min(text.rfind(')') + 1, text.size())));
  return {std::istream_iterator<std::string>(rest), {}};
}

/// Seconds since 1970 at which the machine started; 0: unknown.
double BootTime() {
  std::ifstream file("/proc/stat");
  for (std::string word; file >> word;) {
    double seconds = 0;
    if (word == "btime" && file >> seconds) return seconds;
  }
  return 0;
}

void AddMemoryAndStart(MetricPage* page) {
  // Places behind the name: utime 11, stime 12, starttime 19 (ticks), vsize 20 (bytes), rss 21
  // (pages).
  const auto stat = ProcessStat();
  if (stat.size() < 22) return;
  page->AddGauge("process_virtual_memory_bytes", "Address space.", std::stod(stat[20]));
  page->AddGauge("process_resident_memory_bytes", "Memory that is not swapped out.",
                 std::stod(stat[21]) * static_cast<double>(::sysconf(_SC_PAGESIZE)));
  page->AddGauge("process_start_time_seconds", "Start, in seconds since 1970.",
                 BootTime() + std::stod(stat[19]) / static_cast<double>(::sysconf(_SC_CLK_TCK)));
}

}  // namespace

void MetricPage::AddFamily(const std::string& name, const std::string& help, MetricType type) {
  if (place_of_.contains(name)) return;
  if (!prometheus::CheckMetricName(name)) throw std::logic_error("no name of a metric: " + name);
  place_of_[name] = families_.size();
  families_.push_back({name, help, type, {}});
}

prometheus::ClientMetric& MetricPage::Add(const std::string& name, const std::string& help,
                                          MetricType type, Labels labels) {
  AddFamily(name, help, type);
  for (const auto& label : labels) {
    if (!prometheus::CheckLabelName(label.name)) {
      throw std::logic_error("no name of a label: " + label.name);
    }
  }
  auto& metric = families_[place_of_[name]].metric.emplace_back();
  metric.label = std::move(labels);
  return metric;
}

void MetricPage::AddCounter(const std::string& name, const std::string& help, double value,
                            Labels labels) {
  Add(name, help, MetricType::Counter, std::move(labels)).counter.value = value;
}

void MetricPage::AddGauge(const std::string& name, const std::string& help, double value,
                          Labels labels) {
  Add(name, help, MetricType::Gauge, std::move(labels)).gauge.value = value;
}

void MetricPage::AddDurations(const std::string& name, const std::string& help,
                              const DurationHistogram& durations, Labels labels) {
  auto& histogram = Add(name, help, MetricType::Histogram, std::move(labels)).histogram;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < DurationHistogram::kBoundsNs.size(); ++i) {
    below += durations.in_bucket(i);
    histogram.bucket.push_back(
        {below, 1e-9 * static_cast<double>(DurationHistogram::kBoundsNs[i])});
  }
  histogram.sample_count = below + durations.in_bucket(DurationHistogram::kBoundsNs.size());
  histogram.sample_sum = durations.sum_s();
}

std::string MetricPage::Text() const { return prometheus::TextSerializer().Serialize(families_); }

void AddProcessMetrics(MetricPage* page) {
  AddMemoryAndStart(page);
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0) {
    page->AddCounter("process_cpu_seconds_total", "Processor time, of the user and the system.",
                     Seconds(usage.ru_utime) + Seconds(usage.ru_stime));
  }
  std::error_code error;
  const auto open = std::filesystem::directory_iterator("/proc/self/fd", error);
  if (!error) {
    page->AddGauge("process_open_fds", "Open descriptors.",
                   static_cast<double>(std::distance(begin(open), end(open))));
  }
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    page->AddGauge("process_max_fds", "Most open descriptors.",
                   static_cast<double>(limit.rlim_cur));
  }
  const auto heap = ::mallinfo2();
  const char* help = "Heap, as the C library has it: in use, and kept free for later use.";
  page->AddGauge("grouser_heap_bytes", help, static_cast<double>(heap.uordblks + heap.hblkhd),
                 {{"state", "in_use"}});
  page->AddGauge("grouser_heap_bytes", help, static_cast<double>(heap.fordblks),
                 {{"state", "free"}});
}

}  // namespace grouser::server

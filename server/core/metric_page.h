#pragma once

#include <prometheus/metric_family.h>

#include <map>
#include <string>
#include <vector>

#include "server/core/metrics.h"

namespace grouser::server {

/// Metrics at one moment, for Prometheus to read. Names by its conventions: base units,
/// _total for what only grows. A family may be added without a value, so that it is named
/// and explained before anything happened.
class MetricPage {
 public:
  using Labels = std::vector<prometheus::ClientMetric::Label>;

  /// Of a name that was given before, the type and help of then hold. Throws
  /// std::logic_error for a name or label that Prometheus does not take.
  void AddFamily(const std::string& name, const std::string& help, prometheus::MetricType type);
  void AddCounter(const std::string& name, const std::string& help, double value,
                  Labels labels = {});
  void AddGauge(const std::string& name, const std::string& help, double value, Labels labels = {});
  void AddDurations(const std::string& name, const std::string& help,
                    const DurationHistogram& durations, Labels labels = {});

  const std::vector<prometheus::MetricFamily>& families() const { return families_; }
  /// In the text format, version 0.0.4.
  std::string Text() const;

 private:
  prometheus::ClientMetric& Add(const std::string& name, const std::string& help,
                                prometheus::MetricType type, Labels labels);

  std::vector<prometheus::MetricFamily> families_;
  std::map<std::string, std::size_t> place_of_;
};

/// Of this process, under the names that all of Prometheus's clients use: memory, processor
/// time, descriptors, start; and what the heap holds. What /proc does not tell is left out.
void AddProcessMetrics(MetricPage* page);

}  // namespace grouser::server

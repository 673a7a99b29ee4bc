#include "server/core/query_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/core/snapshot.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/server/quick_served_model.h"

namespace grouser::server {
namespace {

using std::chrono::nanoseconds;

std::shared_ptr<ServedModel> Named(const std::string& name, const std::string& digest) {
  return testing::QuickServedModel(testing::FakeMessage(name, 0.1), digest);
}

/// The value of one sample; -1: it is not there.
double Sample(const MetricPage& page, const std::string& family, const MetricPage::Labels& labels) {
  for (const auto& f : page.families()) {
    if (f.name != family) continue;
    for (const auto& metric : f.metric) {
      if (metric.label != labels) continue;
      return f.type == prometheus::MetricType::Histogram
                 ? static_cast<double>(metric.histogram.sample_count)
                 : metric.counter.value;
    }
  }
  return -1;
}

double StatesOf(const QueryMetrics& metrics, const std::string& model) {
  MetricPage page;
  metrics.AddTo(&page);
  return Sample(page, "grouser_query_states_total", {{"model", model}});
}

TEST(DurationHistogramTest, BoundsBelongToTheBucketBelow) {
  DurationHistogram durations;
  for (const std::int64_t ns : {-1l, 0l, 1000l, 1001l, 30'000'000'000l, 30'000'000'001l}) {
    durations.Add(nanoseconds(ns));
  }
  EXPECT_EQ(durations.in_bucket(0), 3u);
  EXPECT_EQ(durations.in_bucket(1), 1u);
  EXPECT_EQ(durations.in_bucket(15), 1u);
  EXPECT_EQ(durations.in_bucket(16), 1u);
  EXPECT_EQ(durations.count(), 6u);
  EXPECT_DOUBLE_EQ(durations.sum_s(), 1e-9 * (1000 + 1001 + 60'000'000'001.0));
  MetricPage page;
  page.AddDurations("a_seconds", "help", durations);
  EXPECT_THAT(page.Text(), ::testing::HasSubstr("a_seconds_bucket{le=\"+Inf\"} 6\n"));
  EXPECT_THROW(page.AddCounter("no name", "help", 1), std::logic_error);
}

TEST(QueryMetricsTest, CountsFlagsAsOneByOneDoes) {
  std::mt19937 random(3);
  std::array<std::uint64_t, std::size(surrogate::kFlagFields)> expected{};
  const auto model = Named("sand", "a");
  QueryMetrics metrics;
  metrics.Adopt(Snapshot(1, {model}, {}));
  std::size_t states = 0;
  for (int query = 0; query < 200; ++query) {
    std::vector<std::uint32_t> flags(1 + random() % 300);
    const std::uint32_t common = random() % 2 * surrogate::kFormUnknown;
    for (auto& f : flags) {
      f = common;
      if (random() % 100 == 0) f |= surrogate::kFlagFields[random() % expected.size()].flag;
      for (std::size_t k = 0; k < expected.size(); ++k) {
        expected[k] += (f & surrogate::kFlagFields[k].flag) != 0 ? 1 : 0;
      }
    }
    states += flags.size();
    metrics.Answered(Transport::kUnary, *model->counters, flags, nanoseconds(5));
  }
  MetricPage page;
  metrics.AddTo(&page);
  EXPECT_EQ(StatesOf(metrics, "sand"), states);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const MetricPage::Labels labels = {{"model", "sand"}, {"flag", surrogate::kFlagFields[k].name}};
    EXPECT_EQ(Sample(page, "grouser_query_flags_total", labels),
              expected[k] == 0 ? -1 : static_cast<double>(expected[k]));
  }
}

TEST(QueryMetricsTest, CountsOfModelsThatAreGoneStay) {
  QueryMetrics metrics;
  const std::vector<std::uint32_t> flags(10);
  for (int i = 0; i < 5; ++i) {
    const auto model = Named("sand", std::to_string(i));
    metrics.Adopt(Snapshot(1, {model}, {}));
    metrics.Answered(Transport::kLcm, *model->counters, flags, nanoseconds(5));
    EXPECT_EQ(StatesOf(metrics, "sand"), 10 * (i + 1));
  }
}

TEST(QueryMetricsTest, NamesBeyondTheMostShareOne) {
  QueryMetrics metrics;
  std::vector<Snapshot::ModelPtr> models;
  const std::vector<std::uint32_t> flags(1);
  for (std::size_t i = 0; i < QueryMetrics::kMostModels + 10; ++i) {
    const auto model = Named("m" + std::to_string(1000 + i), "a");
    models.push_back(model);
    metrics.Adopt(Snapshot(1, models, {}));
    metrics.Answered(Transport::kStream, *model->counters, flags, nanoseconds(5));
  }
  EXPECT_EQ(StatesOf(metrics, "m1000"), 1);
  EXPECT_EQ(StatesOf(metrics, "other"), 10);
}

TEST(QueryMetricsTest, CountingAllocatesNothingAndLosesNothing) {
  QueryMetrics metrics;
  const auto model = Named("sand", "a");
  metrics.Adopt(Snapshot(1, {model}, {}));
  const std::vector<std::uint32_t> flags(100, surrogate::kFormUnknown);
  const long before = g_allocations;
  metrics.Answered(Transport::kUnary, *model->counters, flags, nanoseconds(500));
  metrics.Refused(Transport::kUnary, StatusCode::kNotFound);
  EXPECT_EQ(g_allocations - before, 0);
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&] {
        for (int i = 0; i < 1000; ++i) {
          metrics.Answered(Transport::kUnary, *model->counters, flags, nanoseconds(500));
        }
      });
    }
    EXPECT_GE(StatesOf(metrics, "sand"), 100);  // a scrape meanwhile
  }
  EXPECT_EQ(StatesOf(metrics, "sand"), 400100);
}

}  // namespace
}  // namespace grouser::server

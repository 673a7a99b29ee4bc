#include "server/core/query_metrics.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "proto/records/status_code.h"
#include "server/core/snapshot.h"

namespace grouser::server {
namespace {

constexpr std::size_t kFlags = std::size(surrogate::kFlagFields);
constexpr std::array<const char*, 3> kTransportNames = {"unary", "stream", "lcm"};

constexpr std::size_t kBits = 32;

/// Place in kFlagFields of the flag with a bit; kFlags: there is none.
constexpr std::array<std::size_t, kBits> kPlaceOfBit = [] {
  std::array<std::size_t, kBits> places{};
  places.fill(kFlags);
  for (std::size_t k = 0; k < kFlags; ++k) {
    places[std::countr_zero(std::uint32_t{surrogate::kFlagFields[k].flag})] = k;
  }
  return places;
}();

template <class PerBit>
void ForBits(std::uint32_t bits, const PerBit& per_bit) {
  for (; bits != 0; bits &= bits - 1) per_bit(std::countr_zero(bits));
}

/// States with each bit. In most blocks all states have the same flags, which one comparison
/// of memory tells.
std::array<std::uint32_t, kBits> CountBits(std::span<const std::uint32_t> flags) {
  constexpr std::size_t kBlock = 64;
  std::array<std::uint32_t, kBits> counts{};
  for (std::size_t at = 0; at < flags.size(); at += kBlock) {
    const auto block = flags.subspan(at, std::min(kBlock, flags.size() - at));
    const auto size = static_cast<std::uint32_t>(block.size());
    if (std::memcmp(block.data(), block.data() + 1, (size - 1) * sizeof block[0]) == 0) {
      ForBits(block[0], [&](int bit) { counts[bit] += size; });
    } else {
      for (const std::uint32_t f : block) ForBits(f, [&](int bit) { ++counts[bit]; });
    }
  }
  return counts;
}

}  // namespace

void ModelCounters::Add(std::span<const std::uint32_t> flags, std::chrono::nanoseconds spent) {
  std::size_t size_class = 0;
  while (size_class < kSizeClassEnds.size() &&
         flags.size() > static_cast<std::size_t>(kSizeClassEnds[size_class])) {
    ++size_class;
  }
  spent_[size_class].Add(spent);
  states_.Add(flags.size());
  const auto counts = CountBits(flags);
  for (std::size_t bit = 0; bit < kBits; ++bit) {
    if (counts[bit] != 0 && kPlaceOfBit[bit] < kFlags) flagged_[kPlaceOfBit[bit]].Add(counts[bit]);
  }
}

void ModelCounters::Add(const ModelCounters& other) {
  for (std::size_t i = 0; i < spent_.size(); ++i) spent_[i].Add(other.spent_[i]);
  states_.Add(other.states_.value());
  for (std::size_t k = 0; k < kFlags; ++k) flagged_[k].Add(other.flagged_[k].value());
}

void QueryMetrics::Adopt(const Snapshot& snapshot) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& model : snapshot.models()) {
    std::string name = model->message.name();
    if (!models_.contains(name) && models_.size() >= kMostModels) name = "other";
    auto& served = models_[name].served;
    if (std::ranges::find(served, model->counters) == served.end()) {
      served.push_back(model->counters);
    }
  }
  for (auto& [name, of_name] : models_) {
    std::erase_if(of_name.served, [&gone = of_name.gone](const auto& counters) {
      if (counters.use_count() != 1) return false;  // a snapshot has it
      gone.Add(*counters);
      return true;
    });
  }
}

void QueryMetrics::AddTo(MetricPage* page) const {
  const char* queries = "grouser_queries_total";
  const char* queries_help = "Messages with wheel states, by how they came and how they ended.";
  for (std::size_t t = 0; t < kTransports; ++t) {
    for (std::size_t c = 0; c < kCodes; ++c) {
      const auto count = by_code_[t][c].value();
      if (count == 0 && c != 0) continue;
      page->AddCounter(queries, queries_help, static_cast<double>(count),
                       {{"transport", kTransportNames[t]},
                        {"code", records::StatusCodeName(static_cast<int>(c))}});
    }
  }
  const char* states = "grouser_query_states_total";
  const char* states_help = "Wheel states that were answered.";
  const char* flagged = "grouser_query_flags_total";
  const char* flagged_help = "Wheel states that were answered with a flag.";
  const char* spent = "grouser_query_duration_seconds";
  const char* spent_help =
      "Time to answer a message in the server, without decoding and transport.";
  page->AddFamily(states, states_help, prometheus::MetricType::Counter);
  page->AddFamily(flagged, flagged_help, prometheus::MetricType::Counter);
  page->AddFamily(spent, spent_help, prometheus::MetricType::Histogram);
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, of_name] : models_) {
    ModelCounters all;
    all.Add(of_name.gone);
    for (const auto& counters : of_name.served) all.Add(*counters);
    page->AddCounter(states, states_help, static_cast<double>(all.states_.value()),
                     {{"model", name}});
    for (std::size_t k = 0; k < kFlags; ++k) {
      const auto count = all.flagged_[k].value();
      if (count == 0) continue;
      page->AddCounter(flagged, flagged_help, static_cast<double>(count),
                       {{"model", name}, {"flag", surrogate::kFlagFields[k].name}});
    }
    for (std::size_t s = 0; s < kSizeClassNames.size(); ++s) {
      if (all.spent_[s].count() == 0) continue;
      page->AddDurations(spent, spent_help, all.spent_[s],
                         {{"model", name}, {"states", kSizeClassNames[s]}});
    }
  }
}

}  // namespace grouser::server

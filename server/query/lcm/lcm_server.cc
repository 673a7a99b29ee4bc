#include "server/query/lcm/lcm_server.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "server/query/lcm/lcm_answer.h"
#include "server/query/lcm/lcm_record.h"

namespace grouser::server {
namespace {

// A flood of foreign messages must not flood the log: powers of two are told.
bool WorthALine(std::uint64_t count) { return (count & (count - 1)) == 0; }

template <class Message>
void Publish(lcm_t* publisher, const char* channel, const Message& message) {
  std::vector<std::uint8_t> bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  lcm_publish(publisher, channel, bytes.data(), static_cast<unsigned>(bytes.size()));
}

}  // namespace

LcmServer::LcmServer(const std::string& url, const std::string& interface,
                     const SnapshotStore& store, QueryMetrics& metrics, QueryLog* log)
    : store_(store),
      metrics_(metrics),
      log_(log),
      url_(lcm_io::EffectiveLcmUrl(url)),
      receiver_(lcm_io::ParseLcmUrl(url_), interface),
      publisher_(lcm_create(lcm_io::ParseLcmUrl(url_).Text().c_str()), lcm_destroy) {
  // Without a subscription liblcm opens no receiver.
  if (!publisher_) throw std::runtime_error("lcm: '" + url_ + "': liblcm cannot use this URL");
  stop_fd_ = ::eventfd(0, EFD_CLOEXEC);
  if (stop_fd_ < 0) throw std::runtime_error(std::string("lcm: eventfd: ") + std::strerror(errno));
  thread_ = std::thread([this] { Loop(); });
}

LcmServer::~LcmServer() {
  const std::uint64_t one = 1;
  // An eventfd write of 1 cannot fail short of 2^64 - 1 of them.
  [[maybe_unused]] const auto written = ::write(stop_fd_, &one, sizeof(one));
  thread_.join();
  ::close(stop_fd_);
}

void LcmServer::Loop() {
  pthread_setname_np(pthread_self(), "grouser-lcm");
  pollfd waiting[2] = {{receiver_.fd(), POLLIN, 0}, {stop_fd_, POLLIN, 0}};
  while (true) {
    if (::poll(waiting, 2, -1) < 0 && errno != EINTR) {
      spdlog::error("lcm: poll: {}; no more LCM queries are answered", std::strerror(errno));
      return;
    }
    if (waiting[1].revents != 0) return;
    if (waiting[0].revents != 0) TakeMessages();
  }
}

void LcmServer::AddTo(MetricPage* page) const {
  const auto add = [page](const char* name, const char* help, const Counter& count) {
    page->AddCounter(name, help, static_cast<double>(count.value()));
  };
  add("grouser_lcm_messages_total", "Messages of any channel that were received.",
      counts_.messages);
  add("grouser_lcm_lost_messages_total", "Messages that are missing in the senders' sequences.",
      counts_.lost);
  add("grouser_lcm_fragments_total", "Fragments of long messages, which are ignored.",
      counts_.fragments);
  add("grouser_lcm_malformed_datagrams_total", "Datagrams that are none of LCM.",
      counts_.malformed);
  add("grouser_lcm_malformed_queries_total", "Messages on the channel of queries that are none.",
      counts_.not_queries);
}

// A part of what waits, so that a flood does not keep the thread from its end.
void LcmServer::TakeMessages() {
  constexpr int kMost = 64;
  for (int taken = 0; taken < kMost; ++taken) {
    const auto message = receiver_.Next();
    WarnOfBadDatagrams();
    const auto& counts = receiver_.counts();
    counts_.messages.Set(counts.messages);
    counts_.fragments.Set(counts.fragments);
    counts_.malformed.Set(counts.malformed);
    counts_.lost.Set(counts.lost);
    if (!message) return;
    if (message->channel == kLcmQueryChannel) Answer(message->payload);
  }
}

void LcmServer::WarnOfBadDatagrams() {
  const auto& counts = receiver_.counts();
  const std::uint64_t bad = counts.fragments + counts.malformed;
  if (bad == told_) return;
  told_ = bad;
  if (!WorthALine(bad)) return;
  spdlog::warn(
      "lcm: ignored so far: {} fragments of long messages, {} malformed datagrams; "
      "lost: {} messages",
      counts.fragments, counts.malformed, counts.lost);
}

void LcmServer::Answer(std::span<const std::uint8_t> query) {
  std::string problem;
  const auto start = std::chrono::steady_clock::now();
  const auto snapshot = store_.Current();
  grouser_lcm::wheel_measured_t measured;
  LcmOutcome outcome;
  const auto response = AnswerLcm(*snapshot, query, &problem, &measured, &outcome);
  if (outcome.model != nullptr) {
    const auto* flags = reinterpret_cast<const std::uint32_t*>(response->flags.data());
    metrics_.Answered(Transport::kLcm, *outcome.model->counters, {flags, response->flags.size()},
                      std::chrono::steady_clock::now() - start);
  } else {
    metrics_.Refused(Transport::kLcm, outcome.code);
  }
  if (!response) {
    const std::uint64_t count = ++malformed_;
    counts_.not_queries.Set(count);
    if (WorthALine(count)) {
      spdlog::warn("lcm: message of {} bytes on {} is {} ({} such so far)", query.size(),
                   kLcmQueryChannel, problem, count);
    }
    return;
  }
  if (measured.n > 0) Publish(publisher_.get(), kLcmMeasuredChannel, measured);
  Publish(publisher_.get(), kLcmResponseChannel, *response);
  if (log_ == nullptr || outcome.model == nullptr) return;
  const LcmRecord record = RecordOf(outcome.query, *response, measured);
  log_->Offer(Transport::kLcm, record.request, record.response);
}

}  // namespace grouser::server

#include "server/query/log/query_log.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/util/time_util.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <span>
#include <utility>

namespace grouser::server {
namespace {

using google::protobuf::io::CodedOutputStream;
using v1alpha1::LoggedQuery;

// Nobody wakes the thread, so that a query costs no system call.
constexpr std::chrono::milliseconds kPeriod{20};
constexpr std::uint32_t kLengthDelimited = 2;  // protobuf's wire type

constexpr std::uint32_t TagOf(int field) {
  return (static_cast<std::uint32_t>(field) << 3) | kLengthDelimited;
}
constexpr std::uint32_t kRequestTag = TagOf(LoggedQuery::kRequestFieldNumber);
constexpr std::uint32_t kResponseTag = TagOf(LoggedQuery::kResponseFieldNumber);

std::size_t FieldBytes(std::uint32_t tag, std::size_t bytes) {
  return CodedOutputStream::VarintSize32(tag) +
         CodedOutputStream::VarintSize32(static_cast<std::uint32_t>(bytes)) + bytes;
}

std::uint8_t* PutField(std::uint32_t tag, const google::protobuf::Message& message,
                       std::uint8_t* to) {
  to = CodedOutputStream::WriteVarint32ToArray(tag, to);
  to = CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(message.GetCachedSize()),
                                               to);
  return message.SerializeWithCachedSizesToArray(to);
}

v1alpha1::QueryTransport WireTransport(Transport transport) {
  switch (transport) {
    case Transport::kUnary:
      return v1alpha1::QUERY_TRANSPORT_UNARY;
    case Transport::kStream:
      return v1alpha1::QUERY_TRANSPORT_STREAM;
    case Transport::kLcm:
      return v1alpha1::QUERY_TRANSPORT_LCM;
  }
  return v1alpha1::QUERY_TRANSPORT_UNSPECIFIED;
}

}  // namespace

QueryLog::QueryLog(QueryLogOptions options, const v1alpha1::QueryLogHeader& header)
    : most_waiting_bytes_(options.most_waiting_bytes) {
  try {
    file_.emplace(std::move(options), header);
    thread_ = std::jthread([this](const std::stop_token& stop) { Loop(stop); });
  } catch (const QueryLogRefused&) {
    throw;
  } catch (const std::exception& e) {
    Fail(e);
  }
}

QueryLog::~QueryLog() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  Record* left = nullptr;  // where the last writing failed
  while (waiting_.pop(left)) delete left;
}

// The parts of a message may be put one after the other; so neither is copied first.
std::unique_ptr<QueryLog::Record> QueryLog::Serialise(
    Transport transport, const v1alpha1::EvaluateWheelsRequest& request,
    const v1alpha1::EvaluateWheelsResponse& response) {
  LoggedQuery head;
  *head.mutable_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  head.set_transport(WireTransport(transport));
  const std::size_t bytes = kFrameBytes + head.ByteSizeLong() +
                            FieldBytes(kRequestTag, request.ByteSizeLong()) +
                            FieldBytes(kResponseTag, response.ByteSizeLong());
  auto record = std::make_unique<Record>(
      Record{std::make_unique_for_overwrite<std::uint8_t[]>(bytes), bytes});
  std::uint8_t* to = head.SerializeWithCachedSizesToArray(record->framed.get() + kFrameBytes);
  to = PutField(kRequestTag, request, to);
  PutField(kResponseTag, response, to);
  return record;
}

void QueryLog::Offer(Transport transport, const v1alpha1::EvaluateWheelsRequest& request,
                     const v1alpha1::EvaluateWheelsResponse& response) noexcept {
  if (!writing_.load(std::memory_order_relaxed) ||
      waiting_bytes_.load(std::memory_order_relaxed) >= most_waiting_bytes_) {
    dropped_.Add();
    return;
  }
  try {
    auto record = Serialise(transport, request, response);
    // Added before the thread can take it off. Threads that come at once may go over the limit by
    // a message each.
    waiting_bytes_.fetch_add(record->bytes, std::memory_order_relaxed);
    if (waiting_.push(record.get())) {
      record.release();  // NOLINT(bugprone-unused-return-value): the queue has it
      return;
    }
    waiting_bytes_.fetch_sub(record->bytes, std::memory_order_relaxed);
  } catch (const std::exception&) {  // no memory
  }
  dropped_.Add();
}

void QueryLog::Fail(const std::exception& why) {
  writing_ = false;
  spdlog::error("query log: {}; no more queries are logged until the next start", why.what());
}

void QueryLog::Loop(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "grouser-qlog");
  std::unique_lock<std::mutex> lock(mutex_);
  bool ends = false;
  while (!ends) {
    ends = wake_.wait_for(lock, stop, kPeriod, [&stop] { return stop.stop_requested(); });
    WriteWaiting();
  }
}

void QueryLog::WriteWaiting() {
  Record* next = nullptr;
  try {
    while (waiting_.pop(next)) {
      const std::unique_ptr<Record> record(next);
      waiting_bytes_.fetch_sub(record->bytes, std::memory_order_relaxed);
      if (!writing_) {
        dropped_.Add();
        continue;
      }
      ++appended_;
      file_->Append({record->framed.get(), record->bytes});
    }
    if (writing_) file_->Flush();
  } catch (const std::exception& e) {
    dropped_.Add(appended_ - file_->records());
    Fail(e);
  }
  written_.Set(file_->records());
  written_bytes_.Set(file_->bytes());
}

void QueryLog::AddTo(MetricPage* page) const {
  page->AddGauge("grouser_query_log_writing", "1: queries are logged; 0: the file failed.",
                 writing_ ? 1 : 0);
  page->AddCounter("grouser_query_log_queries_total", "Queries that were written to the log.",
                   static_cast<double>(written_.value()));
  page->AddCounter("grouser_query_log_bytes_total", "Bytes that were written to the log.",
                   static_cast<double>(written_bytes_.value()));
  page->AddCounter("grouser_query_log_dropped_total",
                   "Queries that were answered and not logged: the queue was full, or the file "
                   "failed.",
                   static_cast<double>(dropped_.value()));
}

}  // namespace grouser::server

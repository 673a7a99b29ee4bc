#include "server/query/lcm/lcm_server.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "server/query/lcm/lcm_answer.h"
#include "server/query/lcm/multicast_probe.h"

namespace grouser::server {
namespace {

// A flood of foreign messages must not flood the log: powers of two are told.
bool WorthALine(std::uint64_t count) { return (count & (count - 1)) == 0; }

}  // namespace

LcmServer::LcmServer(const std::string& url, const SnapshotStore& store)
    : store_(store), url_(EffectiveLcmUrl(url)), lcm_(nullptr, lcm_destroy) {
  if (const std::string problem = ProbeMulticast(url_); !problem.empty()) {
    throw std::runtime_error(problem);
  }
  lcm_.reset(lcm_create(url_.c_str()));
  if (!lcm_) throw std::runtime_error("lcm: '" + url_ + "': liblcm cannot use this URL");
  const auto receive = [](const lcm_recv_buf_t* buffer, const char*, void* self) {
    static_cast<LcmServer*>(self)->Receive(*buffer);
  };
  if (lcm_subscribe(lcm_.get(), kLcmQueryChannel, receive, this) == nullptr) {
    throw std::runtime_error("lcm: '" + url_ + "': cannot subscribe to " + kLcmQueryChannel);
  }
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
  pollfd waiting[2] = {{lcm_get_fileno(lcm_.get()), POLLIN, 0}, {stop_fd_, POLLIN, 0}};
  while (true) {
    if (::poll(waiting, 2, -1) < 0 && errno != EINTR) {
      spdlog::error("lcm: poll: {}", std::strerror(errno));
      return;
    }
    if (waiting[1].revents != 0) return;
    if (waiting[0].revents != 0 && lcm_handle(lcm_.get()) != 0) {
      spdlog::error("lcm: '{}' has failed; no more LCM queries are answered", url_);
      return;
    }
  }
}

void LcmServer::Receive(const lcm_recv_buf_t& buffer) {
  std::string problem;
  const auto snapshot = store_.Current();
  const auto response = AnswerLcm(*snapshot, buffer.data, buffer.data_size, &problem);
  if (!response) {
    const std::uint64_t count = ++malformed_;
    if (WorthALine(count)) {
      spdlog::warn("lcm: message of {} bytes on {} is {} ({} such so far)", buffer.data_size,
                   kLcmQueryChannel, problem, count);
    }
    return;
  }
  std::vector<std::uint8_t> bytes(response->getEncodedSize());
  response->encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  lcm_publish(lcm_.get(), kLcmResponseChannel, bytes.data(), static_cast<unsigned>(bytes.size()));
}

}  // namespace grouser::server

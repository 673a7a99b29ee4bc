#include "server/jobs/serial_thread.h"

#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>

namespace grouser::server {
namespace {

namespace asio = boost::asio;

/// Whoever posts handles its own errors; one that was forgotten must not end
/// the program and every other job with it.
void RunSafely(const std::function<void()>& task) {
  try {
    task();
  } catch (const std::exception& e) {
    spdlog::error("unexpected: {}", e.what());
  }
}

}  // namespace

SerialThread::SerialThread()
    : context_(1), guard_(context_.get_executor()), thread_([this] { context_.run(); }) {}

SerialThread::~SerialThread() {
  // What was posted before runs first; timers that still wait are dropped.
  asio::post(context_, [this] { context_.stop(); });
  thread_.join();
}

void SerialThread::Post(std::function<void()> task) {
  asio::post(context_, [task = std::move(task)] { RunSafely(task); });
}

bool SerialThread::TryPost(std::function<void()> task) {
  if (waiting_.fetch_add(1) >= kMaxWaiting) {
    waiting_.fetch_sub(1);
    return false;
  }
  asio::post(context_, [this, task = std::move(task)] {
    waiting_.fetch_sub(1);
    RunSafely(task);
  });
  return true;
}

void SerialThread::PostAfter(double seconds, std::function<void()> task) {
  auto timer = std::make_shared<asio::steady_timer>(context_);
  timer->expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds)));
  timer->async_wait([timer, task = std::move(task)](const boost::system::error_code& error) {
    if (!error) RunSafely(task);
  });
}

}  // namespace grouser::server

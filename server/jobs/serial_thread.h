#pragma once

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <thread>

namespace grouser::server {

/// One thread that runs what it is given, in order: files, SQLite and model
/// loading happen here, so that neither gRPC's threads nor the event loop
/// ever wait for a disk.
class SerialThread {
 public:
  SerialThread();
  ~SerialThread();  ///< runs what was posted, then joins
  SerialThread(const SerialThread&) = delete;
  SerialThread& operator=(const SerialThread&) = delete;

  void Post(std::function<void()> task);
  /// False where `kMaxWaiting` such tasks wait already: for work that clients
  /// ask for, so that a flood of them cannot fill the memory.
  bool TryPost(std::function<void()> task);
  /// How many such tasks wait now. Any thread.
  int waiting() const { return waiting_; }
  void PostAfter(double seconds, std::function<void()> task);

  static constexpr int kMaxWaiting = 1000;

 private:
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_;
  std::atomic<int> waiting_{0};
  std::thread thread_;
};

}  // namespace grouser::server

#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <functional>
#include <string>
#include <thread>

#include "server/net/grpc_server.h"
#include "server/net/service_manager.h"

namespace grouser::server {

/// The main loop of a program: ready, serve, drain, end.
class ServiceLoop {
 public:
  /// Keeps SIGINT and SIGTERM for Run(). Before any thread: a signal during
  /// start-up must not be lost.
  ServiceLoop();

  boost::asio::io_context& context() { return context_; }

  /// Ends Run() as a signal does, with exit code 1. Any thread; what
  /// GrpcServer's on_unreachable calls.
  void Fail();

  /// The program was told to end. Any thread.
  bool draining() const { return draining_; }

  /// Says that the program is ready; any thread.
  using Announce = std::function<void(std::string ready_line)>;

  /// Serves until SIGINT, SIGTERM or Fail(). `prepare` calls its argument once all is loaded: then
  /// the port file is written ("grpc=ADDR", and "http=ADDR" where it serves that), the line printed
  /// to stderr and a service manager told. At the end drains and has `stop_work` stop what runs
  /// behind the service; it calls its argument when that is done. Returns the exit code; the loop
  /// no longer runs, the server is still to be closed.
  int Run(GrpcServer& server, const std::string& port_file,
          const std::function<void(Announce announce)>& prepare,
          std::function<void(std::function<void()> done)> stop_work,
          const std::string& http_address = "");

 private:
  void BeginStop(const std::string& why);

  boost::asio::io_context context_{1};
  boost::asio::signal_set signals_{context_, SIGINT, SIGTERM};
  ServiceManager manager_{context_};
  std::function<void()> stop_;  // of Run; runs on stopper_
  std::thread stopper_;
  int exit_code_ = 0;
  std::atomic<bool> draining_{false};
};

}  // namespace grouser::server

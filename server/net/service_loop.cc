#include "server/net/service_loop.h"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <csignal>
#include <iostream>

#include "proto/records/model_file.h"

namespace grouser::server {

namespace asio = boost::asio;

ServiceLoop::ServiceLoop() {
  signals_.async_wait([this](const boost::system::error_code& error, int number) {
    if (!error) BeginStop(number == SIGINT ? "SIGINT" : "SIGTERM");
  });
}

void ServiceLoop::Fail() {
  asio::post(context_, [this] {
    exit_code_ = 1;
    BeginStop("unreachable");
  });
}

void ServiceLoop::BeginStop(const std::string& why) {
  if (stopper_.joinable()) return;
  draining_ = true;
  spdlog::info("{}: draining", why);
  manager_.Stopping();
  stopper_ = std::thread(stop_);  // the loop goes on: work may need it to stop
}

int ServiceLoop::Run(GrpcServer& server, const std::string& port_file,
                     const std::function<void(Announce announce)>& prepare,
                     std::function<void(std::function<void()> done)> stop_work,
                     const std::string& http_address) {
  stop_ = [&] {
    server.Drain();
    stop_work([this] { asio::post(context_, [this] { context_.stop(); }); });
  };
  const auto announce = [&](const std::string& ready_line) {
    if (draining_) return;
    if (!port_file.empty()) {
      const std::string http = http_address.empty() ? "" : "http=" + http_address + "\n";
      records::WriteFileDurably(port_file, "grpc=" + server.address() + "\n" + http);
    }
    std::cerr << ready_line << std::endl;
    manager_.Ready();
  };
  prepare([this, announce](std::string ready_line) {
    asio::post(context_, [announce, ready_line] { announce(ready_line); });
  });
  const auto guard = asio::make_work_guard(context_);
  context_.run();
  stopper_.join();
  return exit_code_;
}

}  // namespace grouser::server

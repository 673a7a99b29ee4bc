#include "server/jobs/worker_pool.h"

#include <signal.h>

#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace grouser::server {
namespace {

namespace asio = boost::asio;

constexpr auto kPollLog = std::chrono::milliseconds(300);

std::chrono::steady_clock::duration Seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(s));
}

}  // namespace

struct WorkerPool::Worker {
  Worker(asio::io_context& loop, std::string name, WorkerProcess child, const std::string& log,
         Callbacks calls)
      : key(std::move(name)),
        process(std::move(child)),
        ended(loop, process.pidfd()),
        poll(loop),
        limit(loop),
        grace(loop),
        tail(log),
        callbacks(std::move(calls)) {}
  ~Worker() { ended.release(); }  // the descriptor is the process's

  std::string key;
  WorkerProcess process;
  asio::posix::stream_descriptor ended;
  asio::steady_timer poll, limit, grace;
  ProgressTail tail;
  Callbacks callbacks;
  bool terminating = false, timed_out = false;
};

WorkerPool::WorkerPool(asio::io_context& loop, double grace_s) : loop_(loop), grace_s_(grace_s) {}

WorkerPool::~WorkerPool() {
  for (auto& [key, worker] : workers_) {
    worker->process.SignalGroup(SIGKILL);
    worker->process.Reap();
  }
}

void WorkerPool::Start(std::string key, WorkerCommand command, Callbacks callbacks) {
  asio::post(loop_, [this, key = std::move(key), command = std::move(command),
                     callbacks = std::move(callbacks)]() mutable {
    StartOnLoop(key, std::move(command), std::move(callbacks));
  });
}

void WorkerPool::StartOnLoop(const std::string& key, WorkerCommand command, Callbacks callbacks) {
  const std::string log = command.log_path;
  const double timeout_s = command.timeout_s;
  std::shared_ptr<Worker> worker;
  try {
    if (workers_.contains(key)) throw std::logic_error(key + " has a worker already");
    worker = std::make_shared<Worker>(loop_, key, WorkerProcess::Spawn(std::move(command)), log,
                                      callbacks);
  } catch (const std::exception& e) {
    WorkerEnd end;
    end.spawn_error = e.what();
    callbacks.on_end(end);
    return;
  }
  workers_[key] = worker;
  WatchEnd(worker);
  WatchLog(worker);
  if (timeout_s > 0) WatchTime(worker, timeout_s);
}

void WorkerPool::WatchEnd(const std::shared_ptr<Worker>& worker) {
  worker->ended.async_wait(asio::posix::stream_descriptor::wait_read,
                           [this, worker](const boost::system::error_code& error) {
                             if (error) return;
                             worker->poll.cancel();
                             worker->limit.cancel();
                             worker->grace.cancel();
                             WorkerEnd end = worker->process.Reap();
                             end.timed_out = worker->timed_out;
                             workers_.erase(worker->key);
                             worker->callbacks.on_end(end);
                           });
}

void WorkerPool::WatchLog(const std::shared_ptr<Worker>& worker) {
  worker->poll.expires_after(kPollLog);
  worker->poll.async_wait([this, worker](const boost::system::error_code& error) {
    if (error || !workers_.contains(worker->key)) return;
    if (const auto line = worker->tail.Poll()) worker->callbacks.on_progress(*line);
    WatchLog(worker);
  });
}

void WorkerPool::WatchTime(const std::shared_ptr<Worker>& worker, double timeout_s) {
  worker->limit.expires_after(Seconds(timeout_s));
  worker->limit.async_wait([this, worker](const boost::system::error_code& error) {
    if (error) return;
    worker->timed_out = true;
    TerminateOnLoop(*worker);
  });
}

void WorkerPool::Terminate(std::string key) {
  asio::post(loop_, [this, key = std::move(key)] {
    const auto found = workers_.find(key);
    if (found != workers_.end()) TerminateOnLoop(*found->second);
  });
}

void WorkerPool::TerminateOnLoop(Worker& worker) {
  if (std::exchange(worker.terminating, true)) return;
  worker.process.SignalGroup(SIGTERM);
  worker.grace.expires_after(Seconds(grace_s_));
  worker.grace.async_wait([this, key = worker.key](const boost::system::error_code& error) {
    if (error) return;
    const auto found = workers_.find(key);
    if (found != workers_.end()) found->second->process.SignalGroup(SIGKILL);
  });
}

}  // namespace grouser::server

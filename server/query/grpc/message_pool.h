#pragma once

#include <grpcpp/support/message_allocator.h>

#include <memory>
#include <mutex>
#include <vector>

namespace grouser::server {

/// Hands a unary method its request and response messages and takes them back
/// for reuse, last in first out, so that big arrays are allocated once. Keeps at
/// most `max_idle` pairs. Must outlive the server.
template <class Request, class Response>
class MessagePool : public grpc::MessageAllocator<Request, Response> {
 public:
  explicit MessagePool(std::size_t max_idle) : max_idle_(max_idle) {}

  grpc::MessageHolder<Request, Response>* AllocateMessages() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!idle_.empty()) {
        auto holder = std::move(idle_.back());
        idle_.pop_back();
        return holder.release();
      }
    }
    return new Holder(this);
  }

  /// Frees the idle pairs.
  void Clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.clear();
  }

 private:
  class Holder : public grpc::MessageHolder<Request, Response> {
   public:
    explicit Holder(MessagePool* pool) : pool_(pool) {
      this->set_request(&request_);
      this->set_response(&response_);
    }
    void Release() override { pool_->TakeBack(std::unique_ptr<Holder>(this)); }

   private:
    MessagePool* pool_;
    Request request_;
    Response response_;
  };

  void TakeBack(std::unique_ptr<Holder> holder) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (idle_.size() < max_idle_) idle_.push_back(std::move(holder));
  }

  const std::size_t max_idle_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Holder>> idle_;
};

}  // namespace grouser::server

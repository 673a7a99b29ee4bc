#pragma once

#include <grpcpp/channel.h>

#include <chrono>
#include <memory>
#include <string>

namespace grouser::client {

using Milliseconds = std::chrono::milliseconds;

/// Plain channel to HOST:PORT (or unix:PATH) that takes answers to the biggest
/// batches. A server that went away is tried again at least every second; one that is gone without
/// a word is noticed within 20 s of a call.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

std::chrono::system_clock::time_point DeadlineAfter(Milliseconds limit);

/// Asks the standard health service about `service` ("" is the whole server).
/// True for SERVING. Throws ClientError (NOT_FOUND for an unknown service).
bool IsServing(const std::string& address, const std::string& service, Milliseconds deadline);

}  // namespace grouser::client

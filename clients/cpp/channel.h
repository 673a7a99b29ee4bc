#pragma once

#include <grpcpp/channel.h>

#include <chrono>
#include <memory>
#include <string>

#include "clients/cpp/access.h"

namespace grouser::client {

using Milliseconds = std::chrono::milliseconds;

/// Channel that takes answers to the biggest batches. Throws as MakeCredentials.
std::shared_ptr<grpc::Channel> MakeChannel(const Server& server);
/// The same in plaintext, as nobody in particular.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

std::chrono::system_clock::time_point DeadlineAfter(Milliseconds limit);

/// Asks the standard health service about `service` ("" is the whole server).
/// True for SERVING. Throws ClientError (NOT_FOUND for an unknown service).
bool IsServing(const Server& server, const std::string& service, Milliseconds deadline);
bool IsServing(const std::string& address, const std::string& service, Milliseconds deadline);

}  // namespace grouser::client

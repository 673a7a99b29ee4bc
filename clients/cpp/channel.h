#pragma once

#include <grpcpp/channel.h>

#include <chrono>
#include <memory>
#include <string>

#include "clients/cpp/access.h"
#include "grouser/v1alpha1/operator_service.pb.h"

namespace grouser::client {

using Milliseconds = std::chrono::milliseconds;

/// Channel that takes answers to the biggest batches. A server that went away is tried again at
/// least every second; one that is gone without a word is noticed within 20 s of a call. Throws as
/// MakeCredentials.
std::shared_ptr<grpc::Channel> MakeChannel(const Server& server);
/// The same in plaintext, as nobody in particular.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

std::chrono::system_clock::time_point DeadlineAfter(Milliseconds limit);

/// Asks the standard health service about `service` ("" is the whole server).
/// True for SERVING. Throws ClientError (NOT_FOUND for an unknown service).
bool IsServing(const Server& server, const std::string& service, Milliseconds deadline);
bool IsServing(const std::string& address, const std::string& service, Milliseconds deadline);

/// What runs at an address: grouser-server or grouser-jobs. Throws ClientError (UNIMPLEMENTED
/// from versions that do not tell).
v1alpha1::GetBuildInfoResponse GetBuildInfo(const Server& server, Milliseconds deadline);

}  // namespace grouser::client

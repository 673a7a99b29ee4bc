#pragma once

#include <grpcpp/security/credentials.h>

#include <memory>
#include <string>

#include "clients/cpp/access.h"

namespace grouser::client {

/// Of this machine alone, by its text.
bool IsLocal(const std::string& address);

/// Throws std::invalid_argument "--OPTION: FILE: what is wrong", also where a
/// token would go to another machine in plaintext.
std::shared_ptr<grpc::ChannelCredentials> MakeCredentials(const Server& server);

/// What keeps the two ends from each other, by one more look at the server: its
/// certificate expired, of another authority or name, TLS on one side only.
/// Empty: nothing of that kind. Takes some seconds at most.
std::string TlsProblem(const Server& server);

}  // namespace grouser::client

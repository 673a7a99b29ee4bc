#pragma once

#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/net/access_policy.h"
#include "server/net/call_records.h"
#include "server/net/tls_files.h"

namespace grouser::server {

/// What GrpcServer listens with: TLS or plaintext, every call past the policy.
/// Certificates that changed count for the connections after that, those that
/// are open stay; files that do not fit leave the last good ones in force.
/// gRPC's own TLS credentials of 1.51 would lose all certificates then, and its
/// plaintext ones take no policy. `policy` and `records` outlive the server. Throws as ReadTls.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& tls,
                                                               AccessPolicy& policy,
                                                               CallRecords& records);

/// For the program's own question whether it is answered: any certificate will do.
std::shared_ptr<grpc::ChannelCredentials> MakeProbeCredentials(const TlsFiles& tls);

}  // namespace grouser::server

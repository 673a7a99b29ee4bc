#include "server/net/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/impl/server_builder_option.h>
#include <grpcpp/impl/server_builder_plugin.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <stdexcept>

#include "proto/records/os/descriptor_limit.h"
#include "server/net/server_credentials.h"

namespace grouser::server {
namespace {

using Milliseconds = CallGate::Milliseconds;

// Memory that gRPC may hold for messages; beyond it calls are refused.
constexpr std::size_t kQuotaBytes = 512ull * 1024 * 1024;
// Descriptors that connections leave to the rest: files, workers, LCM.
constexpr std::size_t kReservedDescriptors = 64;
// A client that says nothing at all is dropped after this.
constexpr int kHandshakeMs = 10000;
// A peer that is gone without a word (power, cable) is noticed after the sum.
constexpr int kKeepaliveMs = 30000;
constexpr int kKeepaliveTimeoutMs = 10000;
// Clients may ask as often whether the server is still there.
constexpr int kMinClientPingMs = 10000;
// Long enough for a message to get through the kernel and gRPC on a busy machine.
constexpr Milliseconds kQuiet(200);
// Of the drain's time, the part that answers; the rest refuses and ends streams.
constexpr double kAnsweringShare = 0.8;
// A program that cannot be reached may not be able to end well either.
constexpr unsigned kLastResortS = 60;

Milliseconds ToMilliseconds(double seconds) {
  return std::chrono::duration_cast<Milliseconds>(std::chrono::duration<double>(seconds));
}

void SetLimits(grpc::ServerBuilder& builder, const NetOptions& options) {
  const int idle_ms = static_cast<int>(ToMilliseconds(options.idle_s).count());
  builder.SetMaxReceiveMessageSize(options.max_receive_bytes);
  builder.SetResourceQuota(grpc::ResourceQuota("grouser").Resize(kQuotaBytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.max_calls);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, idle_ms);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, std::min(idle_ms, kHandshakeMs));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kMinClientPingMs);
}

LoadControl::Limits LoadLimits(const NetOptions& options) {
  const std::size_t bytes = static_cast<std::size_t>(options.memory_budget_mb) << 20;
  return {bytes, ToMilliseconds(options.answer_s)};
}

/// Takes reflection out again, which every builder gets by its library alone.
class WithoutReflection final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments*) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins,
                  [](const auto& plugin) { return plugin->name() == "proto_server_reflection"; });
  }
};

std::size_t MostConnections(const NetOptions& options) {
  const std::size_t limit = os::RaiseDescriptorLimit();
  const std::size_t room = limit - std::min(kReservedDescriptors, limit / 2);
  const auto wanted = static_cast<std::size_t>(options.max_connections);
  if (wanted > room) {
    spdlog::warn("grpc: {} connections at most, not {}: the hard limit of open files is {}", room,
                 wanted, limit);
  }
  return std::min(wanted, room);
}

void WarnWhereNobodyMay(const std::string& service, const AccessPolicy& policy,
                        const std::string& address) {
  if (policy.has_file()) return;
  const auto most = std::ranges::max_element(MethodRights(), {}, [&](const MethodRight& r) {
    return r.service == service ? r.role : Role::kNone;
  });
  if (most->service != service || most->role <= policy.role_without_file()) return;
  spdlog::warn(
      "grpc: {}: other machines reach it and there is no --rights: callers may read, and nobody "
      "may submit, promote or administer",
      address);
}

/// Where a client on this machine reaches what listens on `address`.
std::string Reachable(Address address) {
  if (address.host == "0.0.0.0") address.host = "127.0.0.1";
  if (address.host == "::") address.host = "::1";
  return address.Text();
}

}  // namespace

GrpcServer::GrpcServer(const NetOptions& options, const std::vector<NamedService>& services,
                       CallGate& gate, AccessPolicy& policy, std::function<void()> on_unreachable)
    : options_(options), gate_(gate), keeper_(loop_, gate.load()) {
  // Both are registries of gRPC itself and must be set before a builder exists.
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      MakeServerCredentials(options_.tls, policy, gate_.records()));
  for (const NamedService& s : services) {
    CheckTableCovers(s.name);
    WarnWhereNobodyMay(s.name, policy, options_.grpc);
    builder.RegisterService(s.service);
    gate_.records().AddService(s.name);
  }
  SetLimits(builder, options_);
  gate.load().SetLimits(LoadLimits(options_));
  if (!options_.reflection) builder.SetOption(std::make_unique<WithoutReflection>());
  listener_ = std::make_unique<Listener>(
      loop_, ParseAddress(options_.grpc), MostConnections(options_), [this](int listener, int fd) {
        grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
        connection.listener_fd = listener;
        connection.fd = fd;
        acceptor_->HandleNewConnection(&connection);
      });
  gate.load().backlog().SetCount([this] { return listener_->connections().CountWaiting(); });
  server_ = builder.BuildAndStart();
  if (!server_) throw std::runtime_error("grpc: the server cannot be started");
  for (const NamedService& s : services) SetServing(s.name, true);
  listener_->Start();
  keeper_.Start();
  thread_ = std::jthread([this] { loop_.run(); });
  if (options_.probe_s > 0) {
    probe_.emplace(
        Reachable(listener_->address()), MakeProbeCredentials(options_.tls),
        std::chrono::duration<double>(options_.probe_s), [this] { return listener_->full(); },
        [on_unreachable = std::move(on_unreachable)] {
          spdlog::critical("grpc: new clients cannot reach this program: it ends");
          ::alarm(kLastResortS);
          on_unreachable();
        });
  }
}

GrpcServer::~GrpcServer() { Close(); }

std::shared_ptr<grpc::Channel> GrpcServer::InProcessChannel() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);  // answers are bounded by what is asked
  return server_->InProcessChannel(arguments);
}

void GrpcServer::SetServing(const std::string& service, bool serving) {
  server_->GetHealthCheckService()->SetServingStatus(service, serving);
}

void GrpcServer::StopListening() {
  if (!thread_.joinable()) return;
  probe_.reset();
  boost::asio::post(loop_, [this] {
    listener_->Stop();
    loop_.stop();
  });
  thread_.join();
}

void GrpcServer::Drain() {
  server_->GetHealthCheckService()->Shutdown();
  StopListening();
  if (!gate_.WaitQuiet(kQuiet, ToMilliseconds(kAnsweringShare * options_.drain_s))) {
    spdlog::warn("grpc: clients still send; from now on they get UNAVAILABLE");
  }
  gate_.Refuse();
}

void GrpcServer::Close() {
  if (!server_) return;
  StopListening();
  gate_.Refuse();
  const auto limit = ToMilliseconds((1 - kAnsweringShare) * options_.drain_s);
  if (!gate_.WaitEmpty(std::max(limit, kQuiet))) {
    spdlog::warn("grpc: not all calls ended within {} s; they are cancelled", options_.drain_s);
  }
  // Before gRPC shuts down: it would cancel the calls that reach it meanwhile.
  ConnectionTable& connections = listener_->connections();
  connections.EndAll();
  for (auto waited = Milliseconds(0); waited < kQuiet && connections.CountOpen() > 0;
       waited += Milliseconds(1)) {
    std::this_thread::sleep_for(Milliseconds(1));
  }
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
  server_.reset();
}

}  // namespace grouser::server

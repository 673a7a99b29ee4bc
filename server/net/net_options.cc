#include "server/net/net_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "server/net/address.h"
#include "server/net/rights_file.h"

namespace grouser::server {

void NetOptions::AddSecurityTo(CLI::App& app) {
  auto* certificate = app.add_option("--tls-cert", tls.certificates,
                                     "Certificate in PEM, then those that sign it: serve TLS");
  auto* key = app.add_option("--tls-key", tls.key, "Its key in PEM, without a password");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--tls-client-ca", tls.client_ca,
                 "Certificates in PEM of who signs clients' certificates: callers need one, or a "
                 "token of the rights file, unless that says anyone")
      ->needs(certificate);
  app.add_option(
      "--rights", rights,
      "YAML file: who may read, submit, promote, administer; without one the address of --grpc "
      "decides: on one of this machine alone callers may do all, on any other read");
  app.add_flag("--insecure", insecure, "Plaintext, although other machines reach the address");
  app.add_flag("--reflection", reflection, "Clients may ask for the services' descriptions");
}

void NetOptions::AddTo(CLI::App& app) {
  app.add_option("--grpc", grpc,
                 "HOST:PORT to listen on, port 0 takes a free one; or unix:PATH, a socket of mode "
                 "0600")
      ->check([](const std::string& text) -> std::string {
        try {
          ParseAddress(text);
          return "";
        } catch (const std::invalid_argument& e) {
          return e.what();
        }
      })
      ->capture_default_str();
  app.add_option("--port-file", port_file, "File that receives grpc=ADDR when ready");
  app.add_option("--max-connections", max_connections,
                 "Most open connections; further clients wait until one closes")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--idle-s", idle_s, "A connection without a call for so long is closed [s]")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option(
         "--memory-budget-mb", memory_budget_mb,
         "Memory for requests and answers under way over all connections, of which each may "
         "hold as much as is free; what does not fit is refused [MiB]")
      ->check(CLI::Range(8, 1000000))
      ->capture_default_str();
  app.add_option("--max-calls", max_calls,
                 "Most calls and streams under way on a connection; its client holds further ones "
                 "back")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--answer-s", answer_s,
                 "A call whose client does not take its answer within so long is cancelled [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  app.add_option("--drain-s", drain_s,
                 "After SIGTERM, longest time to answer what was sent before it [s]")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--probe-s", probe_s,
                 "The program connects to itself so often and ends with 1 when it cannot three "
                 "times in a row; 0: never [s]")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  AddSecurityTo(app);
}

void NetOptions::Validate() const {
  const Address address = ParseAddress(grpc);
  if (!address.is_local() && !tls.given() && !insecure) {
    throw std::invalid_argument(fmt::format(
        "--grpc {}: other machines reach it, and nothing would be encrypted; expected --tls-cert "
        "and --tls-key, or an address of this machine alone such as 127.0.0.1:{}, or --insecure "
        "to serve plaintext all the same",
        grpc, address.port));
  }
  try {
    if (tls.given()) ReadTls(tls);
    if (!rights.empty()) ReadRights(rights);
  } catch (const std::runtime_error& e) {
    throw std::invalid_argument(e.what());
  }
}

}  // namespace grouser::server

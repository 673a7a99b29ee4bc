#include "server/net/http/http_options.h"

#include <CLI/CLI.hpp>

#include "server/net/address.h"

namespace grouser::server {

void HttpOptions::AddTo(CLI::App& app) {
  app.add_option(
         "--http", http,
         "HOST:PORT or unix:PATH for the web page, /metrics, /healthz, /readyz, /buildinfo and "
         "calls as JSON (default: none)")
      ->check([](const std::string& text) -> std::string {
        try {
          ParseAddress(text, "http");
          return "";
        } catch (const std::invalid_argument& e) {
          return e.what();
        }
      });
  app.add_flag("--http-insecure", insecure,
               "--http may be an address that other machines reach, without encryption and without "
               "web page and calls as JSON");
}

void HttpOptions::Validate() const {
  if (http.empty() || insecure || ParseAddress(http, "http").is_local()) return;
  throw std::invalid_argument(
      "http: '" + http +
      "', expected an address of this machine alone (127.0.0.1, [::1], localhost, unix:PATH), or "
      "--http-insecure");
}

}  // namespace grouser::server

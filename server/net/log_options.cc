#include <CLI/CLI.hpp>

#include "server/net/log_settings.h"

namespace grouser::server {

void LogSettings::AddTo(CLI::App& app) {
  app.add_option("--log-format", format, "text, or json: one object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_option("--log-slow-s", slow_s, "Calls that take longer are logged [s]")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
}

}  // namespace grouser::server

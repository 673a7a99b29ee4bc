#include "server/core/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace grouser::server {
namespace {

constexpr int kMaxPort = 65535;

[[noreturn]] void Fail(const std::string& key, const std::string& value, const char* expected) {
  throw std::invalid_argument(fmt::format("{}: '{}', expected {}", key, value, expected));
}

void CheckAddress(const std::string& address) {
  constexpr const char* kExpected = "HOST:PORT with a port from 0 to 65535";
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) Fail("grpc", address, kExpected);
  const std::string port = address.substr(colon + 1);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      std::all_of(port.begin(), port.end(),
                                  [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!digits || std::stoi(port) > kMaxPort) Fail("grpc", address, kExpected);
}

}  // namespace

void ServerConfig::Validate() const {
  if (state_dir.empty()) {
    Fail("state", state_dir, "a folder (set --state, GROUSER_STATE or HOME)");
  }
  namespace fs = std::filesystem;
  if (fs::exists(state_dir) && !fs::is_directory(state_dir)) Fail("state", state_dir, "a folder");
  if (!shipped_dir.empty() && !fs::is_directory(shipped_dir)) {
    Fail("shipped", shipped_dir, "a folder that exists");
  }
  CheckAddress(grpc_address);
  if (poll_period.count() <= 0) {
    Fail("poll_period", fmt::format("{} ms", poll_period.count()), "more than 0 ms");
  }
  if (drain_limit.count() < 0) {
    Fail("drain_limit", fmt::format("{} ms", drain_limit.count()), "0 ms or more");
  }
  if (max_receive_bytes <= 0) {
    Fail("max_receive_bytes", fmt::format("{}", max_receive_bytes), "more than 0");
  }
  if (max_calls_per_connection <= 0) {
    Fail("max_calls_per_connection", fmt::format("{}", max_calls_per_connection), "more than 0");
  }
}

std::string DefaultStateDir() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  if (const auto state = variable("GROUSER_STATE"); !state.empty()) return state;
  if (const auto xdg = variable("XDG_STATE_HOME"); !xdg.empty()) return xdg + "/grouser";
  if (const auto home = variable("HOME"); !home.empty()) return home + "/.local/state/grouser";
  return "";
}

}  // namespace grouser::server

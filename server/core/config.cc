#include "server/core/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace grouser::server {
namespace {

[[noreturn]] void Fail(const std::string& key, const std::string& value, const char* expected) {
  throw std::invalid_argument(fmt::format("{}: '{}', expected {}", key, value, expected));
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
  if (vehicle_threads < 1 || vehicle_threads > kMostVehicleThreads) {
    Fail("vehicle-threads", std::to_string(vehicle_threads),
         fmt::format("1 to {}", kMostVehicleThreads).c_str());
  }
  if (table_cache_mb < 0) {
    Fail("table-cache-mb", std::to_string(table_cache_mb), "0 or more");
  }
  const auto check = [](const char* key, int value, int most) {
    if (value >= 1 && value <= most) return;
    Fail(key, std::to_string(value), fmt::format("1 to {}", most).c_str());
  };
  check("query-log-limit-mb", query_log_limit_mb, kMostQueryLogMb);
  check("query-log-files", query_log_files, kMostQueryLogFiles);
  // Of another server's FILE that would be an older file, and of this one's that server's.
  const std::string ending = fs::path(query_log).extension();
  if (ending.size() > 1 && ending.find_first_not_of("0123456789", 1) == ending.npos) {
    Fail("query-log", query_log, "a name that does not end in .NUMBER, as older files of a log do");
  }
  if (poll_period.count() <= 0) {
    Fail("poll_period", fmt::format("{} ms", poll_period.count()), "more than 0 ms");
  }
}

int DefaultVehicleThreads(unsigned processors) {
  return static_cast<int>(std::clamp(processors / 2, 1u, unsigned{kMostVehicleThreads}));
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

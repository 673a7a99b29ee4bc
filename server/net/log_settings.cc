#include "server/net/log_settings.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>

namespace grouser::server {
namespace {

// Of the logger whose messages are members of a JSON object already.
constexpr const char* kFieldsLogger = "fields";

/// A text that may hold any bytes, as JSON.
std::string Quoted(std::string_view text) {
  return nlohmann::json(std::string(text))
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// {"time": ..., "level": ..., "program": ..., "message": ...}, one a line.
class JsonFormatter final : public spdlog::formatter {
 public:
  explicit JsonFormatter(std::string program) : program_(std::move(program)) {}

  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& to) override {
    const auto since = line.time.time_since_epoch();
    const std::time_t seconds = std::chrono::duration_cast<std::chrono::seconds>(since).count();
    const auto us =
        std::chrono::duration_cast<std::chrono::microseconds>(since).count() % 1'000'000;
    std::tm utc{};
    ::gmtime_r(&seconds, &utc);
    char time[32];
    std::strftime(time, sizeof time, "%Y-%m-%dT%H:%M:%S", &utc);
    const std::string_view level(spdlog::level::to_string_view(line.level).data());
    const std::string_view payload(line.payload.data(), line.payload.size());
    const bool fields =
        std::string_view(line.logger_name.data(), line.logger_name.size()) == kFieldsLogger;
    fmt::format_to(std::back_inserter(to),
                   R"({{"time": "{}.{:06}Z", "level": "{}", "program": {}, {}{}}})"
                   "\n",
                   time, us, level, Quoted(program_),
                   fields ? "" : "\"message\": ", fields ? std::string(payload) : Quoted(payload));
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>(program_);
  }

 private:
  std::string program_;
};

}  // namespace

void LogSettings::Install(const std::string& program) const {
  const auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  const auto logger = std::make_shared<spdlog::logger>(program, sink);
  if (format == "json") {
    sink->set_formatter(std::make_unique<JsonFormatter>(program));
    spdlog::register_logger(std::make_shared<spdlog::logger>(kFieldsLogger, sink));
  }
  spdlog::set_default_logger(logger);
  spdlog::flush_on(spdlog::level::info);
}

LogLine& LogLine::Add(const char* name, std::string_view value) {
  json_ += fmt::format("\"{}\": {}, ", name, Quoted(value));
  text_ += fmt::format("{}={} ", name, value);
  return *this;
}

LogLine& LogLine::Add(const char* name, double value) {
  json_ += fmt::format("\"{}\": {:.6g}, ", name, value);
  text_ += fmt::format("{}={:.6g} ", name, value);
  return *this;
}

void LogLine::Write(std::string_view message) {
  if (const auto json = spdlog::get(kFieldsLogger)) {
    json->log(level_, json_ + "\"message\": " + Quoted(message));
  } else {
    std::string text = text_ + std::string(message);
    for (char& c : text) {  // what clients send must not move the cursor of a terminal
      if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = '?';
    }
    spdlog::log(level_, "{}", text);
  }
}

}  // namespace grouser::server

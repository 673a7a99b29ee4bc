#pragma once

#include <spdlog/common.h>

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace grouser::server {

/// How a program logs, to stderr.
struct LogSettings {
  std::string format = "text";  ///< or "json": one object a line
  double slow_s = 1;            ///< calls that take longer are logged

  void AddTo(CLI::App& app);
  /// Makes the program's logger. Before any thread.
  void Install(const std::string& program) const;
};

/// A line with fields beside its message: members of the object in JSON, "name=value" in text.
class LogLine {
 public:
  explicit LogLine(spdlog::level::level_enum level) : level_(level) {}
  LogLine& Add(const char* name, std::string_view value);
  LogLine& Add(const char* name, double value);
  void Write(std::string_view message);

 private:
  spdlog::level::level_enum level_;
  std::string json_, text_;
};

}  // namespace grouser::server

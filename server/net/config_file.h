#pragma once

#include <memory>
#include <set>
#include <string>

namespace CLI {
class App;
}

namespace grouser::server {

/// One YAML file for the settings of both programs, by the names of their options:
///   both:   {state: /var/lib/grouser, log-format: json}
///   server: {http: 127.0.0.1:50161, vehicles: [a, b]}
///   jobs:   {workers: 2}
/// The command line goes before the file, a program's own section before "both". Unknown keys
/// are refused, with the nearest known one.
class ConfigFile {
 public:
  /// `section`: "server" or "jobs".
  explicit ConfigFile(std::string section) : section_(std::move(section)) {}

  /// Adds --config, --config-check, --config-show and --config-schema. After all other options;
  /// this must be there while `app` parses.
  void AddTo(CLI::App& app);

  /// Whether the program was asked about its settings alone. It then prints that and ends. Once
  /// the settings were parsed and found good.
  /// Whether the file gave an option.
  bool Gave(const std::string& name) const { return from_file_.contains(name); }

  bool Answer(const CLI::App& app, std::string* text) const;

 private:
  class Reader;

  std::string Shown(const CLI::App& app) const;
  std::string Schema(const CLI::App& app) const;

  std::string section_;
  bool check_ = false, show_ = false, schema_ = false;
  std::set<std::string> from_file_;  // options that the file gave
};

}  // namespace grouser::server

#include "server/net/config_file.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "proto/records/yaml/yaml_section.h"

namespace grouser::server {
namespace {

constexpr const char* kBoth = "both";
constexpr const char* kSections[] = {kBoth, "server", "jobs"};

/// Options that a file may give: not those that ask for something and end, nor hidden ones.
std::vector<const CLI::Option*> Settings(const CLI::App& app) {
  std::vector<const CLI::Option*> settings;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty() || option->get_group().empty()) continue;
    const std::string& name = option->get_lnames().front();
    const bool asks = name == "help" || name == "version" || name.starts_with("config");
    if (!asks) settings.push_back(option);
  }
  return settings;
}

bool IsFlag(const CLI::Option& option) { return option.get_expected_max() == 0; }
bool IsList(const CLI::Option& option) { return option.get_expected_max() > 1; }

const char* TypeOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return IsFlag(option)                                        ? "boolean"
         : type.starts_with("INT") || type.starts_with("UINT") ? "integer"
         : type.starts_with("FLOAT")                           ? "number"
                                                               : "string";
}

/// What a value of a file should be; empty: it is. CLI11 would say it without the line.
std::string ExpectedInstead(CLI::Option& option, const std::string& value) {
  const std::string type = TypeOf(option);
  if (type == "boolean") {
    try {
      CLI::detail::to_flag_value(value);
      return "";
    } catch (const std::invalid_argument&) {
      return "true or false";
    }
  }
  std::int64_t whole = 0;
  if (type == "integer" && !CLI::detail::lexical_cast(value, whole)) return "a whole number";
  double number = 0;
  if (type == "number" && !CLI::detail::lexical_cast(value, number)) return "a number";
  for (int i = 0;; ++i) {
    try {
      const CLI::Validator& check = *option.get_validator(i);
      const std::string fault = check(value);
      if (fault.empty()) continue;
      constexpr std::string_view kExpected = "expected ";
      const std::size_t at = fault.find(kExpected);
      if (at != std::string::npos) return fault.substr(at + kExpected.size());
      const std::string range = check.get_description();
      return range.empty() ? fault : range;
    } catch (const CLI::OptionNotFound&) {
      return "";  // that was the last one
    }
  }
}

std::string Value(const CLI::Option& option) {
  if (option.empty()) {
    const std::string text = option.get_default_str();
    return !text.empty() ? text : IsFlag(option) ? "false" : "''";
  }
  const auto values = option.results();
  return IsList(option) ? fmt::format("[{}]", fmt::join(values, ", ")) : values.front();
}

}  // namespace

/// What CLI11 asks for the values of a file.
class ConfigFile::Reader final : public CLI::Config {
 public:
  Reader(ConfigFile& of, CLI::App& app) : of_(of), app_(app) {}

  std::string to_config(const CLI::App*, bool, bool, std::string) const override {
    return of_.Shown(app_);
  }

  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    const std::string name_of_file = app_.get_config_ptr()->results().front();
    if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
      throw CLI::ConfigError(name_of_file + ": empty, expected sections of both, server or jobs");
    }
    try {
      auto file = records::YamlSection::OfText(text, name_of_file);
      std::vector<CLI::ConfigItem> items;
      // CLI11 takes the first of two: the own section's.
      for (const std::string& name : {of_.section_, std::string(kBoth)}) {
        if (!file.Has(name)) continue;
        try {
          Take(file.Section(name), &items);
        } catch (const records::InputError& e) {
          const bool unknown =
              std::string_view(e.what()).find("an unknown key") != std::string::npos;
          if (name != kBoth || !unknown) throw;
          throw CLI::ConfigError(fmt::format(
              "{}; what is a setting of one program alone belongs under server: or jobs:",
              e.what()));
        }
      }
      for (const char* other : kSections) file.Has(other);
      file.Finish();
      return items;
    } catch (const records::InputError& e) {
      throw CLI::ConfigError(e.what());
    }
  }

 private:
  void Take(records::YamlSection section, std::vector<CLI::ConfigItem>* items) const {
    for (const CLI::Option* option : Settings(app_)) {
      const std::string& name = option->get_lnames().front();
      if (!section.Has(name)) continue;
      const bool one = section.IsText(name) || !IsList(*option);
      auto values = one ? std::vector{section.Text(name)} : section.Words(name, "texts");
      for (const std::string& value : values) {
        const std::string expected = ExpectedInstead(*app_.get_option("--" + name), value);
        if (!expected.empty()) section.Fail(name, "'" + value + "'", expected);
      }
      items->push_back({{}, name, std::move(values)});
      if (option->empty()) of_.from_file_.insert(name);
    }
    section.Finish();
  }

  ConfigFile& of_;
  CLI::App& app_;
};

void ConfigFile::AddTo(CLI::App& app) {
  app.set_config("--config", "", "YAML file of settings; the command line goes before it")
      ->check([](const std::string& path) -> std::string {
        std::error_code unreadable;
        return std::filesystem::is_directory(path, unreadable)
                   ? "'" + path + "': a folder, expected a YAML file"
                   : "";
      });
  app.config_formatter(std::make_shared<Reader>(*this, app));
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.add_flag("--config-check", check_, "Checks the settings, serves nothing");
  app.add_flag("--config-show", show_, "Prints the settings and where each comes from");
  app.add_flag("--config-schema", schema_, "Prints the JSON schema of the file");
}

bool ConfigFile::Answer(const CLI::App& app, std::string* text) const {
  if (schema_) {
    *text = Schema(app);
  } else if (show_) {
    *text = Shown(app);
  } else if (check_) {
    *text = section_ + ": ok\n";
  } else {
    return false;
  }
  return true;
}

std::string ConfigFile::Shown(const CLI::App& app) const {
  std::string text = section_ + ":\n";
  for (const CLI::Option* option : Settings(app)) {
    const std::string& name = option->get_lnames().front();
    const char* source = option->empty()             ? "default"
                         : from_file_.contains(name) ? "file"
                                                     : "command line";
    text += fmt::format("  {}: {}  # {}\n", name, Value(*option), source);
  }
  return text;
}

std::string ConfigFile::Schema(const CLI::App& app) const {
  nlohmann::json settings = nlohmann::json::object();
  for (const CLI::Option* option : Settings(app)) {
    const nlohmann::json scalar = {{"type", TypeOf(*option)}};
    nlohmann::json setting = scalar;
    if (IsList(*option)) setting = {{"type", "array"}, {"items", scalar}};
    setting["description"] = option->get_description();
    settings[option->get_lnames().front()] = setting;
  }
  const nlohmann::json section = {
      {"type", "object"}, {"additionalProperties", false}, {"properties", settings}};
  nlohmann::json sections = nlohmann::json::object();
  for (const char* name : kSections) {
    sections[name] = name == section_ ? section : nlohmann::json{{"type", "object"}};
  }
  const nlohmann::json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                                 {"title", "Settings of grouser-" + section_},
                                 {"type", "object"},
                                 {"additionalProperties", false},
                                 {"properties", sections}};
  return schema.dump(2) + "\n";
}

}  // namespace grouser::server

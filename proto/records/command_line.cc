#include "proto/records/command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

namespace grouser::records {
namespace {

using Json = nlohmann::ordered_json;

Json OptionJson(const CLI::Option& option) {
  Json names = Json::array();
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  if (!option.nonpositional()) names.push_back(option.get_name(true));
  return {{"names", names},
          {"positional", !option.nonpositional()},
          {"required", option.get_required()},
          {"text", option.get_description()},
          {"default", option.get_default_str()},
          {"type", option.get_type_name()},
          {"values", option.get_items_expected_max()}};
}

Json OptionsJson(const CLI::App& app) {
  Json options = Json::array();
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) options.push_back(OptionJson(*option));
  }
  return options;
}

Json AppJson(const CLI::App& app) {
  Json subcommands = Json::array();
  for (const CLI::App* sub : app.get_subcommands(std::function<bool(const CLI::App*)>())) {
    if (!sub->get_group().empty()) subcommands.push_back(AppJson(*sub));
  }
  return {{"name", app.get_name()},      {"text", app.get_description()},
          {"footer", app.get_footer()},  {"falls_through", app.get_fallthrough()},
          {"options", OptionsJson(app)}, {"subcommands", std::move(subcommands)}};
}

}  // namespace

std::string DescribedCommandLine(const CLI::App& app) {
  Json path = Json::array(), above = Json::array();
  for (const CLI::App* at = &app; at->get_parent() != nullptr; at = at->get_parent()) {
    path.insert(path.begin(), at->get_name());
    if (!at->get_fallthrough()) continue;
    for (Json& option : OptionsJson(*at->get_parent())) above.push_back(std::move(option));
  }
  Json json = {{"program", std::filesystem::read_symlink("/proc/self/exe").filename().string()},
               {"path", std::move(path)},
               {"above", std::move(above)}};
  json.update(AppJson(app));
  return json.dump(1);
}

void DescribeOnDemand(CLI::App& app) {
  const auto describe = [&app] { throw CLI::CallForVersion(DescribedCommandLine(app), 0); };
  app.add_flag_callback("--describe-command-line", describe)->group("")->configurable(false);
  for (CLI::App* sub : app.get_subcommands(std::function<bool(CLI::App*)>()))
    DescribeOnDemand(*sub);
}

void RefuseNaN(CLI::App& app) {
  const auto check = [](const std::string& text) -> std::string {
    double value = 0;
    const bool is_nan = CLI::detail::lexical_cast(text, value) && std::isnan(value);
    return is_nan ? "got " + text + ", expected a number" : "";
  };
  for (CLI::Option* option : app.get_options(std::function<bool(CLI::Option*)>())) {
    if (option->get_type_name().find("FLOAT") != std::string::npos) option->check(check);
  }
  for (CLI::App* sub : app.get_subcommands(std::function<bool(CLI::App*)>())) RefuseNaN(*sub);
}

}  // namespace grouser::records

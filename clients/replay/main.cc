// grouser-replay: evaluates logged queries again, and compares bits.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "clients/cpp/access_options.h"
#include "clients/replay/replay.h"
#include "proto/records/command_line.h"
#include "proto/records/os/root_folder.h"
#include "server/core/config.h"

namespace {

using namespace grouser::replay;

constexpr int kExitOk = 0, kExitDiffers = 1, kExitUsage = 2;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-replay queries.log queries.log.1\n"
    "  grouser-replay queries.log --model 5b15eb07a039\n"
    "  grouser-replay queries.log --server 127.0.0.1:50151\n"
    "The logs: grouser-server --query-log FILE.\n"
    "Exit codes: 0 all equal, 1 something differs, is damaged, cut off or has no model here, 2 "
    "bad\n"
    "usage, or a file that is no query log.";

void PrintText(const Report& r) {
  for (const Shown& shown : r.first) {
    const Difference& d = shown.difference;
    fmt::print("{}{}, {}: logged {}, now {}\n", shown.where,
               d.state < 0 ? "" : fmt::format(", state {}", d.state), d.field, d.logged, d.now);
  }
  fmt::print("{} queries, {} replayed: {} states, {} of equal bits, {} differing\n", r.queries,
             r.replayed, r.states, r.states - r.differing_states, r.differing_states);
  for (const auto& [model, missing] : r.missing) {
    fmt::print("not replayed for want of a model: {} ({} queries): {}\n", model, missing.queries,
               missing.why);
  }
  if (r.refused > 0) {
    fmt::print("not replayed, as no server logs such: {} queries\n", r.refused);
  }
}

void PrintJson(const Report& r) {
  nlohmann::json out = {{"queries", r.queries},
                        {"replayed", r.replayed},
                        {"states", r.states},
                        {"equal_states", r.states - r.differing_states},
                        {"differing_states", r.differing_states},
                        {"differing_queries", r.differing_queries},
                        {"refused", r.refused},
                        {"refusals", r.refusals},
                        {"missing", nlohmann::json::object()},
                        {"damaged", r.damaged},
                        {"cut_off", r.cut_off},
                        {"notes", r.notes},
                        {"first", nlohmann::json::array()}};
  for (const auto& [model, missing] : r.missing) {
    out["missing"][model] = {{"queries", missing.queries}, {"why", missing.why}};
  }
  for (const Shown& shown : r.first) {
    const Difference& d = shown.difference;
    out["first"].push_back({{"where", shown.where},
                            {"state", d.state},
                            {"field", d.field},
                            {"logged", d.logged},
                            {"now", d.now}});
  }
  std::cout << out.dump(1) << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Evaluates queries that grouser-server has logged again, by the models that answered them, "
      "and "
      "compares bits."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-replay " GROUSER_VERSION);
  std::vector<std::string> logs;
  std::string model, state = grouser::server::DefaultStateDir();
  std::string shipped = grouser::os::RootOfProgram() / "surrogate/shipped";
  grouser::client::Server server;
  int deadline_ms = 10000;
  bool json = false, allow_cut_tail = false;
  app.add_option("log", logs, "Files of logged queries")->required()->expected(1, -1);
  app.add_option(
      "--model", model,
      "Evaluate all queries by this model: 12 digits of its digest or more, NAME, NAME@ALIAS "
      "or NAME@sha256:HEX; default: each by the one that answered it");
  app.add_option("--state", state, "State folder; its models/ are used")->capture_default_str();
  app.add_option("--shipped", shipped,
                 "Folder of shipped models; default: surrogate/shipped of the installation or "
                 "checkout");
  app.add_option("--server", server.address,
                 "Ask this grouser-server (HOST:PORT or unix:PATH) instead of evaluating here");
  grouser::client::AddAccessOptions(app, &server.access);
  app.add_option("--deadline-ms", deadline_ms, "Limit of one call [ms]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--allow-cut-tail", allow_cut_tail,
               "Take files that end in the middle of a record, as a kill leaves them, for whole");
  app.add_flag("--json", json, "JSON on stdout");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  try {
    const std::unique_ptr<Answers> answers = server.address.empty()
                                                 ? AnswersInProcess(state, shipped)
                                                 : AnswersOfServer(server, deadline_ms);
    Replay replay(*answers, model.empty() ? "" : answers->ReferenceOf(model));
    for (const std::string& log : logs) replay.Add(log);
    const Report& report = replay.report();
    for (const auto* lines : {&report.notes, &report.cut_off, &report.damaged, &report.refusals}) {
      for (const std::string& line : *lines) std::cerr << "grouser-replay: " << line << "\n";
    }
    json ? PrintJson(report) : PrintText(report);
    const bool whole = report.cut_off.empty() || allow_cut_tail;
    return report.all_equal() && whole ? kExitOk : kExitDiffers;
  } catch (const std::exception& e) {
    std::cerr << "grouser-replay: " << e.what() << "\n";
    return kExitUsage;
  }
}

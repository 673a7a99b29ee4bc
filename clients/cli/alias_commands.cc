#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <iostream>

#include "clients/cli/job_options.h"
#include "clients/cli/print.h"

namespace grouser::cli {
namespace {

using google::protobuf::util::TimeUtil;

std::string Short(const std::string& digest) {
  return digest.empty() ? "none" : digest.substr(0, kShownDigits);
}

void PrintMove(const v1alpha1::AliasMove& move) {
  fmt::print("{:>6} {} {}@{} {} -> {}{} by {}: {}\n", move.generation(),
             TimeUtil::ToString(move.time()), move.model(), move.alias(), Short(move.from_digest()),
             Short(move.to_digest()), move.rollback() ? " back" : "", move.who(), move.why());
}

int Print(const Common& common, const v1alpha1::AliasMove& move) {
  if (common.json) {
    PrintJson(move);
  } else if (move.from_digest() == move.to_digest()) {
    fmt::print("nothing moved: {}@{} is {} already\n", move.model(), move.alias(),
               Short(move.to_digest()));
  } else {
    PrintMove(move);
  }
  return kExitOk;
}

int History(const Common& common, const std::string& model, int limit) {
  const auto response = MakeClient(common).ListAliasMoves(model, limit);
  if (common.json) {
    PrintJson(response);
  } else {
    for (const auto& move : response.moves()) PrintMove(move);
    if (response.moves().empty()) std::cerr << "no move is recorded\n";
  }
  return kExitOk;
}

int Prune(const Common& common, const v1alpha1::PruneRequest& request) {
  const auto response = MakeClient(common).Prune(request);
  const int code = response.failed_count() == 0 ? kExitOk : kExitFailed;
  if (common.json) {
    PrintJson(response);
    return code;
  }
  for (const auto& item : response.items()) {
    fmt::print("{:>12} {} {}: {}\n", item.bytes(), TimeUtil::ToString(item.time()), item.name(),
               item.why());
  }
  fmt::print("{} {} of {} MB, {} entries\n", request.dry_run() ? "would free" : "freed",
             response.bytes_freed() / 1e6, response.bytes_before() / 1e6, response.items_count());
  for (const auto& item : response.failed()) {
    std::cerr << fmt::format("not removed: {}: {}\n", item.name(), item.why());
  }
  if (code != kExitOk) {
    std::cerr << fmt::format("{} entries could not be removed\n", response.failed_count());
  }
  return code;
}

template <class Request>
void AddWhoAndWhy(CLI::App* command, std::shared_ptr<Request> request) {
  command
      ->add_option_function<std::string>(
          "--who", [request](const auto& v) { request->set_who(v); }, "Who decided")
      ->required();
  command
      ->add_option_function<std::string>(
          "--why", [request](const auto& v) { request->set_why(v); }, "Why")
      ->required();
}

void AddMove(CLI::App& model, std::shared_ptr<Common> common, Action* action) {
  auto* move = model.add_subcommand("move", "Points an alias at a model: canary to stable");
  auto request = std::make_shared<v1alpha1::MoveAliasRequest>();
  move->add_option_function<std::string>(
          "model", [request](const auto& v) { request->set_model(v); },
          "Where to: NAME@ALIAS or NAME@sha256:HEX")
      ->required();
  move->add_option_function<std::string>(
      "--to", [request](const auto& v) { request->set_alias(v); },
      "Alias to move; default: stable");
  AddWhoAndWhy(move, request);
  move->footer(
      "Examples:\n"
      "  grouser-client model move NAME@canary --to stable --who me --why 'a week without "
      "complaint'\n"
      "  grouser-client model move NAME@sha256:0123456789ab --to paper-2026 --who me --why kept");
  move->add_flag_callback(
      "--override-gate", [request] { request->set_override_gate(true); },
      "Also to what no gate has let through");
  move->callback(
      [=] { *action = [=] { return Print(*common, MakeClient(*common).MoveAlias(*request)); }; });
}

void AddRollback(CLI::App& model, std::shared_ptr<Common> common, Action* action) {
  auto* back = model.add_subcommand("rollback", "Moves an alias back to what it named before");
  auto request = std::make_shared<v1alpha1::RollbackAliasRequest>();
  back->add_option_function<std::string>(
          "model", [request](const auto& v) { request->set_model(v); },
          "NAME (its stable) or NAME@ALIAS")
      ->required();
  back->add_option_function<std::string>(
      "--to", [request](const auto& v) { request->set_to(v); },
      "Digest (12 hex digits or more) or generation; default: the model before");
  AddWhoAndWhy(back, request);
  back->footer(
      "Examples:\n"
      "  grouser-client model rollback NAME --who me --why 'worse on the slope'\n"
      "  grouser-client model rollback NAME@canary --to 12 --who me --why 'as at generation 12'");
  back->callback([=] {
    *action = [=] { return Print(*common, MakeClient(*common).RollbackAlias(*request)); };
  });
}

}  // namespace

void AddAliasCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  CLI::App& model = *app.get_subcommand("model");
  AddMove(model, common, action);
  AddRollback(model, common, action);

  auto name = std::make_shared<std::string>();
  auto limit = std::make_shared<int>(20);
  auto* history = model.add_subcommand("history", "Where aliases pointed, newest first");
  history->add_option("model", *name, "NAME or NAME@ALIAS; default: all");
  history->add_option("--limit", *limit, "How many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  history->footer(
      "Examples:\n"
      "  grouser-client model history\n"
      "  grouser-client model history NAME@stable --limit 100");
  history->callback([=] { *action = [=] { return History(*common, *name, *limit); }; });

  auto request = std::make_shared<v1alpha1::PruneRequest>();
  auto* prune = app.add_subcommand(
      "prune", "Removes models, runs, tiles and ended jobs that nothing names any more");
  prune->add_flag_callback(
      "--dry-run", [request] { request->set_dry_run(true); }, "Say what would go, and why");
  prune
      ->add_option_function<std::uint64_t>(
          "--max-disk-mb", [request](std::uint64_t v) { request->set_max_disk_mb(v); },
          "Oldest first, until so much is left [MB]; default: as grouser-jobs was started")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000'000}));
  prune
      ->add_option_function<double>(
          "--keep-days", [request](double v) { request->set_keep_days(v); },
          "What is older [days]; default: as grouser-jobs was started")
      ->check(CLI::Range(0.0, 1e5));
  prune->footer(
      "Examples:\n"
      "  grouser-client prune --dry-run\n"
      "  grouser-client prune --max-disk-mb 20000 --keep-days 90");
  prune->callback([=] { *action = [=] { return Prune(*common, *request); }; });
}

}  // namespace grouser::cli

#include "server/jobs/alias_requests.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

#include "proto/records/os/no_space.h"
#include "server/core/alias_history.h"
#include "server/core/model_reference.h"
#include "server/core/page.h"
#include "server/core/status.h"
#include "server/jobs/request_checks.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {
namespace {

/// Name and alias of "name" or "name@alias". An empty name only where `all` may be meant.
ModelReference ReadAlias(const std::string& text, bool all) {
  std::string problem;
  const auto parsed = ParseModelReference(text, &problem);
  if (!parsed) throw StatusError(StatusCode::kInvalidArgument, "model: " + problem);
  if (!parsed->digest_prefix.empty() || (parsed->name.empty() && !all)) {
    throw StatusError(StatusCode::kInvalidArgument,
                      "model: " + Quote(text) + ", expected NAME or NAME@ALIAS");
  }
  return *parsed;
}

/// What the repository says, as a status.
template <class Run>
auto Asked(Run run) {
  try {
    return run();
  } catch (const StatusError&) {
    throw;
  } catch (const std::out_of_range& e) {
    throw StatusError(StatusCode::kNotFound, e.what());
  } catch (const std::runtime_error& e) {
    throw StatusError(NotMovedCode(e), std::string("alias not moved: ") + e.what());
  }
}

v1alpha1::AliasMove ToMessage(const AliasMove& move) {
  v1alpha1::AliasMove out;
  out.set_generation(move.generation);
  out.set_model(move.model);
  out.set_alias(move.alias);
  out.set_from_digest(move.from);
  out.set_to_digest(move.digest);
  *out.mutable_time() = records::TimestampOf(move.unix_s);
  out.set_who(move.who);
  out.set_why(move.why);
  out.set_rollback(move.rollback);
  return out;
}

v1alpha1::MoveAliasResponse Moved(const AliasMove& move) {
  v1alpha1::MoveAliasResponse response;
  *response.mutable_move() = ToMessage(move);
  return response;
}

[[noreturn]] void NotLetThrough(const std::string& why) {
  throw StatusError(StatusCode::kFailedPrecondition, "model: " + why);
}

bool WasPromoted(const Repository::Aliases& aliases, const Repository::Entry& entry) {
  const auto of_model = aliases.by_model.find(entry.name);
  const bool named =
      of_model != aliases.by_model.end() &&
      std::any_of(of_model->second.begin(), of_model->second.end(), [&](const auto& alias) {
        return alias.first != kCandidateAlias && alias.second == entry.digest;
      });
  return named || entry.shipped ||
         std::any_of(aliases.history.begin(), aliases.history.end(), [&](const AliasMove& move) {
           return move.model == entry.name && move.alias != kCandidateAlias &&
                  (move.digest == entry.digest || move.from == entry.digest);
         });
}

/// Empty: all models.
void CheckIsKnown(const Repository& repository, const Repository::Aliases& aliases,
                  const std::string& name) {
  std::set<std::string> names;
  for (const auto& [known, of_model] : aliases.by_model) names.insert(known);
  for (const AliasMove& move : aliases.history) names.insert(move.model);
  for (const auto& entry : repository.List(nullptr)) names.insert(entry.name);
  if (name.empty() || names.contains(name)) return;
  throw std::out_of_range(
      fmt::format("model: no model {}; known models: {}", Quote(name),
                  names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

/// A canary lacks what became stable since it was fitted.
void CheckFollowsStable(const Repository::Aliases& aliases, const Repository::Entry& entry) {
  const std::string stable = aliases.Find(entry.name, std::string(kDefaultAlias));
  if (stable.empty() || stable == entry.digest) return;
  const auto named = NamedInTurn(aliases, entry.name, std::string(kDefaultAlias));
  if (std::find(named.begin(), named.end(), entry.digest) != named.end()) return;
  const std::string base = surrogate::ReadModel(entry.path).model.provenance().base_digest();
  if (base.empty() || base == stable) return;
  NotLetThrough(entry.digest + " was fitted from " + base + ", but stable is now " + stable +
                "; refine that one, or move with override_gate");
}

}  // namespace

StatusCode NotMovedCode(const std::exception& e) {
  return dynamic_cast<const os::NoSpace*>(&e) != nullptr ? StatusCode::kResourceExhausted
                                                         : StatusCode::kUnavailable;
}

std::string WhoOf(const std::string& caller, const std::string& says) {
  return says.empty() ? caller : caller + " (says: " + says + ")";
}

v1alpha1::MoveAliasResponse MoveAlias(Repository& repository,
                                      const v1alpha1::MoveAliasRequest& request,
                                      const std::string& who) {
  const std::string alias = request.alias().empty() ? std::string(kDefaultAlias) : request.alias();
  CheckMovableAlias(alias);
  CheckWhoAndWhy(request.who(), request.why());
  std::string problem;
  const auto parsed = ParseModelReference(request.model(), &problem);
  if (!parsed || parsed->name.empty()) {
    throw StatusError(
        StatusCode::kInvalidArgument,
        "model: " + (parsed ? "empty, expected NAME@ALIAS or NAME@sha256:HEX" : problem));
  }
  return Asked([&] {
    const Repository::Entry entry = repository.Resolve(request.model());
    if (!request.override_gate()) {
      const auto aliases = repository.ReadAliases();
      if (!WasPromoted(aliases, entry)) {
        NotLetThrough(entry.digest +
                      " is a candidate that no promotion has let through, expected "
                      "one that was; promote its job, or move with override_gate");
      }
      if (alias == kDefaultAlias) CheckFollowsStable(aliases, entry);
    }
    return Moved(repository.SetAlias(entry.name, alias, entry.digest, WhoOf(who, request.who()),
                                     request.why()));
  });
}

v1alpha1::MoveAliasResponse RollbackAlias(Repository& repository,
                                          const v1alpha1::RollbackAliasRequest& request,
                                          const std::string& who) {
  const ModelReference parsed = ReadAlias(request.model(), /*all=*/false);
  CheckMovableAlias(std::string(parsed.alias));
  CheckWhoAndWhy(request.who(), request.why());
  return Asked([&] {
    return Moved(repository.Rollback(std::string(parsed.name), std::string(parsed.alias),
                                     request.to(), WhoOf(who, request.who()), request.why()));
  });
}

v1alpha1::ListAliasMovesResponse ListAliasMoves(const Repository& repository,
                                                const v1alpha1::ListAliasMovesRequest& request) {
  const ModelReference wanted = ReadAlias(request.model(), /*all=*/true);
  const bool every_alias = request.model().find('@') == std::string::npos;
  int size = 0;
  const Status read = ReadPageSize(request.page_size(), kMaxMovesPageSize, &size);
  if (!read.ok()) throw StatusError(read);
  std::uint64_t before = std::numeric_limits<std::uint64_t>::max();
  const std::string& token = request.page_token();
  if (!token.empty()) {
    const bool number = token.size() < 19 && token.find_first_not_of("0123456789") == token.npos;
    if (!number) throw StatusError(BadPageToken(token));
    before = std::stoull(token);
  }
  return Asked([&] {
    const auto aliases = repository.ReadAliases();
    CheckIsKnown(repository, aliases, std::string(wanted.name));
    v1alpha1::ListAliasMovesResponse response;
    response.set_generation(aliases.generation);
    std::size_t bytes = 0;
    for (auto move = aliases.history.rbegin(); move != aliases.history.rend(); ++move) {
      const bool named = wanted.name.empty() || move->model == wanted.name;
      if (!named || !(every_alias || move->alias == wanted.alias)) continue;
      if (move->generation >= before) continue;
      if (response.moves_size() == size ||
          !AddToPage(ToMessage(*move), &bytes, response.mutable_moves())) {
        const auto last = response.moves(response.moves_size() - 1).generation();
        response.set_next_page_token(std::to_string(last));
        break;
      }
    }
    return response;
  });
}

}  // namespace grouser::server

#include "server/core/alias_history.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "server/core/model_reference.h"

namespace grouser::server {
namespace {

/// More digits are the first ones of a digest.
constexpr std::size_t kMostGenerationDigits = kMinDigestDigits - 1;

std::vector<const AliasMove*> MovesOf(const Repository::Aliases& aliases, const std::string& model,
                                      const std::string& alias) {
  std::vector<const AliasMove*> moves;
  for (const AliasMove& move : aliases.history) {
    if (move.model == model && move.alias == alias) moves.push_back(&move);
  }
  return moves;
}

bool IsGeneration(const std::string& to) {
  return to.size() <= kMostGenerationDigits &&
         std::all_of(to.begin(), to.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// What the alias named at a generation that was; empty: nothing that is known.
std::string NamedAt(const std::vector<const AliasMove*>& moves, std::uint64_t generation) {
  if (moves.empty()) return "";
  // Before the oldest recorded move there may have been others.
  const std::uint64_t first = moves.front()->generation;
  if (moves.size() >= kMovesKept && generation + 1 < first) return "";
  std::string named = moves.front()->from;
  for (const AliasMove* move : moves) {
    if (move->generation <= generation) named = move->digest;
  }
  return named;
}

/// The one digest that an alias named and that begins so; empty: none, or several.
std::string NamedAs(const std::vector<const AliasMove*>& moves, const std::string& digits) {
  std::set<std::string> found;
  for (const AliasMove* move : moves) {
    for (const std::string& digest : {move->from, move->digest}) {
      if (!digest.empty() && digest.starts_with(digits)) found.insert(digest);
    }
  }
  return digits.size() >= kMinDigestDigits && found.size() == 1 ? *found.begin() : "";
}

}  // namespace

std::vector<std::string> NamedInTurn(const Repository::Aliases& aliases, const std::string& model,
                                     const std::string& alias) {
  std::vector<std::string> named;
  for (const AliasMove* move : MovesOf(aliases, model, alias)) {
    if (named.empty() && !move->from.empty()) named.push_back(move->from);
    if (move->rollback) {
      const auto back = std::find(named.rbegin(), named.rend(), move->digest);
      if (back != named.rend()) named.erase(back.base(), named.end());
    }
    if (named.empty() || named.back() != move->digest) named.push_back(move->digest);
  }
  const std::string now = aliases.Find(model, alias);
  if (!now.empty() && (named.empty() || named.back() != now)) named.push_back(now);
  return named;
}

std::string RollbackTarget(const Repository::Aliases& aliases, const std::string& model,
                           const std::string& alias, const std::string& to) {
  const auto moves = MovesOf(aliases, model, alias);
  const auto named = NamedInTurn(aliases, model, alias);
  std::string target;
  if (to.empty()) {
    if (named.size() > 1) target = named[named.size() - 2];
  } else if (IsGeneration(to)) {
    const std::uint64_t generation = std::stoull(to);
    if (generation > aliases.generation) {
      throw std::out_of_range(
          fmt::format("to: generation {} never was, expected at most {}, the "
                      "present one",
                      generation, aliases.generation));
    }
    target = NamedAt(moves, generation);
  } else {
    target = NamedAs(moves, to);
  }
  if (!target.empty()) return target;
  if (to.empty()) {
    throw std::out_of_range(fmt::format(
        "model: {}@{} named no model before{}", model, alias,
        named.empty()   ? ", and names none now"
        : moves.empty() ? fmt::format(" {}: no move of it is recorded", named.back())
                        : fmt::format(" {}, the oldest that is recorded", named.back())));
  }
  throw std::out_of_range(fmt::format(
      "to: {} is nothing that {}@{} named before; it named, oldest first: {}", Quote(to), model,
      alias, named.empty() ? "nothing" : fmt::format("{}", fmt::join(named, ", "))));
}

void BoundHistory(std::vector<AliasMove>* history) {
  std::map<std::pair<std::string, std::string>, std::size_t> later;
  std::vector<AliasMove> kept;
  for (auto move = history->rbegin(); move != history->rend(); ++move) {
    if (later[{move->model, move->alias}]++ < kMovesKept) kept.push_back(std::move(*move));
  }
  std::reverse(kept.begin(), kept.end());
  *history = std::move(kept);
}

std::vector<std::string> NamedLately(const Repository::Aliases& aliases, std::size_t most) {
  std::map<std::pair<std::string, std::string>, std::size_t> later;
  std::set<std::string> named;
  for (auto move = aliases.history.rbegin(); move != aliases.history.rend(); ++move) {
    if (move->alias == kCandidateAlias) continue;
    if (later[{move->model, move->alias}]++ >= most) continue;
    named.insert(move->digest);
    if (!move->from.empty()) named.insert(move->from);
  }
  for (const auto& [alias, moves] : later) {
    // Where rollbacks lead from here: further back than those moves when they were rollbacks.
    std::set<std::string> in_turn;
    const auto back = NamedInTurn(aliases, alias.first, alias.second);
    for (auto digest = back.rbegin(); digest != back.rend(); ++digest) {
      if (in_turn.size() > most) break;  // the present one and those before
      in_turn.insert(*digest);
    }
    named.merge(in_turn);
  }
  return {named.begin(), named.end()};
}

}  // namespace grouser::server

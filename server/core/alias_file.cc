#include "server/core/alias_file.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "server/core/model_reference.h"

namespace grouser::server {
namespace {

using Json = nlohmann::json;

/// Some 100,000 moves; parsed JSON takes several times its text in memory.
constexpr std::uint64_t kMaxAliasFileBytes = std::uint64_t{32} << 20;

/// The value of a key, by reference: a copy of hostile nesting would overflow the stack.
/// Every error names the key.
template <class T>
const T& Get(const Json& object, const std::string& key, const char* expected) {
  try {
    return object.at(key).get_ref<const T&>();
  } catch (const Json::exception&) {
    throw std::runtime_error("key '" + key + "': expected " + expected);
  }
}
const std::string& Text(const Json& object, const std::string& key) {
  return Get<std::string>(object, key, "a string");
}
double Number(const Json& object, const std::string& key, bool whole = false) {
  const auto value = object.is_object() ? object.find(key) : object.end();
  const double x = value != object.end() && value->is_number() ? value->get<double>() : NAN;
  // As protobuf wrote them, generations may be floating-point numbers.
  const bool fits = whole ? x >= 0 && x < 9e15 && x == std::floor(x) : std::isfinite(x);
  if (fits) return x;
  throw std::runtime_error("key '" + key + "': expected a " +
                           (whole ? "whole number >= 0" : "number"));
}
std::uint64_t Count(const Json& object, const std::string& key) {
  return static_cast<std::uint64_t>(Number(object, key, /*whole=*/true));
}

AliasMove MoveFrom(const Json& move) {
  if (!move.is_object()) throw std::runtime_error("key 'history': expected a list of objects");
  AliasMove out{Text(move, "model"),       Text(move, "alias"), Text(move, "digest"),
                Count(move, "generation"), Text(move, "who"),   Text(move, "why"),
                Number(move, "unix_s")};
  if (move.contains("from")) out.from = Text(move, "from");
  if (move.contains("rollback")) out.rollback = Get<bool>(move, "rollback", "true or false");
  return out;
}

Repository::Aliases AliasesFrom(const Json& root) {
  Repository::Aliases aliases;
  aliases.generation = Count(root, "generation");
  const auto& by_model = Get<Json::object_t>(root, "aliases", "an object");
  for (const auto& [model, value] : by_model) {
    for (const auto& [alias, digest] :
         Get<Json::object_t>(root["aliases"], model, "an object of alias: digest")) {
      aliases.by_model[model][alias] = Text(value, alias);
    }
  }
  std::map<std::pair<std::string, std::string>, std::string> last;
  std::map<std::string, std::size_t> unknown;  // by model: the move that lacks its "from"
  for (const Json& move : Get<Json::array_t>(root, "history", "a list")) {
    aliases.history.push_back(MoveFrom(move));
    AliasMove& made = aliases.history.back();
    std::string& before = last[{made.model, made.alias}];
    if (!move.contains("from")) made.from = before;
    before = made.digest;
    if (made.from.empty() && !move.contains("from") && made.alias == kDefaultAlias) {
      unknown[made.model] = aliases.history.size() - 1;
    } else if (made.alias == kDefaultAlias) {
      unknown.erase(made.model);
    }
  }
  // Of the latest move of "stable" "previous" tells what the history of then does not.
  for (const auto& [model, at] : unknown) {
    AliasMove& made = aliases.history[at];
    const std::string previous = aliases.Find(model, std::string(kPreviousAlias));
    if (previous != made.digest) made.from = previous;
  }
  return aliases;
}

}  // namespace

Repository::Aliases ReadAliasFile(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    if (error) throw std::runtime_error(path + ": " + error.message());
    return {};
  }
  const std::string text = records::ReadFileBytes(path, kMaxAliasFileBytes);
  try {
    return AliasesFrom(Json::parse(text));
  } catch (const std::exception& e) {
    throw std::runtime_error(path + ": not an alias file: " + e.what());
  }
}

void WriteAliasFile(const std::string& path, const Repository::Aliases& aliases) {
  Json history = Json::array();
  for (const AliasMove& move : aliases.history) {
    history.push_back({{"model", move.model},
                       {"alias", move.alias},
                       {"digest", move.digest},
                       {"from", move.from},
                       {"rollback", move.rollback},
                       {"generation", move.generation},
                       {"who", move.who},
                       {"why", move.why},
                       {"unix_s", move.unix_s}});
  }
  const Json root = {
      {"generation", aliases.generation}, {"aliases", aliases.by_model}, {"history", history}};
  std::string text;
  try {
    text = root.dump(1);
  } catch (const Json::exception& e) {  // a name that is not UTF-8: nothing has been written yet
    throw std::runtime_error(path + ": " + e.what());
  }
  records::WriteFileDurably(path, text + "\n");
}

}  // namespace grouser::server

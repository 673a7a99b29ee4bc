#include "server/core/repository.h"

#include <fmt/ranges.h>
#include <google/protobuf/util/time_util.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <new>
#include <ranges>
#include <set>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/model_bytes.h"
#include "proto/records/os/file_lock.h"
#include "server/core/alias_file.h"
#include "server/core/alias_history.h"
#include "server/core/model_reference.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestMoveS = 60;  // other programs move an alias in milliseconds

/// Sorted "*.model" files of a folder; a missing folder has none.
std::vector<std::string> ModelFiles(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const fs::path& path = it->path();
    // Files being written aside are hidden or end otherwise.
    if (path.extension() == ".model" && path.filename().string().front() != '.') {
      paths.push_back(path.string());
    }
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    throw std::runtime_error(folder + ": " + error.message());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// What tells that a file was changed: renaming gives a new inode, writing in
/// place new times. Empty for a file that is not there.
std::string StampOf(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return "";
  std::ostringstream out;
  out << path << ' ' << info.st_ino << ' ' << info.st_size;
  for (const timespec& time : {info.st_mtim, info.st_ctim}) {
    out << ' ' << time.tv_sec << '.' << time.tv_nsec;
  }
  out << '\n';
  return out.str();
}

std::string BytesOf(const Repository::File& file) {
  return records::ReadFileBytes(file.path, records::kMaxModelFileBytes);
}

records::LoadedModel FromBytes(const std::string& bytes, const Repository::File& file) {
  auto loaded = surrogate::Upgraded(records::ModelFromBytes(bytes, file.path), file.path);
  if (!file.shipped && fs::path(file.path).stem() != loaded.digest) {
    throw std::runtime_error(file.path + ": its content is " + loaded.digest +
                             ", expected the digest that names the file");
  }
  return loaded;
}

double UnixNow() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string ModelsDir(const std::string& state_dir) { return state_dir + "/models"; }
std::string AliasPath(const std::string& state_dir) {
  return ModelsDir(state_dir) + "/aliases.json";
}

/// Held while an alias moves. Throws std::runtime_error.
os::UniqueFd LockAliases(const std::string& state_dir) {
  fs::create_directories(ModelsDir(state_dir));
  const std::string lock_file = ModelsDir(state_dir) + "/.aliases.lock";
  os::UniqueFd lock = os::LockWithin(lock_file, kLongestMoveS);
  if (!lock.valid()) throw std::runtime_error(lock_file + ": still locked by another program");
  return lock;
}

bool IsThere(const std::vector<Repository::Entry>& entries, const std::string& model,
             const std::string& digest) {
  return std::any_of(entries.begin(), entries.end(), [&](const Repository::Entry& entry) {
    return entry.digest == digest && entry.name == model;
  });
}

bool IsRecorded(const Repository::Aliases& aliases, const std::string& model,
                const std::string& alias) {
  return std::any_of(aliases.history.begin(), aliases.history.end(), [&](const AliasMove& move) {
    return move.model == model && move.alias == alias;
  });
}

std::string KnownNames(const std::vector<Repository::Entry>& entries) {
  std::set<std::string> names;
  for (const auto& entry : entries) names.insert(entry.name);
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

struct Repository::Known {
  struct Read {
    std::string stamp;
    Entry entry;
    std::string problem = {};  ///< not empty: that is all it holds
  };
  std::mutex mutex;
  std::map<std::string, Read> by_path;  // guarded by mutex
};

Repository::Repository(std::string state_dir, std::string shipped_dir)
    : state_dir_(std::move(state_dir)),
      shipped_dir_(std::move(shipped_dir)),
      known_(std::make_shared<Known>()) {
  if (state_dir_.empty()) throw std::runtime_error("state folder: empty, expected a path");
}

std::vector<Repository::File> Repository::Files() const {
  std::vector<File> files;
  const auto add = [&](const std::string& folder, bool shipped) {
    for (const auto& path : ModelFiles(folder)) files.push_back({path, StampOf(path), shipped});
  };
  if (!shipped_dir_.empty()) add(shipped_dir_, true);
  add(ModelsDir(state_dir_), false);
  return files;
}

records::LoadedModel Repository::Read(const File& file) { return FromBytes(BytesOf(file), file); }

std::vector<Repository::Entry> Repository::List(std::vector<std::string>* problems) const {
  std::map<std::string, Known::Read> before, now;
  {
    const std::lock_guard<std::mutex> lock(known_->mutex);
    before = known_->by_path;
  }
  std::vector<Entry> entries;
  std::set<std::string> seen;
  for (const File& file : Files()) {
    bool has_bytes = false;
    try {
      const auto found = before.find(file.path);
      Known::Read& read = now[file.path];
      if (found != before.end() && found->second.stamp == file.stamp) {
        read = found->second;
        if (!read.problem.empty() && problems != nullptr) problems->push_back(read.problem);
        if (!read.problem.empty()) continue;
      } else {
        const std::string bytes = BytesOf(file);
        has_bytes = true;
        const auto loaded = FromBytes(bytes, file);
        read = {file.stamp,
                {file.path, loaded.model.name(), loaded.digest, loaded.model.create_time(),
                 file.shipped}};
      }
      if (seen.insert(read.entry.digest).second) entries.push_back(read.entry);
    } catch (const std::exception& e) {
      // Bytes that are no model stay so until the file changes. What failed for want of
      // descriptors, memory or rights may work the next time.
      if (has_bytes && dynamic_cast<const std::bad_alloc*>(&e) == nullptr) {
        now[file.path] = {file.stamp, {}, e.what()};
      } else {
        now.erase(file.path);
      }
      if (problems != nullptr) problems->push_back(e.what());
    }
  }
  const std::lock_guard<std::mutex> lock(known_->mutex);
  known_->by_path = std::move(now);
  return entries;
}

std::string Repository::Aliases::Find(const std::string& model, const std::string& alias) const {
  const auto of_model = by_model.find(model);
  if (of_model == by_model.end()) return "";
  const auto found = of_model->second.find(alias);
  return found == of_model->second.end() ? "" : found->second;
}

Repository::Aliases Repository::ReadStateAliases() const {
  return ReadAliasFile(AliasPath(state_dir_));
}

void Repository::AddShippedDefaults(const std::vector<Entry>& entries, Aliases* aliases) {
  std::map<std::string, const Entry*> newest;
  for (const Entry& entry : entries) {
    if (!entry.shipped) continue;
    const Entry*& chosen = newest[entry.name];
    if (chosen == nullptr || entry.created > chosen->created) chosen = &entry;
  }
  const std::string alias(kDefaultAlias);
  for (const auto& [name, chosen] : newest) {
    std::string& stable = aliases->by_model[name][alias];
    // Up to 0.2 any move of an alias wrote the default of then along, which nobody had chosen.
    const bool left_over = !IsThere(entries, name, stable) && !IsRecorded(*aliases, name, alias);
    if (stable.empty() || left_over) stable = chosen->digest;
  }
}

Repository::Aliases Repository::ReadAliases() const {
  Aliases aliases = ReadStateAliases();
  AddShippedDefaults(List(nullptr), &aliases);
  return aliases;
}

std::string Repository::Publish(const std::string& model_file) {
  const auto loaded = records::ReadModelFile(model_file);
  fs::create_directories(ModelsDir(state_dir_));
  const std::string target = ModelsDir(state_dir_) + "/" + loaded.digest + ".model";
  try {
    // Already there and whole: the same content, nothing to write.
    if (fs::exists(target) && records::ReadModelFile(target).digest == loaded.digest) {
      fs::last_write_time(target, fs::file_time_type::clock::now());  // its age begins again
      return loaded.digest;
    }
  } catch (const std::exception&) {
    // A damaged copy is replaced below.
  }
  records::WriteFileDurably(target,
                            records::ReadFileBytes(model_file, records::kMaxModelFileBytes));
  if (records::ReadModelFile(target).digest != loaded.digest) {
    throw std::runtime_error(model_file + ": changed while it was being published");
  }
  return loaded.digest;
}

AliasMove Repository::SetAlias(const std::string& model, const std::string& alias,
                               const std::string& digest, const std::string& who,
                               const std::string& why) {
  if (!IsAliasName(alias)) {
    throw std::runtime_error("alias: '" + alias + "', expected a lower-case name such as stable");
  }
  const os::UniqueFd lock = LockAliases(state_dir_);
  const auto entries = List(nullptr);
  if (!IsThere(entries, model, digest)) {
    throw std::runtime_error("digest: '" + digest + "' is no model file of '" + model +
                             "' in this repository; known models: " + KnownNames(entries));
  }
  return Move(ReadStateAliases(), {model, alias, digest, 0, who, why, UnixNow()}, entries);
}

AliasMove Repository::Rollback(const std::string& model, const std::string& alias,
                               const std::string& to, const std::string& who,
                               const std::string& why) {
  const os::UniqueFd lock = LockAliases(state_dir_);
  const auto entries = List(nullptr);
  Aliases aliases = ReadStateAliases();
  AddShippedDefaults(entries, &aliases);
  const bool known = aliases.by_model.contains(model) ||
                     std::ranges::any_of(entries, [&](const Entry& e) { return e.name == model; });
  if (!known) {
    throw std::out_of_range("model: no model " + Quote(model) +
                            "; known models: " + KnownNames(entries));
  }
  const std::string target = RollbackTarget(aliases, model, alias, to);
  if (!IsThere(entries, model, target)) {
    throw std::out_of_range("to: " + target + ", which " + model + "@" + alias +
                            " named before, has no readable model file any more");
  }
  AliasMove move{model, alias, target, 0, who, why, UnixNow()};
  move.rollback = true;
  return Move(ReadStateAliases(), std::move(move), entries);
}

AliasMove Repository::Move(Aliases aliases, AliasMove move,
                           const std::vector<Entry>& entries) const {
  Aliases shown = aliases;  // the defaults are for reading alone: written, they would never change
  AddShippedDefaults(entries, &shown);
  move.from = shown.Find(move.model, move.alias);
  const bool recorded = IsRecorded(aliases, move.model, move.alias);
  // A repeated move (a promotion finished after a crash) must not make the
  // model its own predecessor.
  if (move.from == move.digest && (recorded || move.rollback)) {
    // Who wrote it may have been killed before its name was on disk.
    if (recorded) records::SyncName(AliasPath(state_dir_));
    move.generation = aliases.generation;
    return move;
  }
  auto& of_model = aliases.by_model[move.model];
  const bool leaves = !move.from.empty() && move.from != move.digest;
  if (move.alias == kDefaultAlias && leaves) of_model[std::string(kPreviousAlias)] = move.from;
  of_model[move.alias] = move.digest;
  move.generation = ++aliases.generation;
  aliases.history.push_back(move);
  BoundHistory(&aliases.history);
  WriteAliasFile(AliasPath(state_dir_), aliases);
  return move;
}

void Repository::WithoutMoves(const std::function<void(const Aliases&)>& remove) const {
  const os::UniqueFd lock = LockAliases(state_dir_);
  remove(ReadAliases());
}

Repository::Entry Repository::Resolve(const std::string& reference) const {
  std::string problem;
  auto parsed = ParseModelReference(reference, &problem);
  if (!parsed) throw std::out_of_range("model: " + problem);
  const auto entries = List(nullptr);
  std::string name(parsed->name);
  if (name.empty()) {
    std::set<std::string> names;
    for (const auto& entry : entries) names.insert(entry.name);
    if (names.size() != 1) {
      throw std::out_of_range("model: empty, which needs exactly one model; known: " +
                              KnownNames(entries));
    }
    name = *names.begin();
    parsed->alias = kDefaultAlias;
  }
  std::string wanted(parsed->digest_prefix);
  if (wanted.empty()) {
    Aliases aliases = ReadStateAliases();
    AddShippedDefaults(entries, &aliases);
    wanted = aliases.Find(name, std::string(parsed->alias));
    if (wanted.empty() && aliases.by_model.contains(name)) {
      throw std::out_of_range(
          fmt::format("model: {} has no alias {}; it has: {}", Quote(name), Quote(parsed->alias),
                      fmt::join(std::views::keys(aliases.by_model.at(name)), ", ")));
    }
  }
  std::vector<Entry> matches;
  for (const auto& entry : entries) {
    if (!wanted.empty() && entry.name == name && entry.digest.starts_with(wanted)) {
      matches.push_back(entry);
    }
  }
  if (matches.size() == 1) return matches.front();
  throw std::out_of_range("model: " + Quote(reference) + " is " +
                          (matches.empty() ? "unknown" : "ambiguous") +
                          "; known models: " + KnownNames(entries));
}

std::string Repository::Fingerprint() const {
  std::string stamps = StampOf(AliasPath(state_dir_));
  for (const File& file : Files()) stamps += file.stamp;
  return stamps;
}

}  // namespace grouser::server

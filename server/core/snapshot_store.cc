#include "server/core/snapshot_store.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace grouser::server {
namespace {

using ModelPtr = Snapshot::ModelPtr;

ModelPtr FindDigest(const std::vector<ModelPtr>& models, const std::string& digest) {
  const auto it = std::find_if(models.begin(), models.end(),
                               [&](const ModelPtr& model) { return model->digest == digest; });
  return it == models.end() ? nullptr : *it;
}

/// What each alias names. One whose model cannot be served stays where it was;
/// that model is then added to `models`.
std::map<std::string, Snapshot::Aliases, std::less<>> TargetsOf(const Repository::Aliases& wanted,
                                                                const Snapshot& before,
                                                                std::vector<ModelPtr>* models,
                                                                SnapshotStore::Outcome* outcome) {
  std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
  for (const auto& [name, of_model] : wanted.by_model) {
    for (const auto& [alias, digest] : of_model) {
      ModelPtr target = FindDigest(*models, digest);
      if (!target) {
        target = before.FindAlias(name, alias);
        outcome->problems.push_back(name + "@" + alias + ": " + digest + " cannot be served; " +
                                    (target ? "kept " + target->digest : "left out"));
        if (!target && alias == kDefaultAlias) outcome->unresolved.push_back(name + "@" + alias);
        if (target && !FindDigest(*models, target->digest)) models->push_back(target);
      }
      if (target) aliases[name][alias] = std::move(target);
    }
  }
  return aliases;
}

}  // namespace

SnapshotStore::SnapshotStore(const Repository& repository, ModelFactory factory)
    : repository_(repository), factory_(std::move(factory)) {}

std::shared_ptr<const Snapshot> SnapshotStore::Current() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return current_;
}

SnapshotStore::LastGood SnapshotStore::Load(const Repository::File& file, const Snapshot& before,
                                            std::vector<std::string>* problems) const {
  const auto known = last_good_.find(file.path);
  const LastGood old = known == last_good_.end() ? LastGood{} : known->second;
  if (old.model && old.stamp == file.stamp) return old;
  try {
    auto loaded = Repository::Read(file);
    // A digest names the content: what is loaded already is that model.
    if (auto same = FindDigest(before.models(), loaded.digest)) return {file.stamp, same};
    return {file.stamp, MakeServedModel(std::move(loaded.model), std::move(loaded.digest),
                                        file.shipped, factory_)};
  } catch (const std::exception& e) {
    const std::string what = e.what();
    problems->push_back((what.starts_with(file.path) ? what : file.path + ": not served: " + what) +
                        (old.model ? "; kept " + old.model->reference : ""));
    return old;
  }
}

void SnapshotStore::ReadStateAliases(Outcome* outcome) {
  try {
    state_aliases_ = repository_.ReadStateAliases();
    aliases_were_read_ = true;
  } catch (const std::exception& e) {
    outcome->problems.push_back(std::string(e.what()) + (loaded_ ? "; kept the aliases of before"
                                                                 : "; no alias of it is served"));
    if (!aliases_were_read_) outcome->unresolved.push_back(e.what());
  }
}

SnapshotStore::Outcome SnapshotStore::Refresh() {
  ReleaseRetired();
  // Taken before reading: a change during the reading is seen next time.
  std::string fingerprint = repository_.Fingerprint();
  Outcome outcome;
  if (loaded_ && fingerprint == fingerprint_) return outcome;

  const auto before = Current();
  ReadStateAliases(&outcome);
  LastGoodFiles good;
  std::vector<ModelPtr> models;
  std::vector<Repository::Entry> entries;
  for (const Repository::File& file : repository_.Files()) {
    LastGood loaded = Load(file, *before, &outcome.problems);
    if (!loaded.model) continue;
    if (!FindDigest(models, loaded.model->digest)) models.push_back(loaded.model);
    const auto& message = loaded.model->message;
    entries.push_back(
        {file.path, message.name(), loaded.model->digest, message.create_time(), file.shipped});
    good[file.path] = std::move(loaded);
  }
  Repository::Aliases wanted = state_aliases_;
  Repository::AddShippedDefaults(entries, &wanted);
  auto aliases = TargetsOf(wanted, *before, &models, &outcome);
  std::shared_ptr<const Snapshot> next =
      std::make_shared<const Snapshot>(wanted.generation, std::move(models), std::move(aliases));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    current_.swap(next);
  }
  retired_.push_back(std::move(next));
  last_good_ = std::move(good);
  fingerprint_ = std::move(fingerprint);
  loaded_ = true;
  outcome.changed = true;
  return outcome;
}

void SnapshotStore::ReleaseRetired() {
  // A count of one can only fall to us: Current() no longer hands these out.
  std::erase_if(retired_, [](const auto& snapshot) { return snapshot.use_count() == 1; });
}

}  // namespace grouser::server

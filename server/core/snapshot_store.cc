#include "server/core/snapshot_store.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "proto/records/model_file.h"

namespace grouser::server {
namespace {

using ModelPtr = Snapshot::ModelPtr;

ModelPtr FindDigest(const std::vector<ModelPtr>& models, const std::string& digest) {
  const auto it = std::find_if(models.begin(), models.end(),
                               [&](const ModelPtr& model) { return model->digest == digest; });
  return it == models.end() ? nullptr : *it;
}

/// The model that an alias named before; null if none.
ModelPtr FindAlias(const Snapshot& snapshot, const std::string& name, const std::string& alias) {
  const auto of_model = snapshot.aliases().find(name);
  if (of_model == snapshot.aliases().end()) return nullptr;
  const auto found = of_model->second.find(alias);
  return found == of_model->second.end() ? nullptr : found->second;
}

}  // namespace

SnapshotStore::SnapshotStore(const Repository& repository, ModelFactory factory)
    : repository_(repository), factory_(std::move(factory)) {}

std::shared_ptr<const Snapshot> SnapshotStore::Current() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return current_;
}

std::vector<ModelPtr> SnapshotStore::LoadModels(const Snapshot& before,
                                                std::vector<std::string>* problems) {
  std::vector<ModelPtr> models;
  for (const auto& entry : repository_.List(problems)) {
    // A digest names the content: what is loaded already is that model.
    if (auto old = FindDigest(before.models(), entry.digest)) {
      models.push_back(std::move(old));
      continue;
    }
    try {
      auto loaded = records::ReadModelFile(entry.path);
      models.push_back(MakeServedModel(std::move(loaded.model), std::move(loaded.digest),
                                       entry.shipped, factory_));
    } catch (const std::exception& e) {
      problems->push_back(entry.path + ": not served: " + e.what());
    }
  }
  return models;
}

SnapshotStore::Outcome SnapshotStore::Refresh() {
  ReleaseRetired();
  // Taken before reading: a change during the reading is seen next time.
  std::string fingerprint = repository_.Fingerprint();
  Outcome outcome;
  if (loaded_ && fingerprint == fingerprint_) return outcome;

  const auto before = Current();
  const auto wanted = repository_.ReadAliases();
  auto models = LoadModels(*before, &outcome.problems);
  std::map<std::string, Snapshot::Aliases, std::less<>> aliases;
  for (const auto& [name, of_model] : wanted.by_model) {
    for (const auto& [alias, digest] : of_model) {
      ModelPtr target = FindDigest(models, digest);
      if (!target) {
        target = FindAlias(*before, name, alias);
        outcome.problems.push_back(name + "@" + alias + ": " + digest + " cannot be served; " +
                                   (target ? "kept " + target->digest : "left out"));
        if (target && !FindDigest(models, target->digest)) models.push_back(target);
      }
      if (target) aliases[name][alias] = std::move(target);
    }
  }
  std::shared_ptr<const Snapshot> next =
      std::make_shared<const Snapshot>(wanted.generation, std::move(models), std::move(aliases));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    current_.swap(next);
  }
  retired_.push_back(std::move(next));
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

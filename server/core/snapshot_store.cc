#include "server/core/snapshot_store.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iterator>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

namespace grouser::server {
namespace {

using ModelPtr = Snapshot::ModelPtr;

ModelPtr FindDigest(const std::vector<ModelPtr>& models, const std::string& digest) {
  const auto it = std::find_if(models.begin(), models.end(),
                               [&](const ModelPtr& model) { return model->digest == digest; });
  return it == models.end() ? nullptr : *it;
}

std::string StemOf(const std::string& path) { return std::filesystem::path(path).stem().string(); }

std::set<std::string> NamedDigests(const Repository::Aliases& aliases) {
  std::set<std::string> named;
  for (const auto& [name, of_model] : aliases.by_model) {
    for (const auto& [alias, digest] : of_model) named.insert(digest);
  }
  return named;
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

SnapshotStore::SnapshotStore(const Repository& repository, ModelFactory factory,
                             std::chrono::milliseconds unnamed, TableCache* tables, Adopt adopt)
    : repository_(repository),
      factory_(std::move(factory)),
      unnamed_(unnamed),
      tables_(tables),
      adopt_(std::move(adopt)) {}

std::shared_ptr<const Snapshot> SnapshotStore::Current() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return current_;
}

SnapshotStore::LastGood SnapshotStore::Load(const Repository::File& file, const Snapshot& before,
                                            std::vector<std::string>* problems) const {
  const auto known = last_good_.find(file.path);
  const LastGood old = known == last_good_.end() ? LastGood{} : known->second;
  if (old.model && old.stamp == file.stamp) return old;
  if (const auto failed = failed_.find(file.path); failed != failed_.end()) {
    problems->push_back(failed->second);  // nothing has changed since: only others were pending
    return old;
  }
  try {
    auto loaded = Repository::Read(file);
    // A digest names the content: what is loaded already is that model.
    if (auto same = FindDigest(before.models(), loaded.digest)) return {file.stamp, same};
    const auto kept = tables_ ? tables_->Of(loaded.digest) : surrogate::KeptTable{};
    return {file.stamp, MakeServedModel(std::move(loaded.model), std::move(loaded.digest),
                                        file.shipped, factory_, kept)};
  } catch (const std::exception& e) {
    const std::string what = e.what();
    problems->push_back((what.starts_with(file.path) ? what : file.path + ": not served: " + what) +
                        (old.model ? "; kept " + old.model->reference : ""));
    return old;
  }
}

void SnapshotStore::LoadAll(const Snapshot& before, std::vector<Loading>* all) const {
  // What is loaded already costs nothing; then what an alias names, then the rest.
  std::vector<Loading*> order;
  for (Loading& one : *all) order.push_back(&one);
  const auto rank = [&](const Loading* one) {
    const auto known = last_good_.find(one->file->path);
    const bool loaded = known != last_good_.end() && known->second.stamp == one->file->stamp;
    return loaded || failed_.contains(one->file->path) ? 0 : one->named ? 1 : 2;
  };
  std::ranges::stable_sort(order, {}, rank);
  const auto end = std::chrono::steady_clock::now() + unnamed_;
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> one_more = true;  // each call comes further
  const auto work = [&] {
    for (std::size_t i = next++; i < order.size(); i = next++) {
      Loading& one = *order[i];
      const bool now =
          rank(&one) < 2 || std::chrono::steady_clock::now() < end || one_more.exchange(false);
      if (!now || stopped_) continue;
      one.result = Load(*one.file, before, &one.problems);
      one.tried = true;
    }
  };
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::jthread> helpers;
  const auto made = std::ranges::count_if(order, [&](const Loading* o) { return rank(o) > 0; });
  const std::size_t wanted = std::min<std::size_t>(processors, static_cast<std::size_t>(made));
  for (std::size_t i = 1; i < wanted; ++i) helpers.emplace_back(work);
  work();
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

  if (fingerprint != seen_) failed_.clear();
  seen_ = fingerprint;
  const auto before = Current();
  ReadStateAliases(&outcome);
  LastGoodFiles good;
  std::vector<ModelPtr> models;
  std::vector<Repository::Entry> entries;
  std::vector<std::string> pending;
  const std::vector<Repository::File> files = repository_.Files();
  std::vector<Loading> all;
  const std::set<std::string> named = NamedDigests(state_aliases_);
  for (const Repository::File& file : files) {
    Loading& one = all.emplace_back();
    one.file = &file;
    one.named = file.shipped || named.contains(StemOf(file.path));
  }
  LoadAll(*before, &all);
  if (stopped_) return {};
  for (Loading& one : all) {
    if (!one.tried) {
      pending.push_back(StemOf(one.file->path));
      continue;
    }
    if (!one.problems.empty()) failed_[one.file->path] = one.problems.front();
    std::ranges::copy(one.problems, std::back_inserter(outcome.problems));
    LastGood& loaded = one.result;
    if (!loaded.model) continue;
    if (!FindDigest(models, loaded.model->digest)) models.push_back(loaded.model);
    const auto& message = loaded.model->message;
    entries.push_back({one.file->path, message.name(), loaded.model->digest, message.create_time(),
                       one.file->shipped});
    good[one.file->path] = std::move(loaded);
  }
  Repository::Aliases wanted = state_aliases_;
  Repository::AddShippedDefaults(entries, &wanted);
  auto aliases = TargetsOf(wanted, *before, &models, &outcome);
  FindNews(all, &outcome);
  std::shared_ptr<const Snapshot> next = std::make_shared<const Snapshot>(
      wanted.generation, std::move(models), std::move(aliases), pending);
  adopt_(*next);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    current_.swap(next);
  }
  retired_.push_back(std::move(next));
  last_good_ = std::move(good);
  // With some pending the next call goes on.
  fingerprint_ = pending.empty() ? std::move(fingerprint) : "";
  loaded_ = true;
  outcome.changed = true;
  PruneTables(files, &outcome);
  return outcome;
}

void SnapshotStore::PruneTables(const std::vector<Repository::File>& files,
                                Outcome* outcome) const {
  if (!tables_) return;
  std::set<std::string> digests;
  // Also of models that are pending or cannot be read just now. Names of shipped files say nothing.
  for (const Repository::File& file : files) digests.insert(StemOf(file.path));
  for (const ModelPtr& model : Current()->models()) digests.insert(model->digest);
  tables_->Prune(digests);
  std::ranges::move(tables_->TakeNews(), std::back_inserter(outcome->news));
}

void SnapshotStore::FindNews(const std::vector<Loading>& all, Outcome* outcome) {
  std::map<std::string, std::string> told;
  const auto tell = [&](const std::string& what, const std::string& state,
                        const std::string& problem) {
    const auto known = told_.find(what);
    if (known == told_.end() || known->second != state) outcome->news.push_back(problem);
    told[what] = state;
  };
  std::set<std::string> of_files;
  for (const Loading& one : all) {
    const std::string& path = one.file->path;
    if (!one.tried && told_.contains(path)) told[path] = told_.at(path);
    for (const std::string& problem : one.problems) {
      tell(path, one.file->stamp + problem, problem);
      of_files.insert(problem);
    }
  }
  for (const std::string& problem : outcome->problems) {
    if (!of_files.contains(problem)) tell(problem, "", problem);
  }
  told_ = std::move(told);
}

void SnapshotStore::ReleaseRetired() {
  // A count of one can only fall to us: Current() no longer hands these out.
  std::erase_if(retired_, [](const auto& snapshot) { return snapshot.use_count() == 1; });
}

}  // namespace grouser::server

#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/core/repository.h"
#include "server/core/snapshot.h"
#include "server/core/table_cache.h"

namespace grouser::server {

/// Keeps the snapshot that is served in step with the repository. Refresh()
/// belongs to one thread (the store thread); Current() to any.
class SnapshotStore {
 public:
  static constexpr std::chrono::milliseconds kUnnamed{1000};
  /// Is told each snapshot just before it can answer anything.
  using Adopt = std::function<void(const Snapshot&)>;

  /// `unnamed`: how long a refresh goes on loading models that no alias names. `tables`: of models,
  /// kept between processes.
  SnapshotStore(
      const Repository& repository, ModelFactory factory,
      std::chrono::milliseconds unnamed = kUnnamed, TableCache* tables = nullptr,
      Adopt adopt = [](const Snapshot&) {});

  /// What a refresh did.
  struct Outcome {
    bool changed = false;
    std::vector<std::string> problems;
    /// Those that the refresh before did not have, or of files that have changed since: worth a
    /// log line each.
    std::vector<std::string> news;
    /// Names that should be answered and are not: "name@stable" of an alias without any model
    /// to serve, or the damaged alias file of which no alias was ever read.
    std::vector<std::string> unresolved;
  };

  /// Reads the repository if it changed since the last call and puts a new
  /// snapshot live. Models are made on as many threads as there are processors. Those that no
  /// alias names come last, and what `unnamed` does not suffice for is left to the next calls
  /// (Snapshot::pending): a start waits for what has a name alone. What is damaged never replaces
  /// what is good: a file that cannot be read or fails its self-test leaves the last known good
  /// model of that file in place, a damaged alias file the last known good aliases (none but those
  /// of the shipped models if there were none); `problems` name them. Throws std::runtime_error,
  /// and changes nothing, when a folder of the repository cannot be read; the next call tries
  /// again.
  Outcome Refresh();

  /// A refresh under way loads no further model and changes nothing: the program ends. Any thread.
  void Stop() { stopped_ = true; }

  /// The snapshot to answer one message with. Locks for a pointer copy only:
  /// `atomic<shared_ptr>` of libstdc++ 12 would do the same inside.
  std::shared_ptr<const Snapshot> Current() const;

 private:
  using ModelPtr = Snapshot::ModelPtr;

  struct LastGood {
    std::string stamp;  ///< of the file when it was read
    ModelPtr model;
  };
  using LastGoodFiles = std::map<std::string, LastGood>;  // by path

  /// What became of a file.
  struct Loading {
    const Repository::File* file = nullptr;
    bool named = true;
    bool tried = false;
    LastGood result;
    std::vector<std::string> problems;
  };
  LastGood Load(const Repository::File& file, const Snapshot& before,
                std::vector<std::string>* problems) const;
  void LoadAll(const Snapshot& before, std::vector<Loading>* all) const;
  void ReadStateAliases(Outcome* outcome);
  void PruneTables(const std::vector<Repository::File>& files, Outcome* outcome) const;
  void ReleaseRetired();
  void FindNews(const std::vector<Loading>& all, Outcome* outcome);

  const Repository& repository_;
  ModelFactory factory_;
  std::chrono::milliseconds unnamed_;
  std::atomic<bool> stopped_ = false;
  TableCache* tables_;
  Adopt adopt_;
  std::string fingerprint_;
  bool loaded_ = false;
  bool aliases_were_read_ = false;
  LastGoodFiles last_good_;
  /// Files that could not be served, by path, since the repository last changed.
  std::map<std::string, std::string> failed_;
  std::string seen_;  ///< fingerprint of that
  /// Problems that were told and last: of a file by its path, with its stamp; others by themselves.
  std::map<std::string, std::string> told_;
  Repository::Aliases state_aliases_;  // the last known good ones

  mutable std::mutex mutex_;  // guards current_ alone
  std::shared_ptr<const Snapshot> current_ = std::make_shared<const Snapshot>();
  /// Old snapshots until no query holds them, so that their destruction
  /// happens here and not on a query thread. Store thread only.
  std::vector<std::shared_ptr<const Snapshot>> retired_;
};

}  // namespace grouser::server

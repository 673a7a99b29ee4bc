#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "proto/records/model_file.h"

namespace grouser::server {

/// One entry of the alias file's history.
struct AliasMove {
  std::string model, alias, digest;  ///< digest: sha256 hex
  std::uint64_t generation = 0;      ///< of the whole repository, grows by one a move
  std::string who, why;
  double unix_s = 0;
  std::string from = {};  ///< digest before; empty: none, or recorded before 0.2
  bool rollback = false;
};

/// The history keeps this many latest moves of every alias.
inline constexpr std::size_t kMovesKept = 100;

/// Models and aliases on disk. `state_dir`/models/DIGEST.model are content-
/// addressed; `state_dir`/models/aliases.json is the one truth about aliases
/// (with history). `shipped_dir`/*.model is a read-only underlay: its models
/// are "stable" unless the state folder says otherwise.
class Repository {
 public:
  Repository(std::string state_dir, std::string shipped_dir);

  /// A file that should hold a model.
  struct File {
    std::string path;
    std::string stamp;  ///< differs after any change of the file
    bool shipped = false;
  };
  /// "*.model" of both folders, shipped ones first, sorted. Throws
  /// std::runtime_error when a folder that exists cannot be read.
  std::vector<File> Files() const;

  /// Reads one. Throws std::runtime_error for what surrogate::ReadModel refuses, and
  /// for a file of the state folder whose name is not its content's digest.
  static records::LoadedModel Read(const File& file);

  struct Entry {
    std::string path, name, digest;
    google::protobuf::Timestamp created;
    bool shipped = false;
  };
  /// Every readable model; unreadable files are reported in `problems`. A file is read
  /// once, a damaged one as well, and again when its stamp has changed. What is known of files that
  /// are gone is forgotten. Any thread.
  std::vector<Entry> List(std::vector<std::string>* problems) const;

  struct Aliases {
    std::uint64_t generation = 0;
    /// name -> alias -> digest
    std::map<std::string, std::map<std::string, std::string>> by_model;
    std::vector<AliasMove> history;
    /// Empty where there is no such model or alias.
    std::string Find(const std::string& model, const std::string& alias) const;
  };
  /// Shipped defaults overlaid by the alias file. Throws std::runtime_error
  /// when the alias file is damaged.
  Aliases ReadAliases() const;
  /// The alias file alone; a missing one is generation 0 without aliases.
  Aliases ReadStateAliases() const;
  /// Of the shipped ones of each name the newest becomes "stable", unless the name has a
  /// "stable". One that no move recorded and whose model is not there does not count: earlier
  /// versions wrote the shipped one of then along with any move.
  static void AddShippedDefaults(const std::vector<Entry>& entries, Aliases* aliases);

  /// Copies a model file into the state folder; returns its digest.
  std::string Publish(const std::string& model_file);

  /// Moves an alias under a file lock; "stable" keeps its old target as
  /// "previous". Writes no other alias. Throws std::runtime_error for an unknown digest.
  AliasMove SetAlias(const std::string& model, const std::string& alias, const std::string& digest,
                     const std::string& who, const std::string& why);

  /// Moves an alias back to what it named before, under the same lock. `to`: the
  /// first digits of a digest or a generation; empty: the model before the present
  /// one, and called again the one before that. Throws std::out_of_range naming what
  /// the alias named before where there is no such model.
  AliasMove Rollback(const std::string& model, const std::string& alias, const std::string& to,
                     const std::string& who, const std::string& why);

  /// Runs `remove` while no alias can move and no model be published, with the
  /// aliases as they are: for removing models that nothing names.
  void WithoutMoves(const std::function<void(const Aliases&)>& remove) const;

  /// Resolves "name", "name@alias", "name@sha256:HEX" or "" to an entry.
  /// Throws std::out_of_range with what is known when there is none.
  Entry Resolve(const std::string& reference) const;

  /// Changes whenever aliases.json or the set of model files changed.
  std::string Fingerprint() const;

  const std::string& state_dir() const { return state_dir_; }

 private:
  struct Known;  ///< what List has read, by path
  AliasMove Move(Aliases aliases, AliasMove move, const std::vector<Entry>& entries) const;

  std::string state_dir_, shipped_dir_;
  std::shared_ptr<Known> known_;
};

}  // namespace grouser::server

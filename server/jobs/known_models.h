#pragma once

#include <map>
#include <set>
#include <string>

#include "server/core/repository.h"

namespace grouser::server {

/// So many refits back a model's ancestors are looked at.
inline constexpr int kMostAncestors = 16;

/// What refits ask of models, without what answers: name, soil, wheel and rig, the base's digest,
/// and runs by id, hash and role. A model never changes: each is read once and kept by its digest,
/// some 30 KB. One thread.
class KnownModels {
 public:
  explicit KnownModels(const Repository& repository) : repository_(repository) {}

  /// Throws as Repository::Resolve and surrogate::ReadModel.
  const v1alpha1::Model& Of(const std::string& name, const std::string& digest);
  /// The same of what Repository::List has.
  const v1alpha1::Model& Of(const Repository::Entry& entry);
  bool Has(const std::string& digest) const { return models_.contains(digest); }
  /// Whether it is said for the first time that this one cannot be read; told again after Found or
  /// once KeepOnly has left it out.
  bool TellOnce(const std::string& digest) { return told_.insert(digest).second; }
  void Found(const std::string& digest) { told_.erase(digest); }
  /// Keeps these, and of each the kMostAncestors that it was refitted from, as far as they are
  /// known.
  void KeepOnly(const std::set<std::string>& digests);

 private:
  const v1alpha1::Model& Read(const std::string& path, const std::string& digest);

  const Repository& repository_;
  std::map<std::string, v1alpha1::Model> models_;
  std::set<std::string> told_;  ///< digests of models that cannot be read
};

}  // namespace grouser::server

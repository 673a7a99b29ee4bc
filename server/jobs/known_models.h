#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "server/core/repository.h"

namespace grouser::server {

/// What refits ask of models, without what answers: name, soil, wheel and rig, the base's digest,
/// and runs by id, hash and role. A model never changes: each is read once and kept by its digest,
/// some 30 KB. One thread.
class KnownModels {
 public:
  explicit KnownModels(const Repository& repository) : repository_(repository) {}

  /// Throws as Repository::Resolve and surrogate::ReadModel.
  const v1alpha1::Model& Of(const std::string& name, const std::string& digest);
  bool Has(const std::string& digest) const { return models_.contains(digest); }
  std::size_t size() const { return models_.size(); }
  void KeepOnly(const std::set<std::string>& digests);

 private:
  const Repository& repository_;
  std::map<std::string, v1alpha1::Model> models_;
};

}  // namespace grouser::server

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "server/core/query_metrics.h"
#include "server/core/repository.h"
#include "server/core/status.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/models/model_selector.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::server {

/// Makes the evaluator of a model message, by its kept table where there is one; throws
/// std::runtime_error when it cannot. `surrogate::MakeModel` in the programs.
using ModelFactory = std::function<std::unique_ptr<const surrogate::WheelModel>(
    const v1alpha1::Model&, const surrogate::KeptTable&)>;

/// A model that passed its self-test and may answer. Immutable.
struct ServedModel {
  std::string digest;     ///< sha256 hex of the file's payload
  std::string reference;  ///< "name@sha256:HEX", echoed with every answer
  bool shipped = false;
  v1alpha1::Model message;  ///< domain, errors, provenance, ...
  std::unique_ptr<const surrogate::WheelModel> evaluator;
  surrogate::SelectableModel choice;  ///< what it costs (measured once) and claims; sd_form
  std::string pair;                   ///< equal for models of one wheel on one soil
  /// What it answered: all of a model that changes.
  std::shared_ptr<ModelCounters> counters = std::make_shared<ModelCounters>();
};

/// The models that may answer a query with an accuracy request.
struct SelectableModels {
  std::vector<const ServedModel*> models;  ///< as selector.models(): the cheapest first
  surrogate::ModelSelector selector;
};

/// Builds a model and self-tests it (surrogate::SelfTest). Throws std::runtime_error naming the
/// model and the field.
std::shared_ptr<const ServedModel> MakeServedModel(v1alpha1::Model message, std::string digest,
                                                   bool shipped, const ModelFactory& factory,
                                                   const surrogate::KeptTable& kept = {});

/// What is served at one moment. Immutable; one message sees one snapshot.
class Snapshot {
 public:
  using ModelPtr = std::shared_ptr<const ServedModel>;
  using Aliases = std::map<std::string, ModelPtr, std::less<>>;

  Snapshot() = default;  ///< before the first models are loaded
  /// `pending`: digests of models that are there but not loaded yet.
  Snapshot(std::uint64_t generation, std::vector<ModelPtr> models,
           std::map<std::string, Aliases, std::less<>> aliases,
           std::vector<std::string> pending = {});

  /// Nothing was loaded yet: what is asked for may be there.
  bool loading() const { return loading_; }
  static Status StillLoading();
  std::uint64_t generation() const { return generation_; }
  /// Sorted by name, then digest.
  const std::vector<ModelPtr>& models() const { return models_; }
  /// Aliases by model name.
  const std::map<std::string, Aliases, std::less<>>& aliases() const { return aliases_; }
  /// Digests of models that are there but not loaded yet; none of them has an alias.
  const std::vector<std::string>& pending() const { return pending_; }

  /// Null where there is no such model or alias.
  ModelPtr FindAlias(std::string_view name, std::string_view alias) const;
  /// Resolves "name", "name@alias", "name@sha256:HEX" or "" (the only model).
  /// On failure *model is null and the status is NOT_FOUND (unknown),
  /// INVALID_ARGUMENT (malformed) or UNAVAILABLE (a digest that is pending, loading). Allocates
  /// only on failure.
  Status Find(std::string_view reference, const ServedModel** model) const;

  /// Who may answer where `named` was found by `reference` and an accuracy request given:
  /// `named` and the stable models of other names with its wheel and soil; itself
  /// alone where the reference has a digest. Made with the snapshot.
  const SelectableModels& SelectableOf(std::string_view reference, const ServedModel& named) const;

 private:
  void MakeSelectors();
  Status Unknown(std::string_view reference, const char* why) const;

  bool loading_ = true;
  std::uint64_t generation_ = 0;
  std::vector<ModelPtr> models_;
  std::map<std::string, Aliases, std::less<>> aliases_;
  std::vector<std::string> pending_;
  std::map<const ServedModel*, std::shared_ptr<const SelectableModels>> alone_, together_;
};

}  // namespace grouser::server

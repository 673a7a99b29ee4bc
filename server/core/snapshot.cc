#include "server/core/snapshot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "server/core/model_reference.h"
#include "surrogate/model_io/selectable_model.h"
#include "surrogate/model_io/self_test.h"

namespace grouser::server {
namespace {

constexpr std::size_t kMaxKnown = 1000;  // characters of known names in one error text

std::unique_ptr<const SelectableModels> MakeSelectable(
    const std::vector<const ServedModel*>& models) {
  std::vector<surrogate::SelectableModel> choices;
  for (const ServedModel* model : models) choices.push_back(model->choice);
  auto selectable = std::make_unique<SelectableModels>(
      SelectableModels{{}, surrogate::ModelSelector(std::move(choices))});
  for (const auto& choice : selectable->selector.models()) {
    selectable->models.push_back(*std::ranges::find(
        models, choice.model, [](const ServedModel* model) { return model->evaluator.get(); }));
  }
  return selectable;
}

}  // namespace

std::shared_ptr<const ServedModel> MakeServedModel(v1alpha1::Model message, std::string digest,
                                                   bool shipped, const ModelFactory& factory,
                                                   const surrogate::KeptTable& kept) {
  auto served = std::make_shared<ServedModel>();
  served->reference = message.name() + "@sha256:" + digest;
  served->digest = std::move(digest);
  served->shipped = shipped;
  try {
    served->evaluator = factory(message, kept);
  } catch (const std::exception& e) {
    throw std::runtime_error(served->reference + ": " + e.what());
  }
  if (!served->evaluator) throw std::runtime_error(served->reference + ": no evaluator was made");
  surrogate::SelfTest(served->reference, message, *served->evaluator);
  served->message = std::move(message);
  served->choice = surrogate::MakeSelectableModel(served->message, *served->evaluator);
  served->pair = surrogate::PairKey(served->message);
  return served;
}

Snapshot::Snapshot(std::uint64_t generation, std::vector<ModelPtr> models,
                   std::map<std::string, Aliases, std::less<>> aliases,
                   std::vector<std::string> pending)
    : loading_(false),
      generation_(generation),
      models_(std::move(models)),
      aliases_(std::move(aliases)),
      pending_(std::move(pending)) {
  std::sort(models_.begin(), models_.end(), [](const ModelPtr& a, const ModelPtr& b) {
    return std::tie(a->message.name(), a->digest) < std::tie(b->message.name(), b->digest);
  });
  MakeSelectors();
}

void Snapshot::MakeSelectors() {
  std::vector<const ServedModel*> stable;
  for (const auto& [name, of_model] : aliases_) {
    if (const ModelPtr model = FindAlias(name, kDefaultAlias)) stable.push_back(model.get());
  }
  // The stable models of a pair share one set.
  std::map<std::vector<const ServedModel*>, std::shared_ptr<const SelectableModels>> made;
  for (const ModelPtr& model : models_) alone_.emplace(model.get(), MakeSelectable({model.get()}));
  for (const auto& [name, of_model] : aliases_) {
    for (const auto& [alias, named] : of_model) {
      if (together_.contains(named.get())) continue;
      // A candidate stands in for the stable model of its own name.
      std::vector<const ServedModel*> models = {named.get()};
      for (const ServedModel* other : stable) {
        const bool same = other->pair == named->pair;
        if (same && other->message.name() != named->message.name()) models.push_back(other);
      }
      std::ranges::sort(models, {},
                        [](const ServedModel* m) -> const std::string& { return m->digest; });
      std::shared_ptr<const SelectableModels>& set = made[models];
      if (!set) set = MakeSelectable(models);
      together_.emplace(named.get(), set);
    }
  }
}

const SelectableModels& Snapshot::SelectableOf(std::string_view reference,
                                               const ServedModel& named) const {
  const bool pinned = reference.find("@sha256:") != std::string_view::npos;
  return *(pinned ? alone_ : together_).at(&named);
}

Status Snapshot::StillLoading() {
  return {StatusCode::kUnavailable, "the server's models are being loaded; ask again"};
}

Snapshot::ModelPtr Snapshot::FindAlias(std::string_view name, std::string_view alias) const {
  const auto of_model = aliases_.find(name);
  if (of_model == aliases_.end()) return nullptr;
  const auto found = of_model->second.find(alias);
  return found == of_model->second.end() ? nullptr : found->second;
}

Status Snapshot::Find(std::string_view reference, const ServedModel** model) const {
  *model = nullptr;
  if (loading_) return StillLoading();
  std::string problem;
  const auto parsed = ParseModelReference(reference, &problem);
  if (!parsed) return Status::InvalidArgument("model: " + problem);
  std::string_view name = parsed->name;
  std::string_view alias = parsed->alias;
  if (name.empty()) {
    const bool only_one =
        !models_.empty() && models_.front()->message.name() == models_.back()->message.name();
    if (!only_one) return Unknown(reference, "is empty, which needs exactly one model");
    name = models_.front()->message.name();
    alias = kDefaultAlias;
  }
  if (parsed->digest_prefix.empty()) {
    *model = FindAlias(name, alias).get();  // the snapshot holds it
    if (*model != nullptr) return Status::Ok();
    return Unknown(reference, aliases_.contains(name) ? "has no such alias" : "is unknown");
  }
  for (const ModelPtr& candidate : models_) {
    if (candidate->message.name() != name) continue;
    if (!candidate->digest.starts_with(parsed->digest_prefix)) continue;
    if (*model != nullptr) {
      *model = nullptr;
      return Unknown(reference, "is ambiguous");
    }
    *model = candidate.get();
  }
  if (*model != nullptr) return Status::Ok();
  const bool pending = std::ranges::any_of(pending_, [&](const std::string& digest) {
    return digest.starts_with(parsed->digest_prefix);
  });
  if (!pending) return Unknown(reference, "is unknown");
  return {StatusCode::kUnavailable,
          fmt::format("model: {} is being loaded; ask again", Quote(reference))};
}

Status Snapshot::Unknown(std::string_view reference, const char* why) const {
  std::string known;
  for (const auto& [name, of_model] : aliases_) {
    for (const auto& [alias, target] : of_model) {
      if (known.size() > kMaxKnown) continue;
      if (!known.empty()) known += ", ";
      known.append(name).append("@").append(alias);
      if (known.size() > kMaxKnown) known += ", ...";
    }
  }
  return Status::NotFound(fmt::format("model: {} {}; known: {}", Quote(reference), why,
                                      known.empty() ? "none" : known));
}

}  // namespace grouser::server

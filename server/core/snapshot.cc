#include "server/core/snapshot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "server/core/model_reference.h"
#include "surrogate/model_io/cascade_rung.h"

namespace grouser::server {
namespace {

constexpr std::size_t kMaxKnown = 1000;    // characters of known names in one error text
constexpr double kGoldenTolerance = 1e-9;  // relative, as the model format promises

/// One golden vector through the evaluator.
std::array<double, surrogate::kOutputs> EvaluateOne(const surrogate::WheelModel& model,
                                                    const v1alpha1::GoldenVector& in) {
  const double v_x = in.v_x_m_per_s();
  const double v_y = in.v_y_m_per_s();
  const double rim = in.rim_speed_m_per_s();
  const double load = in.load_n();
  surrogate::WheelStatesView states;
  states.v_x = {&v_x, 1};
  states.v_y = {&v_y, 1};
  states.rim_speed = {&rim, 1};
  states.load = {&load, 1};
  std::array<double, surrogate::kOutputs> value;
  value.fill(std::numeric_limits<double>::quiet_NaN());
  std::uint32_t flags = 0;
  surrogate::ResponsesView out;
  for (int k = 0; k < surrogate::kOutputs; ++k) out.output[k].value = {&value[k], 1};
  out.flags = {&flags, 1};
  model.Evaluate(states, out);
  return value;
}

/// What counts as 1 in Tolerance() of an evaluator.
double ScaleOf(int output, double load, double radius) {
  if (output == surrogate::kSinkage) return radius;
  const bool moment = output == surrogate::kTorque || output == surrogate::kMz;
  return moment ? load * radius : load;
}

void SelfTest(const std::string& name, const v1alpha1::Model& message,
              const surrogate::WheelModel& model) {
  if (message.golden_size() == 0) {
    throw std::runtime_error(name + ": golden: none, expected at least one to test the model with");
  }
  for (int i = 0; i < message.golden_size(); ++i) {
    const auto& golden = message.golden(i);
    if (golden.value_size() != surrogate::kOutputs) {
      throw std::runtime_error(fmt::format("{}: golden[{}].value: {} entries, expected {}", name, i,
                                           golden.value_size(), int{surrogate::kOutputs}));
    }
    const auto value = EvaluateOne(model, golden);
    for (int k = 0; k < surrogate::kOutputs; ++k) {
      const double allowed =
          kGoldenTolerance * std::max(1.0, std::abs(golden.value(k))) +
          model.Tolerance() * ScaleOf(k, golden.load_n(), message.wheel().radius_m());
      if (std::abs(value[k] - golden.value(k)) <= allowed) continue;
      throw std::runtime_error(fmt::format("{}: golden[{}].{}: {:.17g}, expected {:.17g}", name, i,
                                           surrogate::kOutputNames[k], value[k], golden.value(k)));
    }
  }
}

std::unique_ptr<const Ladder> MakeLadder(const std::vector<const ServedModel*>& models) {
  std::vector<surrogate::CascadeRung> rungs;
  for (const ServedModel* model : models) rungs.push_back(model->rung);
  auto ladder = std::make_unique<Ladder>(Ladder{{}, surrogate::Cascade(std::move(rungs))});
  for (const auto& rung : ladder->cascade.rungs()) {
    ladder->models.push_back(*std::ranges::find(
        models, rung.model, [](const ServedModel* model) { return model->evaluator.get(); }));
  }
  return ladder;
}

}  // namespace

std::shared_ptr<const ServedModel> MakeServedModel(v1alpha1::Model message, std::string digest,
                                                   bool shipped, const ModelFactory& factory) {
  auto served = std::make_shared<ServedModel>();
  served->reference = message.name() + "@sha256:" + digest;
  served->digest = std::move(digest);
  served->shipped = shipped;
  try {
    served->evaluator = factory(message);
  } catch (const std::exception& e) {
    throw std::runtime_error(served->reference + ": " + e.what());
  }
  if (!served->evaluator) throw std::runtime_error(served->reference + ": no evaluator was made");
  SelfTest(served->reference, message, *served->evaluator);
  served->sd_form.fill(std::numeric_limits<double>::quiet_NaN());
  for (int k = 0; k < std::min<int>(message.sd_form_size(), surrogate::kOutputs); ++k) {
    served->sd_form[k] = message.sd_form(k);
  }
  served->form_unknown = std::any_of(served->sd_form.begin(), served->sd_form.end(),
                                     [](double sd) { return std::isnan(sd); });
  served->message = std::move(message);
  served->rung = surrogate::MakeCascadeRung(served->message, *served->evaluator);
  served->pair = surrogate::PairKey(served->message);
  return served;
}

Snapshot::Snapshot(std::uint64_t generation, std::vector<ModelPtr> models,
                   std::map<std::string, Aliases, std::less<>> aliases)
    : generation_(generation), models_(std::move(models)), aliases_(std::move(aliases)) {
  std::sort(models_.begin(), models_.end(), [](const ModelPtr& a, const ModelPtr& b) {
    return std::tie(a->message.name(), a->digest) < std::tie(b->message.name(), b->digest);
  });
  MakeLadders();
}

void Snapshot::MakeLadders() {
  std::vector<const ServedModel*> stable;
  for (const auto& [name, of_model] : aliases_) {
    const auto found = of_model.find(kDefaultAlias);
    if (found != of_model.end()) stable.push_back(found->second.get());
  }
  for (const ModelPtr& model : models_) alone_.emplace(model.get(), MakeLadder({model.get()}));
  for (const auto& [name, of_model] : aliases_) {
    for (const auto& [alias, named] : of_model) {
      if (together_.contains(named.get())) continue;
      // A candidate stands in for the stable model of its own name.
      std::vector<const ServedModel*> models = {named.get()};
      for (const ServedModel* other : stable) {
        const bool same = other->pair == named->pair;
        if (same && other->message.name() != named->message.name()) models.push_back(other);
      }
      together_.emplace(named.get(), MakeLadder(models));
    }
  }
}

const Ladder& Snapshot::LadderOf(std::string_view reference, const ServedModel& named) const {
  const bool pinned = reference.find("@sha256:") != std::string_view::npos;
  return *(pinned ? alone_ : together_).at(&named);
}

Status Snapshot::Find(std::string_view reference, const ServedModel** model) const {
  *model = nullptr;
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
    const auto of_model = aliases_.find(name);
    if (of_model == aliases_.end()) return Unknown(reference, "is unknown");
    const auto found = of_model->second.find(alias);
    if (found == of_model->second.end()) return Unknown(reference, "has no such alias");
    *model = found->second.get();
    return Status::Ok();
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
  return *model != nullptr ? Status::Ok() : Unknown(reference, "is unknown");
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

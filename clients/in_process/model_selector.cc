#include "clients/in_process/grouser/model_selector.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "clients/in_process/parts.h"
#include "surrogate/models/model_selector.h"

namespace grouser {
namespace {

bool Sensible(double x) noexcept { return x >= 0 && std::isfinite(x); }

bool Sensible(const AccuracyRequest& accuracy) noexcept {
  bool good = Sensible(accuracy.share_of_load) && Sensible(1e3 * accuracy.budget_us);
  for (const double t : accuracy.tolerance) good &= Sensible(t);
  return good;
}

surrogate::AccuracyRequest ToOurs(const AccuracyRequest& accuracy) noexcept {
  return {accuracy.tolerance, accuracy.share_of_load, 1e3 * accuracy.budget_us,
          accuracy.target == IntervalTarget::kMeasured ? surrogate::IntervalTarget::kMeasured
                                                       : surrogate::IntervalTarget::kDem};
}

// Without the spans that some model would leave as they are.
Answers WithoutGradients(Answers out) noexcept {
  for (OutputSpans& o : out.output) {
    for (std::size_t f = kFirstGradient; f < kGradientsEnd; ++f) {
      o.*kOutputSpanFields[f].member = {};
    }
  }
  return out;
}

}  // namespace

struct ModelSelector::Parts {
  std::vector<Model> models;  // as the models of the selector
  surrogate::ModelSelector selector;
  bool has_gradients;  // of all models
};

ModelSelector::ModelSelector(std::unique_ptr<const Parts> parts) noexcept
    : parts_(std::move(parts)) {}
ModelSelector::ModelSelector(ModelSelector&& other) noexcept = default;
ModelSelector& ModelSelector::operator=(ModelSelector&& other) noexcept = default;
ModelSelector::~ModelSelector() = default;

ModelSelector ModelSelector::Open(const std::vector<std::filesystem::path>& model_files) {
  if (model_files.empty())
    throw std::invalid_argument("model selector: no file, expected one or more");
  std::vector<Model> opened;
  std::vector<surrogate::SelectableModel> models;
  bool has_gradients = true;
  for (const std::filesystem::path& file : model_files) {
    opened.push_back(Model::Open(file));
    const Model::Parts& parts = *opened.back().parts_;
    if (parts.pair != opened.front().parts_->pair) {
      throw std::runtime_error(file.string() + ": another wheel or soil than that of " +
                               model_files.front().string() + ", expected the same");
    }
    models.push_back(parts.as_selectable);
    has_gradients &= parts.has_gradients;
  }
  auto parts = std::make_unique<Parts>(
      Parts{{}, surrogate::ModelSelector(std::move(models)), has_gradients});
  for (const surrogate::SelectableModel& choice : parts->selector.models()) {
    for (Model& model : opened) {
      const bool found = model.parts_ && model.parts_->evaluator.get() == choice.model;
      if (found) parts->models.push_back(std::move(model));
    }
  }
  return ModelSelector(std::move(parts));
}

bool ModelSelector::Evaluate(const States& in, const AccuracyRequest& accuracy, const Answers& out,
                             std::span<std::uint32_t> answered_by) const noexcept {
  const bool fits = answered_by.empty() || answered_by.size() == in.load.size();
  if (parts_ == nullptr || !fits || !SizesFit(in, out) || !Sensible(accuracy)) return false;
  if (!parts_->has_gradients) FillGradients(out, kNaN);
  parts_->selector.Evaluate(ToView(in), ToOurs(accuracy),
                            ToView(parts_->has_gradients ? out : WithoutGradients(out)),
                            answered_by, nullptr, FormViewOf(out));
  FillSdSoil(out);
  return true;
}

std::string ModelSelector::Problem(const States& in, const AccuracyRequest& accuracy,
                                   const Answers& out, std::span<const std::uint32_t> answered_by) {
  const std::string sizes = Model::SizeProblem(in, out);
  if (!sizes.empty()) return sizes;
  const std::size_t n = in.load.size();
  if (!answered_by.empty() && answered_by.size() != n) {
    return "answered_by: " + std::to_string(answered_by.size()) + " entries, expected " +
           std::to_string(n) + " or none";
  }
  const auto problem = [](const std::string& name, double value) {
    return name + ": " + std::to_string(value) + ", expected a finite number above 0, or 0";
  };
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const double t = accuracy.tolerance[o];
    if (!Sensible(t)) return problem("tolerance[" + std::to_string(o) + "]", t);
  }
  if (!Sensible(accuracy.share_of_load)) return problem("share_of_load", accuracy.share_of_load);
  if (!Sensible(1e3 * accuracy.budget_us)) return problem("budget_us", accuracy.budget_us);
  return "";
}

std::size_t ModelSelector::size() const noexcept { return parts_->models.size(); }
const Model& ModelSelector::model(std::size_t k) const noexcept { return parts_->models[k]; }
double ModelSelector::cost_ns(std::size_t k) const noexcept {
  return parts_->selector.models()[k].cost_ns;
}

}  // namespace grouser

#include "clients/in_process/grouser/ladder.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "clients/in_process/parts.h"
#include "surrogate/models/cascade.h"

namespace grouser {
namespace {

bool Sensible(double x) noexcept { return x >= 0 && std::isfinite(x); }

bool Sensible(const Demand& demand) noexcept {
  bool good = Sensible(demand.share_of_load) && Sensible(1e3 * demand.budget_us);
  for (const double t : demand.tolerance) good &= Sensible(t);
  return good;
}

surrogate::Demand ToOurs(const Demand& demand) noexcept {
  return {demand.tolerance, demand.share_of_load, 1e3 * demand.budget_us};
}

// Without the spans that some rung would leave as they are.
Answers WithoutGradients(Answers out) noexcept {
  for (OutputSpans& o : out.output) {
    for (std::size_t f = kFirstGradient; f < kSpanFields.size(); ++f) {
      o.*kSpanFields[f].member = {};
    }
  }
  return out;
}

}  // namespace

struct Ladder::Parts {
  std::vector<Model> models;  // as the rungs of the cascade
  surrogate::Cascade cascade;
  bool has_gradients;  // of all models
};

Ladder::Ladder(std::unique_ptr<const Parts> parts) noexcept : parts_(std::move(parts)) {}
Ladder::Ladder(Ladder&& other) noexcept = default;
Ladder& Ladder::operator=(Ladder&& other) noexcept = default;
Ladder::~Ladder() = default;

Ladder Ladder::Open(const std::vector<std::filesystem::path>& model_files) {
  if (model_files.empty()) throw std::invalid_argument("ladder: no file, expected one or more");
  std::vector<Model> opened;
  std::vector<surrogate::CascadeRung> rungs;
  bool has_gradients = true;
  for (const std::filesystem::path& file : model_files) {
    opened.push_back(Model::Open(file));
    const Model::Parts& parts = *opened.back().parts_;
    if (parts.pair != opened.front().parts_->pair) {
      throw std::runtime_error(file.string() + ": another wheel or soil than that of " +
                               model_files.front().string() + ", expected the same");
    }
    rungs.push_back(parts.as_rung);
    has_gradients &= parts.has_gradients;
  }
  auto parts =
      std::make_unique<Parts>(Parts{{}, surrogate::Cascade(std::move(rungs)), has_gradients});
  for (const surrogate::CascadeRung& rung : parts->cascade.rungs()) {
    for (Model& model : opened) {
      const bool found = model.parts_ && model.parts_->evaluator.get() == rung.model;
      if (found) parts->models.push_back(std::move(model));
    }
  }
  return Ladder(std::move(parts));
}

bool Ladder::Evaluate(const States& in, const Demand& demand, const Answers& out,
                      std::span<std::uint32_t> rung_of) const noexcept {
  const bool fits = rung_of.empty() || rung_of.size() == in.load.size();
  if (parts_ == nullptr || !fits || !SizesFit(in, out) || !Sensible(demand)) return false;
  if (!parts_->has_gradients) FillGradients(out, kNaN);
  parts_->cascade.Evaluate(ToView(in), ToOurs(demand),
                           ToView(parts_->has_gradients ? out : WithoutGradients(out)), rung_of,
                           nullptr);
  return true;
}

std::string Ladder::Problem(const States& in, const Demand& demand, const Answers& out,
                            std::span<const std::uint32_t> rung_of) {
  const std::string sizes = Model::SizeProblem(in, out);
  if (!sizes.empty()) return sizes;
  const std::size_t n = in.load.size();
  if (!rung_of.empty() && rung_of.size() != n) {
    return "rung_of: " + std::to_string(rung_of.size()) + " entries, expected " +
           std::to_string(n) + " or none";
  }
  const auto problem = [](const std::string& name, double value) {
    return name + ": " + std::to_string(value) + ", expected a finite number above 0, or 0";
  };
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const double t = demand.tolerance[o];
    if (!Sensible(t)) return problem("tolerance[" + std::to_string(o) + "]", t);
  }
  if (!Sensible(demand.share_of_load)) return problem("share_of_load", demand.share_of_load);
  if (!Sensible(1e3 * demand.budget_us)) return problem("budget_us", demand.budget_us);
  return "";
}

std::size_t Ladder::size() const noexcept { return parts_->models.size(); }
const Model& Ladder::rung(std::size_t k) const noexcept { return parts_->models[k]; }
double Ladder::cost_ns(std::size_t k) const noexcept { return parts_->cascade.rungs()[k].cost_ns; }

}  // namespace grouser

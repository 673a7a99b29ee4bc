#include "surrogate/model_io/similar_wheel.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace grouser::surrogate {
namespace {

bool Sticks(const v1alpha1::ContactLaws& laws) {
  const bool law = !laws.cohesion().empty() && laws.cohesion() != "none";
  return law || laws.surface_energy_j_per_m2() != 0 ||
         laws.wheel().surface_energy_j_per_m2() != 0 || laws.floor().surface_energy_j_per_m2() != 0;
}

bool Positive(double x) { return x > 0 && std::isfinite(x); }

}  // namespace

std::string ScalingRefusal(const v1alpha1::Model& model) {
  if (Sticks(model.soil().grains().contact())) {
    return "soil " + model.soil().name() + ": grains that cohere, expected dry ones";
  }
  const v1alpha1::BekkerParameters& p = model.bekker();
  if (model.untuned() &&
      (p.cohesion_pa() != 0 || p.k_c_n_per_m_n_plus_1() != 0 || p.reece_k_c() != 0)) {
    std::ostringstream text;
    text << "soil " << model.soil().name() << ": cohesion " << p.cohesion_pa() << " Pa, k_c "
         << (p.reece_k_c() != 0 ? p.reece_k_c() : p.k_c_n_per_m_n_plus_1())
         << ", expected 0, 0: make one for that wheel and gravity (grouser model make)";
    return text.str();
  }
  return "";
}

Similarity SimilarityTo(const v1alpha1::Model& model, double radius_m, double gravity_m_per_s2) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("model " + model.name() + ": a similar wheel: " + what);
  };
  const std::string refusal = ScalingRefusal(model);
  if (!refusal.empty()) refuse(refusal);
  const auto check = [&](const char* what, double x) {
    if (Positive(x)) return;
    std::ostringstream text;
    text << what << ": " << x << ", expected a finite number above 0";
    refuse(text.str());
  };
  check("radius [m]", radius_m);
  check("gravity [m/s^2]", gravity_m_per_s2);
  const bool hard = model.kind() == v1alpha1::MODEL_KIND_HARD;
  const double own = model.soil().gravity_m_per_s2();
  if (!hard) check("the model's gravity [m/s^2]", own);
  // On hard ground nothing goes with gravity but the load.
  const Similarity by{radius_m / model.wheel().radius_m(), hard ? 1 : gravity_m_per_s2 / own};
  check("the ratio of forces", by.Force());
  check("the ratio of moments", by.Moment());
  return by;
}

std::unique_ptr<const WheelModel> MakeScaled(const v1alpha1::Model& model,
                                             std::shared_ptr<const WheelModel> evaluator,
                                             const Similarity& by) {
  return std::make_unique<ScaledModel>(std::move(evaluator), model.wheel().radius_m(), by,
                                       model.kind() != v1alpha1::MODEL_KIND_HARD);
}

}  // namespace grouser::surrogate

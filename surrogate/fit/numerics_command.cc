#include "surrogate/fit/numerics_command.h"

#include <stdexcept>

#include "surrogate/fit/soil_card.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::surrogate {

void AddNumericsOptions(CLI::App* sub, NumericsArguments* a) {
  NumericsRequest& r = a->request;
  sub->add_option("model", a->model, "model file")->required();
  sub->add_option("--load", r.load_n, "[N]; the middle of the training loads if not given")
      ->check(CLI::PositiveNumber);
  sub->add_option("--slip", r.slips,
                  "slips at attack angle 0, -2 to 1 (laws: at most -1 to 1); several: 0.1,0.2")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  sub->add_option("--deflection", r.deflection,
                  "delta/h of a tyre that the laws answer for; 0: a rigid wheel, as the model's")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  sub->add_option("--section-height", r.section_height_m,
                  "h of the tyre [m]; the lesser of width and radius if not given")
      ->check(CLI::PositiveNumber);
  auto* index = sub->add_option("--cone-index", a->index_kpa,
                                "[kPa], instead of that of the model's soil (grouser-soil cones)");
  auto* gradient = sub->add_option("--gradient", a->gradient_kpa_per_m, "of it with depth [kPa/m]");
  index->check(CLI::PositiveNumber)->needs(gradient);
  gradient->needs(index);
  sub->add_option("--cones", a->cones, "further cone indices (a bevameter's cone_index.csv)")
      ->delimiter(',')
      ->allow_extra_args(false);
}

std::string NumericsOf(const NumericsArguments& a, bool json) {
  const records::LoadedModel loaded = ReadModel(a.model);
  if (loaded.model.kind() == v1alpha1::MODEL_KIND_HARD) {
    throw std::invalid_argument(a.model + ": hard ground, expected a model of a soil");
  }
  NumericsRequest request = a.request;
  if (a.index_kpa) {
    ConeIndex given;
    given.index_pa = 1e3 * *a.index_kpa;
    given.gradient_pa_per_m = 1e3 * *a.gradient_kpa_per_m;
    request.cone = given;
  } else {
    request.cone = LineOfSoil(loaded.model, ConeIndices(a.cones));
  }
  const NumericsReport report = CompareWithNumerics(loaded.model, request);
  const std::string reference = loaded.model.name() + "@sha256:" + loaded.digest;
  return json ? NumericsJson(report, reference) : NumericsText(report, loaded.model, reference);
}

}  // namespace grouser::surrogate

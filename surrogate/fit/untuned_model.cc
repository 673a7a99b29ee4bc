#include "surrogate/fit/untuned_model.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "surrogate/fit/error_table.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

constexpr double kShallow = 0.02, kDeep = 0.4;  // of the radius, rolling freely

double LoadAt(const BekkerModel& physics, double sinkage) {
  return physics.AtSinkage(ToCanonical(1, 0, 1), sinkage * physics.wheel().radius_m).value[kFz];
}

void SetDomain(const UntunedRequest& request, const BekkerModel& physics, double froude,
               v1alpha1::Domain* d) {
  d->set_slip_min(-1);
  d->set_slip_max(1);
  d->set_attack_angle_max_rad(std::numbers::pi / 2);
  d->set_load_min_n(request.load_min_n.value_or(LoadAt(physics, kShallow)));
  d->set_load_max_n(request.load_max_n.value_or(LoadAt(physics, kDeep)));
  if (!(d->load_min_n() > 0 && d->load_max_n() > d->load_min_n())) {
    throw std::invalid_argument(fmt::format("loads {:g} to {:g} N, expected 0 < least < most",
                                            d->load_min_n(), d->load_max_n()));
  }
  d->set_froude_max(froude);
  d->set_speed_m_per_s(0.5 *
                       std::sqrt(froude * request.gravity_m_per_s2 * physics.wheel().radius_m));
}

void AddErrorRows(const PairErrors& errors, const ErrorSpread& spread,
                  const std::array<double, kOutputs>& scale, v1alpha1::Model* model) {
  std::vector<Comparison> comparisons;
  for (const LeftOut& l : errors.rows) {
    Comparison c{l.row, l.prediction.value, {}};
    const double bulldozing = Hull::Bulldozing(l.row->state());
    for (int o = 0; o < kOutputs; ++o) {
      c.half_width[o] =
          spread.factor[o] * spread.inside[o] * (1 + spread.bulldozing[o] * bulldozing);
    }
    comparisons.push_back(c);
  }
  const auto index = [](const std::string& output) {
    return std::ranges::find(kOutputFields, output, &OutputField::name) - kOutputFields;
  };
  for (v1alpha1::ErrorRow row : ErrorTable(comparisons, "untuned")) {
    const auto o = index(row.output());
    row.set_rmse(row.rmse() * scale[o]);
    row.set_max_abs(row.max_abs() * scale[o]);
    *model->add_errors() = row;
    if (row.region() != v1alpha1::REGION_ALL || errors.pairs.size() < 2) continue;
    row.set_set("other_pairs");
    row.set_covered90(spread.other_pairs[o]);
    *model->add_errors() = row;
  }
}

}  // namespace

v1alpha1::Model MakeUntuned(const UntunedRequest& request, const PairErrors& errors) {
  BekkerParameters parameters = FromSoil(request.soil, request.gravity_m_per_s2);
  for (const v1alpha1::Tread& tread : request.wheel.treads()) {
    parameters.grouser_height = std::max(parameters.grouser_height, tread.height_m());
  }
  const BekkerModel physics(parameters, {request.wheel.radius_m(), request.wheel.width_m()});
  const ErrorSpread spread = SpreadOf(errors);
  v1alpha1::Model model;
  model.set_name(request.name);
  model.set_kind(v1alpha1::MODEL_KIND_BEKKER);
  model.set_untuned(true);
  *model.mutable_wheel() = request.wheel;
  v1alpha1::Soil* soil = model.mutable_soil();
  soil->set_name(request.soil.name);
  soil->set_source(request.soil.source);
  soil->set_bulk_density_kg_per_m3(parameters.unit_weight / request.gravity_m_per_s2);
  soil->set_gravity_m_per_s2(request.gravity_m_per_s2);
  SetBekker(parameters, &model);
  SetDomain(request, physics, errors.froude_max, model.mutable_domain());

  const double middle = std::sqrt(model.domain().load_min_n() * model.domain().load_max_n());
  std::array<double, kOutputs> scale{};
  for (int o = 0; o < kOutputs; ++o) {
    scale[o] = OutputScale(o, middle, request.wheel.radius_m());
    model.add_sd_fit_inside(spread.inside[o] * scale[o]);
    model.add_sd_fit_growth(spread.inside[o] * scale[o]);  // as much again at each unit beyond
    model.add_sd_patch(0);                                 // is in the errors
    model.add_sd_bulldozing(spread.bulldozing[o]);
    model.add_interval_factor(spread.factor[o]);
    model.add_sd_form(std::numeric_limits<double>::quiet_NaN());
  }
  model.set_interval_level(Calibration{}.level);
  AddErrorRows(errors, spread, scale, &model);

  v1alpha1::Provenance* p = model.mutable_provenance();
  p->set_command(request.command);
  p->set_reason(
      fmt::format("untuned: parameters of a soil, nothing fitted; intervals by the "
                  "errors of such models on {}",
                  fmt::join(errors.pairs, ", ")));
  p->set_grouser_version(GROUSER_VERSION);
  *model.mutable_create_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  SetGoldenVectors(&model);
  return model;
}

}  // namespace grouser::surrogate

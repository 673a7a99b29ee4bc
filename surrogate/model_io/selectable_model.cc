#include "surrogate/model_io/selectable_model.h"

#include <cmath>

#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/load_model.h"

namespace grouser::surrogate {
namespace {

constexpr v1alpha1::Region kRegionNames[kErrorRegions] = {
    v1alpha1::REGION_BRAKING, v1alpha1::REGION_TOWED, v1alpha1::REGION_DRIVING,
    v1alpha1::REGION_LATERAL};

v1alpha1::Region RegionOfRun(const v1alpha1::RunSummary& run) {
  const VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), 1);
  if (std::isnan(v.v_x)) return v1alpha1::REGION_UNSPECIFIED;
  return kRegionNames[static_cast<std::size_t>(ErrorRegionAt(v.v_x, v.v_y, v.rim_speed))];
}

const v1alpha1::ErrorRow* FindRow(const v1alpha1::Model& message, const std::string& set,
                                  v1alpha1::Region region, const char* output) {
  for (const auto& row : message.errors()) {
    const bool found = row.set() == set && row.region() == region && row.output() == output;
    if (found) return row.n() >= kEnoughRuns ? &row : nullptr;
  }
  return nullptr;
}

/// Rms load of the runs that a row is about.
double LoadOf(const v1alpha1::Model& message, const v1alpha1::ErrorRow& row) {
  const bool held_out = row.set() == "held_out";
  double sum = 0;
  int n = 0;
  for (const auto& run : message.provenance().runs()) {
    const bool is_test = run.role() == v1alpha1::RUN_ROLE_TEST;
    const bool is_train =
        run.role() == v1alpha1::RUN_ROLE_TRAIN || run.role() == v1alpha1::RUN_ROLE_UNSPECIFIED;
    const bool ran = run.status() == v1alpha1::RUN_STATUS_STEADY ||
                     run.status() == v1alpha1::RUN_STATUS_UNSTEADY;
    const bool here = row.region() == v1alpha1::REGION_ALL || row.region() == RegionOfRun(run);
    if (!ran || !here || !(held_out ? is_test : is_train) || !(run.load_n() > 0)) continue;
    sum += run.load_n() * run.load_n();
    ++n;
  }
  if (n > 0) return std::sqrt(sum / n);
  return std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
}

double RmsError(const v1alpha1::Model& message, v1alpha1::Region region, int output) {
  for (const char* set : {"held_out", "leave_one_out"}) {
    const v1alpha1::ErrorRow* row = FindRow(message, set, region, kOutputFields[output].name);
    if (!row) row = FindRow(message, set, v1alpha1::REGION_ALL, kOutputFields[output].name);
    if (!row || !(row->rmse() > 0)) continue;
    if (output == kSinkage) return row->rmse();
    return row->rmse() / OutputScale(output, LoadOf(message, *row), message.wheel().radius_m());
  }
  return 0;
}

}  // namespace

SelectableModel MakeSelectableModel(const v1alpha1::Model& message, const WheelModel& model) {
  SelectableModel selectable;
  selectable.model = &model;
  selectable.hull = HullOf(message);
  selectable.radius_m = message.wheel().radius_m();
  selectable.form = FormErrorsOf(message);
  selectable.hard = message.kind() == v1alpha1::MODEL_KIND_HARD;
  for (std::size_t k = 0; k < kErrorRegions; ++k) {
    for (int o = 0; o < kOutputs; ++o)
      selectable.rms_error[k][o] = RmsError(message, kRegionNames[k], o);
  }
  selectable.cost_ns = MeasureCost(selectable);
  return selectable;
}

std::string PairKey(const v1alpha1::Model& message) {
  v1alpha1::Model key;
  *key.mutable_soil() = message.soil();
  key.mutable_soil()->clear_source();
  *key.mutable_wheel() = message.wheel();
  key.mutable_wheel()->clear_name();
  key.mutable_wheel()->clear_source();
  if (message.kind() == v1alpha1::MODEL_KIND_HARD) *key.mutable_hard() = message.hard();
  key.set_interval_level(message.interval_level());
  return key.SerializeAsString();  // no maps inside: the same bytes for the same content
}

}  // namespace grouser::surrogate

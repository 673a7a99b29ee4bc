#include "surrogate/model_io/run_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grouser::surrogate {
namespace {

std::string NonFinite(const google::protobuf::RepeatedField<double>& values, const char* name) {
  for (int i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    return std::string("stress.") + name + "[" + std::to_string(i) +
           "]: " + std::to_string(values[i]) + ", expected a finite stress";
  }
  return "";
}

}  // namespace

v1alpha1::RunRole RoleOf(const v1alpha1::RunSummary& run) {
  return run.role() == v1alpha1::RUN_ROLE_UNSPECIFIED ? v1alpha1::RUN_ROLE_TRAIN : run.role();
}

bool HasUsableMeans(const v1alpha1::RunSummary& run) {
  if (run.status() == v1alpha1::RUN_STATUS_STEADY) return true;
  if (run.status() != v1alpha1::RUN_STATUS_UNSTEADY) return false;
  // Nor is a run of use that never came to a window.
  const bool known = run.drift_size() == kOutputs && run.mean_size() == kOutputs;
  return known && run.travel_m() > 0 &&
         std::ranges::all_of(run.mean(), [](double m) { return std::isfinite(m); });
}

VelocityState MotionOf(const v1alpha1::RunSummary& run, double otherwise) {
  return FromSlip(run.slip(), run.attack_angle_rad(),
                  run.speed_m_per_s() > 0 ? run.speed_m_per_s() : otherwise);
}

std::string StressDamageOf(const v1alpha1::RunSummary& run) {
  const v1alpha1::StressSummary& s = run.stress();
  const int bins = s.normal_pa_size();
  if (s.shear_tangential_pa_size() != bins) {
    return "stress: " + std::to_string(bins) + " normal and " +
           std::to_string(s.shear_tangential_pa_size()) +
           " tangential bins, expected as many of either";
  }
  if (bins == 0) return "";
  const double step = s.angle_step_rad();
  if (!(step > 0) || !std::isfinite(step)) {
    return "stress.angle_step_rad: " + std::to_string(step) + ", expected a positive angle";
  }
  if (!(bins * step <= 2 * std::numbers::pi + 1e-6)) {
    return "stress: " + std::to_string(bins) + " bins of " + std::to_string(step) +
           " rad, expected one turn at most";
  }
  if (!std::isfinite(s.first_angle_rad())) {
    return "stress.first_angle_rad: expected a finite angle";
  }
  const std::string normal = NonFinite(s.normal_pa(), "normal_pa");
  return normal.empty() ? NonFinite(s.shear_tangential_pa(), "shear_tangential_pa") : normal;
}

std::string DamageOf(const v1alpha1::RunSummary& run) {
  if (run.mean_size() != kOutputs || run.standard_error_size() != kOutputs) {
    return "expected six means and six standard errors";
  }
  if (!std::isfinite(MotionOf(run, 1).v_x)) return "slip and attack angle that no motion has";
  if (!(run.load_n() > 0)) return "load_n: expected a positive load";
  for (int o = 0; o < kOutputs; ++o) {
    if (!std::isfinite(run.mean(o)) || !(run.standard_error(o) >= 0)) {
      return std::string(kOutputFields[o].name) + ": expected a finite mean and standard error";
    }
  }
  return StressDamageOf(run);
}

bool HasStress(const v1alpha1::RunSummary& run) {
  return std::ranges::any_of(run.stress().normal_pa(), [](double v) { return v > 0; });
}

void MirrorStress(v1alpha1::StressSummary* s) {
  s->set_first_angle_rad(-(s->first_angle_rad() + s->normal_pa_size() * s->angle_step_rad()));
  std::ranges::reverse(*s->mutable_normal_pa());
  std::ranges::reverse(*s->mutable_shear_tangential_pa());
  for (double& t : *s->mutable_shear_tangential_pa()) t = 0.0 - t;  // never -0
}

}  // namespace grouser::surrogate

#include <cmath>
#include <cstdint>
#include <string>

#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/near_runs.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/state_facts.h"

namespace grouser::surrogate {
namespace {

using v1alpha1::Explanation;

constexpr int kMostBins = 360;  // of a run's stresses

void CopyRun(const v1alpha1::RunSummary& from, v1alpha1::RunSummary* to) {
  to->set_run_id(Bounded(from.run_id()));
  to->set_file(Bounded(from.file()));
  to->set_sha256(Bounded(from.sha256()));
  to->set_reason(Bounded(from.reason()));
  to->set_role(RoleOf(from));
  to->set_status(from.status());
  to->set_slip(from.slip());
  to->set_attack_angle_rad(from.attack_angle_rad());
  to->set_load_n(from.load_n());
  to->set_speed_m_per_s(from.speed_m_per_s());
  to->set_seed(from.seed());
  to->set_travel_m(from.travel_m());
  to->set_wall_s(from.wall_s());
  to->set_grains(from.grains());
  if (from.has_surface_m()) to->set_surface_m(from.surface_m());
  if (from.mean_size() == kOutputs) *to->mutable_mean() = from.mean();
  if (from.standard_error_size() == kOutputs) {
    *to->mutable_standard_error() = from.standard_error();
  }
  if (from.drift_size() == kOutputs) *to->mutable_drift() = from.drift();
}

void SetStress(const v1alpha1::RunSummary& run, bool mirrored, bool some_have,
               v1alpha1::NearRun* near) {
  if (const std::string damage = StressDamageOf(run); !damage.empty()) {
    near->set_no_stress("damaged: " + damage);
  } else if (!HasStress(run)) {
    near->set_no_stress(some_have ? "this run has none"
                                  : "this model file holds no stresses of its runs");
  } else if (run.stress().normal_pa_size() > kMostBins) {
    near->set_no_stress(std::to_string(run.stress().normal_pa_size()) + " bins, expected at most " +
                        std::to_string(kMostBins));
  } else {
    *near->mutable_stress() = run.stress();
    if (mirrored) MirrorStress(near->mutable_stress());
  }
}

/// Sign of an output when a run is brought to the state's side.
double SignOf(int output, const StateSpace::Distance& d) {
  const OutputField& field = kOutputFields[output];
  return (d.mirrored_x ? field.parity_x : 1) * (d.mirrored_y ? field.parity_y : 1);
}

void Describe(const RunBeside& beside, const StateFacts& f, bool some_have_stress,
              v1alpha1::NearRun* near) {
  const StateSpace::Distance& d = beside.distance;
  CopyRun(*beside.run, near->mutable_run());
  near->set_distance(d.total);
  near->set_direction_distance(d.direction);
  near->set_load_distance(d.load);
  near->set_speed_distance(d.speed);
  near->set_mirrored_x(d.mirrored_x);
  near->set_mirrored_y(d.mirrored_y);
  SetStress(*beside.run, d.mirrored_x, some_have_stress, near);
  if (beside.run->mean_size() != kOutputs) return;
  const WheelAnswer answer = AnswerOf(*f.evaluator, beside.motion, beside.run->load_n());
  for (int o = 0; o < kOutputs; ++o) {
    const double sign = SignOf(o, d), value = sign * answer.value[o] + 0.0;
    near->add_mean(sign * beside.run->mean(o));
    near->add_model_value(value);
    near->add_model_low(value - answer.half_width[o]);
    near->add_model_high(value + answer.half_width[o]);
  }
}

bool IsSample(const v1alpha1::RunSummary& run) {
  return HasUsableMeans(run) && DamageOf(run).empty();
}

void CountRuns(const v1alpha1::Provenance& provenance, Explanation* e) {
  std::uint32_t fitted = 0, repeats = 0, held_out = 0, no_use = 0;
  for (const v1alpha1::RunSummary& run : provenance.runs()) {
    const v1alpha1::RunRole role = RoleOf(run);
    if (!IsSample(run)) {
      ++no_use;
    } else {
      ++(role == v1alpha1::RUN_ROLE_TEST    ? held_out
         : role == v1alpha1::RUN_ROLE_PATCH ? repeats
         : role == v1alpha1::RUN_ROLE_TRAIN ? fitted
                                            : no_use);
    }
  }
  e->set_runs_fitted(fitted);
  e->set_runs_repeats(repeats);
  e->set_runs_held_out(held_out);
  e->set_runs_of_no_use(no_use);
}

}  // namespace

void AddRuns(const StateFacts& f, int most, bool some_have_stress, Explanation* e) {
  const v1alpha1::Model& m = *f.model;
  CountRuns(m.provenance(), e);
  if (!f.canonical) return;
  const StateSpace space(TrainedSpeeds(m), m.wheel().radius_m(), m.soil().gravity_m_per_s2());
  const auto add = [&](auto* list, const auto& counts) {
    for (const RunBeside& run :
         NearestRuns(m.provenance(), space, f.motion, f.load, m.domain().speed_m_per_s(),
                     static_cast<std::size_t>(most), counts)) {
      Describe(run, f, some_have_stress, list->Add());
    }
  };
  const auto sample_of = [](v1alpha1::RunRole role) {
    return [role](const v1alpha1::RunSummary& run) { return RoleOf(run) == role && IsSample(run); };
  };
  add(e->mutable_nearest(), sample_of(v1alpha1::RUN_ROLE_TRAIN));
  add(e->mutable_held_out(), sample_of(v1alpha1::RUN_ROLE_TEST));
  add(e->mutable_overloads(), [](const v1alpha1::RunSummary& run) {
    return run.status() == v1alpha1::RUN_STATUS_OVERLOAD;
  });
}

}  // namespace grouser::surrogate

#include "server/jobs/refinement_spec.h"

#include <fmt/core.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <map>

#include "server/core/model_reference.h"
#include "server/core/status.h"
#include "server/jobs/job_files.h"
#include "server/jobs/request_checks.h"

namespace grouser::server {
namespace {

/// Seed of most training runs; of equally many the smallest. 1 without any.
std::uint64_t OwnSeed(const v1alpha1::Model& model) {
  std::map<std::uint64_t, int> count;
  for (const auto& run : model.provenance().runs()) {
    if (run.role() == v1alpha1::RUN_ROLE_TRAIN) ++count[run.seed()];
  }
  const auto most =
      std::ranges::max_element(count, {}, &std::pair<const std::uint64_t, int>::second);
  return most == count.end() ? 1 : most->first;
}

void Require(bool there, const v1alpha1::Model& model, const char* field) {
  if (there) return;
  throw StatusError(StatusCode::kFailedPrecondition,
                    "model '" + model.name() + "' cannot be refined: it has no " + field);
}

/// Names, sources and continuum parameters removed.
v1alpha1::WheelTestSpec Essence(const v1alpha1::WheelTestSpec& spec) {
  v1alpha1::WheelTestSpec out = spec;
  out.DiscardUnknownFields();  // of jobs of earlier versions
  out.clear_scene();
  out.mutable_soil()->clear_name();
  out.mutable_soil()->clear_source();
  out.mutable_soil()->clear_bulk_density_kg_per_m3();
  out.mutable_wheel()->clear_name();
  out.mutable_wheel()->clear_source();
  *out.mutable_state() = Canonical(spec.state());
  return out;
}

}  // namespace

v1alpha1::WheelTestSpec BuildSpec(const v1alpha1::Model& model,
                                  const v1alpha1::SubmitRefinementRequest& request) {
  Require(model.soil().grains().sizes_size() > 0, model, "grains (soil.grains.sizes)");
  Require(model.soil().grains().youngs_modulus_pa() > 0, model,
          "grain stiffness (soil.grains.youngs_modulus_pa)");
  Require(model.wheel().radius_m() > 0 && model.wheel().width_m() > 0, model,
          "wheel (wheel.radius_m, wheel.width_m)");
  Require(model.rig().bed_length_m() > 0 && model.rig().speed_m_per_s() > 0, model,
          "rig (rig.bed_length_m, rig.speed_m_per_s)");
  v1alpha1::WheelTestSpec spec;
  spec.set_scene(model.name());
  *spec.mutable_soil() = model.soil();
  *spec.mutable_wheel() = model.wheel();
  *spec.mutable_rig() = model.rig();
  if (request.max_time_s() > 0) spec.mutable_rig()->set_max_time_s(request.max_time_s());
  *spec.mutable_state() = Canonical(request.state());
  if (spec.state().speed_m_per_s() > 0) {  // one place for it, as campaigns have it
    spec.mutable_rig()->set_speed_m_per_s(spec.state().speed_m_per_s());
    spec.mutable_state()->clear_speed_m_per_s();
  }
  spec.set_seed(request.seed() != 0 ? request.seed() : OwnSeed(model));
  return spec;
}

void CheckScene(const v1alpha1::Model& model, const v1alpha1::WheelTestSpec& spec) {
  const auto refuse = [&](const char* field, double value, const std::string& expected) {
    throw StatusError(
        StatusCode::kInvalidArgument,
        fmt::format("{}: {:.6g}, expected {} (model '{}')", field, value, expected, model.name()));
  };
  const v1alpha1::Domain& domain = model.domain();
  const double load = spec.state().load_n(), speed = spec.rig().speed_m_per_s();
  const double least = domain.load_min_n() / kSceneLighter;
  const double most = domain.load_max_n() * kSceneHeavier;
  if (most > 0 && !(load >= least && load <= most)) {
    refuse("state.load_n", load,
           fmt::format("{:.4g} to {:.4g} N, for which its scene is made", least, most));
  }
  const double fastest = kSceneFaster * model.rig().speed_m_per_s();
  if (speed > fastest) {
    refuse("state.speed_m_per_s", speed,
           fmt::format("at most {:.4g} m/s, {} times its rig's", fastest, kSceneFaster));
  }
}

bool IsOfScene(const v1alpha1::Model& model, const v1alpha1::WheelTestSpec& spec) {
  v1alpha1::WheelTestSpec own = spec;
  *own.mutable_soil() = model.soil();
  *own.mutable_wheel() = model.wheel();
  *own.mutable_rig() = model.rig();
  own.mutable_rig()->set_max_time_s(spec.rig().max_time_s());
  own.mutable_rig()->set_speed_m_per_s(spec.rig().speed_m_per_s());
  return google::protobuf::util::MessageDifferencer::Equals(Essence(own), Essence(spec));
}

std::string StableKeyOf(const std::string& name) { return name + "@stable/"; }

std::string JoinKeyOf(const std::string& name, const std::string& model_digest,
                      const v1alpha1::WheelTestSpec& spec,
                      const v1alpha1::SubmitRefinementRequest& request) {
  std::string problem;
  const auto asked = ParseModelReference(request.model(), &problem);
  const bool follows = asked && (asked->name.empty() || asked->alias == kDefaultAlias);
  const std::string work = (follows ? StableKeyOf(name) : model_digest + "/") + HashOf(spec);
  if (!request.has_time_limit()) return work;
  return fmt::format("{}/{}.{:09}s", work, request.time_limit().seconds(),
                     request.time_limit().nanos());
}

JobRow RowOf(const v1alpha1::SubmitRefinementRequest& request, const std::string& name,
             const std::string& model_digest, const v1alpha1::WheelTestSpec& spec) {
  JobRow row;
  row.join_key = JoinKeyOf(name, model_digest, spec, request);
  row.spec = spec;
  row.job.set_model(ReferenceOf(name, model_digest));
  *row.job.mutable_state() = spec.state();
  row.job.set_seed(spec.seed());
  row.job.set_priority(request.priority());
  if (request.has_time_limit()) *row.job.mutable_time_limit() = request.time_limit();
  return row;
}

bool Answers(const v1alpha1::RunRecord& record, const v1alpha1::WheelTestSpec& spec) {
  return google::protobuf::util::MessageDifferencer::Equals(Essence(record.spec()), Essence(spec));
}

}  // namespace grouser::server

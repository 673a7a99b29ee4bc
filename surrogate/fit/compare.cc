#include "surrogate/fit/compare.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "surrogate/fit/plausible.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

std::vector<v1alpha1::RunSummary> ComparedRuns(const CompareRequest& asked,
                                               const v1alpha1::Model& model,
                                               std::vector<std::string>* notes) {
  if (asked.run_dirs.empty()) {
    return {model.provenance().runs().begin(), model.provenance().runs().end()};
  }
  std::vector<v1alpha1::RunSummary> runs;
  for (const std::string& directory : asked.run_dirs) {
    const TrainingSet set = ReadRuns(directory);
    notes->insert(notes->end(), set.notes.begin(), set.notes.end());
    runs.insert(runs.end(), set.runs.begin(), set.runs.end());
  }
  return runs;
}

void SayWhere(const CompareRequest& asked, const std::string& base_digest, v1alpha1::Model* model) {
  v1alpha1::Provenance* made = model->mutable_provenance();
  made->set_base_digest(base_digest);
  made->set_command(asked.command);
  made->set_reason("sd_form from " + std::filesystem::path(asked.measured).filename().string());
  made->set_grouser_version(GROUSER_VERSION);
  *model->mutable_create_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
}

}  // namespace

MeasuredComparison CompareMeasured(const CompareRequest& asked) {
  const records::LoadedModel loaded = ReadModel(asked.model);
  const auto model = MakeScalar(loaded.model);
  const std::vector<v1alpha1::MeasuredPoint> points =
      ReadMeasured(asked.measured, LimitsOf(loaded.model), asked.accept_unusual);
  MeasuredComparison found;
  const std::vector<v1alpha1::RunSummary> runs = ComparedRuns(asked, loaded.model, &found.notes);
  const std::vector<MeasuredRow> rows =
      MatchMeasured(*model, loaded.model.domain().speed_m_per_s(), points, runs);
  found.with_form = loaded.model;
  found.with_form.mutable_measured()->Assign(points.begin(), points.end());
  found.text = MeasuredText(rows);
  Json left;
  if (asked.leave_angles_out) {
    const v1alpha1::Domain& d = loaded.model.domain();
    const double level = loaded.model.interval_level();
    const auto each = LeaveAnglesOut(MeasuredInDomain(*model, found.with_form),
                                     std::sqrt(d.load_min_n() * d.load_max_n()), level);
    found.text += LeftOutText(each, level);
    left = LeftOutJson(each, level);
  }
  if (asked.with_form) {
    SetFormError(*model, &found.with_form);
    SayWhere(asked, loaded.digest, &found.with_form);
    found.text += FormText(found.with_form);
  }
  found.json = MeasuredJson(rows, loaded.model.name() + "@sha256:" + loaded.digest, left);
  return found;
}

std::vector<Query> StatesOf(const std::vector<double>& slips,
                            const std::vector<double>& angles_deg) {
  if (slips.size() != angles_deg.size()) {
    throw std::invalid_argument(fmt::format("--angle-deg: {} angles, expected {} as --slip",
                                            angles_deg.size(), slips.size()));
  }
  std::vector<Query> states;
  for (std::size_t i = 0; i < slips.size(); ++i) {
    states.push_back({slips[i], angles_deg[i] / kDegPerRad, 0, 1});
    if (!std::isnan(FromSlip(states[i].slip, states[i].attack_angle_rad, 1).v_x)) continue;
    throw std::invalid_argument(fmt::format("--slip {:g}: no motion has this slip at {:g} degrees",
                                            slips[i], angles_deg[i]));
  }
  return states;
}

}  // namespace grouser::surrogate

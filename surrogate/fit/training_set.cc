#include "surrogate/fit/training_set.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/run_file.h"
#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {
namespace {

constexpr char kNotThere[] = ".run.h5: planned, not there";
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void Fail(const std::string& where, const std::string& what) {
  throw std::invalid_argument(where + ": " + what);
}

/// expected: what the file should be, for the message.
template <class Message>
Message ReadJson(const std::string& path, const std::string& expected) {
  const std::string text = records::ReadInputFile(path, expected);
  Message message;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &message, options);
  if (!status.ok()) Fail(path, "not the JSON of " + expected + ": " + status.ToString());
  return message;
}

v1alpha1::StressSummary SummariseStress(const v1alpha1::StressProfile& p) {
  v1alpha1::StressSummary s;
  const int width = std::max(1, static_cast<int>(p.width_bins()));
  s.set_first_angle_rad(p.first_angle_rad());
  s.set_angle_step_rad(p.angle_step_rad());
  const auto mean = [&](const google::protobuf::RepeatedField<double>& all, int angle) {
    double sum = 0;
    for (int k = 0; k < width; ++k) sum += all[angle * width + k] / width;
    return sum;
  };
  for (int a = 0; (a + 1) * width <= p.normal_pa_size(); ++a) {
    s.add_normal_pa(mean(p.normal_pa(), a));
    s.add_shear_tangential_pa(mean(p.shear_tangential_pa(), a));
  }
  return s;
}

/// To 7 digits: far below the noise of any run.
double Rounded(double x) {
  if (x == 0 || !std::isfinite(x)) return x;
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", x);
  return std::strtod(text, nullptr);
}
void Round(google::protobuf::RepeatedField<double>* values) {
  for (double& v : *values) v = Rounded(v);
}

}  // namespace

v1alpha1::RunSummary SummariseRun(const std::string& path, v1alpha1::RunRole role) {
  const v1alpha1::RunRecord record = records::ReadRunFile(path).record;
  v1alpha1::RunSummary s;
  s.set_run_id(record.run_id());
  s.set_file(std::filesystem::path(path).filename().string());
  s.set_sha256(records::Sha256OfFile(path));
  s.set_role(role);
  s.set_status(record.status());
  s.set_slip(record.slip());
  s.set_attack_angle_rad(record.attack_angle_rad());
  s.set_load_n(record.spec().state().load_n());
  s.set_speed_m_per_s(std::max(std::fabs(record.rim_speed_m_per_s()),
                               std::hypot(record.v_x_m_per_s(), record.v_y_m_per_s())));
  s.set_seed(record.spec().seed());
  s.set_travel_m(record.travel_m());
  s.set_reason(record.reason());
  s.set_wall_s(record.numerics().wall_s());
  s.set_grains(record.bed().grains());
  if (record.bed().surface_m() != 0) s.set_surface_m(record.bed().surface_m());
  if (record.has_stress()) *s.mutable_stress() = SummariseStress(record.stress());
  for (int o = 0; o < kOutputs; ++o) {
    double mean = kNaN, error = kNaN, drift = 0;
    for (const v1alpha1::OutputMean& output : record.outputs()) {
      if (output.name() != kOutputFields[o].name) continue;
      mean = output.mean();
      error = output.standard_error();
      drift = output.drift();
    }
    s.add_mean(mean);
    s.add_standard_error(error);
    if (!record.means_of_no_state()) s.add_drift(drift);
  }
  return s;
}

TrainingSet ReadCampaign(const std::string& directory) {
  namespace fs = std::filesystem;
  const auto campaign = ReadJson<v1alpha1::Campaign>(
      (fs::path(directory) / "campaign.json").string(), "a campaign (a folder with campaign.json)");
  TrainingSet set;
  set.name = campaign.name();
  set.scene = campaign.scene();
  for (const v1alpha1::PlannedRun& planned : campaign.runs()) {
    const fs::path runs = fs::path(directory) / "runs";
    const fs::path file = runs / (planned.run_id() + ".run.h5");
    if (!fs::exists(file)) {
      set.notes.push_back((runs / planned.run_id()).string() + kNotThere);
      continue;
    }
    const v1alpha1::RunRole role = planned.role() == v1alpha1::RUN_ROLE_UNSPECIFIED
                                       ? v1alpha1::RUN_ROLE_TRAIN
                                       : planned.role();
    set.runs.push_back(SummariseRun(file.string(), role));
  }
  return set;
}

TrainingSet ReadRuns(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) return ReadCampaign(path);
  const auto summary = ReadJson<v1alpha1::CampaignSummary>(path, "a campaign's summary");
  if (summary.runs().empty()) Fail(path, "no run, expected a campaign's summary");
  TrainingSet set;
  set.name = summary.name();
  set.scene = summary.scene();
  set.runs.assign(summary.runs().begin(), summary.runs().end());
  set.notes.assign(summary.notes().begin(), summary.notes().end());
  return set;
}

void WriteSummary(const std::string& path, const TrainingSet& set) {
  v1alpha1::CampaignSummary summary;
  summary.set_name(set.name);
  *summary.mutable_scene() = set.scene;
  for (v1alpha1::RunSummary run : set.runs) {
    run.set_wall_s(Rounded(run.wall_s()));
    for (auto* values : {run.mutable_mean(), run.mutable_standard_error(), run.mutable_drift()}) {
      Round(values);
    }
    if (run.has_stress()) {
      Round(run.mutable_stress()->mutable_normal_pa());
      Round(run.mutable_stress()->mutable_shear_tangential_pa());
    }
    *summary.add_runs() = run;
  }
  for (const std::string& note : set.notes) {
    // Not the folder it lay in.
    summary.add_notes(std::filesystem::path(note).filename().string());
  }
  std::string text;
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  google::protobuf::util::JsonPrintOptions lines = options;
  lines.add_whitespace = true;
  // A line a run: small, and a change shows where it is.
  v1alpha1::CampaignSummary head = summary;
  head.clear_runs();
  if (!google::protobuf::util::MessageToJsonString(head, &text, lines).ok()) {
    Fail(path, "the summary cannot be written as JSON");
  }
  text.erase(text.rfind('}'));
  text.erase(text.find_last_not_of("\n ,") + 1);
  text += ",\n \"runs\": [";
  const char* separator = "\n";
  for (const v1alpha1::RunSummary& run : summary.runs()) {
    std::string row;
    if (!google::protobuf::util::MessageToJsonString(run, &row, options).ok()) {
      Fail(path, "run " + run.run_id() + " cannot be written as JSON");
    }
    text += separator + row;
    separator = ",\n";
  }
  records::WriteFileDurably(path, text + "\n]}\n");
}

void Merge(const TrainingSet& more, TrainingSet* set) {
  const auto require = [](bool same, const std::string& what) {
    if (!same) Fail("campaigns", what + " differ: one model is of one wheel on one soil");
  };
  const v1alpha1::Scene &a = set->scene, &b = more.scene;
  require(a.wheel().radius_m() == b.wheel().radius_m(), "scene.wheel.radius_m");
  require(a.wheel().width_m() == b.wheel().width_m(), "scene.wheel.width_m");
  require(a.soil().SerializeAsString() == b.soil().SerializeAsString(), "scene.soil");
  for (const v1alpha1::RunSummary& run : more.runs) {
    const bool known = std::any_of(set->runs.begin(), set->runs.end(),
                                   [&](const auto& r) { return r.run_id() == run.run_id(); });
    if (!known) set->runs.push_back(run);
  }
  set->notes.insert(set->notes.end(), more.notes.begin(), more.notes.end());
  std::erase_if(set->notes, [&](const std::string& note) {
    return std::any_of(set->runs.begin(), set->runs.end(),
                       [&](const auto& run) { return note.ends_with(run.run_id() + kNotThere); });
  });
  CountFromOnePlane(set);
}

void CountFromOnePlane(TrainingSet* set) {
  const auto cut = [](const v1alpha1::RunSummary& run) { return !run.has_surface_m(); };
  const auto changed = static_cast<std::ptrdiff_t>(set->runs.size()) -
                       std::count_if(set->runs.begin(), set->runs.end(), cut);
  if (changed == 0 || changed == static_cast<std::ptrdiff_t>(set->runs.size())) return;
  for (v1alpha1::RunSummary& run : set->runs) {
    if (cut(run)) continue;
    if (run.mean_size() == kOutputs) {
      run.set_mean(kSinkage, run.mean(kSinkage) - run.surface_m());
    }
    run.clear_surface_m();
  }
  set->notes.push_back(std::to_string(changed) +
                       " runs of engine 6 or later: sinkage counted from the cut plane, as in the "
                       "other runs");
}

Sample MakeSample(const v1alpha1::RunSummary& s) {
  if (const std::string damage = DamageOf(s); !damage.empty()) Fail("run " + s.run_id(), damage);
  Sample row{};
  row.slip = s.slip();
  row.attack_angle_rad = s.attack_angle_rad();
  row.load_n = s.load_n();
  row.motion = MotionOf(s, 1);
  row.steady = s.status() == v1alpha1::RUN_STATUS_STEADY;
  row.source = &s;
  std::ranges::copy(s.mean(), row.mean.begin());
  std::ranges::copy(s.standard_error(), row.standard_error.begin());
  return row;
}

namespace {

template <class Runs>
std::vector<Sample> UsableOf(const Runs& runs, v1alpha1::RunRole role) {
  std::vector<Sample> rows;
  for (const v1alpha1::RunSummary& run : runs) {
    if (HasUsableMeans(run) && RoleOf(run) == role) rows.push_back(MakeSample(run));
  }
  return rows;
}

}  // namespace

std::vector<Sample> SamplesOf(const std::vector<v1alpha1::RunSummary>& runs,
                              v1alpha1::RunRole role) {
  return UsableOf(runs, role);
}

std::vector<Sample> SamplesOf(const v1alpha1::Model& model, v1alpha1::RunRole role) {
  return UsableOf(model.provenance().runs(), role);
}

std::vector<Sample> ReplicateSamples(const std::vector<v1alpha1::RunSummary>& runs) {
  std::vector<Sample> rows = SamplesOf(runs, v1alpha1::RUN_ROLE_PATCH);
  std::set<StateKey> states;
  for (const Sample& row : rows) states.insert(KeyOf(row));
  for (const Sample& row : SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN)) {
    if (states.contains(KeyOf(row))) rows.push_back(row);
  }
  return rows;
}

StateKey KeyOf(const Sample& row) {
  return {std::lround(row.slip * 1e3), std::lround(row.attack_angle_rad * 1e3),
          std::lround(row.load_n * 1e3), std::lround(row.source->speed_m_per_s() * 1e3)};
}

}  // namespace grouser::surrogate

#include "surrogate/fit/training_set.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "proto/records/run_file.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void Fail(const std::string& where, const std::string& what) {
  throw std::invalid_argument(where + ": " + what);
}

v1alpha1::Campaign ReadCampaignFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) Fail(path, "cannot be read, expected a campaign folder with campaign.json");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  v1alpha1::Campaign campaign;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &campaign, options);
  if (!status.ok()) Fail(path, "not the JSON of a campaign: " + status.ToString());
  return campaign;
}

}  // namespace

double OutputScale(int output, double load_n, double radius_m) {
  if (output == kSinkage) return radius_m;
  return output == kTorque || output == kMz ? load_n * radius_m : load_n;
}

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
  for (int o = 0; o < kOutputs; ++o) {
    double mean = kNaN, error = kNaN;
    for (const v1alpha1::OutputMean& output : record.outputs()) {
      if (output.name() != kOutputNames[o]) continue;
      mean = output.mean();
      error = output.standard_error();
    }
    s.add_mean(mean);
    s.add_standard_error(error);
  }
  return s;
}

TrainingSet ReadCampaign(const std::string& directory) {
  namespace fs = std::filesystem;
  const v1alpha1::Campaign campaign =
      ReadCampaignFile((fs::path(directory) / "campaign.json").string());
  TrainingSet set;
  set.scene = campaign.scene();
  for (const v1alpha1::PlannedRun& planned : campaign.runs()) {
    const fs::path file = fs::path(directory) / "runs" / (planned.run_id() + ".run.h5");
    if (!fs::exists(file)) {
      set.notes.push_back(file.string() + ": planned, not there");
      continue;
    }
    const v1alpha1::RunRole role = planned.role() == v1alpha1::RUN_ROLE_UNSPECIFIED
                                       ? v1alpha1::RUN_ROLE_TRAIN
                                       : planned.role();
    set.runs.push_back(SummariseRun(file.string(), role));
  }
  return set;
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
    const bool known = std::any_of(set->runs.begin(), set->runs.end(), [&](const auto& r) {
      return r.run_id() == run.run_id();
    });
    if (!known) set->runs.push_back(run);
  }
  set->notes.insert(set->notes.end(), more.notes.begin(), more.notes.end());
}

Row MakeRow(const v1alpha1::RunSummary& s) {
  const std::string where = "run " + s.run_id();
  if (s.mean_size() != kOutputs || s.standard_error_size() != kOutputs) {
    Fail(where, "expected six means and six standard errors");
  }
  Row row{};
  row.slip = s.slip();
  row.attack_angle_rad = s.attack_angle_rad();
  row.load_n = s.load_n();
  row.motion = FromSlip(s.slip(), s.attack_angle_rad(),
                        s.speed_m_per_s() > 0 ? s.speed_m_per_s() : 1.0);
  row.source = &s;
  if (!std::isfinite(row.motion.v_x)) Fail(where, "slip and attack angle that no motion has");
  if (!(row.load_n > 0)) Fail(where, "load_n: expected a positive load");
  for (int o = 0; o < kOutputs; ++o) {
    row.mean[o] = s.mean(o);
    row.standard_error[o] = s.standard_error(o);
    if (!std::isfinite(row.mean[o]) || !(row.standard_error[o] >= 0)) {
      Fail(where, std::string(kOutputNames[o]) + ": expected a finite mean and standard error");
    }
  }
  return row;
}

std::vector<Row> SteadyRows(const std::vector<v1alpha1::RunSummary>& runs,
                            v1alpha1::RunRole role) {
  std::vector<Row> rows;
  for (const v1alpha1::RunSummary& run : runs) {
    const bool train = run.role() == v1alpha1::RUN_ROLE_UNSPECIFIED;
    const v1alpha1::RunRole its = train ? v1alpha1::RUN_ROLE_TRAIN : run.role();
    if (run.status() == v1alpha1::RUN_STATUS_STEADY && its == role) rows.push_back(MakeRow(run));
  }
  return rows;
}

}  // namespace grouser::surrogate

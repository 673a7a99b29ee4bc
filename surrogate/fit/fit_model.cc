#include "surrogate/fit/fit_model.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "proto/records/run_file.h"
#include "surrogate/fit/calibration.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/form_fit.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/fit/stress_profile.h"
#include "surrogate/fit/trained.h"
#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {
namespace {

// Runs say nothing about more than twice their speed: Froude goes with v^2.
constexpr double kFroudeReserve = 4;
// With a speed axis they say nothing of more than a tenth beyond.
constexpr double kFroudeReserveOfAxis = 1.1 * 1.1;
// Forces go nearly with the load: a campaign at one load answers a little
// beside it. The hull distance grows there all the same.
constexpr double kLoadReserve = 1.1;

std::string StatusCounts(const std::vector<v1alpha1::RunSummary>& runs) {
  int steady = 0, other_role = 0, not_steady = 0;
  for (const v1alpha1::RunSummary& run : runs) {
    if (run.status() != v1alpha1::RUN_STATUS_STEADY) {
      ++not_steady;
    } else if (run.role() == v1alpha1::RUN_ROLE_TEST || run.role() == v1alpha1::RUN_ROLE_PATCH) {
      ++other_role;
    } else {
      ++steady;
    }
  }
  return std::to_string(steady) + " steady training runs, at least " + std::to_string(kFewestRuns) +
         " needed (besides: " + std::to_string(other_role) + " steady runs held out or repeats, " +
         std::to_string(not_steady) + " not steady)";
}

v1alpha1::Domain MakeDomain(const std::vector<Sample>& rows, const FitRequest& request,
                            bool speed_axis) {
  v1alpha1::Domain d;
  std::vector<double> speeds;
  const double inf = std::numeric_limits<double>::infinity();
  double slip_min = inf, slip_max = -inf, angle = 0, load_min = inf, load_max = 0;
  for (const Sample& row : rows) {
    const Canonical c = row.state();
    const SlipState s = ToSlip(c.forward, c.lateral, c.rim);
    slip_min = std::min(slip_min, s.slip);
    slip_max = std::max(slip_max, s.slip);
    angle = std::max(angle, s.attack_angle_rad);
    load_min = std::min(load_min, row.load_n);
    load_max = std::max(load_max, row.load_n);
    speeds.push_back(row.source->speed_m_per_s());
  }
  std::sort(speeds.begin(), speeds.end());
  d.set_slip_min(slip_min);
  d.set_slip_max(slip_max);
  d.set_attack_angle_max_rad(angle);
  d.set_load_min_n(load_min / kLoadReserve);
  d.set_load_max_n(load_max * kLoadReserve);
  d.set_speed_m_per_s(speeds[speeds.size() / 2]);
  const v1alpha1::Scene& scene = request.set.scene;
  const double reserve = speed_axis ? kFroudeReserveOfAxis : kFroudeReserve;
  d.set_froude_max(reserve * speeds.back() * speeds.back() /
                   (scene.soil().gravity_m_per_s2() * scene.wheel().radius_m()));
  double overload = 0;
  for (const v1alpha1::RunSummary& run : request.set.runs) {
    if (run.status() != v1alpha1::RUN_STATUS_OVERLOAD) continue;
    overload = overload == 0 ? run.load_n() : std::min(overload, run.load_n());
  }
  d.set_load_overload_n(overload);
  return d;
}

void SetUncertainty(const Calibration& calibration, const BedVariability& patch, double radius,
                    v1alpha1::Model* model) {
  const double middle = std::sqrt(model->domain().load_min_n() * model->domain().load_max_n());
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = OutputScale(o, middle, radius);
    model->add_sd_fit_inside(calibration.inside[o] * scale);
    model->add_sd_fit_growth(calibration.growth[o] * scale);
    model->add_sd_patch(patch.sd[o] * scale);
    model->add_sd_bulldozing(patch.bulldozing[o]);
    model->add_interval_factor(calibration.factor[o]);
  }
  model->set_interval_level(calibration.level);
}

// Predictions of the runs left out, with the interval the model would give.
std::vector<Comparison> AsComparisons(const std::vector<LeftOut>& left_out,
                                      const Calibration& calibration, const BedVariability& patch,
                                      double radius) {
  std::vector<Comparison> result;
  for (const LeftOut& l : left_out) {
    Comparison c{l.row, l.prediction.value, {}};
    for (int o = 0; o < kOutputs; ++o) {
      c.half_width[o] = HalfWidth(calibration, patch, o, l, radius);
    }
    result.push_back(c);
  }
  return result;
}

// The rows "leave_one_out" of all regions once more, with that coverage.
void AddCrossConformal(const std::vector<LeftOut>& left_out, const BedVariability& patch,
                       double radius, v1alpha1::Model* model) {
  const auto covered = CrossConformalCoverage(left_out, patch, radius);
  const std::vector<v1alpha1::ErrorRow> rows(model->errors().begin(), model->errors().end());
  for (v1alpha1::ErrorRow row : rows) {
    if (row.region() != v1alpha1::REGION_ALL) continue;
    for (int o = 0; o < kOutputs; ++o) {
      if (row.output() == kOutputFields[o].name) row.set_covered90(covered[o]);
    }
    row.set_set("cross_conformal");
    *model->add_errors() = row;
  }
}

double MedianTravel(const std::vector<Sample>& rows) {
  std::vector<double> travel;
  for (const Sample& row : rows) travel.push_back(row.source->travel_m());
  std::sort(travel.begin(), travel.end());
  return travel[travel.size() / 2];
}

void CheckScene(const v1alpha1::Scene& scene) {
  // Wide: what lies outside is in another unit.
  const auto within = [](double value, const char* field, double low, double high) {
    if (value >= low && value <= high) return;
    throw std::runtime_error(
        fmt::format("{}: {:g}, expected {:g} to {:g}", field, value, low, high));
  };
  within(scene.wheel().radius_m(), "scene.wheel.radius_m", 0.005, 5);
  within(scene.wheel().width_m(), "scene.wheel.width_m", 0.002, 5);
  within(scene.soil().gravity_m_per_s2(), "scene.soil.gravity_m_per_s2", 0.05, 50);
  within(scene.soil().bulk_density_kg_per_m3(), "scene.soil.bulk_density_kg_per_m3", 30, 4000);
}

void FillHead(const FitRequest& request, const std::vector<Sample>& rows, bool speed_axis,
              v1alpha1::Model* model) {
  const v1alpha1::Scene& scene = request.set.scene;
  model->set_name(request.name);
  model->set_kind(request.kind == v1alpha1::MODEL_KIND_UNSPECIFIED ? v1alpha1::MODEL_KIND_HYBRID
                                                                   : request.kind);
  *model->mutable_soil() = scene.soil();
  *model->mutable_wheel() = scene.wheel();
  *model->mutable_rig() = scene.rig();
  *model->mutable_domain() = MakeDomain(rows, request, speed_axis);
  model->set_averaging_length_m(MedianTravel(rows));
  v1alpha1::Provenance* p = model->mutable_provenance();
  p->mutable_runs()->Add(request.set.runs.begin(), request.set.runs.end());
  p->set_base_digest(request.base_digest);
  p->set_command(request.command);
  p->set_reason(request.reason);
  p->set_grouser_version(GROUSER_VERSION);
  *model->mutable_create_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  model->mutable_measured()->Add(request.measured.begin(), request.measured.end());
}

TrainOptions OptionsOf(const FitRequest& request, const std::vector<Sample>& training,
                       const BedVariability& patch) {
  const v1alpha1::Scene& scene = request.set.scene;
  const double radius = scene.wheel().radius_m(), gravity = scene.soil().gravity_m_per_s2();
  TrainOptions options;
  options.wheel = {radius, scene.wheel().width_m()};
  options.with_residual = request.kind != v1alpha1::MODEL_KIND_BEKKER;
  options.with_physics = request.kind != v1alpha1::MODEL_KIND_LOOKUP;
  options.physics.unit_weight = scene.soil().bulk_density_kg_per_m3() * gravity;
  options.physics.patch = patch.sd;
  options.physics.profile_weight = request.profile_weight.value_or(ProfileWeightOf(request.kind));
  options.physics.smear_rad = GrainAngle(scene);
  options.gravity_m_per_s2 = gravity;
  if (options.with_residual) options.speed = SpeedAxisOf(training, radius, gravity);
  return options;
}

struct Fitted {
  Trained trained;
  std::vector<LeftOut> left_out;
};

/// Of fields on physics and fields of the whole answer that which predicts the runs left out
/// better; of kinds without the one or the other what they are.
Fitted FitBest(const std::vector<Sample>& training, const TrainOptions& options,
               const ProgressText& progress) {
  const auto fit = [&](const TrainOptions& form, const char* of) {
    progress(fmt::format("fit of {} runs{}", training.size(), of));
    Trained trained = Train(training, form, nullptr);
    std::vector<LeftOut> left_out = CrossValidate(training, form, trained, progress);
    return Fitted{std::move(trained), std::move(left_out)};
  };
  if (!options.with_physics || !options.with_residual) return fit(options, "");
  Fitted on_physics = fit(options, ", fields of what physics leaves");
  TrainOptions form = options;
  form.whole = true;
  Fitted whole = fit(form, ", fields of the whole answer");
  const double radius = options.wheel.radius_m;
  const double gain =
      LeftOutError(on_physics.left_out, radius) - LeftOutError(whole.left_out, radius);
  progress(fmt::format("errors of runs left out, whole over on physics: {:.3g}",
                       std::exp(-gain / static_cast<double>(std::size(kPredicted)))));
  return gain > 0 ? std::move(whole) : std::move(on_physics);
}

}  // namespace

double ProfileWeightOf(v1alpha1::ModelKind kind) {
  return kind == v1alpha1::MODEL_KIND_BEKKER ? kProfileWeight : 0;
}

v1alpha1::Model FitModel(const FitRequest& request) {
  if (request.name.empty()) throw std::runtime_error("model name: expected one");
  CheckScene(request.set.scene);
  CheckRuns(request.set);
  const std::vector<Sample> training = SamplesOf(request.set.runs, v1alpha1::RUN_ROLE_TRAIN);
  const std::vector<Sample> held_out = SamplesOf(request.set.runs, v1alpha1::RUN_ROLE_TEST);
  const std::vector<Sample> repeats = ReplicateSamples(request.set.runs);
  if (static_cast<int>(training.size()) < kFewestRuns) {
    throw std::runtime_error("cannot fit: " + StatusCounts(request.set.runs));
  }
  const v1alpha1::Scene& scene = request.set.scene;
  const double radius = scene.wheel().radius_m();
  const BedVariability alike = EstimateBedVariability(repeats, training, radius);

  const TrainOptions options = OptionsOf(request, training, alike);
  const auto [trained, left_out] = FitBest(training, options, request.progress);
  const BedVariability patch = EstimateBedVariability(repeats, training, radius,
                                                      EstimateBulldozing(left_out, alike, radius));
  const Calibration calibration = Calibrate(left_out, patch, radius);

  v1alpha1::Model model;
  FillHead(request, training, options.speed.present(), &model);
  if (trained.with_physics) SetBekker(trained.physics, &model);
  const Table table = Tabulate(trained, model.domain().load_min_n(), model.domain().load_max_n());
  SetResidual(table.axes, table.coefficients, &model);
  if (trained.speed.present()) SetSpeed(trained.speed, table.rates, &model);
  SetUncertainty(calibration, patch, radius, &model);
  const std::unique_ptr<TabulatedModel> made = MakeScalar(model);
  SetFormError(*made, &model);
  for (const v1alpha1::ErrorRow& row :
       ErrorTable(AsComparisons(left_out, calibration, patch, radius), "leave_one_out")) {
    *model.add_errors() = row;
  }
  AddCrossConformal(left_out, patch, radius, &model);
  for (const v1alpha1::ErrorRow& row : ErrorTable(CompareRows(*made, held_out), "held_out")) {
    *model.add_errors() = row;
  }
  SetGoldenVectors(&model);
  return model;
}

namespace {

// What another refit of the base was fitted to and `set` lacks.
void AddRunsOf(const v1alpha1::Model& other, const v1alpha1::Model& base, TrainingSet* set) {
  if (other.name() != base.name() || other.wheel().radius_m() != base.wheel().radius_m() ||
      other.wheel().width_m() != base.wheel().width_m()) {
    throw std::runtime_error("--with: model '" + other.name() + "', expected a refit of '" +
                             base.name() + "' with its wheel");
  }
  for (const v1alpha1::RunSummary& run : other.provenance().runs()) {
    const bool known = std::ranges::any_of(
        set->runs, [&](const v1alpha1::RunSummary& one) { return one.run_id() == run.run_id(); });
    if (!known && RoleOf(run) == v1alpha1::RUN_ROLE_TRAIN) set->runs.push_back(run);
  }
}

}  // namespace

FitRequest RefitRequest(const v1alpha1::Model& base, const std::string& base_digest,
                        const std::string& run_file, const std::vector<v1alpha1::Model>& with) {
  const v1alpha1::RunRecord record = records::ReadRunFile(run_file).record;
  const auto refuse = [&](const std::string& what) {
    throw std::runtime_error(run_file + ": " + what);
  };
  if (record.status() != v1alpha1::RUN_STATUS_STEADY) {
    refuse("the run is " + v1alpha1::RunStatus_Name(record.status()) +
           ", expected a steady one: " + record.reason());
  }
  const v1alpha1::Wheel& wheel = record.spec().wheel();
  if (wheel.radius_m() != base.wheel().radius_m() || wheel.width_m() != base.wheel().width_m()) {
    refuse("another wheel than the base model's " + base.wheel().name());
  }
  FitRequest request;
  request.name = base.name();
  request.kind = base.kind();
  request.base_digest = base_digest;
  request.set.scene.set_name(base.name());
  *request.set.scene.mutable_soil() = base.soil();
  *request.set.scene.mutable_wheel() = base.wheel();
  *request.set.scene.mutable_rig() = base.rig();
  request.measured.assign(base.measured().begin(), base.measured().end());
  const v1alpha1::RunSummary added = SummariseRun(run_file, v1alpha1::RUN_ROLE_TRAIN);
  for (const v1alpha1::RunSummary& run : base.provenance().runs()) {
    if (run.sha256() == added.sha256()) refuse("the base model was fitted to this run already");
    if (run.run_id() == added.run_id() && run.role() == v1alpha1::RUN_ROLE_TEST) {
      refuse("run " + run.run_id() + " is held out: it must not train the model");
    }
    if (run.run_id() != added.run_id()) request.set.runs.push_back(run);
  }
  request.set.runs.push_back(added);
  for (const v1alpha1::Model& other : with) AddRunsOf(other, base, &request.set);
  CountFromOnePlane(&request.set);
  return request;
}

}  // namespace grouser::surrogate

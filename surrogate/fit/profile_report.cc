#include "surrogate/fit/profile_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "surrogate/fit/calibration.h"
#include "surrogate/fit/json.h"

namespace grouser::surrogate {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kGroups = 10;
constexpr std::array kJudged = {kFx, kFy, kTorque, kMz, kSinkage};

Canonical StateOf(const Row& row) {
  return ToCanonical(row.motion.v_x, row.motion.v_y, row.motion.rim_speed);
}

// Fitted to all rows but those of `group`; -1: to all.
struct Fitter {
  std::vector<Row> rows;
  std::vector<int> group;  // of each row; all seeds of a state are in one
  WheelGeometry wheel;
  BekkerFitOptions options;

  BekkerParameters Without(int left_out, const BekkerParameters* from) const {
    std::vector<Row> kept;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (group[i] != left_out) kept.push_back(rows[i]);
    }
    return FitBekker(kept, wheel, options, from).parameters;
  }
};

std::vector<int> GroupsOf(const std::vector<Row>& rows) {
  std::map<StateKey, int> of_state;
  std::vector<int> groups;
  for (const Row& row : rows) {
    const auto [at, added] = of_state.emplace(KeyOf(row), static_cast<int>(of_state.size()));
    groups.push_back(at->second % kGroups);
  }
  return groups;
}

// Sums first; Finish makes means of them.
struct ErrorSums {
  PhysicsErrors errors;
  ProfileMisfit size{0, 0};

  void Add(const std::vector<Row>& rows, const BekkerModel& model, double smear) {
    for (const Row& row : rows) {
      const auto value =
          model.Solve(row.motion.v_x, row.motion.v_y, row.motion.rim_speed, row.load_n).value;
      for (const Output o : kJudged) {
        const double error =
            (value[o] - row.mean[o]) / OutputScale(o, row.load_n, model.wheel().radius_m);
        errors.rmse[o] += error * error;
      }
      ++errors.runs;
    }
    const std::vector<ProfileRow> profiles = CompareProfiles(rows, model, smear);
    const int used = static_cast<int>(
        std::count_if(profiles.begin(), profiles.end(), [](const auto& p) { return p.used; }));
    if (used == 0) return;
    const ProfileMisfit misfit = PooledMisfit(profiles);
    errors.misfit.normal += used * misfit.normal * misfit.normal;
    errors.misfit.tangential += used * misfit.tangential * misfit.tangential;
    errors.profiles += used;
  }

  PhysicsErrors Finish() const {
    PhysicsErrors e = errors;
    for (double& rmse : e.rmse) rmse = std::sqrt(rmse / std::max(1, e.runs));
    e.misfit.normal = std::sqrt(e.misfit.normal / std::max(1, e.profiles));
    e.misfit.tangential = std::sqrt(e.misfit.tangential / std::max(1, e.profiles));
    return e;
  }
};

WeightTrial Try(double weight, Fitter fitter, const std::vector<Row>& test) {
  using Clock = std::chrono::steady_clock;
  fitter.options.profile_weight = weight;
  WeightTrial trial{};
  trial.weight = weight;
  const auto start = Clock::now();
  trial.parameters = fitter.Without(-1, nullptr);
  trial.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const double smear = fitter.options.smear_rad;
  std::vector<BekkerParameters> without;
  ErrorSums left_out, held;
  for (int g = 0; g < kGroups; ++g) {
    without.push_back(fitter.Without(g, &trial.parameters));
    std::vector<Row> rows;
    for (std::size_t i = 0; i < fitter.rows.size(); ++i) {
      if (fitter.group[i] == g) rows.push_back(fitter.rows[i]);
    }
    left_out.Add(rows, BekkerModel(without.back(), fitter.wheel), smear);
  }
  held.Add(test, BekkerModel(trial.parameters, fitter.wheel), smear);
  trial.left_out = left_out.Finish();
  trial.test = held.Finish();
  for (const BekkerField& field : BekkerFields()) {
    double mean = 0, sum = 0;
    for (const BekkerParameters& p : without) mean += p.*field.member / kGroups;
    for (const BekkerParameters& p : without) {
      sum += (p.*field.member - mean) * (p.*field.member - mean);
    }
    trial.spread.*field.member = std::sqrt(sum * (kGroups - 1) / kGroups);
  }
  return trial;
}

double NoiseRatio(const PhysicsErrors& errors, const std::array<double, kOutputs>& patch, int o) {
  return errors.rmse[o] / patch[o];
}

void AddErrors(const PhysicsErrors& errors, const std::array<double, kOutputs>& patch, Json* json) {
  json->Open('{').Key("runs").Value(errors.runs).Key("profiles").Value(errors.profiles);
  for (const Output o : kJudged) {
    json->Key(std::string(kOutputNames[o]) + "_over_noise").Value(NoiseRatio(errors, patch, o));
  }
  json->Key("normal").Value(errors.misfit.normal);
  json->Key("tangential").Value(errors.misfit.tangential).Close('}');
}

void AddArray(const char* name, const std::vector<double>& values, double unit, Json* json) {
  json->Key(name).Open('[');
  for (const double v : values) json->Value(v * unit);
  json->Close(']');
}

}  // namespace

std::vector<ProfileRow> CompareProfiles(const std::vector<Row>& rows, const BekkerModel& model,
                                        double smear_rad) {
  std::vector<ProfileRow> result;
  for (const Row& row : rows) {
    if (!HasProfile(*row.source)) continue;
    ProfileRow p{&row, MakeCompared(row, model.wheel()), {}, 0, false, {}};
    p.sinkage = model.SolveCanonical(StateOf(row), row.load_n).value[kSinkage];
    p.model = ModelProfile(model, StateOf(row), p.sinkage, p.compared.measured, smear_rad);
    p.used = IsComparable(p.compared);
    if (p.used) p.misfit = MisfitOf(p.model, p.compared.measured);
    result.push_back(std::move(p));
  }
  return result;
}

ProfileMisfit PooledMisfit(const std::vector<ProfileRow>& rows) {
  ProfileMisfit sum{0, 0};
  int used = 0;
  for (const ProfileRow& row : rows) {
    if (!row.used) continue;
    sum.normal += row.misfit.normal * row.misfit.normal;
    sum.tangential += row.misfit.tangential * row.misfit.tangential;
    ++used;
  }
  return {std::sqrt(sum.normal / std::max(1, used)), std::sqrt(sum.tangential / std::max(1, used))};
}

std::vector<WeightTrial> TryWeights(const TrainingSet& set, const std::vector<double>& weights) {
  Fitter fitter;
  fitter.rows = RowsOf(set.runs, v1alpha1::RUN_ROLE_TRAIN);
  if (fitter.rows.size() < 2 * kGroups) {
    throw std::invalid_argument(set.name + ": " + std::to_string(fitter.rows.size()) +
                                " training runs, expected at least " + std::to_string(2 * kGroups));
  }
  fitter.group = GroupsOf(fitter.rows);
  fitter.wheel = {set.scene.wheel().radius_m(), set.scene.wheel().width_m()};
  fitter.options.unit_weight =
      set.scene.soil().bulk_density_kg_per_m3() * set.scene.soil().gravity_m_per_s2();
  fitter.options.patch = PatchOf(set);
  fitter.options.smear_rad = GrainAngle(set.scene);
  std::vector<WeightTrial> trials;
  const std::vector<Row> test = RowsOf(set.runs, v1alpha1::RUN_ROLE_TEST);
  for (const double weight : weights) trials.push_back(Try(weight, fitter, test));
  return trials;
}

std::array<double, kOutputs> PatchOf(const TrainingSet& set) {
  return EstimatePatch(PatchRows(set.runs), RowsOf(set.runs, v1alpha1::RUN_ROLE_TRAIN),
                       set.scene.wheel().radius_m())
      .sd;
}

std::string ProfilesText(const std::vector<ProfileRow>& rows) {
  std::string text = fmt::format("{:<18}{:>7}{:>8}{:>8}{:>8}{:>9}{:>9}\n", "run", "slip", "angle",
                                 "load", "share", "normal", "shear");
  for (const ProfileRow& p : rows) {
    text +=
        fmt::format("{:<18}{:>7.2f}{:>8.1f}{:>8.1f}{:>8.2f}", p.row->source->run_id(), p.row->slip,
                    p.row->attack_angle_rad * kDegrees, p.row->load_n, p.compared.share);
    text += p.used ? fmt::format("{:>9.2f}{:>9.2f}\n", p.misfit.normal, p.misfit.tangential)
                   : std::string("  not compared: the sides carry too much of the load\n");
  }
  const ProfileMisfit pooled = PooledMisfit(rows);
  return text + fmt::format("{:<49}{:>9.2f}{:>9.2f}\n",
                            "all (rms of model - DEM over rms of DEM, each run alike)",
                            pooled.normal, pooled.tangential);
}

std::string ProfilesJson(const std::vector<ProfileRow>& rows, const std::string& reference) {
  Json json;
  const ProfileMisfit pooled = PooledMisfit(rows);
  json.Open('{').Key("model").Value(reference);
  json.Key("normal").Value(pooled.normal).Key("tangential").Value(pooled.tangential);
  json.Key("runs").Open('[');
  for (const ProfileRow& p : rows) {
    json.Open('{').Key("run_id").Value(p.row->source->run_id()).Key("slip").Value(p.row->slip);
    json.Key("attack_angle_deg").Value(p.row->attack_angle_rad * kDegrees);
    json.Key("load_n").Value(p.row->load_n).Key("share").Value(p.compared.share);
    json.Key("used").Value(p.used).Key("sinkage_m").Value(p.sinkage);
    json.Key("measured_sinkage_m").Value(p.row->mean[kSinkage]);
    json.Key("normal").Value(p.misfit.normal).Key("tangential").Value(p.misfit.tangential);
    std::vector<double> angle;
    for (std::size_t i = 0; i < p.model.size(); ++i) angle.push_back(p.model.MiddleOf(i));
    AddArray("angle_deg", angle, kDegrees, &json);
    AddArray("measured_normal_pa", p.compared.measured.normal, 1, &json);
    AddArray("measured_tangential_pa", p.compared.measured.tangential, 1, &json);
    AddArray("model_normal_pa", p.model.normal, 1, &json);
    AddArray("model_tangential_pa", p.model.tangential, 1, &json);
    json.Close('}');
  }
  json.Close(']').Close('}');
  return json.text();
}

std::string WeightsText(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch) {
  std::string text =
      "rmse over the noise of one placement; profiles: rms of model - DEM over "
      "rms of DEM\n";
  text +=
      fmt::format("{:>7} {:<9}{:>5}{:>8}{:>8}{:>8}{:>8}{:>8}{:>9}{:>9}{:>9}\n", "weight", "runs",
                  "n", "f_x", "f_y", "torque", "m_z", "sinkage", "normal", "shear", "fit [s]");
  for (const WeightTrial& t : trials) {
    for (const bool test : {false, true}) {
      const PhysicsErrors& e = test ? t.test : t.left_out;
      if (e.runs == 0) continue;
      text += fmt::format("{:>7.3g} {:<9}{:>5}", t.weight, test ? "held out" : "left out", e.runs);
      for (const Output o : kJudged) text += fmt::format("{:>8.2f}", NoiseRatio(e, patch, o));
      text += fmt::format("{:>9.2f}{:>9.2f}", e.misfit.normal, e.misfit.tangential);
      text += test ? "\n" : fmt::format("{:>9.2f}\n", t.seconds);
    }
  }
  text += fmt::format("\n{:<20}", "weight");
  for (const WeightTrial& t : trials) text += fmt::format("{:>24.3g}", t.weight);
  for (const BekkerField& field : BekkerFields()) {
    const bool fitted = std::any_of(trials.begin(), trials.end(), [&](const WeightTrial& t) {
      return t.spread.*field.member > 1e-9 * std::fabs(t.parameters.*field.member);
    });
    if (!fitted) continue;
    text += fmt::format("\n{:<20}", field.name);
    for (const WeightTrial& t : trials) {
      text +=
          fmt::format("{:>12.4g} +- {:<8.2g}", t.parameters.*field.member, t.spread.*field.member);
    }
  }
  return text + "\n";
}

std::string WeightsJson(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch) {
  Json json;
  json.Open('[');
  for (const WeightTrial& t : trials) {
    json.Open('{').Key("weight").Value(t.weight).Key("seconds").Value(t.seconds);
    json.Key("left_out");
    AddErrors(t.left_out, patch, &json);
    json.Key("held_out");
    AddErrors(t.test, patch, &json);
    json.Key("parameters").Open('{');
    for (const BekkerField& field : BekkerFields()) {
      json.Key(field.name).Open('{').Key("value").Value(t.parameters.*field.member);
      json.Key("standard_error").Value(t.spread.*field.member).Close('}');
    }
    json.Close('}').Close('}');
  }
  json.Close(']');
  return json.text();
}

}  // namespace grouser::surrogate

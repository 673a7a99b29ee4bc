#include "surrogate/fit/profile_report.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <stdexcept>

#include "surrogate/fit/calibration.h"

namespace grouser::surrogate {
namespace {

constexpr int kGroups = 10;

// Fitted to all rows but those of `group`; -1: to all.
struct Fitter {
  std::vector<Sample> rows;
  std::vector<int> group;  // of each row; all seeds of a state are in one
  WheelGeometry wheel;
  BekkerFitOptions options;

  BekkerParameters Without(int left_out, const BekkerParameters* from) const {
    std::vector<Sample> kept;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (group[i] != left_out) kept.push_back(rows[i]);
    }
    return FitBekker(kept, wheel, options, from).parameters;
  }
};

std::vector<int> GroupsOf(const std::vector<Sample>& rows) {
  std::map<StateKey, int> of_state;
  std::vector<int> groups;
  for (const Sample& row : rows) {
    const auto [at, added] = of_state.emplace(KeyOf(row), static_cast<int>(of_state.size()));
    groups.push_back(at->second % kGroups);
  }
  return groups;
}

// Root mean square of misfits.
struct MisfitSum {
  double normal = 0, tangential = 0;
  int n = 0;

  void Add(double normal2, double tangential2) {
    normal += normal2;
    tangential += tangential2;
    ++n;
  }
  void Add(const std::vector<ProfileRow>& rows) {
    for (const ProfileRow& row : rows) {
      if (row.used) Add(std::pow(row.misfit.normal, 2), std::pow(row.misfit.tangential, 2));
    }
  }
  ProfileMisfit Rms() const {
    return {std::sqrt(normal / std::max(1, n)), std::sqrt(tangential / std::max(1, n))};
  }
};

// Sums first; Finish makes means of them.
struct ErrorSums {
  PhysicsErrors errors;
  MisfitSum misfit;

  void Add(const std::vector<Sample>& rows, const BekkerModel& model, double smear) {
    for (const Sample& row : rows) {
      const auto value =
          model.Solve(row.motion.v_x, row.motion.v_y, row.motion.rim_speed, row.load_n).value;
      for (const Output o : kPredicted) {
        const double error =
            (value[o] - row.mean[o]) / OutputScale(o, row.load_n, model.wheel().radius_m);
        errors.rmse[o] += error * error;
      }
      ++errors.runs;
    }
    misfit.Add(CompareProfiles(rows, model, smear));
  }

  PhysicsErrors Finish() const {
    PhysicsErrors e = errors;
    for (double& rmse : e.rmse) rmse = std::sqrt(rmse / std::max(1, e.runs));
    e.misfit = misfit.Rms();
    e.profiles = misfit.n;
    return e;
  }
};

WeightTrial Try(double weight, Fitter fitter, const std::vector<Sample>& test) {
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
    std::vector<Sample> rows;
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

// Sum over bins of the variance between profiles, over that of their mean squared.
double RelativeVariance(const std::vector<RimProfile>& profiles,
                        std::vector<double> RimProfile::*stress) {
  const auto n = static_cast<double>(profiles.size());
  double variance = 0, size = 0;
  for (std::size_t i = 0; i < profiles.front().size(); ++i) {
    double mean = 0;
    for (const RimProfile& p : profiles) mean += (p.*stress).at(i) / n;
    for (const RimProfile& p : profiles) {
      variance += ((p.*stress)[i] - mean) * ((p.*stress)[i] - mean) / (n - 1);
    }
    size += mean * mean;
  }
  return variance / size;
}

}  // namespace

std::vector<ProfileRow> CompareProfiles(const std::vector<Sample>& rows, const BekkerModel& model,
                                        double smear_rad) {
  std::vector<ProfileRow> result;
  for (const Sample& row : rows) {
    if (!HasProfile(*row.source)) continue;
    ProfileRow p{&row, MakeCompared(row, model.wheel()), {}, 0, false, {}};
    p.sinkage = model.SolveCanonical(row.state(), row.load_n).value[kSinkage];
    p.model = ModelProfile(model, row.state(), p.sinkage, p.compared.measured, smear_rad);
    p.used = IsComparable(p.compared);
    if (p.used) p.misfit = MisfitOf(p.model, p.compared.measured);
    result.push_back(std::move(p));
  }
  return result;
}

ProfileMisfit PooledMisfit(const std::vector<ProfileRow>& rows) {
  MisfitSum sum;
  sum.Add(rows);
  return sum.Rms();
}

ProfileMisfit RepeatMisfit(const std::vector<Sample>& repeats, const WheelGeometry& wheel) {
  std::map<StateKey, std::vector<RimProfile>> states;
  for (const Sample& row : repeats) {
    if (!HasProfile(*row.source)) continue;
    const ComparedProfile compared = MakeCompared(row, wheel);
    if (IsComparable(compared)) states[KeyOf(row)].push_back(compared.measured);
  }
  MisfitSum sum;
  for (const auto& [key, profiles] : states) {
    if (profiles.size() < 2) continue;
    sum.Add(RelativeVariance(profiles, &RimProfile::normal),
            RelativeVariance(profiles, &RimProfile::tangential));
  }
  return sum.Rms();
}

std::vector<WeightTrial> TryWeights(const TrainingSet& set, const std::vector<double>& weights) {
  Fitter fitter;
  fitter.rows = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TRAIN);
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
  const std::vector<Sample> test = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TEST);
  for (const double weight : weights) trials.push_back(Try(weight, fitter, test));
  return trials;
}

std::array<double, kOutputs> PatchOf(const TrainingSet& set) {
  return EstimateBedVariability(ReplicateSamples(set.runs),
                                SamplesOf(set.runs, v1alpha1::RUN_ROLE_TRAIN),
                                set.scene.wheel().radius_m())
      .sd;
}

}  // namespace grouser::surrogate

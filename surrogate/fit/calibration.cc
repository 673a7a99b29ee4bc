#include "surrogate/fit/calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "surrogate/models/hull.h"

namespace grouser::surrogate {
namespace {

constexpr double kWidening = 1.5;
constexpr double kPriorRepeats = 4;  // weight of the standard errors among repeats
constexpr std::size_t kLeaveOneOut = 24;
constexpr std::size_t kFolds = 12;
constexpr std::size_t kConformalFrom = 30;
constexpr double kMostBulldozing = 30;

// By which sds grow at a row.
double Growth(double bulldozing, const Sample& row) {
  const VelocityState& v = row.motion;
  const bool rest = v.v_x == 0 && v.v_y == 0 && v.rim_speed == 0;
  return rest ? 1 : 1 + bulldozing * Hull::Bulldozing(ToCanonical(v.v_x, v.v_y, v.rim_speed));
}

// What a residual is measured in, bulldozing included.
double ScaleAt(const BedVariability& patch, int o, const Sample& row, double radius_m) {
  return OutputScale(o, row.load_n, radius_m) * Growth(patch.bulldozing[o], row);
}

// Of a residual in sds of its interval: that at which a factor of 1 would end.
double Score(const Calibration& calibration, const BedVariability& patch, int o, const LeftOut& l,
             double radius_m) {
  return std::fabs(l.row->mean[o] - l.prediction.value[o]) * calibration.factor[o] /
         HalfWidth(calibration, patch, o, l, radius_m);
}

double ConformalQuantile(std::vector<double> scores, double level) {
  std::sort(scores.begin(), scores.end());
  const auto rank =
      static_cast<std::size_t>(std::ceil(level * static_cast<double>(scores.size() + 1)));
  return scores[std::min(rank, scores.size()) - 1];
}

}  // namespace

double StudentT95(int degrees) {
  // Cornish-Fisher expansion about the normal quantile (Abramowitz & Stegun
  // 26.7.5).
  const double z = kTwoSided90, v = degrees < 1 ? 1 : degrees;
  const double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * v) + (5 * z5 + 16 * z3 + 3 * z) / (96 * v * v) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * v * v * v);
}

BedVariability EstimateBedVariability(const std::vector<Sample>& patch_rows,
                                      const std::vector<Sample>& training, double radius_m,
                                      const std::array<double, kOutputs>& bulldozing) {
  std::map<StateKey, std::vector<const Sample*>> states;
  for (const Sample& row : patch_rows) states[KeyOf(row)].push_back(&row);
  BedVariability noise;
  noise.bulldozing = bulldozing;
  std::array<double, kOutputs> squares{};
  for (const auto& [key, repeats] : states) {
    if (repeats.size() < 2) continue;
    noise.repeats += static_cast<int>(repeats.size()) - 1;
    for (int o = 0; o < kOutputs; ++o) {
      double mean = 0;
      for (const Sample* row : repeats) mean += row->mean[o] / static_cast<double>(repeats.size());
      for (const Sample* row : repeats) {
        const double miss = (row->mean[o] - mean) / ScaleAt(noise, o, *row, radius_m);
        squares[o] += miss * miss;
      }
    }
  }
  for (int o = 0; o < kOutputs; ++o) {
    double widened2 = 0;
    for (const Sample& row : training) {
      const double error = row.standard_error[o] / ScaleAt(noise, o, row, radius_m);
      widened2 += kWidening * kWidening * error * error / static_cast<double>(training.size());
    }
    const double prior = training.empty() && noise.repeats > 0 ? 0 : kPriorRepeats;
    noise.sd[o] = std::sqrt((squares[o] + prior * widened2) / (noise.repeats + prior));
  }
  return noise;
}

std::vector<LeftOut> CrossValidate(const std::vector<Sample>& rows, const TrainOptions& options,
                                   const Trained& full,
                                   const std::function<void(const std::string&)>& progress) {
  std::map<StateKey, std::size_t> states;
  for (const Sample& row : rows) states.emplace(KeyOf(row), states.size());
  const std::size_t folds = states.size() <= kLeaveOneOut ? states.size() : kFolds;
  TrainOptions quick = options;
  quick.physics.max_iterations = 8;
  std::vector<LeftOut> result;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<Sample> kept;
    std::vector<const Sample*> left;
    for (const Sample& row : rows) {
      if (states.at(KeyOf(row)) % folds == fold) {
        left.push_back(&row);
      } else {
        kept.push_back(row);
      }
    }
    const Trained part = Train(kept, quick, &full);
    for (const Sample* row : left)
      result.push_back({row, Predict(part, options.wheel, *row), fold});
    progress("cross-validation " + std::to_string(fold + 1) + "/" + std::to_string(folds));
  }
  return result;
}

double LeftOutError(const std::vector<LeftOut>& left_out, double radius_m) {
  double sum = 0;
  for (const Output o : kPredicted) {
    double error = 0;
    for (const LeftOut& l : left_out) {
      error += std::fabs(l.row->mean[o] - l.prediction.value[o]) /
               OutputScale(o, l.row->load_n, radius_m) / static_cast<double>(left_out.size());
    }
    sum += std::log(std::max(error, 1e-12));
  }
  return sum;
}

Calibration Calibrate(const std::vector<LeftOut>& left_out, const BedVariability& patch,
                      double radius_m) {
  Calibration result;
  const double n = static_cast<double>(left_out.size());
  double distance2 = 0;
  for (const LeftOut& l : left_out) distance2 += l.prediction.distance * l.prediction.distance / n;
  for (int o = 0; o < kOutputs; ++o) {
    double miss2 = 0, physics2 = 0;
    for (const LeftOut& l : left_out) {
      const double scale = ScaleAt(patch, o, *l.row, radius_m);
      miss2 += std::pow((l.row->mean[o] - l.prediction.value[o]) / scale, 2) / n;
      physics2 += std::pow((l.row->mean[o] - l.prediction.physics[o]) / scale, 2) / n;
    }
    const double patch2 = patch.sd[o] * patch.sd[o], least2 = 0.25 * patch2 + 1e-12;
    const double spare2 = miss2 - patch2 - physics2 * distance2;
    const double inside2 = std::max(spare2, least2);
    double growth2 = physics2;
    if (spare2 < least2 && distance2 > 0) {
      growth2 = std::clamp((miss2 - patch2 - least2) / distance2, 0.1 * physics2, physics2);
    }
    result.inside[o] = std::sqrt(inside2);
    result.growth[o] = std::sqrt(growth2);
    std::vector<double> scores;
    double square = 0;
    result.factor[o] = 1;
    for (const LeftOut& l : left_out) {
      scores.push_back(Score(result, patch, o, l, radius_m));
      square += scores.back() * scores.back() / n;
    }
    result.factor[o] = left_out.size() >= kConformalFrom
                           ? ConformalQuantile(scores, result.level)
                           : StudentT95(static_cast<int>(left_out.size()) - 1) *
                                 std::sqrt((1 + 1 / n) * std::max(1.0, square));
  }
  return result;
}

double HalfWidth(const Calibration& calibration, const BedVariability& patch, int o,
                 const LeftOut& at, double radius_m) {
  const double inside = calibration.inside[o];
  const double grown = calibration.growth[o] * at.prediction.distance;
  return calibration.factor[o] * ScaleAt(patch, o, *at.row, radius_m) *
         std::sqrt(inside * inside + grown * grown + patch.sd[o] * patch.sd[o]);
}

std::array<double, kOutputs> EstimateBulldozing(const std::vector<LeftOut>& left_out,
                                                const BedVariability& patch, double radius_m) {
  std::array<double, kOutputs> best{};
  if (left_out.size() < kConformalFrom) return best;
  constexpr int kSteps = 170;
  const double most_log_growth = std::log(1 + kMostBulldozing);
  const double n = static_cast<double>(left_out.size());
  const Calibration calibration = Calibrate(left_out, patch, radius_m);
  for (int o = 0; o < kOutputs; ++o) {
    double least = std::numeric_limits<double>::infinity();
    std::vector<double> scores;
    scores.reserve(left_out.size());
    for (const LeftOut& l : left_out) scores.push_back(Score(calibration, patch, o, l, radius_m));
    for (int step = 0; step <= kSteps; ++step) {
      const double log_growth = most_log_growth * step / kSteps;
      const double bulldozing = std::exp(log_growth) - 1;
      double spread = 0, cost = 0.5 * log_growth * log_growth;
      for (std::size_t i = 0; i < left_out.size(); ++i) {
        const double growth = Growth(bulldozing, *left_out[i].row);
        spread += scores[i] / (growth * n);
        cost += std::log(growth);
      }
      cost += n * std::log(std::max(spread, 1e-12));
      if (cost < least) best[o] = bulldozing;
      least = std::min(least, cost);
    }
  }
  return best;
}

std::array<double, kOutputs> CrossConformalCoverage(const std::vector<LeftOut>& left_out,
                                                    const BedVariability& patch, double radius_m) {
  std::map<std::size_t, std::vector<LeftOut>> folds;
  for (const LeftOut& l : left_out) folds[l.fold].push_back(l);
  std::array<double, kOutputs> share{};
  for (const auto& [fold, members] : folds) {
    std::vector<LeftOut> others;
    for (const LeftOut& l : left_out) {
      if (l.fold != fold) others.push_back(l);
    }
    const Calibration calibration = Calibrate(others, patch, radius_m);
    for (const LeftOut& l : members) {
      for (int o = 0; o < kOutputs; ++o) {
        const double half = HalfWidth(calibration, patch, o, l, radius_m);
        const bool inside = std::fabs(l.row->mean[o] - l.prediction.value[o]) <= half;
        share[o] += inside ? 1 : 0;
      }
    }
  }
  for (double& s : share) s /= static_cast<double>(left_out.size());
  return share;
}

}  // namespace grouser::surrogate

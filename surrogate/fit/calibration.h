#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "surrogate/fit/trained.h"

namespace grouser::surrogate {

/// Spread of one random placement, over OutputScale:
///   sd^2 = (sum_repeats (mean - state mean)^2 + 4 w^2)/(degrees + 4),
/// from PATCH repeats of one state with other seeds; w is 1.5 times the rms
/// block standard error of the training runs (a run knows the noise within its
/// own bed only; 1.5 is a widening by judgement), which stands alone where
/// there are no repeats and counts as four where there are few. All of it over
/// g = 1 + bulldozing P (Hull::Bulldozing), by which every sd of this header grows.
struct BedVariability {
  std::array<double, kOutputs> sd{};
  std::array<double, kOutputs> bulldozing{};
  int repeats = 0;  ///< degrees of freedom of the repeats
};
BedVariability EstimateBedVariability(const std::vector<Sample>& patch_rows,
                                      const std::vector<Sample>& training, double radius_m,
                                      const std::array<double, kOutputs>& bulldozing = {});

/// A training run as predicted without it.
struct LeftOut {
  const Sample* row;
  Prediction prediction;
  std::size_t fold;  ///< left out together
};

/// Leave-one-state-out (all seeds of a state leave together) up to 24 states,
/// else 12 folds. Physics (from the full fit's parameters) and fields are refitted each
/// time and the settings of the fields chosen anew: settings that have seen the runs left
/// out make residuals too small (CMU pair, f_y: intervals that held 78 % of the test
/// states, for 84 %). The speed axis' saturation alone is kept.
std::vector<LeftOut> CrossValidate(const std::vector<Sample>& rows, const TrainOptions& options,
                                   const Trained& full,
                                   const std::function<void(const std::string&)>& progress);

/// Sum over outputs of ln(mean |left-out residual|/OutputScale): which of two forms of a
/// fit predicts runs better that it has not seen. One in which all errors are a tenth
/// smaller has 0.5 less.
double LeftOutError(const std::vector<LeftOut>& left_out, double radius_m);

/// Parts of the uncertainty over OutputScale, from the left-out residuals r at
/// hull distance D: growth^2 = mean square of what physics alone leaves, inside
/// and (where that is too wide) growth adjusted so that
/// mean r^2 = inside^2 + growth^2 mean D^2 + patch^2, inside >= patch/2.
/// factor: half width over combined sd at `level`: from 30 runs on the
/// conformal quantile of |r|/sd (rank ceil((n+1) level)); below, Student's t
/// with n - 1 degrees times sqrt(1 + 1/n) times max(1, rms(r/sd)): few runs
/// cannot prove that the parts are too wide.
struct Calibration {
  std::array<double, kOutputs> inside{}, growth{}, factor{};
  double level = 0.9;
};
Calibration Calibrate(const std::vector<LeftOut>& left_out, const BedVariability& patch,
                      double radius_m);

/// `bulldozing` of BedVariability, 0 to 30: that by which left-out residuals over the sds of
/// Calibrate are likeliest, Laplace's law of errors taken (of long tails, as these have)
/// and a prior of sd 1 on ln(1 + bulldozing). 0 below 30 runs.
std::array<double, kOutputs> EstimateBulldozing(const std::vector<LeftOut>& left_out,
                                                const BedVariability& patch, double radius_m);

/// Half width of the interval at the left-out run, in units of the output.
double HalfWidth(const Calibration& calibration, const BedVariability& patch, int output,
                 const LeftOut& at, double radius_m);

/// Share of the runs inside intervals that were calibrated without their fold, but for
/// `bulldozing` (cross-conformal prediction: Vovk 2015, Ann. Math. Artif. Intell. 74,
/// 9-28); unlike that of Calibrate's own, which holds by construction.
std::array<double, kOutputs> CrossConformalCoverage(const std::vector<LeftOut>& left_out,
                                                    const BedVariability& patch, double radius_m);

/// t quantile at 95 % (two-sided 90 %), to 1e-2 for 3 or more degrees.
double StudentT95(int degrees);

}  // namespace grouser::surrogate

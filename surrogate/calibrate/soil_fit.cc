#include "surrogate/calibrate/soil_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <map>
#include <stdexcept>

#include "surrogate/calibrate/least_squares.h"
#include "surrogate/models/kinematics.h"

namespace grouser::surrogate {
namespace {

constexpr double kRefuted = 0.01;
constexpr double kTypicalCounts = 2;  // as so many degrees of freedom
constexpr int kMostRounds = 10;

// What the fitted plates, shear tests and presses reached, by kind and axis.
class Reach {
 public:
  explicit Reach(const MeasuredSoil& soil) {
    for (const Observation& at : soil.observations) {
      const auto kind = static_cast<std::size_t>(soil.tests[at.test].kind);
      for (std::size_t a = 0; a < kAxes.size() && !at.held_out; ++a) {
        auto& [low, high] = ends_[kind][a];
        low = std::min(low, at.*kAxes[a]);
        high = std::max(high, at.*kAxes[a]);
      }
      if (at.output >= 0 && !at.held_out) states_.push_back(ChartOf(at));
    }
  }

  /// By how many doublings or halvings a row lies beyond, the axis that is farthest; a wheel's: how
  /// far from the nearest fitted state on the chart of wheel states, in half radians.
  double Beyond(TestKind kind, const Observation& at) const {
    if (at.output >= 0) return states_.empty() ? 0 : ToNearest(ChartOf(at));
    double most = 0;
    for (std::size_t a = 0; a < kAxes.size(); ++a) {
      const auto& [low, high] = ends_[static_cast<std::size_t>(kind)][a];
      const double value = at.*kAxes[a];
      if (!(value > 0) || !(low > 0) || low > high) continue;
      most = std::max({most, std::log2(value / high), std::log2(low / value)});
    }
    return most;
  }

 private:
  static ChartPoint ChartOf(const Observation& at) {
    return ToChart(ToCanonical(at.motion.v_x, at.motion.v_y, at.motion.rim_speed));
  }
  double ToNearest(const ChartPoint& at) const {
    constexpr double kUnit = 0.5;  // [rad]
    double least = kInfinite;
    for (const ChartPoint& s : states_) {
      least = std::min(
          least, std::hypot(s.direction_rad - at.direction_rad, s.lateral_rad - at.lateral_rad));
    }
    return least / kUnit;
  }

  static constexpr std::array kAxes = {&Observation::sinkage, &Observation::width,
                                       &Observation::displacement, &Observation::pressure};
  struct Ends {
    double low = kInfinite, high = 0;
  };
  std::array<std::array<Ends, kAxes.size()>, 4> ends_;  // by TestKind
  std::vector<ChartPoint> states_;
};

// The side force and the moment of a wheel that goes straight tell nothing of the law.
bool ZeroBySymmetry(const Observation& at) {
  return at.output >= 0 && kOutputFields[at.output].parity_y < 0 && at.motion.v_y == 0;
}

struct Fitter {
  SoilFit* fit;
  std::vector<double> scale;
  std::vector<int> group;  // of each observation

  void Prepare() {
    const MeasuredSoil& soil = fit->law->soil();
    std::map<int, double> fitted;
    for (const Observation& at : soil.observations) fitted[at.test] += at.held_out ? 0 : 1;
    for (const Observation& at : soil.observations) {
      const MeasuredTest& test = soil.tests[at.test];
      const double counts = test.counts_as.value_or(fitted[at.test]);
      fit->weight.push_back(at.held_out ? 0 : std::min(1.0, counts / fitted[at.test]));
      scale.push_back(fit->law->ScaleOf(at, at.value));
      auto of = std::ranges::find_if(fit->misfits, [&](const Misfit& m) {
        return m.kind == test.kind && m.output == at.output;
      });
      if (of == fit->misfits.end()) {
        fit->misfits.push_back({test.kind, at.output});
        of = fit->misfits.end() - 1;
        of->share = fit->law->TypicalError(test.kind, at.output);
        of->assumed = true;
      }
      if (!at.held_out) ++of->n;
      group.push_back(static_cast<int>(of - fit->misfits.begin()));
    }
    fit->sigma.resize(group.size());
    SetSigma();
  }

  void SetSigma() {
    for (std::size_t i = 0; i < group.size(); ++i) {
      const double sd = fit->law->soil().observations[i].sd;
      fit->sigma[i] = std::hypot(std::isnan(sd) ? 0 : sd, fit->misfits[group[i]].share * scale[i]);
    }
  }

  // The best of several starts: firm and soft, by the pressure that suits best.
  void Start() {
    const SoilLaw& law = *fit->law;
    const Problem problem(*fit);
    Coordinates best{};
    double least = kInfinite;
    for (const double n : {0.5, 1.0}) {
      for (const double friction : {-1.0, 0.5}) {
        Coordinates x, suited{};
        for (int c = 0; c < kCoordinates; ++c) x[c] = law.priors()[c].center;
        x[kExponent] = n;
        x[kModulusShare] = std::clamp(x[kModulusShare], 0.0, 0.9);
        x[kFriction] += friction * std::min(0.15, law.priors()[kFriction].sd);
        double lowest = kInfinite;
        Problem held = problem;
        held.free.clear();
        for (double p = std::log(100.0); p < std::log(1e7); p += 0.7) {
          x[kLogPressure] = p;
          const double cost = Minimise(held, &x, 0);
          if (cost < lowest) lowest = cost, suited = x;
        }
        if (!std::isfinite(lowest)) continue;
        const double cost = Minimise(problem, &suited, 8);
        if (cost < least) least = cost, best = suited;
      }
    }
    if (!std::isfinite(least)) {
      throw std::runtime_error("calibrate: no start led to a usable solution");
    }
    fit->x = best;
  }

  // d model/d x and covariance at the solution.
  void Linearise() {
    const SoilLaw& law = *fit->law;
    const std::vector<int>& free = law.free();
    const auto n = static_cast<Eigen::Index>(group.size());
    const auto k = static_cast<Eigen::Index>(free.size());
    fit->jacobian.resize(n, k);
    for (Eigen::Index c = 0; c < k; ++c) {
      const Prior& prior = law.priors()[free[c]];
      const double step = 1e-4 * prior.sd, x = fit->x[free[c]];
      const double high = std::min(prior.high, x + step), low = std::max(prior.low, x - step);
      Coordinates at = fit->x;
      at[free[c]] = high;
      const std::vector<double> up = law.Predict(at);
      at[free[c]] = low;
      const std::vector<double> down = law.Predict(at);
      for (Eigen::Index i = 0; i < n; ++i) fit->jacobian(i, c) = (up[i] - down[i]) / (high - low);
    }
    // In units of the priors: well scaled.
    Eigen::VectorXd sd(k), w(n);
    for (Eigen::Index c = 0; c < k; ++c) sd[c] = law.priors()[free[c]].sd;
    for (Eigen::Index i = 0; i < n; ++i) {
      w[i] = fit->weight[i] == 0 ? 0 : fit->weight[i] / (fit->sigma[i] * fit->sigma[i]);
    }
    const Eigen::MatrixXd j = fit->jacobian * sd.asDiagonal();
    const Eigen::MatrixXd information =
        j.transpose() * w.asDiagonal() * j + Eigen::MatrixXd::Identity(k, k);
    fit->covariance = sd.asDiagonal() * information.inverse() * sd.asDiagonal();
  }

  // Sets the shares; returns whether one of them changed.
  bool SetShares() {
    const auto& observations = fit->law->soil().observations;
    const std::vector<double> model = fit->law->Predict(fit->x);
    fit->dof = 0;
    bool changed = false;
    for (std::size_t g = 0; g < fit->misfits.size(); ++g) {
      Misfit& m = fit->misfits[g];
      if (m.n == 0) continue;
      m.dof = 0;
      bool stated = true;
      std::vector<std::array<double, 3>> terms;  // weight, squared residual, squared sd
      for (std::size_t i = 0; i < group.size(); ++i) {
        if (group[i] != static_cast<int>(g) || fit->weight[i] == 0) continue;
        if (ZeroBySymmetry(observations[i])) continue;
        const auto row = fit->jacobian.row(static_cast<Eigen::Index>(i));
        const double leverage = fit->weight[i] * (row * fit->covariance * row.transpose())(0) /
                                (fit->sigma[i] * fit->sigma[i]);
        m.dof += fit->weight[i] * std::max(0.0, 1 - leverage);
        const double sd = observations[i].sd, miss = model[i] - observations[i].value;
        stated &= !std::isnan(sd);
        terms.push_back({fit->weight[i], std::pow(miss / scale[i], 2),
                         std::isnan(sd) ? 0 : std::pow(sd / scale[i], 2)});
      }
      fit->dof += m.dof;
      const auto chi2 = [&](double share) {
        double sum = 0;
        for (const auto& [w, r2, v] : terms) sum += w * r2 / std::max(v + share * share, 1e-16);
        return sum;
      };
      const double before = m.share;
      const double usual = fit->law->TypicalError(m.kind, m.output);
      double would_show = 0;  // of chi-squared, by an error of the usual size
      for (const auto& [w, r2, v] : terms) would_show += w * usual * usual / std::max(v, 1e-16);
      const double limit =
          m.dof > 0 ? quantile(complement(boost::math::chi_squared(m.dof), kRefuted)) : 0;
      const bool explained = stated && m.dof >= 2 && would_show > limit && chi2(0) <= limit;
      m.assumed = m.dof < 2;
      m.estimated = !explained;
      m.share = 0;
      double low = 0, high = 10;
      for (int step = 0; m.estimated && step < 60; ++step) {
        m.share = 0.5 * (low + high);
        const double pooled = chi2(m.share) + kTypicalCounts * std::pow(usual / m.share, 2);
        (pooled > m.dof + kTypicalCounts ? low : high) = m.share;
      }
      changed |= std::abs(m.share - before) > 0.01 * before + 1e-6;
    }
    return changed;
  }

  void Finish() {
    fit->sds_estimated = std::ranges::any_of(fit->misfits, &Misfit::estimated);
    fit->deviance = 2 * fit->cost;
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (fit->weight[i] > 0) fit->deviance += 2 * fit->weight[i] * std::log(fit->sigma[i]);
    }
    const MeasuredSoil& soil = fit->law->soil();
    const Reach reach(soil);
    const std::vector<double> model = fit->law->Predict(fit->x);
    for (std::size_t i = 0; i < model.size(); ++i) {
      const auto row = fit->jacobian.row(static_cast<Eigen::Index>(i));
      const double variance = (row * fit->covariance * row.transpose())(0);
      // Of a row that is held out nothing measured may set the width but its own sd.
      const Observation& at = soil.observations[i];
      const double law = fit->misfits[group[i]].share * fit->law->ScaleOf(at, model[i]) *
                         (1 + reach.Beyond(soil.tests[at.test].kind, at));
      const double noise = std::isnan(at.sd) ? 0 : at.sd;
      fit->predicted.push_back({model[i], std::sqrt(std::max(0.0, variance)),
                                std::sqrt(std::max(0.0, variance) + law * law + noise * noise)});
    }
  }
};

}  // namespace

SoilFit FitSoil(const MeasuredSoil& soil, const Typical& typical, double form) {
  SoilFit fit;
  fit.law = std::make_shared<SoilLaw>(soil, typical, form);
  Fitter fitter{&fit, {}, {}};
  fitter.Prepare();
  fitter.Start();
  for (int round = 0; round < kMostRounds; ++round) {
    fit.cost = Minimise(Problem(fit), &fit.x, 60);
    if (!std::isfinite(fit.cost)) throw std::runtime_error("calibrate: the fit diverged");
    fitter.Linearise();
    if (!fitter.SetShares()) break;
    fitter.SetSigma();
  }
  fit.cost = Minimise(Problem(fit), &fit.x, 60);
  fitter.Linearise();
  fitter.Finish();
  return fit;
}

}  // namespace grouser::surrogate

#include "surrogate/calibrate/soil_fit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kTypicalShare = 0.05, kRefuted = 0.01, kLevel = 0.9;
constexpr int kMostRounds = 10;

// Where a least-squares problem stands, and what of it is free.
struct Problem {
  const SoilLaw* law;
  std::vector<Observation> fitted;
  std::vector<double> factor;  // root of weight, over sigma, of each
  std::vector<int> free;
  std::optional<Pin> pin;

  explicit Problem(const SoilFit& fit) : law(fit.law.get()), free(fit.law->free()) {
    for (std::size_t i = 0; i < fit.sigma.size(); ++i) {
      if (fit.weight[i] == 0) continue;
      fitted.push_back(law->soil().observations[i]);
      factor.push_back(std::sqrt(fit.weight[i]) / fit.sigma[i]);
    }
  }

  Coordinates At(const double* u, const Coordinates& from) const {
    Coordinates x = from;
    for (std::size_t k = 0; k < free.size(); ++k) {
      const Prior& prior = law->priors()[free[k]];
      x[free[k]] = prior.center + prior.sd * u[k];
    }
    if (pin) x[kModulusShare] = law->ShareAt(*pin, x);
    return x;
  }
  bool Within(const Coordinates& x) const {
    const Prior& prior = law->priors()[kModulusShare];
    return !pin || (x[kModulusShare] >= prior.low && x[kModulusShare] <= prior.high);
  }
};

// Residuals of all observations and priors, with derivatives by central differences.
class SoilCost final : public ceres::CostFunction {
 public:
  SoilCost(const Problem& problem, const Coordinates& from) : problem_(problem), from_(from) {
    set_num_residuals(static_cast<int>(problem.fitted.size()) + kCoordinates);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.free.size()));
  }

  bool Evaluate(double const* const* u, double* residual, double** jacobians) const override {
    if (!Residuals(u[0], residual)) return false;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    const int rows = num_residuals(), columns = parameter_block_sizes()[0];
    std::vector<double> at(u[0], u[0] + columns), up(rows), down(rows);
    for (int k = 0; k < columns; ++k) {
      constexpr double kStep = 1e-4;  // of the prior's sd
      double span = 0;
      const auto move = [&](double by, std::vector<double>* to) {
        at[k] = u[0][k] + by;
        const Prior& prior = problem_.law->priors()[problem_.free[k]];
        const double x = prior.center + prior.sd * at[k];
        const bool fine = x >= prior.low && x <= prior.high && Residuals(at.data(), to->data());
        if (fine) span += std::abs(by);
        if (!fine) std::copy(residual, residual + rows, to->begin());
      };
      move(kStep, &up);
      move(-kStep, &down);
      at[k] = u[0][k];
      if (span == 0) return false;
      for (int i = 0; i < rows; ++i) jacobians[0][i * columns + k] = (up[i] - down[i]) / span;
    }
    return true;
  }

 private:
  bool Residuals(const double* u, double* to) const {
    const SoilLaw& law = *problem_.law;
    const Coordinates x = problem_.At(u, from_);
    if (!problem_.Within(x)) return false;
    std::vector<double> model;
    try {
      law.Predict(x, problem_.fitted, law.soil().tests, &model);
    } catch (const std::invalid_argument&) {
      return false;  // outside the model's range: the step is refused
    }
    for (std::size_t i = 0; i < model.size(); ++i) {
      to[i] = problem_.factor[i] * (model[i] - problem_.fitted[i].value);
      if (!std::isfinite(to[i])) return false;
    }
    for (int c = 0; c < kCoordinates; ++c) {
      const Prior& prior = law.priors()[c];
      to[model.size() + c] = (x[c] - prior.center) / prior.sd;
    }
    return true;
  }

  const Problem& problem_;
  Coordinates from_;
};

// Half of the sum of squares; infinite where there is nothing usable.
double Minimise(const Problem& problem, Coordinates* x, int iterations) {
  std::vector<double> u;
  for (const int c : problem.free) {
    const Prior& prior = problem.law->priors()[c];
    u.push_back((std::clamp((*x)[c], prior.low, prior.high) - prior.center) / prior.sd);
  }
  SoilCost cost(problem, *x);
  if (u.empty()) {
    std::vector<double> r(cost.num_residuals());
    double const* const at = nullptr;
    if (!cost.Evaluate(&at, r.data(), nullptr)) return kInfinite;
    return 0.5 * Eigen::Map<Eigen::VectorXd>(r.data(), cost.num_residuals()).squaredNorm();
  }
  ceres::Problem::Options keep;
  keep.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(keep);
  ceres_problem.AddResidualBlock(&cost, nullptr, u.data());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const Prior& prior = problem.law->priors()[problem.free[k]];
    ceres_problem.SetParameterLowerBound(u.data(), static_cast<int>(k),
                                         (prior.low - prior.center) / prior.sd);
    ceres_problem.SetParameterUpperBound(u.data(), static_cast<int>(k),
                                         (prior.high - prior.center) / prior.sd);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.num_threads = 1;  // the answer must not depend on the machine
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost)) return kInfinite;
  *x = problem.At(u.data(), *x);
  return summary.final_cost;
}

// What counts as 1 in an observation.
double ScaleOf(const SoilLaw& law, const Observation& at) {
  const MeasuredTest& test = law.soil().tests[at.test];
  if (at.output >= 0) return OutputScale(at.output, at.load, test.wheel.radius_m);
  double most = 0;
  for (const Observation& other : law.soil().observations) {
    if (other.test == at.test) most = std::max(most, std::abs(other.value));
  }
  return std::max(std::abs(at.value), 0.05 * most);
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
      scale.push_back(ScaleOf(*fit->law, at));
      auto of = std::ranges::find_if(fit->misfits, [&](const Misfit& m) {
        return m.kind == test.kind && m.output == at.output;
      });
      if (of == fit->misfits.end()) {
        fit->misfits.push_back({test.kind, at.output});
        of = fit->misfits.end() - 1;
      }
      if (!at.held_out) ++of->n;
      if (std::isnan(at.sd)) of->estimated = true, of->share = kTypicalShare;
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
        const double cost = Minimise(problem, &suited, 25);
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
      m.assumed = m.dof < 2;
      if (m.assumed) {
        m.estimated = false;
        m.share = kTypicalShare;
      } else {
        const boost::math::chi_squared expected(m.dof);
        m.estimated = !stated || chi2(0) > quantile(complement(expected, kRefuted));
        double low = 0, high = 10;
        for (int step = 0; m.estimated && step < 60; ++step) {
          m.share = 0.5 * (low + high);
          (chi2(m.share) > m.dof ? low : high) = m.share;
        }
        if (!m.estimated) m.share = 0;
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
    const std::vector<double> model = fit->law->Predict(fit->x);
    for (std::size_t i = 0; i < model.size(); ++i) {
      const auto row = fit->jacobian.row(static_cast<Eigen::Index>(i));
      const double variance = (row * fit->covariance * row.transpose())(0);
      fit->predicted.push_back(
          {model[i], std::sqrt(std::max(0.0, variance)),
           std::sqrt(std::max(0.0, variance) + fit->sigma[i] * fit->sigma[i])});
    }
  }
};

// Where one free parameter's quantile of twice the cost's rise lies.
double IntervalRise(const SoilFit& fit) {
  if (!fit.sds_estimated) return kTwoSided90 * kTwoSided90;
  const boost::math::students_t t(std::max(1.0, fit.dof));
  return std::pow(quantile(t, 0.5 + kLevel / 2), 2);
}

/// Walks away from the fit along one reported parameter, all others refitted.
class Profile {
 public:
  Profile(const SoilFit& fit, int parameter)
      : fit_(fit), parameter_(parameter), what_(fit.law->Reported()[parameter]) {}

  /// sign of the root of the rise of twice the cost at `by` away (in the coordinate, or for a
  /// modulus in the parameter) less the quantile's root.
  double Over(double by, Coordinates* warm) const {
    Problem problem(fit_);
    const int held = what_.coordinate >= 0 ? what_.coordinate : static_cast<int>(kModulusShare);
    std::erase(problem.free, held);
    if (what_.coordinate >= 0) {
      (*warm)[held] = fit_.x[held] + by;
    } else {
      problem.pin = {parameter_, fit_.law->ReportedValue(parameter_, fit_.x) + by};
    }
    const double cost = Minimise(problem, warm, 30);
    if (!std::isfinite(cost)) return kInfinite;
    return std::sqrt(std::max(0.0, 2 * (cost - fit_.cost))) - std::sqrt(IntervalRise(fit_));
  }

  /// How far the parameter may go in a direction; none: as far as is accepted.
  std::optional<double> End(double direction, double sd) const {
    double room = kInfinite;
    if (what_.coordinate >= 0) {
      const Prior& prior = fit_.law->priors()[what_.coordinate];
      room = direction > 0 ? prior.high - fit_.x[what_.coordinate]
                           : fit_.x[what_.coordinate] - prior.low;
    }
    Coordinates warm = fit_.x, inner = fit_.x;
    double in = 0, in_over = -std::sqrt(IntervalRise(fit_));
    double out = 0, out_over = -1;
    double stride = std::max(1e-12, 1.3 * kTwoSided90 * sd);
    for (int step = 0; step < 12; ++step, stride *= 1.6) {
      out = std::min(room, in + stride);
      warm = inner;
      out_over = Over(direction * out, &warm);
      if (out_over >= 0) break;
      if (out >= room) return std::nullopt;
      in = out, in_over = out_over, inner = warm;
    }
    if (out_over < 0) return std::nullopt;
    for (int step = 0; step < 12 && out - in > 2e-3 * out; ++step) {
      double share = std::isfinite(out_over) ? -in_over / (out_over - in_over) : 0.5;
      if (step % 3 == 2) share = 0.5;
      const double middle = in + std::clamp(share, 0.03, 0.97) * (out - in);
      warm = inner;
      const double over = Over(direction * middle, &warm);
      if (std::abs(over) < 1e-3) return middle;
      if (over < 0) {
        in = middle, in_over = over, inner = warm;
      } else {
        out = middle, out_over = over;
      }
    }
    return 0.5 * (in + out);
  }

 private:
  const SoilFit& fit_;
  int parameter_;
  ReportedParameter what_;
};

// d reported/d x of the free coordinates.
Eigen::MatrixXd ReportedSlopes(const SoilFit& fit) {
  const SoilLaw& law = *fit.law;
  const auto rows = static_cast<Eigen::Index>(law.Reported().size());
  const auto columns = static_cast<Eigen::Index>(law.free().size());
  Eigen::MatrixXd slopes(rows, columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const double step = 1e-5 * law.priors()[law.free()[c]].sd;
    Coordinates up = fit.x, down = fit.x;
    up[law.free()[c]] += step;
    down[law.free()[c]] -= step;
    for (Eigen::Index r = 0; r < rows; ++r) {
      const int i = static_cast<int>(r);
      slopes(r, c) = (law.ReportedValue(i, up) - law.ReportedValue(i, down)) / (2 * step);
    }
  }
  return slopes;
}

Coordinates Centers(const SoilLaw& law) {
  Coordinates x;
  for (int c = 0; c < kCoordinates; ++c) x[c] = law.priors()[c].center;
  return x;
}

}  // namespace

SoilFit FitSoil(const MeasuredSoil& soil, const std::vector<Soil>& published, double form) {
  SoilFit fit;
  fit.law = std::make_shared<SoilLaw>(soil, published, form);
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

std::vector<FittedParameter> ParametersOf(const SoilFit& fit) {
  const SoilLaw& law = *fit.law;
  const Eigen::MatrixXd slopes = ReportedSlopes(fit);
  const Eigen::MatrixXd covariance = slopes * fit.covariance * slopes.transpose();
  Eigen::VectorXd prior_variance(law.free().size());
  for (std::size_t c = 0; c < law.free().size(); ++c) {
    prior_variance[static_cast<Eigen::Index>(c)] = std::pow(law.priors()[law.free()[c]].sd, 2);
  }
  const Coordinates typical = Centers(law);
  std::vector<FittedParameter> parameters;
  for (int i = 0; i < static_cast<int>(law.Reported().size()); ++i) {
    const ReportedParameter& what = law.Reported()[i];
    FittedParameter p{what,
                      law.ReportedValue(i, fit.x),
                      std::sqrt(covariance(i, i)),
                      0,
                      0,
                      false,
                      false,
                      law.ReportedValue(i, typical),
                      1,
                      false};
    // A modulus is known as well as the share of it, once the pressure is.
    const int held = what.coordinate >= 0 ? what.coordinate : static_cast<int>(kModulusShare);
    const auto at = std::ranges::find(law.free(), held) - law.free().begin();
    p.share_left = std::sqrt(fit.covariance(at, at) / prior_variance[at]);
    p.identified = p.share_left <= kIdentified;
    const Profile profile(fit, i);
    const double sd = what.coordinate >= 0 ? std::sqrt(fit.covariance(at, at)) : p.sd;
    const auto to = [&](double by) {
      if (what.coordinate < 0) return p.value + by;
      Coordinates x = fit.x;
      x[held] += by;
      return law.ReportedValue(i, x);
    };
    const Prior& prior = law.priors()[held];
    const auto down = profile.End(-1, sd), up = profile.End(1, sd);
    p.low_open = !down;
    p.high_open = !up;
    const bool modulus = what.coordinate < 0;
    p.low = down ? to(-*down) : modulus ? -kInfinite : to(prior.low - fit.x[held]);
    p.high = up ? to(*up) : modulus ? kInfinite : to(prior.high - fit.x[held]);
    parameters.push_back(p);
  }
  return parameters;
}

Eigen::MatrixXd CorrelationOf(const SoilFit& fit) {
  const Eigen::MatrixXd slopes = ReportedSlopes(fit);
  const Eigen::MatrixXd covariance = slopes * fit.covariance * slopes.transpose();
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  return sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal();
}

double DistanceOf(const SoilFit& fit, const BekkerParameters& truth) {
  Problem problem(fit);
  std::erase_if(problem.free, [](int c) { return c < kSoilCoordinates; });
  const Coordinates of_truth = fit.law->CoordinatesOf(truth);
  Coordinates x = fit.x;
  std::copy_n(of_truth.begin(), kSoilCoordinates, x.begin());
  return 2 * (Minimise(problem, &x, 60) - fit.cost);
}

double RegionOf(const SoilFit& fit) {
  if (!fit.sds_estimated) {
    return quantile(boost::math::chi_squared(kSoilCoordinates), kLevel);
  }
  const boost::math::fisher_f f(kSoilCoordinates, std::max(1.0, fit.dof));
  return kSoilCoordinates * quantile(f, kLevel);
}

}  // namespace grouser::surrogate

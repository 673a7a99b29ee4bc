#include "surrogate/calibrate/least_squares.h"

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

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

}  // namespace

Problem::Problem(const SoilFit& fit) : law(fit.law.get()), free(fit.law->free()) {
  for (std::size_t i = 0; i < fit.sigma.size(); ++i) {
    if (fit.weight[i] == 0) continue;
    fitted.push_back(law->soil().observations[i]);
    factor.push_back(std::sqrt(fit.weight[i]) / fit.sigma[i]);
  }
}

Coordinates Problem::At(const double* u, const Coordinates& from) const {
  Coordinates x = from;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const Prior& prior = law->priors()[free[k]];
    x[free[k]] = prior.center + prior.sd * u[k];
  }
  if (pin) x[kModulusShare] = law->ShareAt(*pin, x);
  return x;
}

bool Problem::Within(const Coordinates& x) const {
  const Prior& prior = law->priors()[kModulusShare];
  return !pin || (x[kModulusShare] >= prior.low && x[kModulusShare] <= prior.high);
}

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

}  // namespace grouser::surrogate

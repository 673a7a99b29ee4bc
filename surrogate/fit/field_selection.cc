#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "surrogate/fit/residual_field.h"

namespace grouser::surrogate {
namespace {

constexpr std::size_t kOfAngle = 4;  // the first of Lengths' axes that are angles
constexpr int kAmplitude = Lengths::kAxes, kLack = kAmplitude + 1, kRate = kLack + 1;
constexpr double kShorter = 0.6;     // of ln length, at the second start
constexpr double kLeastSize = 1e-4;  // of the lack of fit's prior
constexpr int kIterations = 60;

double Power2(double x) { return x * x; }

/// A prior of ln(coordinate): normal.
struct Prior {
  double center, sd;
};

/// The negative logarithm of marginal likelihood times prior, by logarithms of lengths,
/// amplitude, lack of fit and (with speeds) rate_amplitude/amplitude.
class Objective final : public ceres::FirstOrderFunction {
 public:
  Objective(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
            const Eigen::VectorXd& noise, ResidualTable::Parity parity)
      : kernel_(points, parity), values_(values), noise_(noise) {
    Eigen::VectorXd u(values.size());
    for (Eigen::Index i = 0; i < u.size(); ++i) u(i) = points[i].u;
    const auto n = static_cast<double>(values.size());
    speeds_ = u * u.transpose();
    const double spread = std::sqrt(u.squaredNorm() / n), size = Size();
    for (const double length : Lengths{}.All()) {
      priors_.push_back({std::log(length), priors_.size() < kOfAngle ? 0.7 : 1.0});
    }
    priors_.push_back({std::log(0.7 * size), 1});
    priors_.push_back({std::log(std::max(0.03 * size, kLeastSize)), 1});
    if (spread > 0) priors_.push_back({std::log(0.2 / spread), 1});
  }

  int NumParameters() const override { return static_cast<int>(priors_.size()); }
  const std::vector<Prior>& priors() const { return priors_; }
  /// Root mean square of the values.
  double Size() const {
    return std::sqrt(values_.squaredNorm() / static_cast<double>(values_.size()));
  }

  FieldSettings SettingsAt(const double* x) const {
    FieldSettings s;
    std::array<double, Lengths::kAxes> length;
    for (int a = 0; a < Lengths::kAxes; ++a) length[a] = std::exp(x[a]);
    s.lengths = Lengths::Of(length);
    s.amplitude = std::exp(x[kAmplitude]);
    s.lack_of_fit = std::exp(x[kLack]);
    if (HasRate()) s.rate_amplitude = s.amplitude * std::exp(x[kRate]);
    return s;
  }

  bool Evaluate(const double* x, double* cost, double* gradient) const override {
    const FieldSettings s = SettingsAt(x);
    std::array<Eigen::MatrixXd, Lengths::kAxes> slopes;
    const Eigen::MatrixXd kernel = kernel_.At(s.lengths, gradient ? &slopes : nullptr);
    const Eigen::MatrixXd by_speed = kernel.cwiseProduct(speeds_);
    const double amplitude2 = Power2(s.amplitude), rate2 = Power2(s.rate_amplitude);
    const Eigen::MatrixXd signal = amplitude2 * kernel + rate2 * by_speed;
    const Eigen::VectorXd noise2 = NoiseVariance(noise_, s);
    Eigen::MatrixXd covariance = signal;
    covariance.diagonal() += noise2;
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::VectorXd weights = factor.solve(values_);
    *cost = 0.5 * values_.dot(weights) + factor.matrixLLT().diagonal().array().log().sum();
    for (int i = 0; i < NumParameters(); ++i) *cost += 0.5 * Power2(Off(i, x[i]));
    if (!std::isfinite(*cost)) return false;
    if (!gradient) return true;
    // -2 d log likelihood/d covariance
    const Eigen::MatrixXd by =
        factor.solve(Eigen::MatrixXd::Identity(kernel.rows(), kernel.cols())) -
        weights * weights.transpose();
    const Eigen::MatrixXd per_length = 0.5 * (amplitude2 * by + rate2 * by.cwiseProduct(speeds_));
    for (int a = 0; a < Lengths::kAxes; ++a) {
      gradient[a] = per_length.cwiseProduct(slopes[a]).sum();
    }
    // All of the covariance but measured noise and lack of fit goes with the amplitude.
    const Eigen::VectorXd given = noise_.array().square() + Power2(s.lack_of_fit) + 1e-12;
    gradient[kAmplitude] = by.cwiseProduct(signal).sum() + by.diagonal().dot(noise2 - given);
    gradient[kLack] = Power2(s.lack_of_fit) * by.diagonal().sum();
    if (HasRate()) gradient[kRate] = rate2 * by.cwiseProduct(by_speed).sum();
    for (int i = 0; i < NumParameters(); ++i) gradient[i] += Off(i, x[i]) / priors_[i].sd;
    return true;
  }

 private:
  bool HasRate() const { return priors_.size() > kRate; }
  double Off(int i, double x) const { return (x - priors_[i].center) / priors_[i].sd; }

  PairKernel kernel_;
  const Eigen::VectorXd &values_, &noise_;
  Eigen::MatrixXd speeds_;  // u u'
  std::vector<Prior> priors_;
};

/// White noise alone.
SelectedField NoField(const Eigen::VectorXd& values, const Eigen::VectorXd& noise, double size) {
  SelectedField best{{}, -std::numeric_limits<double>::infinity()};
  for (const double lack : {0.0, 0.03, 0.1, 0.25, 0.5, 1.0}) {
    FieldSettings s;
    s.lack_of_fit = lack * size;
    const Eigen::ArrayXd variance = NoiseVariance(noise, s);
    const double likelihood =
        -0.5 * ((values.array().square() / variance).sum() + variance.log().sum());
    if (likelihood > best.likelihood) best = {s, likelihood};
  }
  return best;
}

}  // namespace

SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity) {
  auto* objective = new Objective(points, values, noise, parity);
  const ceres::GradientProblem problem(objective);  // owns it
  SelectedField best = NoField(values, noise, objective->Size());
  if (objective->Size() == 0) return best;
  ceres::GradientProblemSolver::Options options;
  options.max_num_iterations = kIterations;
  options.function_tolerance = 1e-7;
  options.logging_type = ceres::SILENT;
  for (const double shorter : {0.0, kShorter}) {
    std::vector<double> x;
    for (const Prior& prior : objective->priors()) x.push_back(prior.center);
    for (int a = 0; a < Lengths::kAxes; ++a) x[a] -= shorter;
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(options, problem, x.data(), &summary);
    if (!summary.IsSolutionUsable()) continue;  // final_cost says nothing then
    if (-summary.final_cost > best.likelihood) {
      best = {objective->SettingsAt(x.data()), -summary.final_cost};
    }
  }
  return best;
}

}  // namespace grouser::surrogate

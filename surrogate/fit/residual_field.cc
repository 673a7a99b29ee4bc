#include "surrogate/fit/residual_field.h"

#include <cmath>
#include <limits>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr double kJitter = 1e-6;       // of the prior variance
constexpr double kDistanceRidge = 0.01;

double Matern(double d2) {
  const double d = std::sqrt(5 * d2);
  return (1 + d + d * d / 3) * std::exp(-d);
}

double Square(double x) { return x * x; }

// sum_g chi(g) m(d(a, g b)): mirror x turns v_x and rim, mirror y turns v_y.
double SymmetricKernel(const FieldPoint& a, const FieldPoint& b, ResidualTable::Parity parity,
                       double length, double load_length) {
  const double load2 = Square((a.log_load - b.log_load) / load_length);
  double sum = 0;
  for (const int x : {1, -1}) {
    for (const int y : {1, -1}) {
      const double d2 = Square(a.direction[0] - x * b.direction[0]) +
                        Square(a.direction[1] - y * b.direction[1]) +
                        Square(a.direction[2] - x * b.direction[2]);
      const int sign = (x < 0 ? parity.x : 1) * (y < 0 ? parity.y : 1);
      sum += sign * Matern(d2 / Square(length) + load2);
    }
  }
  return sum;
}

Eigen::MatrixXd KernelMatrix(const std::vector<FieldPoint>& points,
                             ResidualTable::Parity parity, double length, double load_length) {
  const int n = static_cast<int>(points.size());
  Eigen::MatrixXd k(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      k(i, j) = k(j, i) = SymmetricKernel(points[i], points[j], parity, length, load_length);
    }
  }
  return k;
}

Eigen::VectorXd NoiseVariance(const Eigen::VectorXd& noise, const FieldSettings& s) {
  const double floor = Square(s.lack_of_fit) + kJitter * Square(s.amplitude) + 1e-12;
  return noise.array().square() + floor;
}

// Sum of log predictive densities of each value given the others
// (Rasmussen & Williams 2006, eq. 5.10-5.12).
double LeaveOneOutDensity(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& values) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const auto n = covariance.rows();
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd solved = factor.solve(values);
  double sum = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double variance = 1 / inverse(i, i), miss = solved(i) * variance;
    sum -= 0.5 * (std::log(variance) + miss * miss / variance);
  }
  return sum;
}

}  // namespace

FieldPoint MakeFieldPoint(const Canonical& s, double load_n) {
  const double norm =
      std::sqrt(s.forward * s.forward + s.lateral * s.lateral + s.rim * s.rim);
  return {{s.forward / norm, s.lateral / norm, s.rim / norm}, std::log(load_n)};
}

FieldPoint MakeFieldPoint(const ChartPoint& chart, double log_load) {
  const double in_plane = std::cos(chart.lateral_rad);
  return {{in_plane * std::cos(chart.direction_rad), std::sin(chart.lateral_rad),
           in_plane * std::sin(chart.direction_rad)},
          log_load};
}

ResidualField::ResidualField(std::vector<FieldPoint> points, const Eigen::VectorXd& values,
                             const Eigen::VectorXd& noise, ResidualTable::Parity parity,
                             const FieldSettings& settings)
    : points_(std::move(points)), parity_(parity), settings_(settings) {
  if (settings.amplitude <= 0 || points_.empty()) return;
  Eigen::MatrixXd covariance =
      Square(settings.amplitude) *
      KernelMatrix(points_, parity, settings.length, settings.load_length);
  covariance.diagonal() += NoiseVariance(noise, settings);
  weights_ = Square(settings.amplitude) * covariance.llt().solve(values);
}

double ResidualField::Mean(const FieldPoint& at) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    sum += weights_(i) *
           SymmetricKernel(at, points_[i], parity_, settings_.length, settings_.load_length);
  }
  return sum;
}

FieldSettings SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity) {
  const double size = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
  FieldSettings best;
  double best_density = -std::numeric_limits<double>::infinity();
  const auto n = static_cast<Eigen::Index>(points.size());
  for (const double length : {0.25, 0.45, 0.8, 1.4}) {
    for (const double load_length : {0.7, 2.0}) {
      const Eigen::MatrixXd kernel = KernelMatrix(points, parity, length, load_length);
      for (const double amplitude : {0.0, 0.25, 0.5, 1.0, 2.0}) {
        for (const double lack : {0.0, 0.25, 0.5, 1.0}) {
          const FieldSettings s{length, load_length, amplitude * size, lack * size};
          Eigen::MatrixXd covariance = Square(s.amplitude) * kernel;
          covariance.diagonal() += NoiseVariance(noise, s);
          const double density = LeaveOneOutDensity(covariance, values);
          // A later candidate must earn its place: a thousandth a value.
          if (density <= best_density + 1e-3 * static_cast<double>(n)) continue;
          best_density = density;
          best = s;
        }
      }
    }
  }
  return best;
}

HullDistance::HullDistance(std::vector<FieldPoint> points, double length, double load_length)
    : points_(std::move(points)), length_(length), load_length_(load_length) {
  Eigen::MatrixXd k = KernelMatrix(points_, {1, 1}, length, load_length);
  k.diagonal().array() += kDistanceRidge;
  factor_.compute(k);
}

double HullDistance::At(const FieldPoint& at) const {
  Eigen::VectorXd k(static_cast<Eigen::Index>(points_.size()));
  for (Eigen::Index i = 0; i < k.size(); ++i) {
    k(i) = SymmetricKernel(at, points_[i], {1, 1}, length_, load_length_);
  }
  const double prior = SymmetricKernel(at, at, {1, 1}, length_, load_length_);
  const double open = prior - k.dot(factor_.solve(k));
  return std::sqrt(open > 0 ? open / prior : 0);
}

}  // namespace grouser::surrogate

#include "surrogate/fit/residual_field.h"

#include <cmath>
#include <limits>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr double kJitter = 1e-6;  // of the prior variance
constexpr double kDistanceRidge = 0.01;

double Matern(double d2) {
  const double d = std::sqrt(5 * d2);
  return (1 + d + d * d / 3) * std::exp(-d);
}

double Square(double x) { return x * x; }

// sum_g chi(g) m(d(a, g b)): mirror x turns v_x and rim, mirror y turns v_y.
double SymmetricKernel(const FieldPoint& a, const FieldPoint& b, ResidualTable::Parity parity,
                       const Lengths& lengths) {
  const double load2 = Square((a.log_load - b.log_load) / lengths.load);
  double sum = 0;
  for (const int x : {1, -1}) {
    for (const int y : {1, -1}) {
      const double plane2 =
          Square(a.direction[0] - x * b.direction[0]) + Square(a.direction[2] - x * b.direction[2]);
      const double lateral2 = Square(a.direction[1] - y * b.direction[1]);
      const int sign = (x < 0 ? parity.x : 1) * (y < 0 ? parity.y : 1);
      sum += sign *
             Matern(plane2 / Square(lengths.plane) + lateral2 / Square(lengths.lateral) + load2);
    }
  }
  return sum;
}

Eigen::MatrixXd KernelMatrix(const std::vector<FieldPoint>& points, ResidualTable::Parity parity,
                             const Lengths& lengths) {
  const int n = static_cast<int>(points.size());
  Eigen::MatrixXd k(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      k(i, j) = k(j, i) = SymmetricKernel(points[i], points[j], parity, lengths);
    }
  }
  return k;
}

Eigen::VectorXd SpeedsOf(const std::vector<FieldPoint>& points) {
  Eigen::VectorXd u(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < u.size(); ++i) u(i) = points[i].u;
  return u;
}

/// k of FieldSettings and the noise on its diagonal, from the kernel's sums and u u'.
Eigen::MatrixXd Covariance(const Eigen::MatrixXd& kernel, const Eigen::MatrixXd& speeds,
                           const Eigen::VectorXd& noise, const FieldSettings& s) {
  Eigen::MatrixXd k = Square(s.amplitude) * kernel;
  if (s.rate_amplitude > 0) k += Square(s.rate_amplitude) * kernel.cwiseProduct(speeds);
  const double floor = Square(s.lack_of_fit) + kJitter * Square(s.amplitude) + 1e-12;
  k.diagonal().array() += noise.array().square() + floor;
  return k;
}

double Likelihood(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& values) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const double determinant = factor.matrixLLT().diagonal().array().log().sum();
  return -0.5 * values.dot(factor.solve(values)) - determinant;
}

}  // namespace

FieldPoint MakeFieldPoint(const Canonical& s, double load_n) {
  const double norm = std::sqrt(s.forward * s.forward + s.lateral * s.lateral + s.rim * s.rim);
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
  const Eigen::MatrixXd kernel = KernelMatrix(points_, parity, settings.lengths);
  const Eigen::VectorXd u = SpeedsOf(points_);
  weights_ = Covariance(kernel, u * u.transpose(), noise, settings).llt().solve(values);
}

double ResidualField::Mean(const FieldPoint& at) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const double k =
        Square(settings_.amplitude) + Square(settings_.rate_amplitude) * at.u * points_[i].u;
    sum += weights_(i) * k * SymmetricKernel(at, points_[i], parity_, settings_.lengths);
  }
  return sum;
}

double ResidualField::Rate(const FieldPoint& at) const {
  if (settings_.rate_amplitude == 0) return 0;
  double sum = 0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    sum += weights_(i) * points_[i].u * SymmetricKernel(at, points_[i], parity_, settings_.lengths);
  }
  return Square(settings_.rate_amplitude) * sum;
}

namespace {

/// The best of the candidates that came by.
class Contest {
 public:
  Contest(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
          const Eigen::VectorXd& noise)
      : values_(values), noise_(noise) {
    const Eigen::VectorXd u = SpeedsOf(points);
    speeds_ = u * u.transpose();
    spread_ = std::sqrt(u.squaredNorm() / static_cast<double>(u.size()));
    size_ = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
  }

  /// All amplitudes and ridges with these lengths.
  void Enter(const Eigen::MatrixXd& kernel, const Lengths& lengths) {
    for (const double amplitude : {0.0, 0.25, 0.5, 1.0, 2.0}) {
      for (const double lack : {0.0, 0.03, 0.1, 0.25, 0.5, 1.0}) {
        for (const double rate : {0.0, 0.1, 0.2, 0.4, 0.8}) {
          if (rate > 0 && (spread_ == 0 || amplitude == 0)) break;
          FieldSettings s{lengths, amplitude * size_, lack * size_, 0};
          if (rate > 0) s.rate_amplitude = rate * s.amplitude / spread_;
          Enter(kernel, s);
        }
      }
    }
  }
  const SelectedField& best() const { return best_; }

 private:
  void Enter(const Eigen::MatrixXd& kernel, const FieldSettings& s) {
    const double likelihood = Likelihood(Covariance(kernel, speeds_, noise_, s), values_);
    // A later candidate must earn its place: a thousandth a value.
    const double gain = 1e-3 * static_cast<double>(values_.size());
    if (likelihood > best_.likelihood + gain) best_ = {s, likelihood};
  }

  const Eigen::VectorXd &values_, &noise_;
  Eigen::MatrixXd speeds_;
  double spread_, size_;
  SelectedField best_{{}, -std::numeric_limits<double>::infinity()};
};

}  // namespace

SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity) {
  Contest contest(points, values, noise);
  for (const double load : {0.7, 2.0, 5.0}) {
    for (const double plane : {0.25, 0.45, 0.8, 1.4}) {
      for (const double lateral : {0.25, 0.45, 0.8, 1.4, 2.5}) {
        if (lateral < plane) continue;
        const Lengths lengths{plane, lateral, load};
        contest.Enter(KernelMatrix(points, parity, lengths), lengths);
      }
    }
  }
  return contest.best();
}

HullDistance::HullDistance(std::vector<FieldPoint> points, const Lengths& lengths)
    : points_(std::move(points)), lengths_(lengths) {
  Eigen::MatrixXd k = KernelMatrix(points_, {1, 1}, lengths);
  k.diagonal().array() += kDistanceRidge;
  factor_.compute(k);
}

double HullDistance::At(const FieldPoint& at) const {
  Eigen::VectorXd k(static_cast<Eigen::Index>(points_.size()));
  for (Eigen::Index i = 0; i < k.size(); ++i) {
    k(i) = SymmetricKernel(at, points_[i], {1, 1}, lengths_);
  }
  const double prior = SymmetricKernel(at, at, {1, 1}, lengths_);
  const double open = prior - k.dot(factor_.solve(k));
  return std::sqrt(open > 0 ? open / prior : 0);
}

}  // namespace grouser::surrogate

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

Eigen::MatrixXd KernelMatrix(const std::vector<FieldPoint>& points, ResidualTable::Parity parity,
                             double length, double load_length) {
  const int n = static_cast<int>(points.size());
  Eigen::MatrixXd k(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      k(i, j) = k(j, i) = SymmetricKernel(points[i], points[j], parity, length, load_length);
    }
  }
  return k;
}

/// k without its noise, from both matrices of s.
Eigen::MatrixXd Covariance(const std::vector<FieldPoint>& points, const Eigen::MatrixXd& plain,
                           const Eigen::MatrixXd& rate, const FieldSettings& s) {
  Eigen::MatrixXd k = Square(s.amplitude) * plain;
  if (s.rate_amplitude == 0) return k;
  Eigen::VectorXd u(k.rows());
  for (Eigen::Index i = 0; i < u.size(); ++i) u(i) = points[i].u;
  k += Square(s.rate_amplitude) * (u.asDiagonal() * rate * u.asDiagonal());
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
  if ((settings.amplitude <= 0 && settings.rate_amplitude <= 0) || points_.empty()) return;
  const auto kernel = [&](double length) {
    return KernelMatrix(points_, parity, length, settings.load_length);
  };
  const Eigen::MatrixXd rate =
      settings.rate_amplitude > 0 ? kernel(settings.rate_length) : Eigen::MatrixXd();
  Eigen::MatrixXd covariance = Covariance(points_, kernel(settings.length), rate, settings);
  covariance.diagonal() += NoiseVariance(noise, settings);
  weights_ = covariance.llt().solve(values);
}

double ResidualField::Mean(const FieldPoint& at) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    sum += weights_(i) *
           SymmetricKernel(at, points_[i], parity_, settings_.length, settings_.load_length);
  }
  sum *= Square(settings_.amplitude);
  return at.u == 0 ? sum : sum + at.u * Rate(at);
}

double ResidualField::Rate(const FieldPoint& at) const {
  if (settings_.rate_amplitude == 0) return 0;
  double sum = 0;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    sum += weights_(i) * points_[i].u *
           SymmetricKernel(at, points_[i], parity_, settings_.rate_length, settings_.load_length);
  }
  return Square(settings_.rate_amplitude) * sum;
}

namespace {

/// The best of the candidates that came by.
class Contest {
 public:
  Contest(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
          const Eigen::VectorXd& noise)
      : points_(points), values_(values), noise_(noise) {}

  void Enter(const Eigen::MatrixXd& plain, const Eigen::MatrixXd& rate, const FieldSettings& s) {
    Eigen::MatrixXd covariance = Covariance(points_, plain, rate, s);
    covariance.diagonal() += NoiseVariance(noise_, s);
    const double density = LeaveOneOutDensity(covariance, values_);
    // A later candidate must earn its place: a thousandth a value.
    if (density <= best_.density + 1e-3 * static_cast<double>(points_.size())) return;
    best_ = {s, density};
  }
  const SelectedField& best() const { return best_; }

 private:
  const std::vector<FieldPoint>& points_;
  const Eigen::VectorXd &values_, &noise_;
  SelectedField best_{{}, -std::numeric_limits<double>::infinity()};
};

double RootMeanSquareOfU(const std::vector<FieldPoint>& points) {
  double sum = 0;
  for (const FieldPoint& p : points) sum += p.u * p.u / static_cast<double>(points.size());
  return std::sqrt(sum);
}

}  // namespace

SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity) {
  const double size = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
  const double spread = RootMeanSquareOfU(points);
  Contest contest(points, values, noise);
  for (const double load_length : {0.7, 2.0}) {
    const auto kernel = [&](double length) {
      return KernelMatrix(points, parity, length, load_length);
    };
    std::vector<std::pair<double, Eigen::MatrixXd>> rates;
    for (const double length : {0.8, 1.6}) {
      if (spread > 0) rates.emplace_back(length, kernel(length));
    }
    for (const double length : {0.25, 0.45, 0.8, 1.4}) {
      const Eigen::MatrixXd plain = kernel(length);
      for (const double amplitude : {0.0, 0.25, 0.5, 1.0, 2.0}) {
        for (const double lack : {0.0, 0.25, 0.5, 1.0}) {
          FieldSettings s{length, load_length, amplitude * size, lack * size};
          contest.Enter(plain, {}, s);
          for (const auto& [rate_length, rate] : rates) {
            for (const double rate_amplitude : {0.25, 0.5, 1.0}) {
              s.rate_length = rate_length;
              s.rate_amplitude = rate_amplitude * size / spread;
              contest.Enter(plain, rate, s);
            }
          }
        }
      }
    }
  }
  return contest.best();
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

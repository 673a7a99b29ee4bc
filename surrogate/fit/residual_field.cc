#include "surrogate/fit/residual_field.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr double kJitter = 1e-6;  // of the prior variance
constexpr double kDistanceRidge = 0.01;
constexpr double kHeadingCorner = 0.04;  // where (p, y) becomes a heading
constexpr double kSlidingCorner = 0.05;  // and (p - q, y) the way in which the rim slides

double Square(double x) { return x * x; }

struct Mirror {
  int x, y;
};
constexpr std::array<Mirror, 4> kMirrorsOfAll = {{{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};

int SignOf(const Mirror& m, ResidualTable::Parity parity) {
  return (m.x < 0 ? parity.x : 1) * (m.y < 0 ? parity.y : 1);
}

FieldCoordinates CoordinatesOf(const FieldPoint& at) {
  const auto& [p, y, q] = at.direction;
  const double hub = std::sqrt(p * p + y * y + kHeadingCorner);
  const double slide = std::sqrt((p - q) * (p - q) + y * y + kSlidingCorner);
  constexpr double kHalf = 1 / std::numbers::sqrt2;
  return {(p - q) * kHalf, (p + q) * kHalf, y,        at.log_load, p / hub,
          y / hub,         (p - q) / slide, y / slide};
}

std::vector<FieldCoordinates> CoordinatesOf(const std::vector<FieldPoint>& points) {
  std::vector<FieldCoordinates> all;
  all.reserve(points.size());
  for (const FieldPoint& point : points) all.push_back(CoordinatesOf(point));
  return all;
}

/// Squared differences by length: mirror x turns v_x and rim, mirror y turns v_y.
std::array<double, Lengths::kAxes> SquaresOf(const FieldCoordinates& a, const FieldCoordinates& b,
                                             const Mirror& m) {
  return {Square(a[0] - m.x * b[0]),
          Square(a[1] - m.x * b[1]),
          Square(a[2] - m.y * b[2]),
          Square(a[3] - b[3]),
          Square(a[4] - m.x * b[4]),
          Square(a[5] - m.y * b[5]),
          Square(a[6] - m.x * b[6]) + Square(a[7] - m.y * b[7])};
}

/// sum_g chi(g) m(d(a, g b)).
double SymmetricKernel(const FieldCoordinates& a, const FieldCoordinates& b,
                       ResidualTable::Parity parity, const Lengths& lengths) {
  const std::array<double, Lengths::kAxes> length = lengths.All();
  double sum = 0;
  for (const Mirror& m : kMirrorsOfAll) {
    const auto square = SquaresOf(a, b, m);
    double d2 = 0;
    for (int i = 0; i < Lengths::kAxes; ++i) d2 += square[i] / Square(length[i]);
    const double d = std::sqrt(5 * d2);
    sum += SignOf(m, parity) * (1 + d + d * d / 3) * std::exp(-d);
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

PairKernel::PairKernel(const std::vector<FieldPoint>& points, ResidualTable::Parity parity) {
  const std::vector<FieldCoordinates> at = CoordinatesOf(points);
  const auto n = static_cast<Eigen::Index>(at.size());
  for (int m = 0; m < kMirrors; ++m) {
    sign_[m] = SignOf(kMirrorsOfAll[m], parity);
    for (Eigen::MatrixXd& square : squares_[m]) square.resize(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto square = SquaresOf(at[i], at[j], kMirrorsOfAll[m]);
        for (int a = 0; a < Lengths::kAxes; ++a) squares_[m][a](i, j) = square[a];
      }
    }
  }
}

Eigen::MatrixXd PairKernel::At(const Lengths& lengths) const { return At(lengths, nullptr); }

Eigen::MatrixXd PairKernel::At(const Lengths& lengths,
                               std::array<Eigen::MatrixXd, Lengths::kAxes>* slopes) const {
  const std::array<double, Lengths::kAxes> length = lengths.All();
  const Eigen::Index n = squares_[0][0].rows();
  Eigen::MatrixXd kernel = Eigen::MatrixXd::Zero(n, n);
  if (slopes) slopes->fill(kernel);
  for (int m = 0; m < kMirrors; ++m) {
    Eigen::ArrayXXd d2 = Eigen::ArrayXXd::Zero(n, n);
    for (int a = 0; a < Lengths::kAxes; ++a) {
      d2 += squares_[m][a].array() / Square(length[a]);
    }
    const Eigen::ArrayXXd d = (5 * d2).sqrt(), decay = (-d).exp();
    kernel.array() += sign_[m] * (1 + d + d.square() / 3) * decay;
    if (!slopes) continue;
    for (int a = 0; a < Lengths::kAxes; ++a) {
      const double weight = sign_[m] * 5 / (3 * Square(length[a]));
      (*slopes)[a].array() += weight * (1 + d) * decay * squares_[m][a].array();
    }
  }
  return kernel;
}

Eigen::VectorXd NoiseVariance(const Eigen::VectorXd& noise, const FieldSettings& s) {
  const double floor = Square(s.lack_of_fit) + kJitter * Square(s.amplitude) + 1e-12;
  return noise.array().square() + floor;
}

ResidualField::ResidualField(std::vector<FieldPoint> points, const Eigen::VectorXd& values,
                             const Eigen::VectorXd& noise, ResidualTable::Parity parity,
                             const FieldSettings& settings)
    : points_(std::move(points)), parity_(parity), settings_(settings) {
  if (settings.amplitude <= 0 || points_.empty()) return;
  coordinates_ = CoordinatesOf(points_);
  Eigen::MatrixXd k = PairKernel(points_, parity).At(settings.lengths);
  for (Eigen::Index i = 0; i < k.rows(); ++i) {
    for (Eigen::Index j = 0; j < k.cols(); ++j) {
      k(i, j) *= Square(settings.amplitude) +
                 Square(settings.rate_amplitude) * points_[i].u * points_[j].u;
    }
  }
  k.diagonal() += NoiseVariance(noise, settings);
  weights_ = k.llt().solve(values);
}

ResidualField::Terms ResidualField::At(const FieldPoint& at) const {
  const FieldCoordinates here = CoordinatesOf(at);
  Terms sum{};
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const double k =
        weights_(i) * SymmetricKernel(here, coordinates_[i], parity_, settings_.lengths);
    sum.table += k;
    sum.rate += k * points_[i].u;
  }
  return {Square(settings_.amplitude) * sum.table, Square(settings_.rate_amplitude) * sum.rate};
}

double ResidualField::Mean(const FieldPoint& at) const {
  const Terms terms = At(at);
  return terms.table + at.u * terms.rate;
}

HullDistance::HullDistance(const std::vector<FieldPoint>& points, const Lengths& lengths)
    : coordinates_(CoordinatesOf(points)), lengths_(lengths) {
  Eigen::MatrixXd k = PairKernel(points, {1, 1}).At(lengths);
  k.diagonal().array() += kDistanceRidge;
  factor_.compute(k);
}

double HullDistance::At(const FieldPoint& at) const {
  const FieldCoordinates here = CoordinatesOf(at);
  Eigen::VectorXd k(static_cast<Eigen::Index>(coordinates_.size()));
  for (Eigen::Index i = 0; i < k.size(); ++i) {
    k(i) = SymmetricKernel(here, coordinates_[i], {1, 1}, lengths_);
  }
  const double prior = SymmetricKernel(here, here, {1, 1}, lengths_);
  const double open = prior - k.dot(factor_.solve(k));
  return std::sqrt(open > 0 ? open / prior : 0);
}

}  // namespace grouser::surrogate

// Fields by themselves: kernel, settings by the likelihood, hull distance.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "surrogate/fit/residual_field.h"

namespace grouser::surrogate {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<FieldPoint> RandomPoints(int n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<FieldPoint> points;
  for (int i = 0; i < n; ++i) {
    const ChartPoint chart{kPi * (unit(random) - 0.5), 0.5 * kPi * unit(random)};
    points.push_back(MakeFieldPoint(chart, std::log(10 + 20 * unit(random))));
  }
  return points;
}

Eigen::VectorXd ValuesOf(const std::vector<FieldPoint>& points,
                         const std::function<double(const FieldPoint&)>& of) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) values(i) = of(points[i]);
  return values;
}

TEST(PairKernel, SlopesAreThoseOfItsValues) {
  const std::vector<FieldPoint> points = RandomPoints(7, 1);
  for (const ResidualTable::Parity parity : {ResidualTable::Parity{1, 1}, {-1, 1}, {-1, -1}}) {
    const PairKernel kernel(points, parity);
    const std::array<double, Lengths::kAxes> at = {0.8, 1.1, 0.6, 2.0, 1.3, 0.9, 1.5};
    std::array<Eigen::MatrixXd, Lengths::kAxes> slopes;
    const Eigen::MatrixXd values = kernel.At(Lengths::Of(at), &slopes);
    EXPECT_TRUE(values.isApprox(kernel.At(Lengths::Of(at)), 1e-14));
    for (int a = 0; a < Lengths::kAxes; ++a) {
      auto low = at, high = at;
      low[a] *= std::exp(-1e-5);
      high[a] *= std::exp(1e-5);
      const Eigen::MatrixXd difference =
          (kernel.At(Lengths::Of(high)) - kernel.At(Lengths::Of(low))) / 2e-5;
      EXPECT_LT((difference - slopes[a]).cwiseAbs().maxCoeff(), 1e-7) << a;
    }
  }
}

TEST(SelectField, FindsAlongWhatValuesChange) {
  const std::vector<FieldPoint> points = RandomPoints(60, 2);
  const Eigen::VectorXd noise = Eigen::VectorXd::Constant(60, 0.01);
  // Even in both mirrors, by (p + q)/sqrt 2 alone.
  const Eigen::VectorXd by_roll = ValuesOf(
      points, [](const FieldPoint& p) { return std::cos(3 * (p.direction[0] + p.direction[2])); });
  const Lengths roll = SelectField(points, by_roll, noise, {1, 1}).settings.lengths;
  const Eigen::VectorXd by_load =
      ValuesOf(points, [](const FieldPoint& p) { return std::sin(4 * p.log_load); });
  const Lengths load = SelectField(points, by_load, noise, {1, 1}).settings.lengths;
  EXPECT_LT(roll.roll, 0.6 * roll.slip);
  EXPECT_LT(roll.roll, 0.6 * roll.lateral);
  EXPECT_LT(load.load, 0.5 * roll.load);
  EXPECT_GT(load.roll, 1.5 * roll.roll);
}

TEST(SelectField, OfNoiseThereIsNone) {
  const std::vector<FieldPoint> points = RandomPoints(40, 3);
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0, 0.05);
  const Eigen::VectorXd values =
      ValuesOf(points, [&](const FieldPoint&) { return normal(random); });
  const FieldSettings noise =
      SelectField(points, values, Eigen::VectorXd::Constant(40, 0.05), {1, 1}).settings;
  EXPECT_EQ(noise.amplitude, 0);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(40);
  EXPECT_EQ(SelectField(points, zero, zero, {1, -1}).settings.amplitude, 0);
}

TEST(ResidualField, FollowsWhatItWasFittedToInBothMirrors) {
  const std::vector<FieldPoint> points = RandomPoints(80, 5), others = RandomPoints(40, 6);
  const ResidualTable::Parity parity{1, -1};
  const auto truth = [](const FieldPoint& p) {
    const auto& [x, y, q] = p.direction;
    return -y * (1 + 0.4 * y * y) / std::sqrt(y * y + (x - q) * (x - q) + 0.2) +
           0.1 * y * p.log_load;
  };
  const Eigen::VectorXd values = ValuesOf(points, truth);
  const Eigen::VectorXd noise = Eigen::VectorXd::Constant(values.size(), 1e-3);
  const SelectedField selected = SelectField(points, values, noise, parity);
  const ResidualField field(points, values, noise, parity, selected.settings);
  double error2 = 0, size2 = 0;
  for (const FieldPoint& p : others) {
    error2 += std::pow(field.Mean(p) - truth(p), 2);
    size2 += std::pow(truth(p), 2);
    FieldPoint left = p, back = p;
    left.direction[1] *= -1;
    back.direction[0] *= -1;
    back.direction[2] *= -1;
    EXPECT_NEAR(field.Mean(left), -field.Mean(p), 1e-9);
    EXPECT_NEAR(field.Mean(back), field.Mean(p), 1e-9);
  }
  EXPECT_LT(error2, 0.01 * 0.01 * size2);
  FieldPoint ahead = others[0];
  ahead.direction[1] = 0;
  EXPECT_NEAR(field.Mean(ahead), 0, 1e-12);
}

TEST(HullDistance, GrowsFromTheRuns) {
  const std::vector<FieldPoint> points = RandomPoints(30, 7);
  const HullDistance distance(points, {0.4, 0.4, 0.4, 1, 0.6, 0.6, 1});
  FieldPoint far = points[0];
  far.log_load += 6;
  EXPECT_LT(distance.At(points[0]), 0.12);
  EXPECT_GT(distance.At(far), 0.95);
}

}  // namespace
}  // namespace grouser::surrogate

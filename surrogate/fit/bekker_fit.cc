#include "surrogate/fit/bekker_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/fit/stress_profile.h"

namespace grouser::surrogate {
namespace {

constexpr int kResiduals = static_cast<int>(std::size(kPredicted));
constexpr double kModelFloor = 0.04;  // of the scale: no smooth model does better
constexpr double kCorner = 5;         // of Huber's loss
constexpr int kFirstIterations = 12;
constexpr double kReferenceDepth = 0.3;  // of r: where the pressure is a parameter

// A fitted coordinate x: ln(parameter), or 1 + parameter/unit; the 1 keeps the
// relative steps of numeric derivatives large where the parameter is 0.
struct Coordinate {
  double BekkerParameters::*member;  // null: pressure at the reference depth
  double unit;                       // 0: logarithmic
  double center, sd, low, high;      // of ln(parameter), or of parameter/unit

  double Shift() const { return unit == 0 ? 0 : 1; }
  double Value(double x) const { return unit == 0 ? std::exp(x) : (x - 1) * unit; }
  double At(double value) const {
    const double bounded = std::clamp(unit == 0 ? std::log(value) : value / unit, low, high);
    return bounded + Shift();
  }
};

// Numeric derivatives step a little over a bound: the model's own range holds.
double Bounded(double BekkerParameters::*member, double value) {
  for (const BekkerField& field : BekkerFields()) {
    if (field.member == member) return std::clamp(value, field.low, field.high);
  }
  return value;
}

std::vector<Coordinate> Coordinates(double radius) {
  using P = BekkerParameters;
  const double k = std::log(0.16 * radius);
  return {
      {nullptr, 0, 0, 0, std::log(1.0), std::log(1e8)},  // no prior
      {&P::n, 1, 1.0, 0.3, 0.3, 1.6},
      {&P::cohesion, 1000, 0, 0.3, 0, 5},
      {&P::friction_angle, 1, 0.5, 0.2, 0.02, 1.1},
      {&P::shear_modulus, 0, k, 0.8, std::log(0.003 * radius), std::log(3 * radius)},
      {&P::c1, 1, 0.3, 0.15, 0.02, 0.8},
      {&P::c2, 1, 0.15, 0.15, -0.3, 0.6},
      {&P::c3, 1, 0.3, 0.2, 0, 1},
      {&P::sinkage_drive, 1, 0.4, 0.3, 0, 2},
      {&P::sinkage_brake, 1, 0.2, 0.3, 0, 2},
      {&P::sinkage_lateral, 1, 0.3, 0.3, 0, 2},
      {&P::side_passive, 0, std::log(4.0), 1.0, std::log(0.05), std::log(60.0)},
      {&P::front_passive, 0, std::log(1.0), 1.0, std::log(0.01), std::log(40.0)},
      {&P::bulldozing_length, 0, k, 0.8, std::log(0.003 * radius), std::log(3 * radius)},
  };
}

// A row's profile, ready for the residuals.
struct RowProfile {
  const Row* row;
  Canonical state;
  ComparedProfile compared;
};

struct Problem {
  const std::vector<Row>* rows;
  std::vector<RowProfile> profiles;
  WheelGeometry wheel;
  BekkerFitOptions options;
  std::vector<Coordinate> coordinates;

  double ReferenceDepth() const { return kReferenceDepth * wheel.radius_m; }

  BekkerParameters Parameters(const double* x) const {
    BekkerParameters p;
    p.k_c = 0;
    p.unit_weight = options.unit_weight;
    for (std::size_t i = 1; i < coordinates.size(); ++i) {
      const Coordinate& c = coordinates[i];
      p.*c.member = Bounded(c.member, c.Value(x[i]));
    }
    p.k_phi = std::exp(x[0]) / std::pow(ReferenceDepth(), p.n);
    return p;
  }

  std::vector<double> Point(const BekkerParameters& p) const {
    std::vector<double> x(coordinates.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Coordinate& c = coordinates[i];
      const double modulus = p.k_c / wheel.width_m + p.k_phi;
      x[i] = c.At(c.member == nullptr ? modulus * std::pow(ReferenceDepth(), p.n) : p.*c.member);
    }
    return x;
  }
};

struct RowResidual {
  const Problem* problem;
  const Row* row;

  bool operator()(const double* const* x, double* residual) const {
    try {
      const BekkerModel model(problem->Parameters(x[0]), problem->wheel);
      const BekkerModel::Answer a =
          model.Solve(row->motion.v_x, row->motion.v_y, row->motion.rim_speed, row->load_n);
      for (int i = 0; i < kResiduals; ++i) {
        const int o = kPredicted[i];
        const double scale = OutputScale(o, row->load_n, problem->wheel.radius_m);
        const double patch = problem->options.patch[o] * scale;
        const double sigma =
            std::hypot(std::hypot(row->standard_error[o], patch), kModelFloor * scale);
        residual[i] = (a.value[o] - row->mean[o]) / sigma;
      }
    } catch (const std::invalid_argument&) {
      return false;  // outside the model's range: the step is refused
    }
    return true;
  }
};

struct StressResidual {
  const Problem* problem;
  const RowProfile* own;

  bool operator()(const double* const* x, double* residual) const {
    try {
      const BekkerModel model(problem->Parameters(x[0]), problem->wheel);
      const RimProfile& measured = own->compared.measured;
      const double sinkage = model.SolveCanonical(own->state, own->row->load_n).value[kSinkage];
      const RimProfile said =
          ModelProfile(model, own->state, sinkage, measured, problem->options.smear_rad);
      const double root =
          std::sqrt(problem->options.profile_weight * kResiduals / (2.0 * own->compared.bins));
      for (std::size_t i = 0; i < measured.size(); ++i) {
        residual[2 * i] = root * (said.normal[i] - measured.normal[i]) / own->compared.sd_normal;
        residual[2 * i + 1] =
            root * (said.tangential[i] - measured.tangential[i]) / own->compared.sd_tangential;
      }
    } catch (const std::invalid_argument&) {
      return false;
    }
    return true;
  }
};

struct PriorResidual {
  const Problem* problem;

  bool operator()(const double* const* x, double* residual) const {
    for (std::size_t i = 1; i < problem->coordinates.size(); ++i) {
      const Coordinate& c = problem->coordinates[i];
      residual[i - 1] = (x[0][i] - c.Shift() - c.center) / c.sd;
    }
    return true;
  }
};

// Sets the pressure so that the mean sinkage of the runs is met.
void MatchSinkage(const Problem& problem, std::vector<double>* x) {
  double measured = 0;
  for (const Row& row : *problem.rows) measured += row.mean[kSinkage];
  double low = problem.coordinates[0].low, high = problem.coordinates[0].high;
  for (int i = 0; i < 40; ++i) {
    (*x)[0] = 0.5 * (low + high);
    const BekkerModel model(problem.Parameters(x->data()), problem.wheel);
    double sum = 0;
    for (const Row& row : *problem.rows) {
      sum += model.Solve(row.motion.v_x, row.motion.v_y, row.motion.rim_speed, row.load_n)
                 .value[kSinkage];
    }
    (sum > measured ? low : high) = (*x)[0];
  }
}

using Cost = ceres::DynamicNumericDiffCostFunction<RowResidual, ceres::FORWARD>;
using StressCost = ceres::DynamicNumericDiffCostFunction<StressResidual, ceres::FORWARD>;
using PriorCost = ceres::DynamicNumericDiffCostFunction<PriorResidual, ceres::FORWARD>;

// Returns false where Ceres found nothing usable.
bool Minimise(const Problem& problem, int iterations, std::vector<double>* x, double* cost) {
  const int n = static_cast<int>(x->size());
  ceres::Problem ceres_problem;
  for (const Row& row : *problem.rows) {
    auto* function = new Cost(new RowResidual{&problem, &row});
    function->AddParameterBlock(n);
    function->SetNumResiduals(kResiduals);
    ceres_problem.AddResidualBlock(function, new ceres::HuberLoss(kCorner), x->data());
  }
  for (const RowProfile& own : problem.profiles) {
    auto* function = new StressCost(new StressResidual{&problem, &own});
    function->AddParameterBlock(n);
    function->SetNumResiduals(2 * static_cast<int>(own.compared.measured.size()));
    ceres_problem.AddResidualBlock(function, new ceres::HuberLoss(kCorner), x->data());
  }
  auto* prior = new PriorCost(new PriorResidual{&problem});
  prior->AddParameterBlock(n);
  prior->SetNumResiduals(n - 1);
  ceres_problem.AddResidualBlock(prior, nullptr, x->data());
  for (int i = 0; i < n; ++i) {
    const Coordinate& c = problem.coordinates[i];
    ceres_problem.SetParameterLowerBound(x->data(), i, c.low + c.Shift());
    ceres_problem.SetParameterUpperBound(x->data(), i, c.high + c.Shift());
  }
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = 1e-5;
  options.num_threads = 1;  // the answer must not depend on the machine
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  *cost = summary.final_cost;
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

std::vector<double> Start(const Problem& problem, int number) {
  BekkerParameters p;
  for (const Coordinate& c : problem.coordinates) {
    if (c.member != nullptr) p.*c.member = c.Value(c.center + c.Shift());
  }
  if (number == 1) {  // smooth rim, short shear, peak low
    p.friction_angle = 0.3;
    p.shear_modulus *= 0.4;
    p.c1 = 0.15;
  } else if (number == 2) {  // firm and rough
    p.n = 0.8;
    p.friction_angle = 0.65;
    p.shear_modulus *= 2;
    p.side_passive *= 2;
  }
  std::vector<double> x = problem.Point(p);
  MatchSinkage(problem, &x);
  return x;
}

std::vector<RowProfile> ProfilesOf(const std::vector<Row>& rows, const WheelGeometry& wheel) {
  std::vector<RowProfile> profiles;
  for (const Row& row : rows) {
    if (!HasProfile(*row.source)) continue;
    RowProfile own{&row, ToCanonical(row.motion.v_x, row.motion.v_y, row.motion.rim_speed),
                   MakeCompared(row, wheel)};
    if (IsComparable(own.compared)) profiles.push_back(std::move(own));
  }
  return profiles;
}

}  // namespace

BekkerFit FitBekker(const std::vector<Row>& rows, const WheelGeometry& wheel,
                    const BekkerFitOptions& options, const BekkerParameters* from) {
  Problem problem{&rows, {}, wheel, options, Coordinates(wheel.radius_m)};
  if (options.profile_weight > 0) problem.profiles = ProfilesOf(rows, wheel);
  // A short way from every start, the rest from the best.
  std::vector<double> best;
  double best_cost = 0;
  const int starts = from != nullptr ? 1 : std::clamp(options.starts, 1, 3);
  for (int i = 0; i < starts; ++i) {
    std::vector<double> x = from != nullptr ? problem.Point(*from) : Start(problem, i);
    double cost = 0;
    const int iterations = starts == 1 ? options.max_iterations : kFirstIterations;
    if (!Minimise(problem, iterations, &x, &cost)) continue;
    if (!best.empty() && cost >= best_cost) continue;
    best = x;
    best_cost = cost;
  }
  if (best.empty()) throw std::runtime_error("physics fit: no start led to a usable solution");
  if (starts > 1) Minimise(problem, options.max_iterations, &best, &best_cost);
  return {problem.Parameters(best.data()), best_cost};
}

}  // namespace grouser::surrogate

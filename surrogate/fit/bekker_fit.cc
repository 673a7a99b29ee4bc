#include "surrogate/fit/bekker_fit.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "surrogate/fit/stress_profile.h"
#include "surrogate/models/bekker_balance.h"
#include "surrogate/models/bekker_constants.h"
#include "surrogate/models/isa.h"

namespace grouser::surrogate {
namespace {

constexpr int kResiduals = static_cast<int>(std::size(kPredicted));
constexpr double kModelFloor = 0.04;  // of the scale: no smooth model does better
constexpr double kCorner = 5;         // of Huber's loss
constexpr int kFirstIterations = 12;
constexpr double kReferenceDepth = 0.3;  // of r: where the pressure is a parameter
constexpr int kCoordinates = 14;

// A number with its derivatives by the coordinates, and last by the entry angle.
using Slopes = Dual<double, kCoordinates + 1>;

// A fitted coordinate x: ln(parameter), or parameter/unit.
struct Coordinate {
  double BekkerParameters::*member;  // null: pressure at the reference depth
  double unit;                       // 0: logarithmic
  double center, sd, low, high;      // of ln(parameter), or of parameter/unit

  double ValueOf(double x) const { return unit == 0 ? std::exp(x) : x * unit; }
  double At(double value) const {
    return std::clamp(unit == 0 ? std::log(value) : value / unit, low, high);
  }
};

std::array<Coordinate, kCoordinates> Coordinates(double radius) {
  using P = BekkerParameters;
  const double k = std::log(0.16 * radius);
  return {{
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
  }};
}

// A row's profile, ready for the residuals.
struct RowProfile {
  const Sample* row;
  Canonical state;
  ComparedProfile compared;
  ProfileSamples samples;
};

struct Problem {
  const std::vector<Sample>* rows;
  std::vector<RowProfile> profiles;
  WheelGeometry wheel;
  BekkerFitOptions options;
  std::array<Coordinate, kCoordinates> coordinates;

  double ReferenceDepth() const { return kReferenceDepth * wheel.radius_m; }

  BekkerParameters Parameters(const double* x) const {
    BekkerParameters p;
    p.k_c = 0;
    p.unit_weight = options.unit_weight;
    for (std::size_t i = 1; i < coordinates.size(); ++i) {
      p.*coordinates[i].member = coordinates[i].ValueOf(x[i]);
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

// A parameter as a T, with its derivatives where T has them.
template <class T>
T ParameterOf(const Problem& problem, const BekkerParameters& p, double BekkerParameters::*member) {
  T value = Constant<T>(p.*member);
  if constexpr (!Plain<T>) {
    for (int i = 1; i < kCoordinates; ++i) {
      const Coordinate& c = problem.coordinates[i];
      if (c.member == member) value.d[i] = c.unit == 0 ? value.v : c.unit;
      // k_phi = pressure / depth^n
      if (member == &BekkerParameters::k_phi && c.member == &BekkerParameters::n) {
        value.d[i] = -value.v * std::log(problem.ReferenceDepth()) * c.unit;
      }
    }
    if (member == &BekkerParameters::k_phi) value.d[0] = value.v;
  }
  return value;
}

// The model at a point, in balance: outputs in the canonical half-space.
template <class T>
struct Solved {
  BekkerLaw<T> law;
  bekker::Motion<T> motion;
  T theta_f;
  T output[kOutputs];
};
template <class T>
Solved<T> Solve(const Problem& problem, const BekkerModel& model, const Canonical& state,
                double load) {
  const BekkerLaw<double>& plain = model.law();
  const BekkerRules& rules = RulesOfBekker();
  StateBlock at;
  at.v_x[0] = state.forward;
  at.v_y[0] = state.lateral;
  at.rim_speed[0] = state.rim;
  at.load[0] = load;
  BlockSolverFor(nullptr)(plain, rules, /*gradients=*/false, 1, &at);
  const BekkerParameters& p = model.parameters();
  Solved<T> s;
  s.law = bekker::MakeLaw<T>([&](auto member) { return ParameterOf<T>(problem, p, member); },
                             problem.wheel);
  s.motion = bekker::MakeMotion(s.law, Constant<T>(state.forward), Constant<T>(state.lateral),
                                Constant<T>(state.rim));
  // With the entry angle's own derivative last, which Close does away with.
  using Open = std::conditional_t<Plain<T>, Dual<double, 1>, T>;
  constexpr int kDirections = Plain<T> ? 0 : kCoordinates;
  const Open theta = Seed<Open>(at.theta[0], kDirections, 1);
  const auto closed =
      bekker::Close<kDirections>(plain, bekker::AllForces(s.law, s.motion, theta, rules.full, true),
                                 at.theta[0], at.overload[0] != 0, load);
  const auto take = [](const Dual<double, kDirections>& from) {
    T to = Constant<T>(from.v);
    if constexpr (!Plain<T>) std::copy_n(from.d, kDirections, to.d);
    return to;
  };
  s.theta_f = take(closed.theta_f);
  for (int o = 0; o < kOutputs; ++o) s.output[o] = take(closed.of[o]);
  return s;
}

// Residuals, and where they have derivatives rows of the Jacobian.
struct ResidualRows {
  double* value;
  double* jacobian;

  void Put(int i, double r) { value[i] = r; }
  void Put(int i, const Slopes& r) {
    value[i] = r.v;
    std::copy_n(r.d, kCoordinates, jacobian + i * kCoordinates);
  }
};

struct RowResidual {
  const Problem* problem;
  const Sample* row;

  template <class T>
  void Compute(const double* x, ResidualRows to) const {
    const BekkerModel model(problem->Parameters(x), problem->wheel);
    const Canonical state = ToCanonical(row->motion.v_x, row->motion.v_y, row->motion.rim_speed);
    const Solved<T> solved = Solve<T>(*problem, model, state, row->load_n);
    std::array<double, kOutputs> sign = {1, 1, 1, 1, 1, 1};
    ApplyMirrors(state, &sign);
    for (int i = 0; i < kResiduals; ++i) {
      const int o = kPredicted[i];
      const double scale = OutputScale(o, row->load_n, problem->wheel.radius_m);
      const double patch = problem->options.patch[o] * scale;
      const double sigma =
          std::hypot(std::hypot(row->standard_error[o], patch), kModelFloor * scale);
      to.Put(i, (sign[o] * solved.output[o] - row->mean[o]) * (1 / sigma));
    }
  }
};

struct StressResidual {
  const Problem* problem;
  const RowProfile* own;

  template <class T>
  void Compute(const double* x, ResidualRows to) const {
    const BekkerModel model(problem->Parameters(x), problem->wheel);
    const Solved<T> solved = Solve<T>(*problem, model, own->state, own->row->load_n);
    const auto contact = bekker::MakeContact(solved.law, solved.motion, solved.theta_f);
    const ProfileSamples& samples = own->samples;
    std::vector<bekker::Stress<T>> stress;
    stress.reserve(samples.angle.size());
    for (const double angle : samples.angle) {
      stress.push_back(bekker::StressAt(solved.law, contact, angle));
    }
    const ComparedProfile& compared = own->compared;
    const double root =
        std::sqrt(problem->options.profile_weight * kResiduals / (2.0 * compared.bins));
    for (std::size_t i = 0; i < compared.measured.size(); ++i) {
      T normal = Constant<T>(-compared.measured.normal[i]);
      T tangential = Constant<T>(-compared.measured.tangential[i]);
      for (std::size_t k = 0; k < samples.weight.size(); ++k) {
        const bekker::Stress<T>& at = stress[i * samples.per_bin + k];
        normal = normal + samples.weight[k] * at.normal;
        tangential = tangential + samples.weight[k] * at.tangential;
      }
      to.Put(static_cast<int>(2 * i), root / compared.sd_normal * normal);
      to.Put(static_cast<int>(2 * i + 1), root / compared.sd_tangential * tangential);
    }
  }
};

struct PriorResidual {
  const Problem* problem;

  template <class T>
  void Compute(const double* x, ResidualRows to) const {
    for (int i = 1; i < kCoordinates; ++i) {
      const Coordinate& c = problem->coordinates[i];
      to.Put(i - 1, (Seed<T>(x[i], i, 1) - c.center) * (1 / c.sd));
    }
  }
};

// A block of residuals of all coordinates, for Ceres.
template <class Residual>
class Cost final : public ceres::CostFunction {
 public:
  Cost(const Residual& residual, int count) : residual_(residual) {
    set_num_residuals(count);
    mutable_parameter_block_sizes()->push_back(kCoordinates);
  }
  bool Evaluate(double const* const* x, double* value, double** jacobians) const override {
    try {
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        residual_.template Compute<Slopes>(x[0], {value, jacobians[0]});
      } else {
        residual_.template Compute<double>(x[0], {value, nullptr});
      }
    } catch (const std::invalid_argument&) {
      return false;  // outside the model's range: the step is refused
    }
    return true;
  }

 private:
  Residual residual_;
};

// Sets the pressure so that the mean sinkage of the runs is met.
void MatchSinkage(const Problem& problem, std::vector<double>* x) {
  double measured = 0;
  for (const Sample& row : *problem.rows) measured += row.mean[kSinkage];
  double low = problem.coordinates[0].low, high = problem.coordinates[0].high;
  for (int i = 0; i < 40; ++i) {
    (*x)[0] = 0.5 * (low + high);
    const BekkerModel model(problem.Parameters(x->data()), problem.wheel);
    double sum = 0;
    for (const Sample& row : *problem.rows) {
      sum += model.Solve(row.motion.v_x, row.motion.v_y, row.motion.rim_speed, row.load_n)
                 .value[kSinkage];
    }
    (sum > measured ? low : high) = (*x)[0];
  }
}

// Returns false where Ceres found nothing usable.
bool Minimise(const Problem& problem, int iterations, std::vector<double>* x, double* cost) {
  ceres::Problem ceres_problem;
  for (const Sample& row : *problem.rows) {
    ceres_problem.AddResidualBlock(new Cost<RowResidual>({&problem, &row}, kResiduals),
                                   new ceres::HuberLoss(kCorner), x->data());
  }
  for (const RowProfile& own : problem.profiles) {
    const int count = 2 * static_cast<int>(own.compared.measured.size());
    ceres_problem.AddResidualBlock(new Cost<StressResidual>({&problem, &own}, count),
                                   new ceres::HuberLoss(kCorner), x->data());
  }
  ceres_problem.AddResidualBlock(new Cost<PriorResidual>({&problem}, kCoordinates - 1), nullptr,
                                 x->data());
  for (int i = 0; i < kCoordinates; ++i) {
    ceres_problem.SetParameterLowerBound(x->data(), i, problem.coordinates[i].low);
    ceres_problem.SetParameterUpperBound(x->data(), i, problem.coordinates[i].high);
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
    if (c.member != nullptr) p.*c.member = c.ValueOf(c.center);
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

std::vector<RowProfile> ProfilesOf(const std::vector<Sample>& rows, const WheelGeometry& wheel,
                                   double smear_rad) {
  std::vector<RowProfile> profiles;
  for (const Sample& row : rows) {
    if (!HasProfile(*row.source)) continue;
    RowProfile own{&row,
                   ToCanonical(row.motion.v_x, row.motion.v_y, row.motion.rim_speed),
                   MakeCompared(row, wheel),
                   {}};
    if (!IsComparable(own.compared)) continue;
    own.samples = SamplesOf(own.compared.measured, smear_rad);
    profiles.push_back(std::move(own));
  }
  return profiles;
}

}  // namespace

BekkerFit FitBekker(const std::vector<Sample>& rows, const WheelGeometry& wheel,
                    const BekkerFitOptions& options, const BekkerParameters* from) {
  Problem problem{&rows, {}, wheel, options, Coordinates(wheel.radius_m)};
  if (options.profile_weight > 0) problem.profiles = ProfilesOf(rows, wheel, options.smear_rad);
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

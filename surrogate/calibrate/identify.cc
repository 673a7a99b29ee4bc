#include "surrogate/calibrate/identify.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace grouser::surrogate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr double kNoise = 0.05, kWheelNoise = 0.04, kLoading = 0.4;

// As sentences name a coordinate.
std::string WordsOf(const SoilLaw& law, int coordinate) {
  const bool reece = law.form() == kReeceForm;
  switch (coordinate) {
    case kLogPressure:
      return reece ? "the level of k_c' and k_phi'" : "the level of k_c and k_phi";
    case kModulusShare:
      return reece ? "k_c' from k_phi'" : "k_c from k_phi";
    case kExponent:
      return "n";
    default:
      break;
  }
  for (const ReportedParameter& r : law.Reported()) {
    if (r.coordinate == coordinate) return r.words;
  }
  return "another parameter";
}

struct Candidate {
  std::string text;
  MeasuredTest test;
  std::vector<Observation> rows;
};

// What was fitted, as far as advice depends on it.
struct Made {
  std::set<double> widths, pressures;
  double depth = 0;
  int wheels = 0, presses = 0, shears = 0;
  const MeasuredTest* wheel = nullptr;
  double load = 0, displacement = 0;
};

Made MadeOf(const MeasuredSoil& soil) {
  Made made;
  std::set<std::pair<int, int>> states;
  for (const Observation& at : soil.observations) {
    if (at.held_out) continue;
    const MeasuredTest& test = soil.tests[at.test];
    switch (test.kind) {
      case TestKind::kPlate:
        made.widths.insert(at.width);
        made.depth = std::max(made.depth, at.sinkage);
        break;
      case TestKind::kShear:
        made.pressures.insert(at.pressure);
        made.displacement = std::max(made.displacement, at.displacement);
        ++made.shears;
        break;
      case TestKind::kPress:
        made.wheel = &test;
        made.load = std::max(made.load, at.value);
        ++made.presses;
        break;
      case TestKind::kWheel:
        made.wheel = &test;
        made.load = at.load;
        states.insert({at.test, at.line});
    }
  }
  made.wheels = static_cast<int>(states.size());
  return made;
}

std::string Listed(const std::set<double>& values, double unit) {
  std::vector<std::string> texts;
  for (const double v : values) texts.push_back(fmt::format("{:.3g}", v / unit));
  if (texts.size() > 4) return fmt::format("{} to {}", texts.front(), texts.back());
  std::string text = texts.front();
  for (std::size_t i = 1; i < texts.size(); ++i) {
    text += (i + 1 == texts.size() ? " and " : ", ") + texts[i];
  }
  return text;
}

// What was measured, as the subject of a sentence.
std::string TestsMade(const Made& made) {
  std::vector<std::string> parts;
  if (!made.widths.empty()) {
    parts.push_back(made.widths.size() == 1
                        ? fmt::format("plates of one width (b = {} mm)", Listed(made.widths, 1e-3))
                        : fmt::format("plates of b = {} mm", Listed(made.widths, 1e-3)));
  }
  if (made.shears > 0) {
    parts.push_back(
        made.pressures.size() == 1
            ? fmt::format("shear tests at one pressure ({} kPa)", Listed(made.pressures, 1e3))
            : fmt::format("shear tests at {} kPa", Listed(made.pressures, 1e3)));
  }
  if (made.presses > 0) parts.push_back("a wheel pressed down");
  if (made.wheels > 0) {
    parts.push_back(fmt::format("{} wheel state{}", made.wheels, made.wheels == 1 ? "" : "s"));
  }
  std::string text = parts.empty() ? "the tests" : parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    text += (i + 1 == parts.size() ? " and " : ", ") + parts[i];
  }
  return text;
}

Candidate Plate(const std::string& text, double width, double depth) {
  Candidate c{text, {}, {}};
  c.test.kind = TestKind::kPlate;
  for (int i = 1; i <= 10; ++i) {
    Observation at;
    at.width = width;
    at.sinkage = depth * i / 10;
    c.rows.push_back(at);
  }
  return c;
}

Candidate Shear(const std::string& text, const std::vector<double>& pressures, double travel) {
  Candidate c{text, {}, {}};
  c.test.kind = TestKind::kShear;
  for (const double pressure : pressures) {
    for (int i = 1; i <= 10; ++i) {
      Observation at;
      at.pressure = pressure;
      at.displacement = travel * i / 10;
      c.rows.push_back(at);
    }
  }
  return c;
}

Candidate Wheel(const std::string& text, const Made& made, const std::vector<double>& slips,
                double angle) {
  Candidate c{text, *made.wheel, {}};
  c.test.kind = TestKind::kWheel;
  for (const double slip : slips) {
    for (const Output o : kMeasurable) {
      Observation at;
      at.output = o;
      at.motion = FromSlip(slip, angle, 1);
      at.load = made.load;
      c.rows.push_back(at);
    }
  }
  return c;
}

std::vector<Candidate> CandidatesFor(const SoilFit& fit, const Made& made) {
  const BekkerParameters p = fit.Parameters();
  const double width = fit.law->reference_width();
  const double depth = made.depth > 0 ? made.depth : 2 * fit.law->reference_sinkage();
  const double pressure = std::exp(fit.x[kLogPressure]);
  const double narrow = made.widths.empty() ? width : *made.widths.begin();
  const double wide = made.widths.empty() ? width : *made.widths.rbegin();
  const double travel = 5 * p.shear_modulus;
  const auto kpa = [](double value) { return fmt::format("{:.2g} kPa", 1e-3 * value); };
  const auto mm = [](double value) { return fmt::format("{:.2g} mm", 1e3 * value); };
  std::vector<Candidate> all;
  all.push_back(Plate("a plate of width b = " + mm(2 * wide), 2 * wide, depth));
  all.push_back(Plate("a plate of width b = " + mm(narrow / 2), narrow / 2, depth));
  if (!made.widths.empty()) {
    all.push_back(Plate("the same plate to a sinkage of " + mm(2 * depth), wide, 2 * depth));
  }
  if (made.pressures.size() == 1) {
    const double own = std::max(*made.pressures.begin(), 500.0);
    all.push_back(Shear("a shear ring at " + kpa(own / 4) + " besides", {own / 4}, travel));
    all.push_back(Shear("a shear ring at " + kpa(4 * own) + " besides", {4 * own}, travel));
  } else {
    all.push_back(Shear(
        "a shear ring at " + kpa(pressure / 4) + ", " + kpa(pressure) + " and " + kpa(4 * pressure),
        {pressure / 4, pressure, 4 * pressure}, travel));
  }
  if (made.wheel != nullptr && made.load > 0) {
    constexpr double kSkew = std::numbers::pi / 6;
    all.push_back(
        Wheel("the wheel driven at slips 0.1, 0.3 and 0.6, with torque", made, {0.1, 0.3, 0.6}, 0));
    all.push_back(
        Wheel("the wheel braked at slips -0.2 and -0.5, with torque", made, {-0.2, -0.5}, 0));
    all.push_back(
        Wheel("the wheel at 30 deg of attack angle and slips -0.2, 0 and 0.3, with torque", made,
              {-0.2, 0, 0.3}, kSkew));
  }
  return all;
}

// Information that a candidate adds, by the free coordinates over their priors' sds.
MatrixXd InformationOf(const SoilFit& fit, const Candidate& candidate) {
  const SoilLaw& law = *fit.law;
  const auto k = static_cast<Index>(law.free().size());
  const std::vector<MeasuredTest> tests = {candidate.test};
  std::vector<double> here, up, down;
  law.Predict(fit.x, candidate.rows, tests, &here);
  double most = 0;
  for (const double value : here) most = std::max(most, std::abs(value));
  MatrixXd j(static_cast<Index>(here.size()), k);
  for (Index c = 0; c < k; ++c) {
    const Prior& prior = law.priors()[law.free()[c]];
    Coordinates at = fit.x;
    double& x = at[law.free()[c]];
    const double high = std::min(prior.high, x + 1e-4 * prior.sd);
    const double low = std::max(prior.low, x - 1e-4 * prior.sd);
    x = high;
    law.Predict(at, candidate.rows, tests, &up);
    x = low;
    law.Predict(at, candidate.rows, tests, &down);
    for (std::size_t i = 0; i < here.size(); ++i) {
      const Observation& row = candidate.rows[i];
      const double sigma =
          row.output < 0
              ? kNoise * std::max(std::abs(here[i]), 0.05 * most)
              : kWheelNoise * OutputScale(row.output, row.load, candidate.test.wheel.radius_m);
      j(static_cast<Index>(i), c) = (up[i] - down[i]) / (high - low) * prior.sd / sigma;
    }
  }
  return j.transpose() * j;
}

// Posterior covariance over the priors'.
MatrixXd Whitened(const SoilFit& fit) {
  VectorXd inverse(fit.covariance.rows());
  for (Index c = 0; c < inverse.size(); ++c) {
    inverse[c] = 1 / fit.law->priors()[fit.law->free()[c]].sd;
  }
  return inverse.asDiagonal() * fit.covariance * inverse.asDiagonal();
}

struct Gain {
  const Candidate* candidate;
  MatrixXd after;  // covariance over the priors'
};

std::vector<Gain> GainsOf(const SoilFit& fit, const std::vector<Candidate>& candidates) {
  const MatrixXd information = Whitened(fit).inverse();
  std::vector<Gain> gains;
  for (const Candidate& c : candidates) {
    try {
      const MatrixXd added = InformationOf(fit, c);
      if (added.allFinite()) gains.push_back({&c, (information + added).inverse()});
    } catch (const std::invalid_argument&) {  // the model does not reach there
    }
  }
  return gains;
}

// The most uncertain direction of the soil's own coordinates, as a vector over all free ones.
VectorXd WorstOfSoil(const MatrixXd& covariance) {
  const Index n = std::min<Index>(kSoilCoordinates, covariance.rows());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance.topLeftCorner(n, n));
  VectorXd v = VectorXd::Zero(covariance.rows());
  v.head(n) = solver.eigenvectors().col(n - 1);
  return v;
}

double Left(const MatrixXd& covariance, const VectorXd& v) {
  return std::sqrt(std::max(0.0, (v.transpose() * covariance * v)(0)));
}

std::string Sentence(const SoilFit& fit, const Direction& d, const std::string& tests,
                     const Gain* best, double left) {
  std::string what;
  const bool modulus = d.coordinates.front() == kModulusShare;
  if (modulus) {
    what = tests + " cannot tell " + WordsOf(*fit.law, kModulusShare);
  } else if (d.coordinates.size() == 1) {
    what = tests + " do not tell " + WordsOf(*fit.law, d.coordinates.front());
  } else {
    what = tests + " cannot tell apart ";
    for (std::size_t i = 0; i < d.coordinates.size(); ++i) {
      const bool last = i + 1 == d.coordinates.size();
      what += (i == 0 ? "" : last ? " and " : ", ") + WordsOf(*fit.law, d.coordinates[i]);
    }
  }
  if (best == nullptr || left > 0.8 * d.share_left) return what + "; none of the usual tests would";
  return what + "; " + best->candidate->text + " would";
}

}  // namespace

std::vector<Direction> UnidentifiedDirections(const SoilFit& fit) {
  const Made made = MadeOf(fit.law->soil());
  const std::vector<Candidate> candidates = CandidatesFor(fit, made);
  const std::vector<Gain> gains = GainsOf(fit, candidates);
  const MatrixXd covariance = Whitened(fit);
  const std::string tests = TestsMade(made);
  std::vector<Direction> directions;
  const auto add = [&](Index first, Index count) {
    if (count <= 0) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(
        covariance.block(first, first, count, count));
    for (Index e = count - 1; e >= 0; --e) {
      Direction d{std::sqrt(std::max(0.0, solver.eigenvalues()[e])), {}, {}, ""};
      if (d.share_left <= kIdentified) break;
      VectorXd v = VectorXd::Zero(covariance.rows());
      v.segment(first, count) = solver.eigenvectors().col(e);
      std::vector<Index> order(static_cast<std::size_t>(covariance.rows()));
      for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
      std::ranges::sort(order, std::greater{}, [&](Index i) { return std::abs(v[i]); });
      for (const Index i : order) {
        if (std::abs(v[i]) < kLoading && !d.coordinates.empty()) break;
        d.coordinates.push_back(fit.law->free()[i]);
        d.loadings.push_back(v[i]);
      }
      const Gain* best = nullptr;
      for (const Gain& gain : gains) {
        if (best == nullptr || Left(gain.after, v) < Left(best->after, v)) best = &gain;
      }
      d.text = Sentence(fit, d, tests, best, best == nullptr ? 1 : Left(best->after, v));
      directions.push_back(d);
    }
  };
  const Index soil = std::min<Index>(kSoilCoordinates, covariance.rows());
  add(0, soil);
  add(soil, covariance.rows() - soil);
  return directions;
}

std::vector<NextTest> NextTests(const SoilFit& fit) {
  const Made made = MadeOf(fit.law->soil());
  const std::vector<Candidate> candidates = CandidatesFor(fit, made);
  const MatrixXd before = Whitened(fit);
  const VectorXd worst = WorstOfSoil(before);
  std::vector<NextTest> tests;
  for (const Gain& gain : GainsOf(fit, candidates)) {
    NextTest t{gain.candidate->text, Left(gain.after, worst), 1, ""};
    for (Index c = 0; c < std::min<Index>(kSoilCoordinates, before.rows()); ++c) {
      const double left = std::sqrt(gain.after(c, c) / before(c, c));
      if (left >= t.interval_left) continue;
      t.interval_left = left;
      const int of = fit.law->free()[c];
      t.gains = of == kModulusShare ? (fit.law->form() == kReeceForm ? "k_c'" : "k_c")
                                    : WordsOf(*fit.law, of);
    }
    tests.push_back(t);
  }
  std::ranges::sort(tests, {}, &NextTest::share_left);
  return tests;
}

}  // namespace grouser::surrogate

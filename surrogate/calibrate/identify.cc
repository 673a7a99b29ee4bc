#include "surrogate/calibrate/identify.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/calibrate/candidate_tests.h"

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
  if (made.wheel != nullptr) add(soil, covariance.rows() - soil);
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

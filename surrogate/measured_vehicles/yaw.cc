#include "surrogate/measured_vehicles/yaw.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/fit/binomial_band.h"

namespace grouser::measured {
namespace {

constexpr double kTooFast = 0.3;     // [rad/s] faster than without slip: no turning of the wheels
constexpr double kLeastScale = 0.2;  // [rad/s] of intervals
constexpr double kLevel = 0.9;
constexpr double kStuck = 0.2;  // of the yaw rate without slip
constexpr double kLeastFriction = 0.05, kMostFriction = 2;
constexpr double kSame = 0.04;  // of the fastest rim
constexpr int kGrid = 20, kRefinements = 14;

double Scale(const YawPoint& p) { return std::max(std::fabs(p.without_slip), kLeastScale); }

template <class Error>
double Rms(const std::vector<YawPoint>& points, bool fitted, const Error& error) {
  double sum = 0;
  int n = 0;
  for (const YawPoint& p : points) {
    if (p.fitted != fitted) continue;
    sum += error(p) * error(p);
    ++n;
  }
  return std::sqrt(sum / n);
}

// Predicts all rows at a friction level; returns how many have no balance.
int Predict(const GroundOf& ground, double friction, std::vector<YawPoint>* points) {
  std::vector<double> left, right;
  for (const YawPoint& p : *points) {
    left.push_back(p.left_m_per_s);
    right.push_back(p.right_m_per_s);
  }
  const std::vector<vehicle::Solution> solved = ground(friction).Turn(left, right);
  int unbalanced = 0;
  for (std::size_t i = 0; i < solved.size(); ++i) {
    (*points)[i].predicted = solved[i].yaw_rate_rad_per_s;
    (*points)[i].predicted_v_x = solved[i].v_x_m_per_s;
    unbalanced += !solved[i].balanced;
  }
  return unbalanced;
}

// The best level of a grid, then golden sections between its neighbours.
double FitFriction(const GroundOf& ground, std::vector<YawPoint>* points) {
  const auto misfit = [&](double log_friction) {
    Predict(ground, std::exp(log_friction), points);
    const double rms =
        Rms(*points, true, [](const YawPoint& p) { return p.predicted - p.measured; });
    return std::isfinite(rms) ? rms : 1e30;
  };
  const double low = std::log(kLeastFriction), step = (std::log(kMostFriction) - low) / kGrid;
  int best = 0;
  double least = 1e30;
  for (int i = 0; i <= kGrid; ++i) {
    const double here = misfit(low + i * step);
    if (here < least) {
      least = here;
      best = i;
    }
  }
  double a = low + std::max(best - 1, 0) * step, b = low + std::min(best + 1, kGrid) * step;
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  double c = b - ratio * (b - a), d = a + ratio * (b - a);
  double at_c = misfit(c), at_d = misfit(d);
  for (int i = 0; i < kRefinements; ++i) {
    if (at_c < at_d) {
      b = d, d = c, at_d = at_c;
      at_c = misfit(c = b - ratio * (b - a));
    } else {
      a = c, c = d, at_c = at_d;
      at_d = misfit(d = a + ratio * (b - a));
    }
  }
  return std::exp((a + b) / 2);
}

void AddIntervals(YawComparison* result) {
  std::vector<double> errors;
  for (const YawPoint& p : result->points) {
    if (p.fitted) errors.push_back(std::fabs(p.predicted - p.measured) / Scale(p));
  }
  std::ranges::sort(errors);
  const double n = static_cast<double>(errors.size());
  const auto rank = static_cast<std::size_t>(std::ceil((n + 1) * kLevel));
  const double factor = errors[std::min(rank, errors.size()) - 1];
  for (YawPoint& p : result->points) {
    p.half_width = factor * Scale(p);
    if (p.fitted) continue;
    ++result->held_back;
    result->covered += std::fabs(p.predicted - p.measured) <= p.half_width;
  }
  const surrogate::Band band = surrogate::BinomialBand(result->held_back, kLevel);
  result->band_low = band.low;
  result->band_high = band.high;
}

void FitFactor(YawComparison* result) {
  double both = 0, square = 0, both_all = 0, square_all = 0;
  for (const YawPoint& p : result->points) {
    both_all += p.measured * p.without_slip;
    square_all += p.without_slip * p.without_slip;
    if (!p.fitted) continue;
    both += p.measured * p.without_slip;
    square += p.without_slip * p.without_slip;
  }
  result->factor = both / square;
  result->factor_rms = Rms(result->points, false, [&](const YawPoint& p) {
    return p.measured - result->factor * p.without_slip;
  });
  const auto miss = [&](const YawPoint& p) {
    return p.measured - both_all / square_all * p.without_slip;
  };
  const double fitted = Rms(result->points, true, miss), others = Rms(result->points, false, miss);
  const auto n = static_cast<double>(result->points.size());
  const auto n_fitted = static_cast<double>(
      std::ranges::count_if(result->points, [](const YawPoint& p) { return p.fitted; }));
  result->factor_rms_all =
      std::sqrt((fitted * fitted * n_fitted + others * others * (n - n_fitted)) / n);
}

// How far windows of the same rim speeds differ. Mirrored: the faster side turns forward.
void AddRepeats(YawComparison* result) {
  struct Mirrored {
    double slow, fast, yaw;
  };
  std::vector<Mirrored> all;
  double fastest = 0;
  for (const YawPoint& p : result->points) {
    const bool left_fast = std::fabs(p.left_m_per_s) > std::fabs(p.right_m_per_s);
    const double fast = left_fast ? p.left_m_per_s : p.right_m_per_s;
    const double slow = left_fast ? p.right_m_per_s : p.left_m_per_s;
    const double sense = fast < 0 ? -1 : 1;
    all.push_back({slow * sense, fast * sense, p.measured * (p.without_slip < 0 ? -1 : 1)});
    fastest = std::max(fastest, std::fabs(fast));
  }
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const double apart = std::hypot(all[i].slow - all[k].slow, all[i].fast - all[k].fast);
      if (apart > kSame * fastest) continue;
      sum += (all[i].yaw - all[k].yaw) * (all[i].yaw - all[k].yaw);
      ++result->pairs;
    }
  }
  if (result->pairs > 0) result->repeat_rms = std::sqrt(sum / (2 * result->pairs));
}

void AddSpeeds(YawComparison* result) {
  double rims = 0, measured = 0, predicted = 0;
  for (const YawPoint& p : result->points) {
    const double rim = (p.left_m_per_s + p.right_m_per_s) / 2;
    const double sense = rim < 0 ? -1 : 1;
    rims += rim * sense;
    measured += p.v_x * sense;
    predicted += p.predicted_v_x * sense;
  }
  result->speed_ratio = measured / rims;
  result->predicted_speed_ratio = predicted / rims;
}

}  // namespace

YawComparison CompareYaw(const std::vector<DriveWindow>& windows, const std::string& robot,
                         double track, const std::string& ground_name, const GroundOf& ground) {
  YawComparison result;
  result.ground = ground_name;
  for (const DriveWindow& w : windows) {
    if (w.robot != robot || !w.steady) continue;
    ++result.windows;
    const double free = (w.right_m_per_s - w.left_m_per_s) / track;
    if (std::fabs(w.yaw_rate_rad_per_s) > std::fabs(free) + kTooFast) {
      ++result.left_out;
      continue;
    }
    result.points.push_back({w.left_m_per_s, w.right_m_per_s, free, w.yaw_rate_rad_per_s, 0, 0,
                             w.v_x_m_per_s, 0, result.points.size() % 2 == 0});
  }
  if (result.points.size() < 20) {
    throw std::invalid_argument(robot + ": " + std::to_string(result.points.size()) +
                                " steady windows, expected 20 or more");
  }
  FitFactor(&result);
  AddRepeats(&result);
  result.friction = FitFriction(ground, &result.points);
  result.unbalanced = Predict(ground, result.friction, &result.points);
  const auto miss = [](const YawPoint& p) { return p.predicted - p.measured; };
  result.rms_fitted = Rms(result.points, true, miss);
  result.rms = Rms(result.points, false, miss);
  std::vector<YawPoint> moving;
  for (const YawPoint& p : result.points) {
    if (p.fitted) continue;
    const bool stuck = std::fabs(p.measured) < kStuck * std::fabs(p.without_slip);
    result.stuck += stuck;
    if (!stuck) moving.push_back(p);
  }
  result.rms_moving = Rms(moving, false, miss);
  AddSpeeds(&result);
  AddIntervals(&result);
  return result;
}

}  // namespace grouser::measured

#include "surrogate/fit/measured.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "surrogate/fit/error_table.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNearSlip = 0.06, kNearAngle = 3 * kDegree, kNearLoad = 0.2;

WheelAnswer At(const TabulatedModel& model, const v1alpha1::MeasuredPoint& p, double speed) {
  const VelocityState v = FromSlip(p.slip(), p.attack_angle_rad(), speed > 0 ? speed : 0.1);
  return model.EvaluateOne(v.v_x, v.v_y, v.rim_speed, p.load_n());
}

}  // namespace

double DistanceOf(const v1alpha1::RunSummary& run, const v1alpha1::MeasuredPoint& p) {
  const double slip = std::fabs(run.slip() - p.slip()) / kNearSlip;
  const double angle = std::fabs(run.attack_angle_rad() - p.attack_angle_rad()) / kNearAngle;
  const double load = std::fabs(run.load_n() / p.load_n() - 1) / kNearLoad;
  const bool near = slip <= 1 && angle <= 1 && load <= 1;
  return near ? slip + angle + load : std::numeric_limits<double>::infinity();
}

namespace {

const v1alpha1::RunSummary* Nearest(const v1alpha1::MeasuredPoint& p,
                                    const std::vector<v1alpha1::RunSummary>& runs) {
  const v1alpha1::RunSummary* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const v1alpha1::RunSummary& run : runs) {
    if (run.status() != v1alpha1::RUN_STATUS_STEADY || run.mean_size() != kOutputs) continue;
    const double distance = DistanceOf(run, p);
    if (distance >= least) continue;
    least = distance;
    best = &run;
  }
  return best;
}

}  // namespace

bool InDomain(const v1alpha1::Domain& d, const v1alpha1::MeasuredPoint& p) {
  return p.slip() >= d.slip_min() - kNearSlip && p.slip() <= d.slip_max() + kNearSlip &&
         std::fabs(p.attack_angle_rad()) <= d.attack_angle_max_rad() + kNearAngle &&
         p.load_n() * 1.33 >= d.load_min_n() && p.load_n() <= 1.33 * d.load_max_n();
}

std::vector<MeasuredRow> MatchMeasured(const TabulatedModel& model, double speed,
                                       const std::vector<v1alpha1::MeasuredPoint>& points,
                                       const std::vector<v1alpha1::RunSummary>& runs) {
  std::vector<MeasuredRow> rows;
  for (const v1alpha1::MeasuredPoint& p : points) {
    rows.push_back({&p, At(model, p, speed), Nearest(p, runs)});
  }
  return rows;
}

std::vector<MeasuredError> MeasuredErrors(const std::vector<MeasuredRow>& rows) {
  std::vector<MeasuredError> errors;
  for (const v1alpha1::Region region : kRegions) {
    for (const Output o : kMeasurable) {
      MeasuredError e{region, o, 0, 0, 0, 0, 0};
      for (const MeasuredRow& row : rows) {
        const v1alpha1::MeasuredPoint& p = *row.measured;
        if (!IsIn(region, p.slip(), p.attack_angle_rad()) || std::isnan(p.value(o))) continue;
        ++e.n;
        e.rmse += std::pow(row.model.value[o] - p.value(o), 2);
        e.mean_measured += p.value(o);
        if (row.dem == nullptr) continue;
        ++e.n_dem;
        e.rmse_dem += std::pow(row.dem->mean(o) - p.value(o), 2);
      }
      if (e.n == 0) continue;
      e.mean_measured /= e.n;
      e.rmse = std::sqrt(e.rmse / e.n);
      e.rmse_dem = e.n_dem == 0 ? kNaN : std::sqrt(e.rmse_dem / e.n_dem);
      errors.push_back(e);
    }
  }
  return errors;
}

}  // namespace grouser::surrogate

#include "surrogate/fit/form_fit.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "surrogate/model_io/form_message.h"

namespace grouser::surrogate {
namespace {

bool IsMeasured(const v1alpha1::MeasuredPoint& p, int o) {
  return p.value_size() == kOutputs && !std::isnan(p.value(o));
}

MeasuredRegion RegionOfPoint(const v1alpha1::MeasuredPoint& p) {
  const VelocityState v = FromSlip(p.slip(), p.attack_angle_rad(), 1);
  return MeasuredRegionAt(v.v_x, v.v_y, v.rim_speed);
}

double MissOf(const MeasuredRow& row, int o) { return row.model.value[o] - row.measured->value(o); }

double MiddleLoad(const v1alpha1::Domain& domain) {
  return std::sqrt(domain.load_min_n() * domain.load_max_n());
}

// Rows whose angles round to the same multiple of this are of one angle: rigs hold an angle to a
// degree or so, and are set to angles further apart.
constexpr double kAngleStep = 5 * std::numbers::pi / 180;

long AngleKey(const v1alpha1::MeasuredPoint& p) {
  return std::lround(std::fabs(p.attack_angle_rad()) / kAngleStep);
}

}  // namespace

FormEstimate EstimateForm(const std::vector<MeasuredRow>& rows, double middle_load, double level) {
  const double upper = 0.5 + 0.5 * level;
  const double normal = boost::math::quantile(boost::math::normal(), upper);
  FormEstimate estimate;
  estimate.form.middle_load_n = middle_load;
  std::array<std::array<double, kOutputs>, kMeasuredRegions> misses{}, own{};
  std::array<std::array<std::set<long>, kOutputs>, kMeasuredRegions> angles;
  for (const MeasuredRow& row : rows) {
    const auto region = static_cast<std::size_t>(RegionOfPoint(*row.measured));
    for (int o = 0; o < kOutputs; ++o) {
      if (!IsMeasured(*row.measured, o)) continue;
      const double scale = o == kSinkage ? 1 : middle_load / row.measured->load_n();
      misses[region][o] += std::pow(scale * MissOf(row, o), 2);
      own[region][o] += std::pow(scale * row.model.half_width[o] / normal, 2);
      ++estimate.rows[region][o];
      angles[region][o].insert(AngleKey(*row.measured));
    }
  }
  for (std::size_t region = 0; region < kMeasuredRegions; ++region) {
    for (int o = 0; o < kOutputs; ++o) {
      const int n = estimate.rows[region][o];
      if (n == 0) continue;
      const bool one_angle = region == static_cast<std::size_t>(MeasuredRegion::kStraight);
      const int k = one_angle ? n : static_cast<int>(angles[region][o].size());
      const double mean = misses[region][o] / n, least = mean * std::min(1.0, std::sqrt(2.0 / k));
      FormErrors::OfRegion& to = estimate.form.region[region];
      to.sd[o] = std::sqrt(std::max(mean - own[region][o] / n, least));
      to.factor[o] = boost::math::quantile(boost::math::students_t(k), upper);
    }
  }
  return estimate;
}

std::vector<MeasuredRow> MeasuredInDomain(const TabulatedModel& model,
                                          const v1alpha1::Model& message) {
  const std::vector<v1alpha1::MeasuredPoint> points(message.measured().begin(),
                                                    message.measured().end());
  std::vector<MeasuredRow> rows =
      MatchMeasured(model, message.domain().speed_m_per_s(), points, {});
  for (std::size_t i = 0; i < rows.size(); ++i) {  // the message outlives our points
    rows[i].measured = &message.measured(static_cast<int>(i));
  }
  std::erase_if(rows,
                [&](const MeasuredRow& row) { return !InDomain(message.domain(), *row.measured); });
  return rows;
}

void SetFormError(const TabulatedModel& model, v1alpha1::Model* message) {
  message->clear_sd_form();
  message->clear_form_by_region();
  const std::vector<MeasuredRow> rows = MeasuredInDomain(model, *message);
  for (int o = 0; o < kOutputs; ++o) {
    double square = 0;
    int n = 0;
    for (const MeasuredRow& row : rows) {
      if (!IsMeasured(*row.measured, o)) continue;
      square += std::pow(MissOf(row, o), 2);
      ++n;
    }
    message->add_sd_form(n < 3 ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(square / n));
  }
  if (rows.empty()) return;
  const FormEstimate estimate =
      EstimateForm(rows, MiddleLoad(message->domain()), message->interval_level());
  for (std::size_t region = 0; region < kMeasuredRegions; ++region) {
    v1alpha1::FormError* to = message->add_form_by_region();
    const FormErrors::OfRegion& from = estimate.form.region[region];
    to->set_region(ToMessage(static_cast<MeasuredRegion>(region)));
    for (int o = 0; o < kOutputs; ++o) {
      to->add_rows(estimate.rows[region][o]);
      to->add_sd(from.sd[o]);
      to->add_factor(from.factor[o]);
    }
  }
}

std::vector<AngleLeftOut> LeaveAnglesOut(const std::vector<MeasuredRow>& rows, double middle_load,
                                         double level) {
  std::map<long, std::vector<MeasuredRow>> by_angle;
  for (const MeasuredRow& row : rows) by_angle[AngleKey(*row.measured)].push_back(row);
  std::vector<AngleLeftOut> result;
  for (const auto& [angle, left_out] : by_angle) {
    std::vector<MeasuredRow> others;
    for (const MeasuredRow& row : rows) {
      if (AngleKey(*row.measured) != angle) others.push_back(row);
    }
    const FormErrors form = EstimateForm(others, middle_load, level).form;
    for (const Output o : kMeasurable) {
      AngleLeftOut found{std::fabs(left_out.front().measured->attack_angle_rad()), o};
      for (const MeasuredRow& row : left_out) {
        const v1alpha1::MeasuredPoint& p = *row.measured;
        if (!IsMeasured(p, o)) continue;
        const double half =
            std::hypot(row.model.half_width[o], form.HalfWidth(RegionOfPoint(p), o, p.load_n()));
        if (std::isnan(half)) {
          ++found.unknown;
          continue;
        }
        ++found.rows;
        found.inside += std::fabs(MissOf(row, o)) <= half ? 1 : 0;
      }
      if (found.rows + found.unknown > 0) result.push_back(found);
    }
  }
  return result;
}

std::vector<AngleLeftOut> OverAngles(const std::vector<AngleLeftOut>& each) {
  std::vector<AngleLeftOut> all;
  for (const Output o : kMeasurable) {
    AngleLeftOut sum{std::numeric_limits<double>::quiet_NaN(), o};
    for (const AngleLeftOut& one : each) {
      if (one.output != o) continue;
      sum.rows += one.rows;
      sum.inside += one.inside;
      sum.unknown += one.unknown;
    }
    if (sum.rows + sum.unknown > 0) all.push_back(sum);
  }
  return all;
}

}  // namespace grouser::surrogate

// sd_form by region, and the check that leaves one attack angle out.
#include <fmt/format.h>

#include <cmath>

#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/print.h"
#include "surrogate/model_io/form_message.h"

namespace grouser::surrogate {
namespace {

std::string AngleText(const AngleLeftOut& one) {
  return std::isnan(one.attack_angle_rad)
             ? "all"
             : fmt::format("{:.4g}", one.attack_angle_rad * kDegPerRad);
}

std::size_t RegionOfState(const Query& q) {
  const VelocityState v = FromSlip(q.slip, q.attack_angle_rad, 1);
  return static_cast<std::size_t>(MeasuredRegionAt(v.v_x, v.v_y, v.rim_speed));
}

std::vector<AngleLeftOut> WithAll(std::vector<AngleLeftOut> each) {
  const std::vector<AngleLeftOut> all = OverAngles(each);
  each.insert(each.end(), all.begin(), all.end());
  return each;
}

}  // namespace

std::string FormText(const v1alpha1::Model& m) {
  if (m.form_by_region().empty()) return "";
  std::string text = fmt::format(
      "\nDEM minus measurement at the middle load, of {} measured rows\n{:<10}{:<10}{:>6}{:>12}"
      "{:>12}{:>18}\n",
      m.measured_size(), "region", "output", "rows", "sd_form", "factor", "90 % half width");
  for (const v1alpha1::FormError& e : m.form_by_region()) {
    for (const Output o : kPredicted) {
      if (e.rows(o) == 0) continue;
      text += fmt::format("{:<10}{:<10}{:>6}{:>12.3g}{:>12.3g}{:>18.3g}\n",
                          kMeasuredRegionNames[e.region() - 1], kOutputFields[o].name, e.rows(o),
                          e.sd(o), e.factor(o), e.factor(o) * e.sd(o));
    }
  }
  return text + "what is not here is unknown: NaN, flag FORM_UNKNOWN\n";
}

std::string LeftOutText(const std::vector<AngleLeftOut>& each, double level) {
  std::string text = fmt::format(
      "\none angle left out: its rows inside the {:.0f} % intervals for a measurement that the "
      "other "
      "angles give\n{:<8}{:<10}{:>6}{:>8}{:>10}{:>9}\n",
      100 * level, "angle", "output", "rows", "inside", "band", "unknown");
  for (const AngleLeftOut& one : WithAll(each)) {
    const Band band = BinomialBand(one.rows, level);
    text += fmt::format("{:<8}{:<10}{:>6}{:>8}{:>10}{:>9}{}\n", AngleText(one),
                        kOutputFields[one.output].name, one.rows, one.inside,
                        one.rows == 0 ? "-" : fmt::format("{}-{}", band.low, band.high),
                        one.unknown, band.Has(one.inside) ? "" : "  outside the band");
  }
  return text +
         "band: exact 95 % binomial band; unknown: the other angles have no row in that region\n";
}

Json LeftOutJson(const std::vector<AngleLeftOut>& each, double level) {
  Json out = Json::array();
  for (const AngleLeftOut& one : WithAll(each)) {
    const Band band = BinomialBand(one.rows, level);
    Json angle;
    if (!std::isnan(one.attack_angle_rad)) angle = one.attack_angle_rad * kDegPerRad;
    out.push_back({{"attack_angle_deg", angle},
                   {"output", kOutputFields[one.output].name},
                   {"rows", one.rows},
                   {"inside", one.inside},
                   {"unknown", one.unknown},
                   {"band", {band.low, band.high}},
                   {"in_band", band.Has(one.inside)}});
  }
  return out;
}

std::string RegionsText(const std::vector<Query>& states) {
  std::string text = fmt::format("{:>8}{:>10}  {}\n", "slip", "angle deg", "region");
  for (const Query& q : states) {
    text += fmt::format("{:>8.4g}{:>10.4g}  {}\n", q.slip, q.attack_angle_rad * kDegPerRad,
                        kMeasuredRegionNames[RegionOfState(q)]);
  }
  text += "groups of tables:";
  for (const MeasuredGroup& group : kMeasuredGroups) {
    text += fmt::format("\n  {:<24}", group.name);
    for (std::size_t k = 0; k < kMeasuredRegions; ++k) {
      if (group.has[k]) text += fmt::format(" {}", kMeasuredRegionNames[k]);
    }
  }
  return text + "\n";
}

std::string RegionsJson(const std::vector<Query>& states) {
  Json groups = Json::array(), rows = Json::array();
  for (const MeasuredGroup& group : kMeasuredGroups) groups.push_back(group.name);
  for (const Query& q : states) {
    const std::size_t region = RegionOfState(q);
    Json in = Json::array();
    for (const MeasuredGroup& group : kMeasuredGroups) {
      if (group.has[region]) in.push_back(group.name);
    }
    rows.push_back({{"slip", q.slip},
                    {"attack_angle_deg", q.attack_angle_rad * kDegPerRad},
                    {"region", kMeasuredRegionNames[region]},
                    {"groups", in}});
  }
  return Text({{"groups", groups}, {"states", rows}});
}

}  // namespace grouser::surrogate

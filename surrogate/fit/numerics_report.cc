#include "surrogate/fit/numerics_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "surrogate/fit/calibration.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/soil_card.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

constexpr std::size_t kGrossRatio = 0, kNetRatio = 1;
constexpr std::array kGrossAndNet = {"gross", "net"};

[[noreturn]] void RefuseOption(const std::string& what) { throw std::invalid_argument(what); }

std::array<double, 2> GrossAndNet(const TractionRatios& r) { return {r.gross, r.net()}; }

/// t quantile of Student at 95 %: in closed form where StudentT95 is not exact.
double BedsT95(int degrees) {
  if (degrees == 1) return std::tan(0.45 * std::numbers::pi);
  if (degrees == 2) return 0.9 / std::sqrt(2 * 0.95 * 0.05);
  return StudentT95(degrees);
}

/// Half width of the 90 % interval of a mean over beds, over the mean; NaN: one bed.
double ShareOfBeds(double mean, std::optional<double> standard_error, int beds) {
  return standard_error ? BedsT95(beds - 1) * *standard_error / mean : NAN;
}

NumericsReport::OfLaw AskLaw(const NumericLaw& law, const NumericsReport& report,
                             const NumericsReport::AtSlip& row) {
  const ConeStrength cone{report.cone.index_pa, report.cone.gradient_pa_per_m};
  NumericsReport::OfLaw out{law.ratios(report.wheel, cone, row.slip), {}, {}, {}};
  out.low = out.high = GrossAndNet(out.at);
  const ConeIndex& c = report.cone;
  const double gradient_share = ShareOfBeds(c.gradient_pa_per_m, c.gradient_se_pa_per_m, c.beds);
  const auto scaled = [](double mean, double share, double sign) {
    return std::isnan(share) ? mean : mean * std::max(1 + sign * share, 0.01);
  };
  for (const double sign : {-1.0, 1.0}) {  // a weak bed is weak in both
    const ConeStrength bound{scaled(cone.index_pa, report.cone_share, sign),
                             scaled(cone.gradient_pa_per_m, gradient_share, sign)};
    const auto at = GrossAndNet(law.ratios(report.wheel, bound, row.slip));
    for (std::size_t k = 0; k < 2; ++k) {
      out.low[k] = std::min(out.low[k], at[k]);
      out.high[k] = std::max(out.high[k], at[k]);
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    out.apart[k] = out.high[k] < row.low[k] || out.low[k] > row.high[k];
  }
  return out;
}

NumericsReport::AtSlip AtOneSlip(const WheelModel& model, const v1alpha1::Model& message,
                                 double slip, const NumericsReport& report) {
  const double load = report.wheel.load_n;
  const VelocityState motion = FromSlip(slip, 0, message.domain().speed_m_per_s());
  if (std::isnan(motion.v_x))
    RefuseOption(fmt::format("--slip: got {:g}, expected -1 to below 1", slip));
  const WheelAnswer answer = AnswerOf(model, motion, load);
  NumericsReport::AtSlip row{slip, answer.flags, {}, {}, {}, {}};
  const std::array<std::pair<Output, double>, 2> parts = {
      {{kTorque, load * message.wheel().radius_m()}, {kFx, load}}};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [output, scale] = parts[k];
    row.value[k] = answer.value[output] / scale;
    row.low[k] = (answer.value[output] - answer.half_width[output]) / scale;
    row.high[k] = (answer.value[output] + answer.half_width[output]) / scale;
  }
  for (std::size_t l = 0; l < kNumericLaws.size(); ++l) {
    row.laws[l] = AskLaw(kNumericLaws[l], report, row);
  }
  return row;
}

/// One quantity of all rows.
std::string TableOfLaws(const NumericsReport& report, std::size_t k) {
  std::string text = fmt::format("{:>6}  {:<26}", "slip", "model [90 %, a DEM run]");
  for (const NumericLaw& law : kNumericLaws) text += fmt::format("{:>14}", law.name);
  text += '\n';
  for (const NumericsReport::AtSlip& row : report.rows) {
    const bool flagged = (row.flags & ~static_cast<std::uint32_t>(kFormUnknown)) != 0;
    text += fmt::format("{:>6.3g}  {:<26}", row.slip,
                        fmt::format("{:.3f} [{:.3f}, {:.3f}]{}", row.value[k], row.low[k],
                                    row.high[k], flagged ? " *" : ""));
    for (const NumericsReport::OfLaw& law : row.laws) {
      const double value = GrossAndNet(law.at)[k];
      text += std::isnan(value) ? fmt::format("{:>14}", "-  ")
                                : fmt::format("{:>12.3f}{:>2}", value, law.apart[k] ? "!" : "");
    }
    text += '\n';
  }
  return text;
}

Json AtSlipJson(const NumericsReport::AtSlip& row) {
  Json model, laws;
  for (std::size_t k = 0; k < 2; ++k) {
    model[kGrossAndNet[k]] = {{"value", row.value[k]}, {"low", row.low[k]}, {"high", row.high[k]}};
  }
  for (std::size_t l = 0; l < kNumericLaws.size(); ++l) {
    const NumericsReport::OfLaw& law = row.laws[l];
    for (std::size_t k = 0; k < 2; ++k) {
      laws[kNumericLaws[l].key][kGrossAndNet[k]] = {{"value", GrossAndNet(law.at)[k]},
                                                    {"low", law.low[k]},
                                                    {"high", law.high[k]},
                                                    {"apart", law.apart[k]}};
    }
  }
  return {{"slip", row.slip}, {"flags", row.flags}, {"model", model}, {"laws", laws}};
}

}  // namespace

NumericsReport CompareWithNumerics(const v1alpha1::Model& message, const NumericsRequest& request) {
  if (!request.cone) {
    RefuseOption(
        "--cone-index: got none, expected one with --gradient: that of this model's soil is not "
        "known (grouser-soil cones; a bevameter's cone_index.csv by --cones)");
  }
  const v1alpha1::Domain& domain = message.domain();
  const double load =
      request.load_n > 0 ? request.load_n : std::sqrt(domain.load_min_n() * domain.load_max_n());
  if (!(load > 0)) RefuseOption("--load: got none, expected one: the model has no training loads");
  const v1alpha1::Wheel& wheel = message.wheel();
  NumericsReport report;
  if (request.section_height_m.value_or(0) > wheel.radius_m()) {
    RefuseOption(fmt::format("--section-height: got {:g} m, expected at most the radius, {:g} m",
                             *request.section_height_m, wheel.radius_m()));
  }
  report.wheel = {2 * wheel.radius_m(), wheel.width_m(), load, request.deflection,
                  request.section_height_m.value_or(std::min(wheel.width_m(), wheel.radius_m()))};
  report.cone = *request.cone;
  report.cone_share = ShareOfBeds(report.cone.index_pa, report.cone.index_se_pa, report.cone.beds);
  const auto model = MakeLaw(message);
  for (const double slip : request.slips) {
    report.rows.push_back(AtOneSlip(*model, message, slip, report));
  }
  return report;
}

std::string NumericsText(const NumericsReport& r, const v1alpha1::Model& model,
                         const std::string& reference) {
  const ConeStrength cone{r.cone.index_pa, r.cone.gradient_pa_per_m};
  std::string text = fmt::format(
      "{}\nwheel {} (diameter {:.4g} m, width {:.4g} m) on {}, load {:.4g} N, straight\n{}",
      reference, model.wheel().name(), r.wheel.diameter_m, r.wheel.width_m, model.soil().name(),
      r.wheel.load_n, ConeText(r.cone));
  for (const v1alpha1::Tread& tread : model.wheel().treads()) {
    text += fmt::format("bars of {:.3g} mm stand beyond the diameter; the laws know none\n",
                        1e3 * tread.height_m());
  }
  text += r.wheel.deflection > 0
              ? fmt::format(
                    "delta/h {:g}, h {:.3g} mm: laws answer for a tyre that deflects, the "
                    "model for a rigid wheel\n",
                    r.wheel.deflection, 1e3 * r.wheel.section_height_m)
              : fmt::format(
                    "delta/h 0, a rigid wheel as the model's (--deflection for a tyre); h "
                    "{:.3g} mm\n",
                    1e3 * r.wheel.section_height_m);
  text += fmt::format(
      "numerics: Cn {:.3g}, Bn {:.3g}, N_s {:.3g}, contact pressure over cone "
      "index {:.3g}\n",
      WheelNumeric(r.wheel, cone), BrixiusNumeric(r.wheel, cone), SandNumeric(r.wheel, cone),
      PressureOverCone(r.wheel, cone));
  text += "\nnet traction: pull over load\n" + TableOfLaws(r, kNetRatio);
  text += "\ngross traction: torque over load and radius\n" + TableOfLaws(r, kGrossRatio);
  text += "\n!: outside of the model's interval, over all of the 90 % interval of cone index";
  text += std::isnan(r.cone_share)
              ? " (not known)\n"
              : fmt::format(" (+-{:.0f} %) and gradient\n", 100 * r.cone_share);
  if (std::ranges::any_of(r.rows, [](const auto& row) {
        return (row.flags & ~static_cast<std::uint32_t>(kFormUnknown)) != 0;
      })) {
    text += "*: the model's answer has a flag (./grouser model eval)\n";
  }
  text += "-: the law does not say\n";
  for (const NumericLaw& law : kNumericLaws) text += fmt::format("{}\n", law.about);
  return text;
}

std::string NumericsJson(const NumericsReport& r, const std::string& reference) {
  const ConeStrength cone{r.cone.index_pa, r.cone.gradient_pa_per_m};
  Json rows = Json::array();
  for (const NumericsReport::AtSlip& row : r.rows) rows.push_back(AtSlipJson(row));
  return Text({{"model", reference},
               {"load_n", r.wheel.load_n},
               {"diameter_m", r.wheel.diameter_m},
               {"width_m", r.wheel.width_m},
               {"deflection", r.wheel.deflection},
               {"section_height_m", r.wheel.section_height_m},
               {"cone_index", Json::parse(ConeListJson({r.cone}))[0]},
               {"cone_half_width_share", r.cone_share},
               {"wheel_numeric", WheelNumeric(r.wheel, cone)},
               {"brixius_numeric", BrixiusNumeric(r.wheel, cone)},
               {"sand_numeric", SandNumeric(r.wheel, cone)},
               {"pressure_over_cone", PressureOverCone(r.wheel, cone)},
               {"rows", rows}});
}

}  // namespace grouser::surrogate

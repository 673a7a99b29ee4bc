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

void Require(bool good, const std::string& what, double got, const std::string& expected) {
  if (good) return;
  throw std::invalid_argument(fmt::format("{}: got {:g}, expected {}", what, got, expected));
}

std::array<double, 2> GrossAndNet(const TractionRatios& r) { return {r.gross, r.net()}; }

/// t quantile of Student at 95 %: in closed form where StudentT95 is not exact.
double BedsT95(int degrees) {
  if (degrees == 1) return std::tan(0.45 * std::numbers::pi);
  if (degrees == 2) return 0.9 / std::sqrt(2 * 0.95 * 0.05);
  return StudentT95(degrees);
}

/// Half width of the 90 % interval of a mean over beds, in its unit; 0: one bed.
double HalfWidthOfBeds(std::optional<double> standard_error, int beds) {
  return standard_error ? BedsT95(beds - 1) * *standard_error : 0;
}

NumericsReport::OfLaw AskLaw(const NumericLaw& law, const NumericsReport& report,
                             const NumericsReport::AtSlip& row) {
  constexpr int kSteps = 32;  // to either side
  const ConeIndex& c = report.cone;
  const double index_half = HalfWidthOfBeds(c.index_se_pa, c.beds);
  const double gradient_half = HalfWidthOfBeds(c.gradient_se_pa_per_m, c.beds);
  const ConeStrength mean{c.index_pa, c.gradient_pa_per_m};
  NumericsReport::OfLaw out{law.ratios(report.wheel, mean, row.slip), {}, {}, {}};
  out.low = out.high = GrossAndNet(out.at);
  for (int i = -kSteps; i <= kSteps; ++i) {  // a weak bed is weak in both
    const double share = i / static_cast<double>(kSteps);
    const ConeStrength cone{std::max(c.index_pa + share * index_half, 0.01 * c.index_pa),
                            c.gradient_pa_per_m + share * gradient_half};
    const auto at = GrossAndNet(law.ratios(report.wheel, cone, row.slip));
    for (std::size_t k = 0; k < 2; ++k) {  // a NaN stays
      if (at[k] < out.low[k] || std::isnan(at[k])) out.low[k] = at[k];
      if (at[k] > out.high[k] || std::isnan(at[k])) out.high[k] = at[k];
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
  Require(!std::isnan(motion.v_x), "--slip", slip, "-2 to 1");
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
      const char* mark = std::isnan(law.low[k]) ? "?" : law.apart[k] ? "!" : "";
      text += std::isnan(value) ? fmt::format("{:>14}", "-  ")
                                : fmt::format("{:>12.3f}{:>2}", value, mark);
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
    throw std::invalid_argument(
        "--cone-index: got none, expected one with --gradient: that of this model's soil is not "
        "known (grouser-soil cones; a bevameter's cone_index.csv by --cones)");
  }
  const v1alpha1::Domain& domain = message.domain();
  const v1alpha1::Wheel& wheel = message.wheel();
  const double radius = wheel.radius_m(), speed = domain.speed_m_per_s();
  const double load = request.load_n.value_or(std::sqrt(domain.load_min_n() * domain.load_max_n()));
  const double section_height =
      request.section_height_m.value_or(std::min(wheel.width_m(), radius));
  const ConeIndex& cone = *request.cone;
  Require(load > 0 && std::isfinite(load), "--load", load,
          request.load_n ? "more than 0 N" : "one: the model has no training loads");
  Require(request.deflection >= 0 && request.deflection <= 1, "--deflection", request.deflection,
          "0 to 1");
  Require(section_height > 0 && section_height <= radius, "--section-height", section_height,
          fmt::format("more than 0 and at most the radius, {:g} m", radius));
  Require(cone.index_pa > 0 && std::isfinite(cone.index_pa), "--cone-index", cone.index_pa / 1e3,
          "more than 0 kPa");
  Require(std::isfinite(cone.gradient_pa_per_m), "--gradient", cone.gradient_pa_per_m / 1e3,
          "a finite number of kPa/m");
  Require(speed > 0 && std::isfinite(speed), message.name() + ": training speed", speed,
          "more than 0 m/s");
  NumericsReport report;
  report.wheel = {2 * radius, wheel.width_m(), load, request.deflection, section_height};
  report.cone = cone;
  report.cone_share =
      cone.index_se_pa ? HalfWidthOfBeds(cone.index_se_pa, cone.beds) / cone.index_pa : NAN;
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
  text += "?: the law does not say over all of that interval\n";
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

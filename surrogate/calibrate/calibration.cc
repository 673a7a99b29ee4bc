#include "surrogate/calibrate/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBetter = 2;  // of the deviance

std::vector<ErrorSummary> ErrorsOf(const SoilFit& fit) {
  const MeasuredSoil& soil = fit.law->soil();
  std::map<std::pair<int, int>, ErrorSummary> by;
  for (std::size_t i = 0; i < soil.observations.size(); ++i) {
    const Observation& at = soil.observations[i];
    ErrorSummary& e =
        by.try_emplace({at.test, at.output}, ErrorSummary{at.test, at.output}).first->second;
    const double miss = fit.predicted[i].value - at.value;
    if (at.held_out) {
      ++e.held_out;
      e.held_out_rms += miss * miss;
      e.covered += std::abs(miss) <= kTwoSided90 * fit.predicted[i].sd_total ? 1 : 0;
    } else {
      ++e.fitted;
      e.fitted_rms += miss * miss;
    }
  }
  std::vector<ErrorSummary> errors;
  for (auto& [key, e] : by) {
    e.fitted_rms = e.fitted == 0 ? kNaN : std::sqrt(e.fitted_rms / e.fitted);
    e.held_out_rms = e.held_out == 0 ? kNaN : std::sqrt(e.held_out_rms / e.held_out);
    e.covered = e.held_out == 0 ? kNaN : e.covered / e.held_out;
    errors.push_back(e);
  }
  return errors;
}

// Whether widths differ among what depends on them.
bool WidthsDiffer(const MeasuredSoil& soil) {
  std::set<double> widths;
  for (const Observation& at : soil.observations) {
    const MeasuredTest& test = soil.tests[at.test];
    if (at.held_out || test.kind == TestKind::kShear) continue;
    widths.insert(test.kind == TestKind::kPlate ? at.width : test.wheel.width_m);
  }
  return widths.size() > 1;
}

}  // namespace

SoilCalibration CalibrateSoil(MeasuredSoil measured, const Typical& typical,
                              const std::string& form) {
  SoilCalibration c;
  c.soil = std::move(measured);
  const bool differ = WidthsDiffer(c.soil);
  // Kept by the fits: the calibration may move.
  const auto soil = std::make_shared<const MeasuredSoil>(c.soil);
  const auto fit = [&](double which) {
    const auto own = std::make_shared<const SoilFit>(FitSoil(*soil, typical, which));
    return std::shared_ptr<const SoilFit>(own.get(), [own, soil](const SoilFit*) {});
  };
  c.bekker = fit(kBekkerForm);
  c.fit = c.bekker;
  c.bekker_deviance = c.bekker->deviance;
  c.reece_deviance = kNaN;
  if (form == "reece" || (form == "auto" && differ)) {
    const auto reece = fit(kReeceForm);
    c.reece_deviance = reece->deviance;
    c.reece_parameters = ParametersOf(*reece);
    const double gain = c.bekker_deviance - c.reece_deviance;
    if (form == "reece" || gain >= kBetter) c.fit = reece;
    c.why_form = form == "reece"
                     ? "Reece's form, as asked for"
                     : fmt::format(
                           "{} form: the deviance of Bekker's is {:.1f} {} than that of "
                           "Reece's",
                           gain >= kBetter ? "Reece's" : "Bekker's", std::abs(gain),
                           gain > 0 ? "higher" : "lower");
  } else {
    c.why_form = form == "bekker" ? "Bekker's form, as asked for"
                                  : "Bekker's form: tests of one width cannot tell it from Reece's";
  }
  c.bekker_parameters = ParametersOf(*c.bekker);
  c.parameters = c.fit == c.bekker ? c.bekker_parameters : c.reece_parameters;
  c.correlation = CorrelationOf(*c.fit);
  c.directions = UnidentifiedDirections(*c.fit);
  c.next_tests = NextTests(*c.fit);
  c.errors = ErrorsOf(*c.fit);
  return c;
}

Soil SoilOf(const SoilCalibration& c) {
  const BekkerParameters p = c.bekker->Parameters();
  Soil soil;
  soil.name = c.soil.name;
  soil.n = p.n;
  soil.k_c = p.k_c;
  soil.k_phi = p.k_phi;
  soil.cohesion_pa = p.cohesion;
  soil.friction_angle_rad = p.friction_angle;
  soil.density_kg_per_m3 = c.soil.density_kg_per_m3;
  soil.kind = c.soil.kind.value_or(SoilKind::kSand);
  std::vector<std::string> typical;
  for (int i = 0; i < kSoilCoordinates; ++i) {
    const FittedParameter& f = c.bekker_parameters[i];
    if (f.what.member == &BekkerParameters::shear_modulus && f.identified) {
      soil.shear_modulus_m = f.value;
    }
    if (!f.identified) typical.emplace_back(f.what.name);
  }
  int fitted = 0;
  std::set<std::string> kinds;
  for (const Observation& at : c.soil.observations) {
    if (at.held_out) continue;
    ++fitted;
    kinds.insert(NameOf(c.soil.tests[at.test].kind));
  }
  soil.source = fmt::format("calibrated by Grouser from {} measured numbers ({})", fitted,
                            fmt::join(kinds, ", "));
  if (!typical.empty()) {
    soil.source +=
        fmt::format("; not identified, near typical values: {}", fmt::join(typical, ", "));
  }
  if (!kinds.contains("shear")) soil.source += "; c and phi are the rim's: no shear test";
  if (!c.soil.source.empty()) soil.source += "; data: " + c.soil.source;
  std::ranges::replace(soil.source, '"', '\'');
  std::ranges::replace(soil.source, '\n', ' ');
  return soil;
}

std::string SoilFileText(const SoilCalibration& c, const std::string& command) {
  std::string text = "# Made by: " + command + "\n";
  for (const auto& [file, hash] : c.soil.files) text += "# " + file + " sha256:" + hash + "\n";
  const Soil soil = SoilOf(c);
  const std::string unusual = UnusualOf(soil);
  if (!unusual.empty()) {
    text += "# Outside of what published soils have (--accept-unusual takes it): " + unusual + "\n";
  }
  return text + WriteSoils({soil});
}

}  // namespace grouser::surrogate

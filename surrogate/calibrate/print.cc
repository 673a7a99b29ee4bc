#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "surrogate/calibrate/calibration.h"

namespace grouser::surrogate {
namespace {

using nlohmann::json;

json Number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

const char* OutputOf(TestKind kind, int output) {
  if (output >= 0) return kOutputFields[output].name;
  return kind == TestKind::kPlate ? "pressure" : kind == TestKind::kShear ? "shear" : "force";
}
const char* UnitOf(TestKind kind, int output) {
  if (output >= 0) return kOutputFields[output].unit;
  return kind == TestKind::kPress ? "N" : "Pa";
}

std::string End(double value, bool open, bool low) {
  if (!open) return fmt::format("{:.4g}", value);
  return std::isfinite(value) ? fmt::format("{:.4g} (bound)", value) : low ? "-inf" : "inf";
}

std::string ParametersText(const SoilCalibration& c) {
  std::string text =
      fmt::format("{:<18} {:>10} {:<11} {:>10} {:>24} {:>10} {:>6}\n", "parameter", "value", "unit",
                  "sd", "90 % interval (profile)", "typical", "left");
  for (const FittedParameter& p : c.parameters) {
    text += fmt::format("{:<18} {:>10.4g} {:<11} {:>10.3g} {:>24} {:>10.4g} {:>5.0f}%{}\n",
                        p.what.name, p.value, p.what.unit, p.sd,
                        End(p.low, p.low_open, true) + " to " + End(p.high, p.high_open, false),
                        p.typical, 100 * p.share_left,
                        p.identified ? "" : "  not identified: rests on what is typical");
  }
  return text;
}

std::string ErrorsText(const SoilCalibration& c) {
  std::string text = fmt::format("{:<22} {:<9} {:<4} {:>7} {:>11} | {:>9} {:>11} {:>8}\n", "test",
                                 "measured", "", "fitted", "rms", "held out", "rms", "in 90 %");
  for (const ErrorSummary& e : c.errors) {
    const MeasuredTest& test = c.soil.tests[e.test];
    const auto cell = [](int n, double value) {
      return n == 0 ? "-" : fmt::format("{:.4g}", value);
    };
    text += fmt::format("{:<22} {:<9} {:<4} {:>7} {:>11} | {:>9} {:>11} {:>8}\n", test.name,
                        OutputOf(test.kind, e.output), UnitOf(test.kind, e.output), e.fitted,
                        cell(e.fitted, e.fitted_rms), e.held_out, cell(e.held_out, e.held_out_rms),
                        e.held_out == 0 ? "-" : fmt::format("{:.0f} %", 100 * e.covered));
  }
  return text;
}

std::string MisfitText(const Misfit& m) {
  const char* of = m.output < 0           ? "the measured value"
                   : m.output == kSinkage ? "the radius"
                   : IsMoment(m.output)   ? "load x radius"
                                          : "the load";
  const std::string what = fmt::format("{} {}", NameOf(m.kind), OutputOf(m.kind, m.output));
  if (m.share == 0) return what + ": the stated standard deviations explain the residuals";
  return fmt::format("{}: the law's own error is {:.1f} % of {} ({})", what, 100 * m.share, of,
                     m.n == 0    ? "typical: nothing was fitted"
                     : m.assumed ? "typical: too few rows to tell"
                                 : "by the residuals");
}

json ParametersJson(const std::vector<FittedParameter>& parameters) {
  json list = json::array();
  for (const FittedParameter& p : parameters) {
    list.push_back({{"name", p.what.name},
                    {"unit", p.what.unit},
                    {"value", Number(p.value)},
                    {"sd", Number(p.sd)},
                    {"low90", Number(p.low)},
                    {"high90", Number(p.high)},
                    {"low_open", p.low_open},
                    {"high_open", p.high_open},
                    {"typical", Number(p.typical)},
                    {"share_left", Number(p.share_left)},
                    {"identified", p.identified}});
  }
  return list;
}

json ObservationJson(const MeasuredTest& test, const Observation& at) {
  json o = {{"test", test.name},
            {"kind", NameOf(test.kind)},
            {"line", at.line},
            {"held_out", at.held_out},
            {"measured", OutputOf(test.kind, at.output)},
            {"unit", UnitOf(test.kind, at.output)},
            {"value", at.value},
            {"sd", Number(at.sd)}};
  if (test.kind == TestKind::kPlate) o["width_m"] = at.width;
  if (test.kind == TestKind::kPlate || test.kind == TestKind::kPress) o["sinkage_m"] = at.sinkage;
  if (test.kind == TestKind::kShear) {
    o["pressure_pa"] = at.pressure;
    o["displacement_m"] = at.displacement;
  }
  if (test.kind == TestKind::kWheel) {
    o["slip"] = at.slip;
    o["attack_angle_deg"] = at.attack_angle * 180 / std::numbers::pi;
    o["load_n"] = at.load;
  }
  return o;
}

json TestJson(const MeasuredTest& test) {
  json o = {{"name", test.name},
            {"kind", NameOf(test.kind)},
            {"counts_as", test.counts_as ? json(*test.counts_as) : json(nullptr)}};
  if (test.kind == TestKind::kPlate) o["shape"] = test.disc ? "disc" : "rectangle";
  if (test.kind == TestKind::kPress || test.kind == TestKind::kWheel) {
    o["radius_m"] = test.wheel.radius_m;
    o["width_m"] = test.wheel.width_m;
  }
  return o;
}

json FilesJson(const MeasuredSoil& soil) {
  json files = json::array();
  for (const auto& [file, hash] : soil.files) files.push_back({{"file", file}, {"sha256", hash}});
  return files;
}

json ObservationsJson(const SoilCalibration& c) {
  json list = json::array();
  for (std::size_t i = 0; i < c.soil.observations.size(); ++i) {
    const Observation& at = c.soil.observations[i];
    const Predicted& p = c.fit->predicted[i];
    json o = ObservationJson(c.soil.tests[at.test], at);
    o["model"] = Number(p.value);
    o["sd_soil"] = Number(p.sd_soil);
    o["sd_total"] = Number(p.sd_total);
    list.push_back(o);
  }
  return list;
}

}  // namespace

std::string RowsJson(const MeasuredSoil& soil) {
  json list = json::array(), tests = json::array();
  for (const Observation& at : soil.observations) {
    list.push_back(ObservationJson(soil.tests[at.test], at));
    list.back()["test_index"] = at.test;
  }
  for (const MeasuredTest& test : soil.tests) tests.push_back(TestJson(test));
  return json{{"soil", soil.name},       {"source", soil.source}, {"files", FilesJson(soil)},
              {"gravity", soil.gravity}, {"tests", tests},        {"observations", list},
              {"notes", soil.notes}}
             .dump(1) +
         "\n";
}

std::string CalibrationText(const SoilCalibration& c) {
  std::string text = fmt::format("soil {}: {}\n\n", c.soil.name, c.why_form) + ParametersText(c);
  text += "\n" + ErrorsText(c) + "\n";
  for (const Misfit& m : c.fit->misfits) text += MisfitText(m) + "\n";
  for (const std::string& note : c.soil.notes) text += "note: " + note + "\n";
  text += "\nNot identified:";
  if (c.directions.empty()) text += " nothing, all parameters are told by the data";
  text += "\n";
  for (const Direction& d : c.directions) {
    text +=
        fmt::format("- {} ({:.0f} % of what was uncertain is left)\n", d.text, 100 * d.share_left);
  }
  text += "\nWhat would tell most next (of the soil's most uncertain direction is left):\n";
  for (std::size_t i = 0; i < c.next_tests.size() && i < 3; ++i) {
    const NextTest& t = c.next_tests[i];
    text += fmt::format("- {}: {:.0f} %", t.text, 100 * t.share_left);
    if (!t.gains.empty()) {
      text +=
          fmt::format("; {} to {:.0f} % of its uncertainty now", t.gains, 100 * t.interval_left);
    }
    text += "\n";
  }
  return text;
}

std::string CalibrationJson(const SoilCalibration& c, const std::string& command) {
  json correlation = json::array();
  for (Eigen::Index i = 0; i < c.correlation.rows(); ++i) {
    json line = json::array();
    for (Eigen::Index k = 0; k < c.correlation.cols(); ++k)
      line.push_back(Number(c.correlation(i, k)));
    correlation.push_back(line);
  }
  json errors = json::array(), misfits = json::array(), directions = json::array(),
       next = json::array(), model = json::object();
  for (const ErrorSummary& e : c.errors) {
    const MeasuredTest& test = c.soil.tests[e.test];
    errors.push_back(
        {{"test", test.name},
         {"measured", OutputOf(test.kind, e.output)},
         {"unit", UnitOf(test.kind, e.output)},
         {"fitted", {{"n", e.fitted}, {"rms", Number(e.fitted_rms)}}},
         {"held_out",
          {{"n", e.held_out}, {"rms", Number(e.held_out_rms)}, {"covered90", Number(e.covered)}}}});
  }
  for (const Misfit& m : c.fit->misfits) misfits.push_back(MisfitText(m));
  for (const Direction& d : c.directions) {
    directions.push_back({{"text", d.text}, {"share_left", d.share_left}});
  }
  for (const NextTest& t : c.next_tests) {
    next.push_back({{"test", t.text},
                    {"share_left", t.share_left},
                    {"gains", t.gains},
                    {"interval_left", t.interval_left}});
  }
  const BekkerParameters p = c.fit->Parameters();
  for (const BekkerField& field : BekkerFields()) model[field.name] = p.*field.member;
  const json all = {
      {"soil", c.soil.name},
      {"source", c.soil.source},
      {"command", command},
      {"files", FilesJson(c.soil)},
      {"form", c.fit->law->form() == kReeceForm ? "reece" : "bekker"},
      {"why_form", c.why_form},
      {"deviance", {{"bekker", c.bekker_deviance}, {"reece", Number(c.reece_deviance)}}},
      {"parameters", ParametersJson(c.parameters)},
      {"bekker_parameters", ParametersJson(c.bekker_parameters)},
      {"reece_parameters", ParametersJson(c.reece_parameters)},
      {"correlation", correlation},
      {"rim_friction", c.fit->x[kRimFriction]},
      {"model_parameters", model},
      {"errors", errors},
      {"law_errors", misfits},
      {"not_identified", directions},
      {"next_tests", next},
      {"notes", c.soil.notes},
      {"observations", ObservationsJson(c)}};
  return all.dump(1) + "\n";
}

}  // namespace grouser::surrogate

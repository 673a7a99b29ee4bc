#include "surrogate/fit/print.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/records/message_json.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/json.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

/// "40 training (12 of them drift), 10 held out, ...".
std::string RunsText(const v1alpha1::Model& model) {
  int used = 0;
  std::string text;
  const auto add = [&](v1alpha1::RunRole role, const char* name) {
    const std::vector<Sample> rows = SamplesOf(model, role);
    const auto drift =
        std::count_if(rows.begin(), rows.end(), [](const Sample& r) { return !r.steady; });
    used += static_cast<int>(rows.size());
    text += fmt::format("{} {}{}, ", rows.size(), name,
                        drift > 0 ? fmt::format(" ({} still drifting at their end)", drift) : "");
  };
  add(v1alpha1::RUN_ROLE_TRAIN, "training");
  add(v1alpha1::RUN_ROLE_TEST, "held out");
  add(v1alpha1::RUN_ROLE_PATCH, "repeats");
  return text +
         fmt::format("{} of no use (overload, failed)", model.provenance().runs_size() - used);
}

// What hard ground has: a law and the spread of its parameters.
std::string HardText(const v1alpha1::Model& m, const std::string& digest) {
  std::string text = fmt::format(
      "{}@sha256:{}\nwheel {} (radius {} m, width {} m) on {}, hard ground\nsource: {}\n"
      "domain: every slip, attack angle and speed, load {:.3g} to {:.3g} N\n"
      "intervals: {:.0f} %, of the standard deviations below\n\nparameters:",
      m.name(), digest, m.wheel().name(), m.wheel().radius_m(), m.wheel().width_m(),
      m.soil().name(), m.soil().source(), m.domain().load_min_n(), m.domain().load_max_n(),
      100 * m.interval_level());
  const HardGround ground = ReadHard(m.hard());
  for (const HardGroundField& field : HardGroundFields()) {
    text += fmt::format(" {}={:.4g}", field.name, ground.*field.member);
  }
  return text + "\n";
}

}  // namespace

std::string ModelText(const v1alpha1::Model& m, const std::string& digest) {
  if (m.kind() == v1alpha1::MODEL_KIND_HARD) return HardText(m, digest);
  const v1alpha1::Domain& d = m.domain();
  std::string text = fmt::format(
      "{}@sha256:{}\nwheel {} (radius {} m, width {} m) on {}\n"
      "runs: {}\n"
      "domain: slip {:.3g} to {:.3g}, attack angle to {:.3g} deg, load {:.3g} to {:.3g} N, "
      "Froude number to {:.2g}\n",
      m.name(), digest, m.wheel().name(), m.wheel().radius_m(), m.wheel().width_m(),
      m.soil().name(),
      m.untuned() ? "none, UNTUNED (" + m.provenance().reason() + ")" : RunsText(m), d.slip_min(),
      d.slip_max(), d.attack_angle_max_rad() * kDegPerRad, d.load_min_n(), d.load_max_n(),
      d.froude_max());
  text += fmt::format("\n{:<10}{:>12}{:>12}{:>12}{:>10}{:>10}{:>12}\n", "output", "sd_fit in",
                      "growth", "sd_patch", "bulldozing", "factor", "sd_form");
  for (int o = 0; o < kOutputs; ++o) {
    const double bulldozing = o < m.sd_bulldozing_size() ? m.sd_bulldozing(o) : 0;
    text +=
        fmt::format("{:<10}{:>12.3g}{:>12.3g}{:>12.3g}{:>10.3g}{:>10.3g}{:>12.3g}\n",
                    kOutputFields[o].name, m.sd_fit_inside(o), m.sd_fit_growth(o), m.sd_patch(o),
                    bulldozing, m.interval_factor(o), o < m.sd_form_size() ? m.sd_form(o) : NAN);
  }
  text += FormText(m);
  text += fmt::format("\n{:<17}{:<10}{:<10}{:>5}{:>12}{:>12}{:>10}\n", "set", "region", "output",
                      "n", "rmse", "largest", "in 90 %");
  for (const v1alpha1::ErrorRow& e : m.errors()) {
    text += fmt::format("{:<17}{:<10}{:<10}{:>5}{:>12.4g}{:>12.4g}{:>9.0f}%\n", e.set(),
                        RegionName(e.region()), e.output(), e.n(), e.rmse(), e.max_abs(),
                        100 * e.covered90());
  }
  if (m.kind() == v1alpha1::MODEL_KIND_LOOKUP) return text + "\nno physics: a table alone\n";
  text += "\nparameters:";
  const BekkerParameters p = ReadBekker(m.bekker());
  for (const BekkerField& field : BekkerFields()) {
    text += fmt::format(" {}={:.4g}", field.name, p.*field.member);
  }
  return text + "\n";
}

std::string ModelJson(const v1alpha1::Model& model, const std::string& digest) {
  v1alpha1::Model slim = model;
  if (slim.has_residual()) slim.mutable_residual()->clear_coefficients();
  return Text({{"digest", digest}, {"model", Json::parse(records::ToJson(slim))}});
}

std::string AnswerText(const Query& q, const WheelAnswer& a, const FormAnswer& form) {
  std::string text = fmt::format(
      "slip {:.4g}, attack angle {:.4g} deg, load {:.4g} N, {:.4g} m/s; radius "
      "{:.4g} m, gravity {:.4g} m/s^2\n",
      q.slip, q.attack_angle_rad * kDegPerRad, q.load_n, q.speed_m_per_s, q.radius_m,
      q.gravity_m_per_s2);
  text += fmt::format("{:<10}{:>12}{:>12}{:>12}{:>12}{:>12}{:>12}{:>14}{:>14}\n", "output", "value",
                      "low", "high", "sd_fit", "sd_patch", "sd_form", "measured low", "high");
  for (int o = 0; o < kOutputs; ++o) {
    text += fmt::format(
        "{:<10}{:>12.5g}{:>12.5g}{:>12.5g}{:>12.3g}{:>12.3g}{:>12.3g}{:>14.5g}{:>14.5g} {}\n",
        kOutputFields[o].name, a.value[o], a.value[o] - a.half_width[o],
        a.value[o] + a.half_width[o], a.sd_fit[o], a.sd_patch[o], form.sd[o],
        a.value[o] - form.half_width[o], a.value[o] + form.half_width[o], kOutputFields[o].unit);
  }
  text += "flags:";
  for (const FlagField& f : kFlagFields) {
    if ((a.flags & f.flag) != 0) text += fmt::format(" {}", f.name);
  }
  return text + "\n";
}

std::string AnswerJson(const Query& q, const WheelAnswer& a, const FormAnswer& form,
                       const std::string& reference) {
  Json flags = Json::array(), outputs;
  for (const FlagField& f : kFlagFields) {
    if ((a.flags & f.flag) != 0) flags.push_back(f.name);
  }
  for (int o = 0; o < kOutputs; ++o) {
    outputs[kOutputFields[o].name] = {{"value", a.value[o]},
                                      {"low", a.value[o] - a.half_width[o]},
                                      {"high", a.value[o] + a.half_width[o]},
                                      {"sd_fit", a.sd_fit[o]},
                                      {"sd_patch", a.sd_patch[o]},
                                      {"sd_form", form.sd[o]},
                                      {"measured_low", a.value[o] - form.half_width[o]},
                                      {"measured_high", a.value[o] + form.half_width[o]}};
  }
  return Text({{"model", reference},
               {"slip", q.slip},
               {"attack_angle_rad", q.attack_angle_rad},
               {"load_n", q.load_n},
               {"speed_m_per_s", q.speed_m_per_s},
               {"radius_m", q.radius_m},
               {"gravity_m_per_s2", q.gravity_m_per_s2},
               {"flags", a.flags},
               {"flag_names", flags},
               {"outputs", outputs}});
}

std::string MeasuredText(const std::vector<MeasuredRow>& rows) {
  std::string text = fmt::format("{:>7}{:>7}{:>7}  {:<9}{:>18}{:>30}{:>20}\n", "slip", "angle",
                                 "load", "output", "measured", "surrogate [interval]", "DEM");
  for (const MeasuredRow& row : rows) {
    const v1alpha1::MeasuredPoint& p = *row.measured;
    for (const Output o : kMeasurable) {
      if (std::isnan(p.value(o))) continue;
      const double value = row.model.value[o], half = row.model.half_width[o];
      const std::string dem = row.dem == nullptr ? "-"
                                                 : fmt::format("{:.4g} +- {:.2g}", row.dem->mean(o),
                                                               row.dem->standard_error(o));
      text += fmt::format("{:>7.3f}{:>7.1f}{:>7.2f}  {:<9}{:>18}{:>30}{:>20}\n", p.slip(),
                          p.attack_angle_rad() * kDegPerRad, p.load_n(), kOutputFields[o].name,
                          fmt::format("{:.4g} +- {:.2g}", p.value(o), p.sd(o)),
                          fmt::format("{:.4g} [{:.4g}, {:.4g}]", value, value - half, value + half),
                          dem);
    }
  }
  text +=
      fmt::format("\nrms difference to the measurement\n{:<10}{:<10}{:>4}{:>14}{:>12}{:>14}{:>8}\n",
                  "region", "output", "n", "mean measured", "surrogate", "DEM", "n DEM");
  for (const MeasuredError& e : MeasuredErrors(rows)) {
    text += fmt::format("{:<10}{:<10}{:>4}{:>14.4g}{:>12.4g}{:>14.4g}{:>8}\n", RegionName(e.region),
                        kOutputFields[e.output].name, e.n, e.mean_measured, e.rmse, e.rmse_dem,
                        e.n_dem);
  }
  return text;
}

std::string MeasuredJson(const std::vector<MeasuredRow>& rows, const std::string& reference,
                         const Json& left_out) {
  Json states = Json::array(), errors = Json::array();
  for (const MeasuredRow& row : rows) {
    const v1alpha1::MeasuredPoint& p = *row.measured;
    Json measured, surrogate, dem;
    if (row.dem != nullptr) {
      dem = {{"run_id", row.dem->run_id()},
             {"slip", row.dem->slip()},
             {"attack_angle_deg", row.dem->attack_angle_rad() * kDegPerRad},
             {"load_n", row.dem->load_n()}};
    }
    for (const Output o : kMeasurable) {
      const char* name = kOutputFields[o].name;
      const double value = row.model.value[o], half = row.model.half_width[o];
      measured[name] = {{"value", p.value(o)}, {"sd", p.sd(o)}};
      surrogate[name] = {{"value", value}, {"low", value - half}, {"high", value + half}};
      if (row.dem == nullptr) continue;
      dem[name] = {{"value", row.dem->mean(o)}, {"standard_error", row.dem->standard_error(o)}};
    }
    states.push_back({{"source", p.source()},
                      {"slip", p.slip()},
                      {"attack_angle_deg", p.attack_angle_rad() * kDegPerRad},
                      {"load_n", p.load_n()},
                      {"region", RegionName(RegionOf(p.slip(), p.attack_angle_rad()))},
                      {"flags", row.model.flags},
                      {"measured", measured},
                      {"surrogate", surrogate},
                      {"dem", dem}});
  }
  for (const MeasuredError& e : MeasuredErrors(rows)) {
    errors.push_back({{"region", RegionName(e.region)},
                      {"output", kOutputFields[e.output].name},
                      {"n", e.n},
                      {"rmse", e.rmse},
                      {"n_dem", e.n_dem},
                      {"rmse_dem", e.rmse_dem},
                      {"mean_measured", e.mean_measured}});
  }
  Json all = {{"model", reference}, {"rows", states}, {"errors", errors}};
  if (!left_out.is_null()) all["angles_left_out"] = left_out;
  return Text(all);
}

std::string GateText(const std::vector<GateResult>& checks) {
  std::string text;
  for (const GateResult& c : checks) {
    text += fmt::format("{:<7}{:<14}{}\n", c.passed ? "passed" : "FAILED", c.name, c.detail);
  }
  return text;
}

std::string GateJson(const std::vector<GateResult>& checks) {
  Json out = Json::array();
  for (const GateResult& c : checks) {
    out.push_back({{"name", c.name},
                   {"passed", c.passed},
                   {"value", c.value},
                   {"limit", c.limit},
                   {"detail", c.detail}});
  }
  return Text(out);
}

}  // namespace grouser::surrogate

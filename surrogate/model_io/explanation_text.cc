#include "surrogate/model_io/explanation_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "surrogate/models/outputs.h"

namespace grouser::surrogate {
namespace {

using v1alpha1::Explanation;
using v1alpha1::NearRun;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kContact = 0.01;  // of the peak: less is no contact

/// "HYBRID" of MODEL_KIND_HYBRID, in small letters.
std::string KindName(v1alpha1::ModelKind kind) {
  std::string name = v1alpha1::ModelKind_Name(kind);
  name.erase(0, std::min(name.size(), std::string("MODEL_KIND_").size()));
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

std::string StatusName(v1alpha1::RunStatus status) {
  std::string name = v1alpha1::RunStatus_Name(status);
  return name.erase(0, std::min(name.size(), std::string("RUN_STATUS_").size()));
}

std::string Head(const Explanation& e) {
  std::string text = fmt::format("{}\n{} model of wheel {} on {}\n", e.model(), KindName(e.kind()),
                                 e.wheel(), e.soil());
  if (!e.command().empty()) {
    text += fmt::format("made by: {} ({}; grouser {})\n", e.command(),
                        e.reason().empty() ? "no reason given" : e.reason(),
                        e.grouser_version().empty() ? "?" : e.grouser_version());
  }
  return text + fmt::format(
                    "\nstate: slip {:.4g}, attack angle {:.4g} deg, load {:.4g} N, {:.4g} m/s "
                    "(v_x {:.4g}, v_y {:.4g}, r w {:.4g} m/s)\n",
                    e.slip(), e.attack_angle_rad() * kDegPerRad, e.load_n(), e.speed_m_per_s(),
                    e.v_x_m_per_s(), e.v_y_m_per_s(), e.rim_speed_m_per_s());
}

/// The parts in % of the variance of the DEM interval; empty where they have none.
std::string Shares(const v1alpha1::OutputExplanation& o) {
  const double most = std::max({o.sd_fit_inside(), o.sd_fit_beyond(), o.sd_patch()});
  if (!(most > 0) || !(o.sd_fit_inside() >= 0)) return "";
  const auto square = [most](double sd) { return sd / most * (sd / most); };
  const double inside = square(o.sd_fit_inside()), beyond = square(o.sd_fit_beyond());
  const double patch = square(o.sd_patch()), all = inside + beyond + patch;
  return fmt::format("{:>7.0f}{:>8.0f}{:>7.0f}", 100 * inside / all, 100 * beyond / all,
                     100 * patch / all);
}

std::string Outputs(const Explanation& e) {
  const std::string level = fmt::format("{:.0f} %", 100 * e.interval_level());
  std::string text = fmt::format(
      "\nintervals of {}; parts: % of the DEM interval's variance by the fit near its runs, the "
      "fit\ngrown with the hull distance, one placement of the bed (sd_patch); sd_soil: none, a "
      "model is of one soil\n{:<9}{:>11}{:>11}{:>11}{:>9}{:>9}{:>9}{:>7}{:>8}{:>7}{:>13}{:>11}\n",
      level, "output", "value", "low", "high", "sd_fit", "sd_patch", "sd_form", "near", "beyond",
      "patch", "measured low", "high");
  for (const auto& o : e.outputs()) {
    text += fmt::format(
        "{:<9}{:>11.5g}{:>11.5g}{:>11.5g}{:>9.3g}{:>9.3g}{:>9.3g}{:>22}{:>13.5g}"
        "{:>11.5g} {}\n",
        o.output(), o.value(), o.low(), o.high(), o.sd_fit(), o.sd_patch(), o.sd_form(), Shares(o),
        o.measured_low(), o.measured_high(), o.unit());
  }
  return text;
}

std::string Flags(const Explanation& e) {
  std::string text = "\nflags:";
  if (e.reasons().empty()) return text + " none\n";
  text += "\n";
  std::uint32_t before = 0;
  for (const auto& reason : e.reasons()) {
    const auto flag = static_cast<std::uint32_t>(reason.flag());
    const auto* field = std::ranges::find(
        kFlagFields, flag, [](const FlagField& f) { return static_cast<std::uint32_t>(f.flag); });
    const char* name = field == std::end(kFlagFields) ? "(unknown)" : field->name;
    text += fmt::format("  {:<16}{}\n", flag == before ? "" : name, reason.text());
    before = flag;
  }
  return text;
}

std::string Domain(const Explanation& e) {
  if (e.axes().empty()) return "";
  std::string text = "\ntraining domain, mirrored to where the runs are:\n";
  for (const auto& axis : e.axes()) {
    const bool angle = axis.quantity() == "attack_angle_rad";
    const double unit = angle ? kDegPerRad : 1;
    text += fmt::format("  {:<18}{:>10.4g} in {:>8.4g} to {:<8.4g}",
                        angle ? "attack_angle_deg" : axis.quantity(), unit * axis.value(),
                        unit * axis.low(), unit * axis.high());
    if (axis.beyond() != 0) text += fmt::format(" outside by {:.3g}", unit * axis.beyond());
    if (axis.hull_distance() > 0) {
      text += fmt::format(", adds {:.3g} to the hull distance", axis.hull_distance());
    }
    text += "\n";
  }
  return text + fmt::format(
                    "  hull distance {:.3g} (0 at runs, 1 far away; by the model's table {:.3g}); "
                    "share that bulldozes {:.3g}\n",
                    e.hull_distance(), e.table_distance(), e.bulldozing());
}

/// "normal to 31 kPa at 22 deg, contact -12 to 58 deg, shear -4 to 6 kPa".
std::string Rim(const v1alpha1::StressSummary& s) {
  const auto &normal = s.normal_pa(), &shear = s.shear_tangential_pa();
  if (normal.size() != shear.size()) {
    return fmt::format("no stress: {} bins of normal, {} of shear", normal.size(), shear.size());
  }
  const auto peak = std::ranges::max_element(normal);
  if (peak == normal.end() || !(*peak > 0)) return "no contact";
  const auto at = [&](double bin) {
    return (s.first_angle_rad() + bin * s.angle_step_rad()) * kDegPerRad;
  };
  int first = normal.size(), last = -1;
  for (int i = 0; i < normal.size(); ++i) {
    if (!(normal[i] > kContact * *peak)) continue;
    first = std::min(first, i);
    last = i;
  }
  const auto [low, high] = std::ranges::minmax_element(shear);
  return fmt::format(
      "normal to {:.3g} kPa at {:.0f} deg, contact {:.0f} to {:.0f} deg, shear "
      "{:.3g} to {:.3g} kPa",
      *peak / 1e3, at(static_cast<double>(peak - normal.begin()) + 0.5), at(first), at(last + 1),
      *low / 1e3, *high / 1e3);
}

std::string RunLines(const NearRun& near) {
  const v1alpha1::RunSummary& run = near.run();
  std::string text =
      fmt::format("  {:>6.2f}  {:<17}{:<13} {:<9}{:>7.3g}{:>7.3g}{:>8.4g}", near.distance(),
                  run.run_id(), run.sha256().substr(0, 12), StatusName(run.status()), run.slip(),
                  run.attack_angle_rad() * kDegPerRad, run.load_n());
  const int sizes[] = {near.mean_size(), near.model_value_size(), near.model_low_size(),
                       near.model_high_size()};
  if (!std::ranges::all_of(sizes, [](int size) { return size == kOutputs; })) {
    return text + "   no means\n";
  }
  for (const Output o : kPredicted) text += fmt::format("{:>11.4g}", near.mean(o));
  text +=
      fmt::format("\n{:>70}", near.mirrored_x() || near.mirrored_y() ? "mirrored; model" : "model");
  for (const Output o : kPredicted) {
    const bool inside = near.mean(o) >= near.model_low(o) && near.mean(o) <= near.model_high(o);
    text += fmt::format("{:>10.4g}{}", near.model_value(o), inside ? ' ' : '*');
  }
  text += "\n";
  if (near.has_stress()) return text + fmt::format("{:>10}rim: {}\n", "", Rim(near.stress()));
  const bool noted = near.no_stress().starts_with("this model file");
  return noted ? text : text + fmt::format("{:>10}rim: {}\n", "", near.no_stress());
}

std::string RunTable(const char* title, const google::protobuf::RepeatedPtrField<NearRun>& runs) {
  if (runs.empty()) return "";
  std::string text = fmt::format("\n{}:\n{:>8}  {:<17}{:<13} {:<9}{:>7}{:>7}{:>8}", title,
                                 "distance", "run", "sha256", "status", "slip", "deg", "load N");
  for (const Output o : kPredicted) text += fmt::format("{:>11}", kOutputFields[o].name);
  text += "\n";
  for (const NearRun& run : runs) text += RunLines(run);
  return text;
}

}  // namespace

std::string ExplanationText(const Explanation& e) {
  std::string text = Head(e) + Outputs(e) + Flags(e) + Domain(e);
  text += fmt::format("\nruns: {} fitted, {} repeats, {} held out, {} of no use\n", e.runs_fitted(),
                      e.runs_repeats(), e.runs_held_out(), e.runs_of_no_use());
  if (!e.nearest().empty() || !e.held_out().empty()) {
    text +=
        "distance: 1 is 0.3 on the unit sphere of (v_x, v_y, r w), or a factor of 1.5 in load; "
        "*: DEM outside of the model's interval\n";
  }
  text += RunTable("nearest that were fitted", e.nearest());
  text += RunTable("nearest that were held out", e.held_out());
  text += RunTable("nearest overloads", e.overloads());
  if (e.has_physics_stress()) {
    text += "\nrim by the model's physics at this state: " + Rim(e.physics_stress()) + "\n";
  }
  for (const std::string& note : e.notes()) text += "note: " + note + "\n";
  return text;
}

}  // namespace grouser::surrogate

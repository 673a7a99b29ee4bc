#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "surrogate/measured_vehicles/comparison.h"
#include "surrogate/measured_vehicles/ways.h"

namespace grouser::measured {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no NaN.
Json NumberOf(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json JsonOf(const Range& r) { return {NumberOf(r.low), NumberOf(r.middle), NumberOf(r.high)}; }

Json JsonOf(const YawComparison& y) {
  Json points = Json::array();
  for (const YawPoint& p : y.points) {
    points.push_back({{"left_m_per_s", p.left_m_per_s},
                      {"right_m_per_s", p.right_m_per_s},
                      {"without_slip", p.without_slip},
                      {"measured", p.measured},
                      {"predicted", p.predicted},
                      {"half_width", p.half_width},
                      {"fitted", p.fitted}});
  }
  return {{"ground", y.ground},
          {"windows", y.windows},
          {"left_out", y.left_out},
          {"friction", y.friction},
          {"rms", y.rms},
          {"rms_fitted", y.rms_fitted},
          {"rms_moving", y.rms_moving},
          {"stuck", y.stuck},
          {"speed_ratio", y.speed_ratio},
          {"predicted_speed_ratio", y.predicted_speed_ratio},
          {"unbalanced", y.unbalanced},
          {"factor", y.factor},
          {"factor_rms", y.factor_rms},
          {"factor_rms_all", y.factor_rms_all},
          {"pairs", y.pairs},
          {"repeat_rms", y.repeat_rms},
          {"held_back", y.held_back},
          {"covered", y.covered},
          {"band", {y.band_low, y.band_high}},
          {"points", points}};
}

Json JsonOf(const PowerComparison& c) {
  Json points = Json::array();
  for (const PowerPoint& p : c.points) {
    points.push_back({{"terrain", p.terrain},
                      {"motion", p.motion},
                      {"fitted", p.fitted},
                      {"windows", p.windows},
                      {"rim_m_per_s", {p.rim_in_m_per_s, p.rim_out_m_per_s}},
                      {"measured_current_a", {p.measured_in_a, p.measured_out_a}},
                      {"current_in_a", JsonOf(p.in_a)},
                      {"current_out_a", JsonOf(p.out_a)},
                      {"measured_power_w", p.measured_w},
                      {"power_w", JsonOf(p.power_w)},
                      {"measured_yaw_ratio", NumberOf(p.measured_yaw_ratio)},
                      {"yaw_ratio", JsonOf(p.yaw_ratio)}});
  }
  return {{"rim_scale", c.rim_scale},
          {"no_load_current_a", c.no_load_current_a},
          {"fit_rms", c.fit_rms},
          {"points", points}};
}

Json JsonOf(const Comparison& c, const Way& way) {
  Json robots, power;
  for (std::size_t i = 0; i < way.robots.size(); ++i) {
    const TwistMiss& m = way.robots[i];
    robots[c.robots[i].robot] = {{"yaw_rms_rad_per_s", NumberOf(m.yaw_rad_per_s)},
                                 {"speed_rms_m_per_s", NumberOf(m.speed_m_per_s)},
                                 {"rows", m.rows},
                                 {"unanswered", m.unanswered},
                                 {"covered", m.covered < 0 ? Json(nullptr) : Json(m.covered)}};
  }
  for (const PowerMiss& m : way.power) {
    power[m.terrain] = {{"rms_share", NumberOf(m.share)}, {"rms_w", NumberOf(m.watts)}};
  }
  return {{"way", way.name},
          {"motion_us", way.motion_us},
          {"plan_ms", NumberOf(way.plan_ms)},
          {"robots", robots},
          {"power", power},
          {"current_miss_share", NumberOf(way.current_share)}};
}

std::string TextOf(const RobotYaw& r) {
  const YawComparison& h = r.hard;
  std::string text = fmt::format(
      "\n{}: {} steady windows, {} faster than without slip left out, {} fitted, {} held back\n",
      r.robot, h.windows, h.left_out, h.points.size() - static_cast<std::size_t>(h.held_back),
      h.held_back);
  text += fmt::format(
      "  one factor on the yaw rate without slip: {:.3f}, rms held back {:.3f} rad/s "
      "(fitted on all, over all: {:.3f})\n",
      h.factor, h.factor_rms, h.factor_rms_all);
  text += fmt::format("  {} pairs of windows of the same rim speeds differ by {:.3f} rad/s\n",
                      h.pairs, h.repeat_rms);
  text += fmt::format("  forward speed over mean rim speed: {:.2f} measured\n", h.speed_ratio);
  for (const YawComparison* y : {&h, &r.soil}) {
    text += fmt::format(
        "  {:<16} friction {:.2f}: rms fitted {:.3f}, held back {:.3f}, without {} rows that "
        "hardly "
        "turn {:.3f};\n  {:<16} forward speed {:.2f} of the rims'; intervals hold {} of {} (band "
        "{} to "
        "{})\n",
        y->ground, y->friction, y->rms_fitted, y->rms, y->stuck, y->rms_moving, "",
        y->predicted_speed_ratio, y->covered, y->held_back, y->band_low, y->band_high);
  }
  return text;
}

std::string Shown(double x, int decimals) {
  return std::isfinite(x) ? fmt::format("{:.{}f}", x, decimals) : "-";
}

// Ranges in parentheses: of all soils of the terrain's name.
std::string TextOf(const PowerComparison& c, const PowerComparison& all) {
  std::string text = fmt::format(
      "\nhusky, power: no-load current {:.2f} A a side fitted to straight driving on hard ground "
      "(rms of power {:.2f})\n{:<11}{:<9}{:>13}{:>14}{:>12}{:>9}{:>11}{:<14}{:>8}{:>11}\n",
      c.no_load_current_a, c.fit_rms, "terrain", "motion", "rims m/s", "currents A", "predicted",
      "power W", "predicted", " (all soils)", "yaw", "predicted");
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    const PowerPoint& p = c.points[i];
    const Range& of = all.points[i].power_w;
    text += fmt::format(
        "{:<11}{:<9}{:>6.2f}{:>7.2f}{:>7.1f}{:>7.1f}{:>6}{:>6}{:>9.0f}{:>11}{:<14}{:>8}"
        "{:>11}{}\n",
        p.terrain, p.motion, p.rim_in_m_per_s, p.rim_out_m_per_s, p.measured_in_a, p.measured_out_a,
        Shown(p.in_a.middle, 1), Shown(p.out_a.middle, 1), p.measured_w, Shown(p.power_w.middle, 0),
        of.low < of.high ? fmt::format(" ({:.0f} to {:.0f})", of.low, of.high) : "",
        Shown(p.measured_yaw_ratio, 2), Shown(p.yaw_ratio.middle, 2), p.fitted ? "  fitted" : "");
  }
  return text;
}

}  // namespace

std::string TextOf(const Comparison& c) {
  std::string text =
      fmt::format("{:<60}{:>8}{:>8}  {:<6}{}\n", "row", "target", "value", "held", "");
  for (const Verdict& v : VerdictsOf(c)) {
    text += fmt::format("{:<60}{:>8.3f}{:>8}  {:<6}{}\n", v.row, v.target, Shown(v.value, 3),
                        v.held ? "yes" : "NO", v.note);
  }
  if (!c.ploughed) text += "straight current, ploughed over concrete: not without --currents\n";
  for (const RobotYaw& r : c.robots) text += TextOf(r);
  return text + TextOf(c.power, c.all_soils);
}

// Three digits, "-" for none.
std::string Short(double x) {
  if (!std::isfinite(x)) return "-";
  return x < 1000 ? fmt::format("{:.3g}", x) : fmt::format("{:.0f}", x);
}

std::string NoteOf(const TwistMiss& m) {
  std::string note;
  if (m.covered >= 0) note += fmt::format(" ({} of {} inside)", m.covered, m.rows);
  if (m.unanswered > 0) note += fmt::format(" ({} of {} no balance)", m.unanswered, m.rows);
  return note;
}

std::string TableOf(const Comparison& c, const std::vector<Way>& ways) {
  std::string text =
      fmt::format("| way to answer | a motion [us] | a plan of {} points [ms] |", kPlanPoints);
  for (const RobotYaw& r : c.robots) {
    text += fmt::format(" {}: yaw rate [rad/s] | forward speed [m/s] |", r.robot);
  }
  for (const PowerSummary& s : c.power.terrains) {
    text += fmt::format(" power on {} |", TerrainOf(s.terrain).hard.empty()
                                              ? TerrainOf(s.terrain).soils
                                              : TerrainOf(s.terrain).hard);
  }
  text += " straight current, loam over asphalt |\n|";
  for (std::size_t i = 0; i < 4 + 2 * c.robots.size() + c.power.terrains.size(); ++i) {
    text += " --- |";
  }
  for (const Way& way : ways) {
    text += fmt::format("\n| {} | {} | {} |", way.name, Short(way.motion_us), Short(way.plan_ms));
    for (const TwistMiss& m : way.robots) {
      text += fmt::format(" {}{} | {} |", Shown(m.yaw_rad_per_s, 3), NoteOf(m),
                          Shown(m.speed_m_per_s, 3));
    }
    for (const PowerMiss& m : way.power) {
      text += std::isfinite(m.share) ? fmt::format(" {:.0f} %, {:.0f} W |", 100 * m.share, m.watts)
                                     : " - |";
    }
    text += std::isfinite(way.current_share) ? fmt::format(" {:.0f} % |", 100 * way.current_share)
                                             : " - |";
  }
  return text + "\n";
}

std::string JsonOf(const Comparison& c, const std::vector<Way>& ways) {
  Json verdicts = Json::array(), robots, all_ways = Json::array();
  for (const Way& way : ways) all_ways.push_back(JsonOf(c, way));
  for (const Verdict& v : VerdictsOf(c)) {
    verdicts.push_back({{"row", v.row},
                        {"target", v.target},
                        {"value", NumberOf(v.value)},
                        {"held", v.held},
                        {"note", v.note}});
  }
  for (const RobotYaw& r : c.robots) {
    robots[r.robot] = {{"hard", JsonOf(r.hard)}, {"soil", JsonOf(r.soil)}};
  }
  return Json{{"rows", verdicts},
              {"yaw", robots},
              {"power", JsonOf(c.power)},
              {"power_rescaled", JsonOf(c.rescaled)},
              {"power_rigid", JsonOf(c.rigid)},
              {"power_all_soils", JsonOf(c.all_soils)},
              {"ways", all_ways}}
             .dump() +
         "\n";
}

}  // namespace grouser::measured

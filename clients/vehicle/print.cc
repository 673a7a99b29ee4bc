#include "clients/vehicle/print.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "surrogate/vehicle/vehicle_keys.h"

namespace grouser::cli {
namespace {

using namespace vehicle;
using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180 / std::numbers::pi;

std::string ReasonsOf(const Solution& s) {
  const std::string names = NamesOf(s.reasons);
  return names.empty() ? "none: within every limit" : names;
}

std::string ChanceOf(const GoProbability& go) {
  if (go.most - go.least < 1e-3) return fmt::format("{:.3f}", go.least);
  return fmt::format("{:.3f} to {:.3f}, as the models' runs do not cover all of it", go.least,
                     go.most);
}

/// 5, 50 and 95 % of what balances.
struct Quantiles {
  std::string name;
  double low, middle, high;
};

std::vector<Quantiles> QuantilesOf(const Vehicle& v, std::span<const Solution> draws) {
  std::vector<Quantiles> all;
  const auto add = [&](const std::string& name, const auto& value) {
    std::vector<double> values;
    for (const Solution& s : draws) {
      if (s.balanced) values.push_back(value(s));
    }
    if (values.empty()) return;
    std::sort(values.begin(), values.end());
    // Linear between the ordered values.
    const auto at = [&](double share) {
      const double place = share * static_cast<double>(values.size() - 1);
      const auto below = static_cast<std::size_t>(place);
      const double rest = place - static_cast<double>(below);
      return rest > 0 ? values[below] + rest * (values[below + 1] - values[below]) : values[below];
    };
    all.push_back({name, at(0.05), at(0.5), at(0.95)});
  };
  const std::pair<const char*, double Solution::*> fields[] = {
      {"v_x_m_per_s", &Solution::v_x_m_per_s},
      {"v_y_m_per_s", &Solution::v_y_m_per_s},
      {"yaw_rate_rad_per_s", &Solution::yaw_rate_rad_per_s},
      {"steering_rad", &Solution::steering_rad},
      {"shaft_power_w", &Solution::shaft_power_w},
      {"electric_power_w", &Solution::electric_power_w},
      {"torque_margin", &Solution::torque_margin},
      {"sinkage_margin", &Solution::sinkage_margin}};
  for (const auto& [name, member] : fields) {
    add(name, [m = member](const Solution& s) { return s.*m; });
  }
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    add("rim_speed_m_per_s." + v.drives[d].name,
        [d](const Solution& s) { return s.rim_speed_m_per_s[d]; });
  }
  return all;
}

double StandardError(const MotionOnDraws& on) {
  const double p = on.go.least;
  return std::sqrt(p * (1 - p) / static_cast<double>(on.solutions.size()));
}

std::string DrawsOf(const Vehicle& v, const MotionOnDraws& on) {
  if (on.solutions.empty()) return "";
  std::string out = fmt::format(
      "\nprobability to go on {} draws of the ground: {} (standard error {:.3f})\n"
      "{:32} {:>10} {:>10} {:>10}\n",
      on.solutions.size(), ChanceOf(on.go), StandardError(on), "of the draws that balance", "5 %",
      "50 %", "95 %");
  for (const Quantiles& q : QuantilesOf(v, on.solutions)) {
    out += fmt::format("{:32} {:10.4g} {:10.4g} {:10.4g}\n", q.name, q.low, q.middle, q.high);
  }
  return out;
}

Json JsonOf(const Vehicle& v, const MotionOnDraws& on) {
  Json quantiles = Json::object();
  for (const Quantiles& q : QuantilesOf(v, on.solutions)) {
    quantiles[q.name] = {q.low, q.middle, q.high};
  }
  const auto balanced = std::count_if(on.solutions.begin(), on.solutions.end(),
                                      [](const Solution& s) { return s.balanced; });
  return {{"count", on.solutions.size()},        {"balanced", balanced},
          {"go_probability_least", on.go.least}, {"go_probability_most", on.go.most},
          {"standard_error", StandardError(on)}, {"quantiles_5_50_95", quantiles}};
}

}  // namespace

std::string TextOf(const DescribedVehicle& described) {
  const Vehicle& v = described.vehicle;
  std::string out = fmt::format(
      "{}: {} kg, centre of gravity at ({}, {}, {}) m, yaw inertia {} kg m^2, gravity {} m/s^2\n",
      v.name, v.mass_kg, v.centre_x_m, v.centre_y_m, v.centre_z_m, v.yaw_inertia_kg_m2,
      v.gravity_m_per_s2);
  for (const Wheel& w : v.wheels) {
    const WheelType& type = v.wheel_types[w.type];
    out += fmt::format(
        "  {:14} ({:6.3f}, {:6.3f}) m  {} (radius {} m, width {} m)  {}{}\n", w.name, w.x_m, w.y_m,
        type.name, type.radius_m, type.width_m,
        w.drive < 0 ? "rolls freely" : "drive " + v.drives[static_cast<std::size_t>(w.drive)].name,
        w.steered ? ", steered" : "");
  }
  for (const Drive& d : v.drives) {
    out += fmt::format("  drive {}: {}\n", d.name, kCouplingNames[static_cast<int>(d.coupling)]);
  }
  for (const std::string& source : described.sources) out += "  " + source + "\n";
  return out;
}

std::string TextOf(const Vehicle& v, const Solution& s, const GoProbability& go,
                   const MotionOnDraws& on_draws) {
  std::string out = fmt::format(
      "reasons: {}\nv_x {:.4g} m/s, v_y {:.4g} m/s, yaw rate {:.4g} rad/s, side slip {:.2f} deg\n",
      ReasonsOf(s), s.v_x_m_per_s, s.v_y_m_per_s, s.yaw_rate_rad_per_s, s.side_slip_rad * kDegrees);
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    out += fmt::format("rim speed of {}: {:.4g} m/s\n", v.drives[d].name, s.rim_speed_m_per_s[d]);
  }
  if (v.steered()) {
    out += fmt::format("steering: {:.2f} deg\n", s.steering_rad * kDegrees);
  }
  out += fmt::format(
      "ground on vehicle: f_x {:.4g} N, f_y {:.4g} N, m_z {:.4g} N m\n"
      "power: {:.4g} W at the wheels, {:.4g} W electric\n"
      "margins: tipping {:.3f}, torque {:.3f}, sinkage {:.3f}; residual {:.1e} of the weight\n"
      "probability to go: {}\n\n"
      "{:14} {:>8} {:>8} {:>7} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
      s.f_x_n, s.f_y_n, s.m_z_n_m, s.shaft_power_w, s.electric_power_w, s.tip_margin,
      s.torque_margin, s.sinkage_margin, s.residual, ChanceOf(go), "wheel", "load N", "rim m/s",
      "slip", "angle deg", "f_x N", "f_y N", "T N m", "sink mm", "power W");
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    const WheelSolution& w = s.wheel[i];
    out += fmt::format(
        "{:14} {:8.2f} {:8.4f} {:7.3f} {:9.2f} {:8.2f} {:8.2f} {:8.3f} {:8.2f} {:8.2f}\n",
        v.wheels[i].name, w.load_n, w.rim_speed_m_per_s, w.slip, w.slip_angle_rad * kDegrees,
        w.f_x_n, w.f_y_n, w.torque_n_m, 1e3 * w.sinkage_m, w.shaft_power_w);
  }
  return out + DrawsOf(v, on_draws);
}

std::string JsonOf(const Vehicle& v, const Solution& s, const GoProbability& go,
                   const MotionOnDraws& on_draws) {
  Json wheels = Json::array();
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    const WheelSolution& w = s.wheel[i];
    wheels.push_back({{"name", v.wheels[i].name},
                      {"load_n", w.load_n},
                      {"rim_speed_m_per_s", w.rim_speed_m_per_s},
                      {"v_x_m_per_s", w.v_x_m_per_s},
                      {"v_y_m_per_s", w.v_y_m_per_s},
                      {"slip", w.slip},
                      {"slip_angle_rad", w.slip_angle_rad},
                      {"steer_rad", w.steer_rad},
                      {"f_x_n", w.f_x_n},
                      {"f_y_n", w.f_y_n},
                      {"torque_n_m", w.torque_n_m},
                      {"m_z_n_m", w.m_z_n_m},
                      {"sinkage_m", w.sinkage_m},
                      {"shaft_power_w", w.shaft_power_w},
                      {"flags", w.flags}});
  }
  Json drives = Json::object();
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    drives[v.drives[d].name] = s.rim_speed_m_per_s[d];
  }
  Json out = {{"reasons", NamesOf(s.reasons)},
              {"balanced", s.balanced},
              {"residual", s.residual},
              {"v_x_m_per_s", s.v_x_m_per_s},
              {"v_y_m_per_s", s.v_y_m_per_s},
              {"yaw_rate_rad_per_s", s.yaw_rate_rad_per_s},
              {"side_slip_rad", s.side_slip_rad},
              {"steering_rad", s.steering_rad},
              {"rim_speed_m_per_s", drives},
              {"f_x_n", s.f_x_n},
              {"f_y_n", s.f_y_n},
              {"m_z_n_m", s.m_z_n_m},
              {"shaft_power_w", s.shaft_power_w},
              {"electric_power_w", s.electric_power_w},
              {"tip_margin", s.tip_margin},
              {"torque_margin", s.torque_margin},
              {"sinkage_margin", s.sinkage_margin},
              {"go_probability_least", go.least},
              {"go_probability_most", go.most},
              {"wheels", wheels}};
  if (!on_draws.solutions.empty()) out["draws"] = JsonOf(v, on_draws);
  return out.dump(1) + "\n";
}

std::string TextOf(const Vehicle& v, const PowerInterval& p) {
  const Power& m = p.mean;
  std::string out = fmt::format(
      "reasons: {}\nelectric {:.4g} W (90 %: {:.4g} to {:.4g}), {:.4g} J/m (90 %: {:.4g} to "
      "{:.4g}), at the wheels {:.4g} W\n",
      ReasonsOf(p.solution), m.electric, p.electric_low, p.electric_high, p.joules_per_metre, p.low,
      p.high, m.shaft);
  const std::pair<const char*, double> parts[] = {
      {"drive losses", m.drive},  {"rolling", m.rolling}, {"slip", m.slip},
      {"lateral scrub", m.scrub}, {"grade", m.grade},     {"acceleration", m.acceleration},
      {"imbalance", m.imbalance}};
  for (const auto& [name, watts] : parts) out += fmt::format("  {:14} {:12.4f} W\n", name, watts);
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    out += fmt::format("  {:14} {:12.4f} W shaft\n", v.wheels[i].name, m.wheel[i]);
  }
  return out;
}

namespace {

Json ObjectOf(const Vehicle& v, const PowerInterval& p) {
  const Power& m = p.mean;
  Json wheels = Json::object();
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    wheels[v.wheels[i].name] = m.wheel[i];
  }
  return {{"reasons", NamesOf(p.solution.reasons)},
          {"balanced", p.solution.balanced},
          {"electric_w", m.electric},
          {"electric_low_w", p.electric_low},
          {"electric_high_w", p.electric_high},
          {"joules_per_metre", p.joules_per_metre},
          {"joules_per_metre_low", p.low},
          {"joules_per_metre_high", p.high},
          {"shaft_w", m.shaft},
          {"drive_w", m.drive},
          {"rolling_w", m.rolling},
          {"slip_w", m.slip},
          {"scrub_w", m.scrub},
          {"grade_w", m.grade},
          {"acceleration_w", m.acceleration},
          {"imbalance_w", m.imbalance},
          {"wheel_shaft_w", wheels}};
}

}  // namespace

std::string JsonOf(const Vehicle& v, const PowerInterval& p) {
  return ObjectOf(v, p).dump(1) + "\n";
}

std::string JsonOf(const Vehicle& v, const MotionLog& log, std::span<const PowerInterval> powers) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < powers.size(); ++i) {
    Json row = ObjectOf(v, powers[i]);
    if (!log.time_s.empty()) row["time_s"] = log.time_s[i];
    rows.push_back(std::move(row));
  }
  Json out = {{"rows", std::move(rows)}};
  if (!log.time_s.empty()) {
    const DriveEnergy sum = EnergyOf(log, powers);
    out.update({{"joules", sum.joules},
                {"joules_low", sum.low},
                {"joules_high", sum.high},
                {"seconds", sum.seconds},
                {"metres", sum.metres},
                {"rows_left_out", sum.left_out},
                {"seconds_left_out", sum.left_out_s}});
  }
  return out.dump(1) + "\n";
}

std::string CsvOf(const MotionLog& log, std::span<const PowerInterval> powers) {
  const bool timed = !log.time_s.empty();
  std::string out = timed ? "time_s," : "";
  out +=
      "electric_w,electric_low_w,electric_high_w,joules_per_metre,joules_per_metre_low,"
      "joules_per_metre_high,drive_w,rolling_w,slip_w,scrub_w,grade_w,acceleration_w,reasons\n";
  for (std::size_t i = 0; i < powers.size(); ++i) {
    const PowerInterval& p = powers[i];
    const Power& m = p.mean;
    if (timed) out += fmt::format("{},", log.time_s[i]);
    for (const double value :
         {m.electric, p.electric_low, p.electric_high, p.joules_per_metre, p.low, p.high, m.drive,
          m.rolling, m.slip, m.scrub, m.grade, m.acceleration}) {
      out += fmt::format("{:.6g},", p.solution.balanced ? value : NAN);
    }
    out += NamesOf(p.solution.reasons) + "\n";
  }
  return out;
}

std::string SumOf(const MotionLog& log, std::span<const PowerInterval> powers) {
  if (log.time_s.empty()) {
    const auto fallen = std::count_if(powers.begin(), powers.end(),
                                      [](const PowerInterval& p) { return !p.solution.balanced; });
    return fmt::format("{} rows, {} of them without balance; a column time_s would give joules\n",
                       powers.size(), fallen);
  }
  const DriveEnergy sum = EnergyOf(log, powers);
  std::string out = fmt::format(
      "{:.4g} J (90 %: {:.4g} to {:.4g}, of a ground that errs alike all along) in {:.4g} s and "
      "{:.4g} m\n",
      sum.joules, sum.low, sum.high, sum.seconds, sum.metres);
  if (sum.left_out > 0) {
    out += fmt::format(
        "not in it: {} rows of {:.4g} s where the ground or its interval's ends give no balance\n",
        sum.left_out, sum.left_out_s);
  }
  return out;
}

std::string TextOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan,
                   const PlanOnDraws& on_draws) {
  const bool drawn = on_draws.draws > 0;
  std::string out = fmt::format("{:>10} {:>10} {:>10} {:>10}  {:5} {:15} {:15} {:>10}{}\n", "s m",
                                "safe m/s", "plan m/s", "a m/s^2", "holds", "safe binds",
                                "plan binds", "short by", drawn ? "  on draws" : "");
  for (std::size_t i = 0; i < path.size(); ++i) {
    const SpeedPoint& p = plan[i];
    out +=
        fmt::format("{:10.3f} {:10.3f} {:10.3f} {:10.3f}  {:5} {:15} {:15} {:10.2e}", path[i].s_m,
                    p.safe_m_per_s, p.speed_m_per_s, p.acceleration_m_per_s2,
                    p.holds ? "yes" : "NO", NameOf(p.safe_binding), NameOf(p.binding), p.shortfall);
    out += drawn ? fmt::format("  {:8.3f}\n", on_draws.at[i]) : "\n";
  }
  if (drawn) {
    out += fmt::format("holds at all points on a share of {:.3f} of {} draws of the ground\n",
                       on_draws.holds, on_draws.draws);
  }
  return out;
}

std::string JsonOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan,
                   const PlanOnDraws& on_draws) {
  Json out = Json::array();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const SpeedPoint& p = plan[i];
    out.push_back({{"s_m", path[i].s_m},
                   {"curvature_per_m", path[i].curvature_per_m},
                   {"safe_m_per_s", p.safe_m_per_s},
                   {"safe_binding", NameOf(p.safe_binding)},
                   {"speed_m_per_s", p.speed_m_per_s},
                   {"acceleration_m_per_s2", p.acceleration_m_per_s2},
                   {"holds", p.holds},
                   {"binding", NameOf(p.binding)},
                   {"shortfall", p.shortfall}});
    if (on_draws.draws == 0) continue;
    out.back()["hold_probability"] = on_draws.at[i];
    out.back()["plan_hold_probability"] = on_draws.holds;  // of all points
  }
  return out.dump(1) + "\n";
}

std::string TextOf(std::span<const SoilGrades> soils) {
  std::string out = fmt::format("{:16} {:>8}  {:15} {:>8}  {:15}\n", "soil", "up deg", "beyond it",
                                "down deg", "beyond it");
  for (const SoilGrades& c : soils) {
    const GradeRange& g = c.grades;
    if (g.any) {
      out += fmt::format("{:16} {:8.2f}  {:15} {:8.2f}  {:15}\n", c.soil, g.up_rad * kDegrees,
                         NameOf(g.binding_up), -g.down_rad * kDegrees, NameOf(g.binding_down));
    } else {
      out +=
          fmt::format("{:16} {:>8}  {:15} {:>8}\n", c.soil, "none", NameOf(g.binding_up), "none");
    }
  }
  return out;
}

std::string JsonOf(std::span<const SoilGrades> soils) {
  Json out = Json::array();
  for (const SoilGrades& c : soils) {
    const GradeRange& g = c.grades;
    const auto degrees = [&](double grade) { return g.any ? Json(grade * kDegrees) : Json(); };
    out.push_back({{"soil", c.soil},
                   {"up_deg", degrees(g.up_rad)},
                   {"up_binding", NameOf(g.binding_up)},
                   {"down_deg", degrees(-g.down_rad)},
                   {"down_binding", g.any ? Json(NameOf(g.binding_down)) : Json()}});
  }
  return out.dump(1) + "\n";
}

}  // namespace grouser::cli

#include "surrogate/measured_vehicles/power.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "surrogate/vehicle/motor.h"

namespace grouser::measured {
namespace {

using vehicle::Motor, vehicle::Solution, vehicle::Vehicle;

Range RangeOf(std::vector<double> values) {
  std::erase_if(values, [](double x) { return !std::isfinite(x); });
  if (values.empty()) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan};
  }
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return {values.front(), (values[(n - 1) / 2] + values[n / 2]) / 2, values.back()};
}

// A steady motion, and wheels that do not sink in.
bool Answers(const Solution& s) { return s.balanced && (s.reasons & vehicle::kSinksIn) == 0; }

// Torque of a side, the tyre's own rolling resistance included.
double SideTorque(const Vehicle& v, const Solution& s, int side, double tyre_rolling) {
  double torque = TorqueOf(v, s, side);
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    if (v.wheels[i].drive != side) continue;
    const double rim = s.wheel[i].rim_speed_m_per_s;
    torque += tyre_rolling * s.wheel[i].load_n * v.wheel_types[v.wheels[i].type].radius_m *
              (rim > 0   ? 1
               : rim < 0 ? -1
                         : 0);
  }
  return torque;
}

double SpinOf(const Vehicle& v, double rim) { return rim / v.wheel_types[0].radius_m; }

double Current(const Vehicle& v, int side, double torque, double rim) {
  const Motor& motor = v.drives[static_cast<std::size_t>(side)].motor;
  return std::fabs(StateOf(motor, torque, SpinOf(v, rim)).current_a);
}

// As the table's own estimate: of magnitudes.
double Power(const Vehicle& v, double current, double rim) {
  const Motor& m = v.drives[0].motor;
  return m.resistance_ohm * current * current +
         m.torque_constant_n_m_per_a * m.gear * std::fabs(SpinOf(v, rim)) * current;
}

// Motor current per torque of one side while it drives.
double CurrentPerTorque(const Motor& m) {
  return 1 / (m.torque_constant_n_m_per_a * m.gear * m.efficiency);
}

bool OnHard(const PowerRow& row) { return !TerrainOf(row.terrain).hard.empty(); }
bool Fitted(const PowerRow& row) { return OnHard(row) && row.motion == "straight"; }

Vehicle WithNoLoad(Vehicle v, double current) {
  for (vehicle::Drive& d : v.drives) d.motor.no_load_current_a = current;
  return v;
}

// Mean over the rows of the current of a side that rolling does not explain.
double FitNoLoad(const std::vector<PowerRow>& rows, const Vehicle& v,
                 const PublishedGrounds& grounds, double rim_scale) {
  double sum = 0;
  int n = 0;
  for (const PowerRow& row : rows) {
    if (!Fitted(row)) continue;
    Candidates c = CandidatesOf(TerrainOf(row.terrain), v, grounds, Wheels::kRigid);
    const double speed = rim_scale * (row.rim_in_m_per_s + row.rim_out_m_per_s) / 2;
    const Solution s = c.grounds[0].Straight(speed);
    if (!Answers(s)) continue;
    const double torque = SideTorque(v, s, 0, 0) + SideTorque(v, s, 1, 0);
    sum +=
        (row.current_in_a + row.current_out_a - torque * CurrentPerTorque(v.drives[0].motor)) / 2;
    ++n;
  }
  if (n == 0) {
    throw std::invalid_argument(
        "no row 'straight' on hard ground that the vehicle can drive, expected one or more");
  }
  return std::max(0.0, sum / n);
}

PowerPoint PointOf(const PowerRow& row, const Vehicle& v, Candidates* c, double rim_scale) {
  const double in = rim_scale * row.rim_in_m_per_s, out = rim_scale * row.rim_out_m_per_s;
  std::vector<double> in_a, out_a, power, yaw;
  int unanswered = 0;
  for (OnGround& ground : c->grounds) {
    const Solution s = ground.Turn({in}, {out})[0];
    if (!Answers(s)) {
      ++unanswered;
      continue;
    }
    in_a.push_back(Current(v, 0, SideTorque(v, s, 0, c->tyre_rolling), in));
    out_a.push_back(Current(v, 1, SideTorque(v, s, 1, c->tyre_rolling), out));
    power.push_back(Power(v, in_a.back(), in) + Power(v, out_a.back(), out));
    yaw.push_back(s.yaw_rate_rad_per_s / (rim_scale * row.yaw_wheels_rad_per_s));
  }
  const Motor& m = v.drives[0].motor;
  const double back_emf = m.torque_constant_n_m_per_a * m.gear *
                          (std::fabs(SpinOf(v, row.rim_in_m_per_s)) * row.current_in_a +
                           std::fabs(SpinOf(v, row.rim_out_m_per_s)) * row.current_out_a);
  return {row.terrain,
          row.motion,
          Fitted(row),
          row.windows,
          in,
          out,
          row.current_in_a,
          row.current_out_a,
          row.power_w + (rim_scale - 1) * back_emf,
          static_cast<int>(c->grounds.size()),
          unanswered,
          RangeOf(in_a),
          RangeOf(out_a),
          RangeOf(power),
          row.yaw_ratio / rim_scale,
          RangeOf(yaw)};
}

// Root mean square and mean of what `value` says of the points that `chosen` takes.
struct Moments {
  int n = 0;
  double rms = 0, mean = 0;
};
template <class Chosen, class Value>
Moments Over(const std::vector<PowerPoint>& points, const Chosen& chosen, const Value& value) {
  Moments m;
  for (const PowerPoint& p : points) {
    const double x = chosen(p) ? value(p) : std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(x)) continue;
    m.rms += x * x;
    m.mean += x;
    ++m.n;
  }
  m.rms = std::sqrt(m.rms / m.n);
  m.mean /= m.n;
  return m;
}

double RelativeMiss(const PowerPoint& p) {
  return (p.power_w.middle - p.measured_w) / p.measured_w;
}

PowerSummary SummaryOf(const Terrain& t, const std::string& ground,
                       const std::vector<PowerPoint>& points) {
  const auto here = [&](const PowerPoint& p) { return p.terrain == t.name; };
  const auto straight = [&](const PowerPoint& p) { return here(p) && p.motion == "straight"; };
  const auto yawing = [&](const PowerPoint& p) {
    return here(p) && p.motion != "straight" && std::isfinite(p.measured_yaw_ratio);
  };
  PowerSummary s{t.name, ground};
  const Moments all = Over(
      points, [&](const auto& p) { return here(p) && !p.fitted; }, RelativeMiss);
  s.rows = all.n;
  s.unanswered = static_cast<int>(std::ranges::count_if(
      points, [&](const auto& p) { return here(p) && !p.fitted && p.unanswered == p.grounds; }));
  s.rms = all.rms;
  s.mean = all.mean;
  s.rms_straight = Over(points, straight, RelativeMiss).rms;
  s.rms_turning = Over(
                      points, [&](const auto& p) { return here(p) && !straight(p); }, RelativeMiss)
                      .rms;
  s.target = t.power_target;
  const Moments yaw = Over(points, yawing, [](const PowerPoint& p) {
    return p.yaw_ratio.middle - p.measured_yaw_ratio;
  });
  s.yaw_rows = yaw.n;
  s.yaw_rms = yaw.rms;
  s.yaw_measured =
      Over(points, yawing, [](const PowerPoint& p) { return p.measured_yaw_ratio; }).mean;
  s.yaw_predicted = s.yaw_measured + yaw.mean;
  s.yaw_target = t.yaw_target;
  return s;
}

// Mean current of straight driving on loam over asphalt.
void AddCurrentRatio(PowerComparison* result) {
  const auto mean = [&](const char* terrain, const auto& value) {
    return Over(
               result->points,
               [&](const PowerPoint& p) { return p.terrain == terrain && p.motion == "straight"; },
               value)
        .mean;
  };
  const auto measured = [](const PowerPoint& p) { return p.measured_in_a + p.measured_out_a; };
  const auto at = [](double Range::*end) {
    return [end](const PowerPoint& p) { return p.in_a.*end + p.out_a.*end; };
  };
  result->measured_current_ratio = mean("SANDY_LOAM", measured) / mean("ASPHALT", measured);
  const double asphalt = mean("ASPHALT", at(&Range::middle));
  result->current_ratio = {mean("SANDY_LOAM", at(&Range::low)) / asphalt,
                           mean("SANDY_LOAM", at(&Range::middle)) / asphalt,
                           mean("SANDY_LOAM", at(&Range::high)) / asphalt};
}

}  // namespace

PowerComparison ComparePower(const std::vector<PowerRow>& rows, const Vehicle& vehicle,
                             const PublishedGrounds& grounds, double rim_scale, Wheels wheels) {
  if (vehicle.drives.size() != 2 || !(vehicle.drives[0].motor.torque_constant_n_m_per_a > 0)) {
    throw std::invalid_argument(vehicle.name + ": drives: expected two with a torque constant");
  }
  PowerComparison result;
  result.rim_scale = rim_scale;
  result.no_load_current_a = FitNoLoad(rows, vehicle, grounds, rim_scale);
  const Vehicle v = WithNoLoad(vehicle, result.no_load_current_a);
  for (const PowerRow& row : rows) TerrainOf(row.terrain);  // refuses unknown ones
  for (const Terrain& terrain : Terrains()) {
    Candidates candidates = CandidatesOf(terrain, v, grounds, wheels);
    bool any = false;
    for (const PowerRow& row : rows) {
      if (row.terrain != terrain.name || row.motion == "still" || row.motion == "stuck") continue;
      result.points.push_back(PointOf(row, v, &candidates, rim_scale));
      any = true;
    }
    if (any) result.terrains.push_back(SummaryOf(terrain, candidates.said, result.points));
  }
  result.fit_rms = Over(
                       result.points, [](const PowerPoint& p) { return p.fitted; }, RelativeMiss)
                       .rms;
  AddCurrentRatio(&result);
  return result;
}

StraightCurrent MeanStraight(const std::vector<CurrentSample>& samples) {
  StraightCurrent mean;
  for (const CurrentSample& s : samples) {
    const bool straight = s.left_m_per_s > 0.1 && s.right_m_per_s > 0.1 &&
                          std::fabs(s.left_m_per_s - s.right_m_per_s) < 0.05;
    if (!straight) continue;
    mean.current_a += s.current_left_a + s.current_right_a;
    mean.speed_m_per_s += (s.left_m_per_s + s.right_m_per_s) / 2;
    ++mean.samples;
  }
  if (mean.samples == 0) throw std::invalid_argument("no sample of straight driving");
  mean.current_a /= mean.samples;
  mean.speed_m_per_s /= mean.samples;
  return mean;
}

PloughedComparison ComparePloughed(const StraightCurrent& concrete, const StraightCurrent& ploughed,
                                   const Vehicle& vehicle, const PublishedGrounds& grounds,
                                   Wheels wheels) {
  PloughedComparison result{concrete, ploughed};
  const double per_torque = CurrentPerTorque(vehicle.drives[0].motor);
  const auto torque = [&](OnGround& ground, double speed, double tyre_rolling) {
    const Solution s = ground.Straight(speed);
    if (!Answers(s)) return std::numeric_limits<double>::quiet_NaN();
    return SideTorque(vehicle, s, 0, tyre_rolling) + SideTorque(vehicle, s, 1, tyre_rolling);
  };
  OnGround hard(vehicle, FindHardGround(grounds.hard, "concrete").ground);
  const double rolling = torque(hard, concrete.speed_m_per_s, 0) * per_torque;
  if (std::isnan(rolling)) {
    throw std::invalid_argument(vehicle.name + ": no steady motion on concrete, expected one");
  }
  result.no_load_current_a = std::max(0.0, (concrete.current_a - rolling) / 2);
  Candidates soils = CandidatesOf(TerrainOf("SANDY_LOAM"), vehicle, grounds, wheels);
  std::vector<double> ratios;
  for (OnGround& ground : soils.grounds) {
    const double current = torque(ground, ploughed.speed_m_per_s, soils.tyre_rolling) * per_torque;
    ratios.push_back((2 * result.no_load_current_a + current) / concrete.current_a);
  }
  result.ratio = RangeOf(ratios);
  return result;
}

}  // namespace grouser::measured

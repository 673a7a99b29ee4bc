#include "surrogate/measured_vehicles/ways.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::measured {
namespace {

using vehicle::Solution, vehicle::Vehicle;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kRepetitions = 5;
constexpr double kLongUs = 1e5;  // is not repeated
constexpr double kInterval = 0.9;

// Processor time of this thread [us].
double ProcessorUs() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// The least of several.
double LeastUs(const std::function<void()>& work) {
  double least = std::numeric_limits<double>::infinity();
  const double begin = ProcessorUs();
  for (int i = 0; i < kRepetitions && ProcessorUs() < begin + kLongUs; ++i) {
    const double start = ProcessorUs();
    work();
    least = std::min(least, ProcessorUs() - start);
  }
  return least;
}

// Rim speeds of the rows, left and right.
std::array<std::vector<double>, 2> RimsOf(const std::vector<YawPoint>& points) {
  std::array<std::vector<double>, 2> rims;
  for (const YawPoint& p : points) {
    rims[0].push_back(p.left_m_per_s);
    rims[1].push_back(p.right_m_per_s);
  }
  return rims;
}

// Of sorted values, between neighbours in a straight line.
double Quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), sorted.size() - 1);
  const double next = sorted[std::min(i + 1, sorted.size() - 1)];
  return sorted[i] + (at - static_cast<double>(i)) * (next - sorted[i]);
}

/// What some grounds, or draws of one, say of the rows: at ground, row.
using TwistAnswers = std::vector<std::vector<Solution>>;

// Of the medians of those that balance; `draws`: their 5 to 95 % is an interval.
TwistMiss MissOf(const std::vector<YawPoint>& points, const TwistAnswers& answers, bool draws) {
  TwistMiss miss;
  if (draws) miss.covered = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].fitted) continue;
    std::vector<double> yaw, speed;
    for (const auto& answer : answers) {
      if (!answer[i].balanced) continue;
      yaw.push_back(answer[i].yaw_rate_rad_per_s);
      speed.push_back(answer[i].v_x_m_per_s);
    }
    ++miss.rows;
    if (yaw.empty()) {
      ++miss.unanswered;
      continue;
    }
    std::ranges::sort(yaw);
    std::ranges::sort(speed);
    miss.yaw_rad_per_s += std::pow(Quantile(yaw, 0.5) - points[i].measured, 2);
    miss.speed_m_per_s += std::pow(Quantile(speed, 0.5) - points[i].v_x, 2);
    miss.covered += draws && points[i].measured >= Quantile(yaw, (1 - kInterval) / 2) &&
                    points[i].measured <= Quantile(yaw, (1 + kInterval) / 2);
  }
  const int answered = miss.rows - miss.unanswered;
  miss.yaw_rad_per_s = std::sqrt(miss.yaw_rad_per_s / answered);
  miss.speed_m_per_s = std::sqrt(miss.speed_m_per_s / answered);
  return miss;
}

double RimMean(const YawPoint& p) { return (p.left_m_per_s + p.right_m_per_s) / 2; }

// The factor of least squares on `of` of the fitted rows.
template <class Of, class Measured>
double FactorOf(const std::vector<YawPoint>& points, const Of& of, const Measured& measured) {
  double both = 0, square = 0;
  for (const YawPoint& p : points) {
    if (!p.fitted) continue;
    both += measured(p) * of(p);
    square += of(p) * of(p);
  }
  return both / square;
}

TwistMiss FactorMiss(const YawComparison& y, double* motion_us) {
  const double on_speed = FactorOf(y.points, RimMean, [](const YawPoint& p) { return p.v_x; });
  TwistAnswers answers(1, std::vector<Solution>(y.points.size()));
  *motion_us = LeastUs([&] {
                 for (std::size_t i = 0; i < y.points.size(); ++i) {
                   Solution& s = answers[0][i];
                   s.balanced = true;
                   s.yaw_rate_rad_per_s = y.factor * y.points[i].without_slip;
                   s.v_x_m_per_s = on_speed * RimMean(y.points[i]);
                 }
               }) /
               static_cast<double>(y.points.size());
  return MissOf(y.points, answers, false);
}

bool Counts(const PowerPoint& p, const std::string& terrain) {
  return p.terrain == terrain && !p.fitted;
}

PowerMiss MissOf(const std::vector<PowerPoint>& points, const std::string& terrain,
                 const std::function<double(const PowerPoint&)>& predicted) {
  double share = 0, watts = 0;
  int n = 0;
  for (const PowerPoint& p : points) {
    if (!Counts(p, terrain)) continue;
    const double miss = predicted(p) - p.measured_w;
    share += miss / p.measured_w * (miss / p.measured_w);
    watts += miss * miss;
    ++n;
  }
  return {terrain, std::sqrt(share / n), std::sqrt(watts / n)};
}

// P = a v + b w, by least squares on the rows of the other terrains.
PowerMiss FitOfOthers(const std::vector<PowerPoint>& points, const std::string& terrain) {
  const auto v = [](const PowerPoint& p) { return (p.rim_in_m_per_s + p.rim_out_m_per_s) / 2; };
  const auto w = [](const PowerPoint& p) { return p.rim_out_m_per_s - p.rim_in_m_per_s; };
  double vv = 0, vw = 0, ww = 0, vp = 0, wp = 0;
  for (const PowerPoint& p : points) {
    if (p.terrain == terrain) continue;
    vv += v(p) * v(p);
    vw += v(p) * w(p);
    ww += w(p) * w(p);
    vp += v(p) * p.measured_w;
    wp += w(p) * p.measured_w;
  }
  const double det = vv * ww - vw * vw;
  const double a = (vp * ww - wp * vw) / det, b = (wp * vv - vp * vw) / det;
  return MissOf(points, terrain, [&](const PowerPoint& p) { return a * v(p) + b * w(p); });
}

// Of the terrains that are hard ground, or of those that are not.
std::vector<PowerMiss> PowerOf(const PowerComparison& c, bool hard) {
  std::vector<PowerMiss> all;
  for (const PowerSummary& s : c.terrains) {
    const bool answers = TerrainOf(s.terrain).hard.empty() != hard && s.unanswered == 0;
    all.push_back(
        answers ? MissOf(c.points, s.terrain, [](const PowerPoint& p) { return p.power_w.middle; })
                : PowerMiss{s.terrain, kNone, kNone});
  }
  return all;
}

double CurrentShare(const PowerComparison& c, double predicted) {
  return std::fabs(predicted / c.measured_current_ratio - 1);
}

// 100 m of curves of 2 m and more, level, no faster than 1 m/s.
std::vector<vehicle::PathPoint> PlanPath() {
  std::vector<vehicle::PathPoint> path(kPlanPoints);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i].s_m = 0.1 * static_cast<double>(i);
    path[i].curvature_per_m = 0.5 * std::sin(2 * std::numbers::pi * path[i].s_m / 40);
  }
  return path;
}

double PlanMs(const OnGround& ground, std::size_t draws) {
  const std::vector<vehicle::PathPoint> path = PlanPath();
  const vehicle::Grounds grounds = ground.grounds();
  vehicle::SpeedPlanner planner(ground.vehicle(), grounds, path.size());
  if (draws > 0) {
    planner.UseDraws(std::make_shared<const vehicle::GroundDraws>(grounds, draws));
  }
  vehicle::SpeedOptions options;
  options.speed_limit_m_per_s = 1;
  std::vector<vehicle::SpeedPoint> plan(path.size());
  return 1e-3 * LeastUs([&] {
           planner.Plan(path, options, plan);
           if (draws > 0) planner.PlanByDraws(path, options, plan, {});
         });
}

/// The ground of a robot at what was fitted to its rows, or as it was published.
using GroundsFor = std::function<std::vector<OnGround>(const Vehicle&, const RobotYaw*)>;

Way Solved(const std::string& name, const Comparison& c, const GroundsFor& grounds_for) {
  Way way{name, 0, 0, {}, {}, kNone};
  for (const RobotYaw& robot : c.robots) {
    const auto& points = robot.hard.points;
    const auto [left, right] = RimsOf(points);
    std::vector<OnGround> grounds = grounds_for(Shipped(robot.robot), &robot);
    TwistAnswers answers(grounds.size());
    const auto solve = [&, &l = left, &r = right] {
      for (std::size_t k = 0; k < grounds.size(); ++k) answers[k] = grounds[k].Turn(l, r);
    };
    if (&robot == &c.robots.front()) {
      way.motion_us = LeastUs(solve) / static_cast<double>(points.size());
    } else {
      solve();
    }
    way.robots.push_back(MissOf(points, answers, false));
  }
  for (const OnGround& ground : grounds_for(Shipped("husky"), nullptr)) {
    way.plan_ms += PlanMs(ground, 0);
  }
  return way;
}

// Hard ground by draws of its friction and rolling resistance.
Way Drawn(const Comparison& c, const GroundsFor& hard) {
  Way way{fmt::format("hard ground, {} draws, median", kWayDraws), 0, 0, {}, {}, kNone};
  for (const RobotYaw& robot : c.robots) {
    const auto& points = robot.hard.points;
    const auto [left, right] = RimsOf(points);
    OnGround ground = std::move(hard(Shipped(robot.robot), &robot).front());
    ground.solver().UseDraws(
        std::make_shared<const vehicle::GroundDraws>(ground.grounds(), kWayDraws));
    TwistAnswers answers(kWayDraws);
    const auto solve = [&, &l = left, &r = right] {
      for (std::size_t k = 0; k < kWayDraws; ++k) {
        answers[k] = ground.Turn(l, r, static_cast<int>(k));
      }
    };
    if (&robot == &c.robots.front()) {
      way.motion_us = LeastUs(solve) / static_cast<double>(points.size());
    } else {
      solve();
    }
    way.robots.push_back(MissOf(points, answers, true));
  }
  way.plan_ms = PlanMs(hard(Shipped("husky"), nullptr).front(), kWayDraws);
  for (const PowerSummary& s : c.power.terrains) way.power.push_back({s.terrain, kNone, kNone});
  return way;
}

Way OneFactor(const Comparison& c) {
  Way way{"one factor; power: a v + b w of the other terrains", 0, kNone, {}, {}, kNone};
  for (const RobotYaw& robot : c.robots) {
    double us = 0;
    way.robots.push_back(FactorMiss(robot.hard, &us));
    if (&robot == &c.robots.front()) way.motion_us = us;
  }
  for (const PowerSummary& s : c.power.terrains) {
    way.power.push_back(FitOfOthers(c.power.points, s.terrain));
  }
  way.current_share = CurrentShare(c.power, 1);
  return way;
}

GroundsFor OnSoil(const surrogate::Soil& soil, Wheels wheels) {
  return [&soil, wheels](const Vehicle& v, const RobotYaw* robot) {
    std::vector<OnGround> one;
    one.emplace_back(v, robot != nullptr ? WithFriction(soil, robot->soil.friction) : soil, wheels);
    return one;
  };
}

}  // namespace

std::vector<Way> WaysOf(const Tables& tables, const Comparison& c) {
  std::ifstream file(tables.power);
  const std::vector<PowerRow> rows = ReadPowerRows(file, tables.power);
  const PublishedGrounds all = Published(), suggested = SuggestedOf(all);
  const Terrain& loam = TerrainOf("SANDY_LOAM");
  const auto hard = [&](const Vehicle& v, const RobotYaw* robot) {
    surrogate::HardGround ground = FindHardGround(all.hard, "asphalt").ground;
    if (robot != nullptr) ground.friction = robot->hard.friction;
    std::vector<OnGround> one;
    one.emplace_back(v, ground);
    return one;
  };
  const auto loams = [&](const Vehicle& v, const RobotYaw*) {
    return std::move(CandidatesOf(loam, v, all, Wheels::kTyres).grounds);
  };
  std::vector<Way> ways = {OneFactor(c), Solved("hard ground", c, hard)};
  ways[1].power = PowerOf(c.power, true);
  const surrogate::Soil& soil = suggested.soils.front();  // the sandy loam
  const PowerComparison from_table =
      ComparePower(rows, Shipped("husky"), suggested, 1, Wheels::kTabulatedTyres);
  const struct {
    std::string name;
    GroundsFor grounds;
    const PowerComparison& power;
  } soils[] = {
      {soil.name + ", tyres, from a table", OnSoil(soil, Wheels::kTabulatedTyres), from_table},
      {soil.name + ", tyres, by its law", OnSoil(soil, Wheels::kTyres), c.power},
      {soil.name + ", rigid wheels, by its law", OnSoil(soil, Wheels::kRigid), c.rigid},
      {"all sandy loams, tyres, by their laws, median", loams, c.all_soils}};
  for (const auto& s : soils) {
    ways.push_back(Solved(s.name, c, s.grounds));
    ways.back().power = PowerOf(s.power, false);
    ways.back().current_share = CurrentShare(s.power, s.power.current_ratio.middle);
  }
  ways.insert(ways.end() - 1, Drawn(c, hard));
  return ways;
}

}  // namespace grouser::measured

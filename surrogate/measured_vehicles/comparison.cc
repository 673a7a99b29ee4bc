#include "surrogate/measured_vehicles/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace grouser::measured {
namespace {

namespace fs = std::filesystem;

constexpr double kCurrentTarget = 0.15;

struct Robot {
  const char* name;
  double track_m;  ///< of the recordings' own configuration
  double target;
};
constexpr Robot kRobots[] = {{"husky", 0.55, 0.12}, {"warthog", 1.08, 0.065}};

std::ifstream Open(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::invalid_argument(path + ": cannot be read, expected a table");
  return file;
}

RobotYaw CompareRobot(const Robot& robot, const std::vector<DriveWindow>& windows,
                      const PublishedGrounds& suggested) {
  const vehicle::Vehicle v = Shipped(robot.name);
  const surrogate::HardGround& hard = FindHardGround(suggested.hard, "asphalt").ground;
  const surrogate::Soil& soil = suggested.soils.front();  // the sandy loam
  const auto on_hard = [&](double friction) {
    surrogate::HardGround ground = hard;
    ground.friction = friction;
    return OnGround(v, ground);
  };
  const auto on_soil = [&](double friction) {
    return OnGround(v, WithFriction(soil, friction), Wheels::kTyres);
  };
  return {robot.name, robot.target,
          CompareYaw(windows, robot.name, robot.track_m, "hard ground", on_hard),
          CompareYaw(windows, robot.name, robot.track_m, soil.name, on_soil)};
}

// All samples of the files of a folder whose names begin so.
StraightCurrent Recorded(const std::string& folder, const std::string& begin) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with(begin)) files.push_back(entry.path());
  }
  if (files.empty()) {
    throw std::invalid_argument(folder + ": no file " + begin + "*.csv, expected recordings");
  }
  std::ranges::sort(files);
  std::vector<CurrentSample> all;
  for (const fs::path& path : files) {
    std::ifstream file = Open(path.string());
    const auto some = ReadCurrents(file, path.string());
    all.insert(all.end(), some.begin(), some.end());
  }
  return MeanStraight(all);
}

std::string Percent(double share) { return fmt::format("{:+.0f} %", 100 * share); }

void AddYaw(const RobotYaw& r, std::vector<Verdict>* out) {
  const YawComparison& h = r.hard;
  out->push_back(
      {r.robot + ": yaw rate, rad/s, rows held back (hard ground)", r.target, h.rms,
       h.rms <= r.target,
       fmt::format("friction {:.2f}; a constant factor {:.3f}; windows alike differ by {:.3f}",
                   h.friction, h.factor_rms, h.repeat_rms)});
  out->push_back({fmt::format("{}: 90 % intervals that hold, of {}", r.robot, h.held_back), 0.9,
                  static_cast<double>(h.covered) / h.held_back,
                  h.covered >= h.band_low && h.covered <= h.band_high,
                  fmt::format("band {} to {}", h.band_low, h.band_high)});
  const YawComparison& s = r.soil;
  out->push_back({fmt::format("{}: yaw rate, rad/s, rows held back ({})", r.robot, s.ground),
                  r.target, s.rms, s.rms <= r.target,
                  fmt::format("friction {:.2f}; without rows that hardly turn {:.3f}", s.friction,
                              s.rms_moving)});
}

Verdict PowerVerdict(const PowerSummary& s, const std::string& note) {
  const bool answered = s.unanswered == 0;
  return {fmt::format("power on {} ({})", s.terrain, s.ground), s.target, s.rms,
          answered && s.rms <= s.target,
          answered ? fmt::format("mean {}{}", Percent(s.mean), note)
                   : fmt::format("no answer for {} rows: wheels sink in or nothing balances",
                                 s.unanswered)};
}

void AddPower(const Comparison& c, std::vector<Verdict>* out) {
  for (std::size_t i = 0; i < c.power.terrains.size(); ++i) {
    const PowerSummary &s = c.power.terrains[i], &all = c.all_soils.terrains[i];
    std::string note = fmt::format(", rescaled rims {:.3f}", c.rescaled.terrains[i].rms);
    const bool soil = all.ground != s.ground;
    if (soil) note += fmt::format(", rigid wheels {:.3f}", c.rigid.terrains[i].rms);
    out->push_back(PowerVerdict(s, note));
    if (soil) out->push_back(PowerVerdict(all, ""));
  }
  for (const PowerComparison* p : {&c.power, &c.rescaled}) {
    for (const PowerSummary& s : p->terrains) {
      if (s.yaw_rows == 0) continue;
      out->push_back({fmt::format("yaw ratio on {} ({}){}", s.terrain, s.ground,
                                  p == &c.power ? "" : ", rescaled rims"),
                      s.yaw_target, s.yaw_rms, s.yaw_rms <= s.yaw_target,
                      fmt::format("means {:.3f} measured, {:.3f} predicted", s.yaw_measured,
                                  s.yaw_predicted)});
    }
  }
}

Verdict CurrentVerdict(const std::string& what, double measured, const Range& predicted,
                       double rigid) {
  const double miss = predicted.middle / measured - 1;
  std::string note = fmt::format("{:.2f} measured, {:.2f} predicted", measured, predicted.middle);
  if (predicted.low < predicted.high) {
    note += fmt::format(" ({:.2f} to {:.2f})", predicted.low, predicted.high);
  }
  if (std::isfinite(rigid)) note += fmt::format(", rigid wheels {:.2f}", rigid);
  return {"current, straight: " + what, kCurrentTarget, std::fabs(miss),
          std::fabs(miss) <= kCurrentTarget, note};
}

void AddCurrents(const Comparison& c, std::vector<Verdict>* out) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double loam = c.power.measured_current_ratio;
  out->push_back(CurrentVerdict("loam over asphalt", loam, c.power.current_ratio,
                                c.rigid.current_ratio.middle));
  out->push_back(
      CurrentVerdict("loam over asphalt, all soils", loam, c.all_soils.current_ratio, none));
  if (!c.ploughed) return;
  const double ploughed = c.ploughed->ploughed.current_a / c.ploughed->concrete.current_a;
  out->push_back(CurrentVerdict("ploughed over concrete", ploughed, c.ploughed->ratio,
                                c.ploughed_rigid->ratio.middle));
  out->push_back(CurrentVerdict("ploughed over concrete, all soils", ploughed,
                                c.ploughed_all_soils->ratio, none));
}

}  // namespace

Comparison Compare(const Tables& tables) {
  std::ifstream windows_file = Open(tables.windows), power_file = Open(tables.power);
  const std::vector<DriveWindow> windows = ReadDriveWindows(windows_file, tables.windows);
  const std::vector<PowerRow> rows = ReadPowerRows(power_file, tables.power);
  const PublishedGrounds all = Published(), suggested = SuggestedOf(all);
  const vehicle::Vehicle husky = Shipped("husky");
  Comparison c;
  c.power = ComparePower(rows, husky, suggested, 1, Wheels::kTyres);
  c.rescaled = ComparePower(rows, husky, suggested, kRimScale, Wheels::kTyres);
  c.rigid = ComparePower(rows, husky, suggested, 1, Wheels::kRigid);
  c.all_soils = ComparePower(rows, husky, all, 1, Wheels::kTyres);
  if (!tables.currents.empty()) {
    const StraightCurrent concrete = Recorded(tables.currents, "CONCRETE_"),
                          ploughed = Recorded(tables.currents, "PLOUGHED_");
    const auto compare = [&](const PublishedGrounds& grounds, Wheels wheels) {
      return ComparePloughed(concrete, ploughed, husky, grounds, wheels);
    };
    c.ploughed = compare(suggested, Wheels::kTyres);
    c.ploughed_rigid = compare(suggested, Wheels::kRigid);
    c.ploughed_all_soils = compare(all, Wheels::kTyres);
  }
  for (const Robot& robot : kRobots) c.robots.push_back(CompareRobot(robot, windows, suggested));
  return c;
}

std::vector<Verdict> VerdictsOf(const Comparison& c) {
  std::vector<Verdict> all;
  for (const RobotYaw& robot : c.robots) AddYaw(robot, &all);
  AddPower(c, &all);
  AddCurrents(c, &all);
  return all;
}

}  // namespace grouser::measured

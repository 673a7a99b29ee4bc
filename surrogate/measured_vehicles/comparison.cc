#include "surrogate/measured_vehicles/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::measured {
namespace {

namespace fs = std::filesystem;

constexpr double kCurrentTarget = 0.15;
constexpr const char* kSoil = "Sandy loam 15 %";  // a soft ground, chosen beforehand

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

vehicle::Vehicle Shipped(const std::string& name) {
  return vehicle::ReadVehicle(surrogate::SurrogateFile("vehicle/shipped/" + name + ".vehicle.yaml"))
      .vehicle;
}

PublishedGrounds Published() {
  const std::string path = surrogate::PublishedSoilsFile();
  std::ifstream soils = Open(path);
  return {surrogate::PublishedHardGrounds(), surrogate::ReadSoils(soils, path)};
}

RobotYaw CompareRobot(const Robot& robot, const std::vector<DriveWindow>& windows,
                      const PublishedGrounds& grounds) {
  const vehicle::Vehicle v = Shipped(robot.name);
  const surrogate::HardGround& hard = FindHardGround(grounds.hard, "asphalt").ground;
  const auto soil = std::ranges::find(grounds.soils, kSoil, &surrogate::Soil::name);
  if (soil == grounds.soils.end())
    throw std::invalid_argument(std::string(kSoil) + ": no such soil");
  const auto on_hard = [&](double friction) {
    surrogate::HardGround ground = hard;
    ground.friction = friction;
    return OnGround(v, ground);
  };
  const auto on_soil = [&](double friction) {
    return OnGround(v, WithFriction(*soil, friction), Wheels::kTyres);
  };
  return {robot.name, robot.target,
          CompareYaw(windows, robot.name, robot.track_m, "hard ground", on_hard),
          CompareYaw(windows, robot.name, robot.track_m, kSoil, on_soil)};
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
      {r.robot + ": yaw rate, rms of the rows held back", r.target, h.rms, "rad/s",
       h.rms <= r.target,
       fmt::format("friction {:.2f}; a constant factor {:.3f}; windows alike differ by {:.3f}",
                   h.friction, h.factor_rms, h.repeat_rms)});
  out->push_back({r.robot + ": 90 % intervals that hold, of " + std::to_string(h.held_back), 0.9,
                  static_cast<double>(h.covered) / h.held_back, "",
                  h.covered >= h.band_low && h.covered <= h.band_high,
                  fmt::format("band {} to {}", h.band_low, h.band_high)});
}

void AddPower(const Comparison& c, std::vector<Verdict>* out) {
  for (std::size_t i = 0; i < c.power.terrains.size(); ++i) {
    const PowerSummary &s = c.power.terrains[i], &wide = c.rescaled.terrains[i],
                       &rigid = c.rigid.terrains[i];
    std::string note =
        s.unanswered > 0 ? fmt::format("no answer for {} rows: wheels sink in", s.unanswered)
                         : fmt::format("mean {}, rescaled rims {:.3f}", Percent(s.mean), wide.rms);
    if (s.unanswered == 0 && rigid.rms != s.rms)
      note += fmt::format(", rigid wheels {:.3f}", rigid.rms);
    out->push_back({"power on " + s.terrain + ", rms of the rows not fitted", s.target, s.rms, "",
                    s.unanswered == 0 && s.rms <= s.target, note});
  }
  for (const PowerComparison* p : {&c.power, &c.rescaled}) {
    for (const PowerSummary& s : p->terrains) {
      if (s.yaw_rows == 0) continue;
      out->push_back(
          {fmt::format("yaw ratio on {}, rms{}", s.terrain, p == &c.power ? "" : ", rescaled rims"),
           s.yaw_target, s.yaw_rms, "", s.yaw_rms <= s.yaw_target,
           fmt::format("means {:.3f} measured, {:.3f} predicted", s.yaw_measured,
                       s.yaw_predicted)});
    }
  }
}

Verdict CurrentVerdict(const std::string& row, double measured, const Range& predicted,
                       double rigid) {
  const double miss = predicted.middle / measured - 1;
  return {row,
          kCurrentTarget,
          std::fabs(miss),
          "",
          std::fabs(miss) <= kCurrentTarget,
          fmt::format("{:.2f} measured, {:.2f} predicted ({:.2f} to {:.2f}), rigid wheels {:.2f}",
                      measured, predicted.middle, predicted.low, predicted.high, rigid)};
}

}  // namespace

Comparison Compare(const Tables& tables) {
  std::ifstream windows_file = Open(tables.windows), power_file = Open(tables.power);
  const std::vector<DriveWindow> windows = ReadDriveWindows(windows_file, tables.windows);
  const std::vector<PowerRow> rows = ReadPowerRows(power_file, tables.power);
  const PublishedGrounds grounds = Published();
  Comparison c;
  const vehicle::Vehicle husky = Shipped("husky");
  c.power = ComparePower(rows, husky, grounds, 1, Wheels::kTyres);
  c.rescaled = ComparePower(rows, husky, grounds, kRimScale, Wheels::kTyres);
  c.rigid = ComparePower(rows, husky, grounds, 1, Wheels::kRigid);
  if (!tables.currents.empty()) {
    const StraightCurrent concrete = Recorded(tables.currents, "CONCRETE_"),
                          ploughed = Recorded(tables.currents, "PLOUGHED_");
    c.ploughed = ComparePloughed(concrete, ploughed, husky, grounds, Wheels::kTyres);
    c.ploughed_rigid = ComparePloughed(concrete, ploughed, husky, grounds, Wheels::kRigid);
  }
  for (const Robot& robot : kRobots) c.robots.push_back(CompareRobot(robot, windows, grounds));
  return c;
}

std::vector<Verdict> VerdictsOf(const Comparison& c) {
  std::vector<Verdict> all;
  for (const RobotYaw& robot : c.robots) AddYaw(robot, &all);
  AddPower(c, &all);
  all.push_back(CurrentVerdict("straight current, loam over asphalt, miss",
                               c.power.measured_current_ratio, c.power.current_ratio,
                               c.rigid.current_ratio.middle));
  if (c.ploughed) {
    all.push_back(CurrentVerdict("straight current, ploughed over concrete, miss",
                                 c.ploughed->ploughed.current_a / c.ploughed->concrete.current_a,
                                 c.ploughed->ratio, c.ploughed_rigid->ratio.middle));
  }
  return all;
}

}  // namespace grouser::measured

// grouser-vehicle: what a vehicle does on its ground.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>

#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/path_file.h"
#include "surrogate/vehicle/print.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "surrogate/vehicle/yaml.h"

namespace {

using namespace grouser::vehicle;

constexpr int kOk = 0, kFailed = 1, kUsage = 2;
constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-vehicle show surrogate/vehicle/shipped/husky.vehicle.yaml\n"
    "  grouser-vehicle solve FILE --soil asphalt --speed 0.8 --radius 2\n"
    "  grouser-vehicle solve FILE --speed 0.5 --grade-deg 12 --json\n"
    "  grouser-vehicle solve FILE --rim 0.4 0.8\n"
    "  grouser-vehicle climb FILE --soil asphalt --speed 0.5\n"
    "  grouser-vehicle speed FILE PATH.csv --limit 1.5\n"
    "  grouser-vehicle energy FILE --soil asphalt --speed 0.5 --radius 1\n"
    "  grouser-vehicle constants FILE --speeds 0.5 --radii 1 5\n"
    "  grouser-vehicle schema\n"
    "  grouser vehicle measured: measured vehicles beside the solver (grouser-measured-vehicles)\n"
    "Exit codes: 0 ok, 1 no solution within every limit, 2 usage or a bad file.";

struct Arguments {
  std::string file, soil;
  std::vector<std::string> soils;
  std::optional<double> speed, yaw_rate, curvature, radius;
  std::vector<double> rim;
  double steer_deg = 0, grade_deg = 0, bank_deg = 0, acceleration = 0;
  std::string path;
  std::vector<double> speeds = {0.3, 0.8}, radii = {1, 3, 10};
  SpeedOptions plan;
  bool json = false, untrained = false;
};

std::uint8_t SoilIndex(const VehicleFile& file, const std::string& name) {
  const auto& soils = file.grounds.soils;
  for (std::size_t s = 0; s < soils.size(); ++s) {
    if (soils[s] == name) return static_cast<std::uint8_t>(s);
  }
  throw CLI::ValidationError("--soil", "got " + name + ", expected one of the file, such as " +
                                           yaml::NearestOf(name, soils));
}

Motion MotionOf(const Arguments& a, const VehicleFile& file) {
  Motion m;
  const int turns =
      int(a.yaw_rate.has_value()) + int(a.curvature.has_value()) + int(a.radius.has_value());
  if (turns > 1) {
    throw CLI::ValidationError("--radius", "at most one of --yaw-rate, --curvature and --radius");
  }
  if (!a.rim.empty()) {
    if (a.speed || turns > 0) throw CLI::ValidationError("--rim", "not with a twist");
    if (a.rim.size() != file.vehicle.drives.size()) {
      throw CLI::ValidationError(
          "--rim", "got " + std::to_string(a.rim.size()) + " speeds, expected one a drive");
    }
    m.given = Motion::Given::kControls;
    std::copy(a.rim.begin(), a.rim.end(), m.rim_speed_m_per_s.begin());
    m.steering_rad = a.steer_deg * kDegree;
  } else {
    if (!a.speed && !a.yaw_rate) throw CLI::RequiredError("--speed, --yaw-rate or --rim");
    m.v_x_m_per_s = a.speed.value_or(0);
    if (a.radius && *a.radius == 0) {
      throw CLI::ValidationError("--radius",
                                 "got 0, expected another number (--yaw-rate turns in "
                                 "place)");
    }
    const double curvature = a.radius ? 1 / *a.radius : a.curvature.value_or(0);
    m.yaw_rate_rad_per_s = a.yaw_rate.value_or(m.v_x_m_per_s * curvature);
  }
  m.acceleration_m_per_s2 = a.acceleration;
  m.grade_rad = a.grade_deg * kDegree;
  m.bank_rad = a.bank_deg * kDegree;
  if (!a.soil.empty() && !a.soils.empty()) {
    throw CLI::ValidationError("--soil", "not with --soils");
  }
  if (!a.soil.empty()) m.soil.fill(SoilIndex(file, a.soil));
  if (!a.soils.empty() && a.soils.size() != file.vehicle.wheels.size()) {
    throw CLI::ValidationError("--soils",
                               "got " + std::to_string(a.soils.size()) + ", expected one a wheel");
  }
  for (std::size_t i = 0; i < a.soils.size(); ++i) m.soil[i] = SoilIndex(file, a.soils[i]);
  return m;
}

int SolveOne(const Arguments& a) {
  const VehicleFile file = ReadVehicle(a.file);
  const Motion motion = MotionOf(a, file);
  Solver solver(file.vehicle, file.grounds);
  Solution solution;
  solver.Solve({&motion, 1}, {&solution, 1});
  SpeedOptions limits;  // those of the vehicle alone
  limits.tip_margin = 0;
  const GoProbability go =
      SpeedPlanner(file.vehicle, file.grounds, 1).ProbabilityToGo(motion, limits);
  std::cout << (a.json ? JsonOf(file, solution, go) : TextOf(file, solution, go));
  return (solution.reasons & ~kUntrained) == 0 && solution.balanced ? kOk : kFailed;
}

int Energy(const Arguments& a) {
  const VehicleFile file = ReadVehicle(a.file);
  Solver solver(file.vehicle, file.grounds);
  const PowerInterval power = PowerOf(&solver, MotionOf(a, file));
  std::cout << (a.json ? JsonOf(file, power) : TextOf(file, power));
  return (power.solution.reasons & ~kUntrained) == 0 && power.solution.balanced ? kOk : kFailed;
}

int PlanSpeeds(Arguments a) {
  const VehicleFile file = ReadVehicle(a.file);
  const std::vector<PathPoint> path = ReadPath(a.path, file.grounds);
  SpeedPlanner planner(file.vehicle, file.grounds, path.size());
  std::vector<SpeedPoint> out(path.size());
  a.plan.trained_only = !a.untrained;
  const std::size_t not_held = planner.Plan(path, a.plan, out);
  std::cout << (a.json ? JsonOf(path, out) : TextOf(path, out));
  if (not_held == 0) return kOk;
  const auto first = std::find_if(out.begin(), out.end(), [](const auto& p) { return !p.holds; });
  const auto undriven =
      std::count_if(out.begin(), out.end(), [](const auto& p) { return !(p.safe_m_per_s > 0); });
  std::cerr << "grouser-vehicle: the plan does not hold at " << not_held << " of " << out.size()
            << " points, at " << undriven << " of them at no speed; first at s = "
            << path[static_cast<std::size_t>(first - out.begin())].s_m << " m ("
            << NameOf(first->binding) << ")\n";
  return kFailed;
}

int SteepestGrades(Arguments a) {
  const VehicleFile file = ReadVehicle(a.file);
  SpeedPlanner planner(file.vehicle, file.grounds, 1);
  a.plan.trained_only = !a.untrained;
  std::vector<SoilGrades> soils;
  for (const std::string& soil : file.grounds.soils) {
    const std::uint8_t index = SoilIndex(file, a.soil.empty() ? soil : a.soil);
    soils.push_back(
        {file.grounds.soils[index], planner.Grades(a.speed.value_or(0), index, a.plan)});
    if (!a.soil.empty()) break;
  }
  std::cout << (a.json ? JsonOf(soils) : TextOf(soils));
  const bool level = std::all_of(soils.begin(), soils.end(), [](const SoilGrades& c) {
    return c.grades.any && c.grades.down_rad <= 0 && c.grades.up_rad >= 0;
  });
  return level ? kOk : kFailed;
}

int Constants(const Arguments& a) {
  const VehicleFile file = ReadVehicle(a.file);
  const auto constants = ConstantsOf(file.vehicle, file.grounds, a.speeds, a.radii);
  std::cout << YamlOf(file.vehicle, constants);
  return kOk;
}

void AddLimits(CLI::App* app, Arguments* a) {
  app->add_option("--worse-by-sd", a->plan.worse_by_sd, "Ground that must be stood")
      ->capture_default_str();
  app->add_option("--tip-margin", a->plan.tip_margin, "Least")->capture_default_str();
  app->add_flag("--untrained", a->untrained, "Also where the models' runs do not reach");
  app->add_flag("--json", a->json, "JSON on stdout");
}

void AddGrades(CLI::App* app, Arguments* a) {
  app->add_option("file", a->file, "Vehicle file")->required();
  app->add_option("--soil", a->soil, "Soil of all wheels; default: each of the file");
  app->add_option("--speed", a->speed, "Forward [m/s]; default: creeping");
  AddLimits(app, a);
}

void AddSpeed(CLI::App* app, Arguments* a) {
  app->add_option("file", a->file, "Vehicle file")->required();
  app->add_option("path", a->path,
                  "CSV: s_m, curvature_per_m or x_m, y_m[, grade_deg, bank_deg, soil]")
      ->required();
  app->add_option("--limit", a->plan.speed_limit_m_per_s, "Never faster [m/s]")->required();
  app->add_option("--acceleration", a->plan.acceleration_m_per_s2, "Largest [m/s^2]")
      ->capture_default_str();
  app->add_option("--braking", a->plan.braking_m_per_s2, "Largest [m/s^2]")->capture_default_str();
  app->add_option("--start", a->plan.start_m_per_s, "Speed at the first point [m/s]");
  app->add_option("--end", a->plan.end_m_per_s, "Speed at the last point [m/s]");
  AddLimits(app, a);
}

void AddSolve(CLI::App* app, Arguments* a) {
  app->add_option("file", a->file, "Vehicle file")->required();
  app->add_option("--speed", a->speed, "Forward speed of the origin [m/s]");
  app->add_option("--yaw-rate", a->yaw_rate, "To the left [rad/s]");
  app->add_option("--curvature", a->curvature, "Of the path, to the left [1/m]");
  app->add_option("--radius", a->radius, "Of the path, to the left [m]");
  app->add_option("--rim", a->rim, "Instead: rim speed of each drive [m/s]");
  app->add_option("--steer-deg", a->steer_deg, "With --rim: steering angle");
  app->add_option("--acceleration", a->acceleration, "Forward [m/s^2]");
  app->add_option("--grade-deg", a->grade_deg, "The ground rises ahead");
  app->add_option("--bank-deg", a->bank_deg, "The ground rises to the left");
  app->add_option("--soil", a->soil, "Soil of all wheels; default: the file's first");
  app->add_option("--soils", a->soils, "Soil of each wheel");
  app->add_flag("--json", a->json, "JSON on stdout");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Loads, slips, forces and power of a vehicle on its ground."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-vehicle " GROUSER_VERSION);
  app.require_subcommand(1);
  Arguments a;
  auto* show = app.add_subcommand("show", "Reads a vehicle file and says what is in it");
  show->add_option("file", a.file, "Vehicle file")->required();
  auto* solve = app.add_subcommand("solve", "One steady motion");
  AddSolve(solve, &a);
  auto* grades = app.add_subcommand("climb", "Steepest grades up and down, straight, on each soil");
  AddGrades(grades, &a);
  auto* energy = app.add_subcommand("energy", "Power of one steady motion, and where it goes");
  AddSolve(energy, &a);
  auto* speed = app.add_subcommand("speed", "Safe speeds and a speed plan along a path");
  AddSpeed(speed, &a);
  auto* constants = app.add_subcommand("constants", "Multipliers of a skid-steered robot, as YAML");
  constants->add_option("file", a.file, "Vehicle file")->required();
  constants->add_option("--speeds", a.speeds, "[m/s]")->capture_default_str();
  constants->add_option("--radii", a.radii, "[m]")->capture_default_str();
  auto* schema = app.add_subcommand("schema", "The JSON schema of vehicle files");
  try {
    app.parse(argc, argv);
    if (*schema) std::cout << VehicleSchema();
    if (*show) std::cout << TextOf(ReadVehicle(a.file));
    if (*grades) return SteepestGrades(a);
    if (*energy) return Energy(a);
    if (*speed) return PlanSpeeds(a);
    if (*constants) return Constants(a);
    return *solve ? SolveOne(a) : kOk;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-vehicle: " << e.what() << "\n";
    return kUsage;
  } catch (const yaml::InputError& e) {
    std::cerr << "grouser-vehicle: " << e.what() << "\n";
    return kUsage;
  } catch (const std::exception& e) {
    std::cerr << "grouser-vehicle: " << e.what() << "\n";
    return kFailed;
  }
}

// grouser-vehicle: what a vehicle does on its ground.
#include <algorithm>
#include <iostream>

#include "clients/cpp/access_options.h"
#include "clients/vehicle/answers.h"
#include "clients/vehicle/drives.h"
#include "clients/vehicle/motion_options.h"
#include "clients/vehicle/path_file.h"
#include "clients/vehicle/print.h"
#include "proto/records/command_line.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "surrogate/vehicle/yaml.h"

namespace {

using namespace grouser::vehicle;
using namespace grouser::cli;

constexpr int kOk = 0, kFailed = 1, kUsage = 2;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-vehicle show surrogate/vehicle/shipped/husky.vehicle.yaml\n"
    "  grouser-vehicle solve FILE --soil asphalt --speed 0.8 --radius 2\n"
    "  grouser-vehicle solve FILE --speed 0.5 --grade-deg 12 --json\n"
    "  grouser-vehicle solve FILE --rim 0.4 0.8\n"
    "  grouser-vehicle solve FILE --soil asphalt --speed 0.5 --grade-deg 20 --draws 200\n"
    "  grouser-vehicle climb FILE --soil asphalt --speed 0.5\n"
    "  grouser-vehicle speed FILE PATH.csv --limit 1.5\n"
    "  grouser-vehicle energy FILE --soil asphalt --speed 0.5 --radius 1\n"
    "  grouser-vehicle energy FILE --soil '{asphalt: 0.7, ice: 0.3}' --speed 0.5\n"
    "  grouser-vehicle energy FILE --drive log.csv > watts.csv\n"
    "  grouser-vehicle energy FILE --drive one.csv other.csv: a line each, to compare\n"
    "  grouser-vehicle constants FILE --speeds 0.5 --radii 1 5\n"
    "  grouser-vehicle constants FILE --soil '{asphalt: 0.7, ice: 0.3}' --speeds 0.5\n"
    "  grouser-vehicle list --server 127.0.0.1:50151\n"
    "  grouser-vehicle speed husky PATH.csv --limit 1.5 --server 127.0.0.1:50151\n"
    "  grouser-vehicle schema\n"
    "  grouser vehicle plot FILE --out energy.png: energy over speed, radius and yaw rate\n"
    "  grouser vehicle measured: measured vehicles beside the solver (grouser-measured-vehicles)\n"
    "With --server FILE is the name of a vehicle there; the answers are the same.\n"
    "Exit codes: 0 ok, 1 no solution within every limit, or no answer (a server that is away, has\n"
    "too many calls waiting or takes less at once: RESOURCE_EXHAUSTED), 2 usage, a bad file, or\n"
    "what a server finds wrong with the call. Of energy 1 also where a motion or a row, but the "
    "last\n"
    "of a drive with times, has no power at an end of its interval.";

struct Arguments {
  std::string file, path;
  std::vector<std::string> drives;
  MotionOptions motion;
  std::vector<double> speeds = {0.3, 0.8}, radii = {1, 3, 10};
  SpeedOptions plan;
  VehicleServer server;
  std::size_t draws = 0;
  bool json = false, untrained = false;

  std::unique_ptr<VehicleAnswers> Open() const {
    return server.address.empty() ? AnswersOfFile(file) : AnswersOfServer(server, file);
  }
  /// Soils that are spelled out: "{NAME: WEIGHT, ...}".
  void AddMixtures(VehicleAnswers* answers) const {
    std::vector<std::string> soils = motion.soils;
    soils.push_back(motion.soil);
    std::sort(soils.begin(), soils.end());
    soils.erase(std::unique(soils.begin(), soils.end()), soils.end());
    for (const std::string& soil : soils) {
      if (soil.starts_with('{')) answers->AddMixture(soil);
    }
  }
};

int ExitCodeOf(const Solution& s) {
  return (s.reasons & ~kUntrained) == 0 && s.balanced ? kOk : kFailed;
}

int SolveOne(const Arguments& a) {
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  const Vehicle& vehicle = answers->described().vehicle;
  GoProbability go;
  const Motion motion = a.motion.MotionOf(answers->described());
  const Solution solution = answers->Solve(motion, &go);
  MotionOnDraws on_draws;
  if (a.draws > 0) on_draws = answers->SolveOnDraws(motion, a.draws);
  std::cout << (a.json ? JsonOf(vehicle, solution, go, on_draws)
                       : TextOf(vehicle, solution, go, on_draws));
  return ExitCodeOf(solution);
}

int Energy(const Arguments& a) {
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  const Vehicle& vehicle = answers->described().vehicle;
  const Motion motion = a.motion.MotionOf(answers->described());
  const PowerInterval power = answers->Energies({&motion, 1}).front();
  std::cout << (a.json ? JsonOf(vehicle, power) : TextOf(vehicle, power));
  return AreGood({&power, 1}) ? kOk : kFailed;
}

int EnergyOfDrives(const Arguments& a) {
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  return PrintEnergies(answers.get(), a.drives, a.motion.soil, a.json) ? kOk : kFailed;
}

int PlanSpeeds(Arguments a) {
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  const std::string& soil = a.motion.soil;
  const std::vector<PathPoint> path =
      ReadPath(a.path, answers->described().soils,
               soil.empty() ? 0 : SoilOption(answers->described(), soil));
  std::vector<SpeedPoint> out(path.size());
  a.plan.trained_only = !a.untrained;
  PlanOnDraws on_draws{.draws = a.draws, .holds = 0, .at = {}};
  const std::size_t not_held = answers->Plan(path, a.plan, out, &on_draws);
  std::cout << (a.json ? JsonOf(path, out, on_draws) : TextOf(path, out, on_draws));
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
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  a.plan.trained_only = !a.untrained;
  std::vector<SoilGrades> soils;
  for (const std::string& soil : answers->described().soils) {
    const std::string& name = a.motion.soil.empty() ? soil : a.motion.soil;
    const std::uint8_t index = SoilOption(answers->described(), name);
    soils.push_back({name, answers->Grades(a.motion.speed.value_or(0), index, a.plan)});
    if (!a.motion.soil.empty()) break;
  }
  std::cout << (a.json ? JsonOf(soils) : TextOf(soils));
  const bool level = std::all_of(soils.begin(), soils.end(), [](const SoilGrades& c) {
    return c.grades.any && c.grades.down_rad <= 0 && c.grades.up_rad >= 0;
  });
  return level ? kOk : kFailed;
}

int Constants(const Arguments& a) {
  const auto answers = a.Open();
  a.AddMixtures(answers.get());
  std::vector<std::uint8_t> soils;
  if (!a.motion.soil.empty()) soils.push_back(SoilOption(answers->described(), a.motion.soil));
  std::cout << YamlOf(answers->described().vehicle, answers->Constants(a.speeds, a.radii, soils));
  return kOk;
}

int List(const Arguments& a) {
  if (a.server.address.empty()) throw CLI::RequiredError("--server");
  std::cout << ListVehicles(a.server);
  return kOk;
}

void AddServer(CLI::App* app, Arguments* a) {
  app->add_option("--server", a->server.address,
                  "grouser-server that answers, HOST:PORT or unix:PATH");
  grouser::client::AddAccessOptions(*app, &a->server.access);
  app->add_option("--deadline-ms", a->server.deadline_ms, "Limit of one call to it [ms]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

void AddVehicle(CLI::App* app, Arguments* a) {
  app->add_option("file", a->file, "Vehicle file; with --server the name of a vehicle there")
      ->required();
  AddServer(app, a);
}

void AddDraws(CLI::App* app, Arguments* a) {
  app->add_option("--draws", a->draws,
                  "Also on so many draws of the ground, each the same at all wheels and points")
      ->check(CLI::Range(1, 1024));
}

void AddLimits(CLI::App* app, Arguments* a) {
  app->add_option("--worse-by-sd", a->plan.worse_by_sd, "Ground that must be stood")
      ->capture_default_str();
  app->add_option("--tip-margin", a->plan.tip_margin, "Least")->capture_default_str();
  app->add_flag("--untrained", a->untrained, "Also where the models' runs do not reach");
  app->add_flag("--json", a->json, "JSON on stdout");
}

void AddGrades(CLI::App* app, Arguments* a) {
  AddVehicle(app, a);
  app->add_option("--soil", a->motion.soil, "Soil of all wheels; default: each of the vehicle");
  app->add_option("--speed", a->motion.speed, "Forward [m/s]; default: creeping");
  AddLimits(app, a);
}

void AddSpeed(CLI::App* app, Arguments* a) {
  AddVehicle(app, a);
  app->add_option("path", a->path,
                  "CSV: s_m, curvature_per_m or x_m, y_m[, grade_deg, bank_deg, soil]")
      ->required();
  app->add_option("--soil", a->motion.soil,
                  "Where the path names none; default: the vehicle's first");
  app->add_option("--limit", a->plan.speed_limit_m_per_s, "Never faster [m/s]")->required();
  app->add_option("--acceleration", a->plan.acceleration_m_per_s2, "Largest [m/s^2]")
      ->capture_default_str();
  app->add_option("--braking", a->plan.braking_m_per_s2, "Largest [m/s^2]")->capture_default_str();
  app->add_option("--start", a->plan.start_m_per_s, "Speed at the first point [m/s]");
  app->add_option("--end", a->plan.end_m_per_s, "Speed at the last point [m/s]");
  AddDraws(app, a);
  AddLimits(app, a);
}

void AddMotion(CLI::App* app, Arguments* a) {
  AddVehicle(app, a);
  a->motion.AddTo(app);
  app->add_flag("--json", a->json, "JSON on stdout");
}

int Fail(const std::exception& error, int code) {
  std::cerr << "grouser-vehicle: " << error.what() << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Loads, slips, forces and power of a vehicle on its ground."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-vehicle " GROUSER_VERSION);
  app.require_subcommand(1);
  Arguments a;
  auto* show = app.add_subcommand("show", "What is in a vehicle file");
  AddVehicle(show, &a);
  auto* solve = app.add_subcommand("solve", "One steady motion");
  AddMotion(solve, &a);
  AddDraws(solve, &a);
  auto* grades = app.add_subcommand("climb", "Steepest grades up and down, straight, on each soil");
  AddGrades(grades, &a);
  auto* energy =
      app.add_subcommand("energy", "Power of one steady motion or of a drive, and where it goes");
  AddMotion(energy, &a);
  energy
      ->add_option(
          "--drive", a.drives,
          "Instead of one motion a drive, CSV: speed_m_per_s[, time_s, yaw_rate_rad_per_s, "
          "acceleration_m_per_s2, grade_deg, bank_deg, soil (before --soil)]; CSV to stdout. Of "
          "several drives with times one line each: energy, reasons, least margin")
      ->excludes("--speed", "--yaw-rate", "--curvature", "--radius", "--rim", "--steer-deg",
                 "--acceleration", "--grade-deg", "--bank-deg", "--soils");
  auto* speed = app.add_subcommand("speed", "Safe speeds and a speed plan along a path");
  AddSpeed(speed, &a);
  auto* constants = app.add_subcommand("constants", "Multipliers of a skid-steered robot, as YAML");
  AddVehicle(constants, &a);
  constants->add_option("--speeds", a.speeds, "[m/s]")->capture_default_str();
  constants->add_option("--soil", a.motion.soil,
                        "One soil, or '{NAME: WEIGHT, ...}'; default: each of the vehicle");
  constants->add_option("--radii", a.radii, "[m]")->capture_default_str();
  auto* list = app.add_subcommand("list", "The vehicles of a server");
  AddServer(list, &a);
  auto* schema = app.add_subcommand("schema", "The JSON schema of vehicle files");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    if (*schema) std::cout << VehicleSchema();
    if (*show) std::cout << TextOf(a.Open()->described());
    if (*grades) return SteepestGrades(a);
    if (*energy) return a.drives.empty() ? Energy(a) : EnergyOfDrives(a);
    if (*speed) return PlanSpeeds(a);
    if (*constants) return Constants(a);
    if (*list) return List(a);
    return *solve ? SolveOne(a) : kOk;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& e) {
    return Fail(e, kUsage);
  } catch (const yaml::InputError& e) {
    return Fail(e, kUsage);
  } catch (const std::exception& e) {
    return Fail(e, kFailed);
  }
}

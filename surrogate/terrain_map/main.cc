// grouser-map: what a vehicle can drive of a terrain, as rasters.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "proto/records/command_line.h"
#include "surrogate/terrain_map/map_run.h"
#include "surrogate/terrain_map/table_check.h"
#include "surrogate/vehicle/yaml.h"

namespace {

using namespace grouser::terrain_map;
namespace vehicle = grouser::vehicle;

constexpr int kOk = 0, kFailed = 1, kUsage = 2, kNoPictures = 3;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser map surrogate/vehicle/shipped/husky.vehicle.yaml --elevation DEM.tif --soil asphalt"
    " --out out/map\n"
    "  grouser map FILE --elevation DEM.tif --soil-class SOIL.tif --soils 1=asphalt,2=ice --out M\n"
    "  grouser map FILE --elevation DEM.tif --soil-probability asphalt=A.tif --soil-probability"
    " ice=I.tif --out M\n"
    "  grouser map FILE --soil asphalt --check 500     # errors of the table, no raster\n"
    "Exit codes: 0 ok, 1 failed or interrupted, 2 usage or bad input, 3 a map without its "
    "pictures.";

// "1=loam" -> {1, "loam"}
std::pair<std::string, std::string> PartsOf(const std::string& option, const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == text.size()) {
    throw std::invalid_argument(option + ": got " + text + ", expected A=B");
  }
  return {text.substr(0, at), text.substr(at + 1)};
}

// As a shell takes it again. --pictures-by is of the front door, not of who called it.
std::string CommandOf(int argc, char** argv) {
  const auto quoted = [](const std::string& word) {
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                            "0123456789_-+=./,:@%") == std::string::npos;
    if (plain) return word;
    std::string out = "'";
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
  };
  std::string command = "grouser map";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--pictures-by") {
      ++i;
    } else {
      command += " " + quoted(word);
    }
  }
  return command;
}

struct Arguments {
  MapOptions map;
  std::vector<std::string> soils, probabilities;
  std::size_t check = 0;
  bool no_pictures = false;
};

void ReadSoilOptions(const vehicle::VehicleFile& file, Arguments* a) {
  SoilSources& s = a->map.soils;
  if (s.class_raster.empty() != a->soils.empty()) {
    throw std::invalid_argument("--soil-class: expected together with --soils VALUE=SOIL,...");
  }
  if (int(!s.soil.empty()) + int(!s.class_raster.empty()) + int(!a->probabilities.empty()) > 1) {
    throw std::invalid_argument(
        "--soil, --soil-class, --soil-probability: got more than one, expected one");
  }
  for (const std::string& text : a->soils) {
    const auto [value, soil] = PartsOf("--soils", text);
    std::size_t used = 0;
    int number = 0;
    try {
      number = std::stoi(value, &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used != value.size()) {
      throw std::invalid_argument("--soils: got class " + value + ", expected a whole number");
    }
    SoilIndexOf(file, "--soils", soil);
    for (const auto& [before, other] : s.classes) {
      if (before != number) continue;
      throw std::invalid_argument("--soils: got class " + value + " twice, expected it once");
    }
    s.classes.emplace_back(number, soil);
  }
  for (const std::string& text : a->probabilities) {
    s.probabilities.push_back(PartsOf("--soil-probability", text));
    SoilIndexOf(file, "--soil-probability", s.probabilities.back().first);
  }
  if (s.soil.empty()) s.soil = file.grounds.soils[0];
  SoilIndexOf(file, "--soil", s.soil);
}

void PrintErrors(const char* name, const Errors& e) {
  std::cout << "  " << name << " (" << e.count << " states";
  if (e.skipped > 0) std::cout << ", " << e.skipped << " without a number";
  std::cout << "): median " << e.median << ", 95 % " << e.p95 << ", largest " << e.largest << "\n";
}

int Check(const vehicle::VehicleFile& file, const Arguments& a) {
  const std::uint8_t soil = SoilIndexOf(file, "--soil", a.map.soils.soil);
  ProgressReport report(nullptr, isatty(STDERR_FILENO) != 0);
  const Progress progress = [&](double done) { report.Tick(done); };
  report.Stage("slopes and headings on " + a.map.soils.soil);
  const SlopeTable table = BuildTable(file.vehicle, file.grounds, soil, a.map.table, progress);
  report.Done();
  report.Stage("direct solves");
  const TableErrors e =
      CheckTable(file.vehicle, file.grounds, soil, a.map.table, table, a.check, 1, progress);
  report.Done();
  std::cout << file.vehicle.name << " on " << table.soil << ", " << e.states
            << " random slopes and headings, table against direct solves:\n";
  PrintErrors("safe speed over the limit", e.speed);
  PrintErrors("energy over its median", e.energy);
  PrintErrors("P(GO)", e.go);
  std::cout << "  driven by the table alone " << e.only_table << ", by the solve alone "
            << e.only_direct << ", within " << e.edge_rad << " rad of the edge\n";
  return kOk;
}

void AddOptions(CLI::App* app, Arguments* a) {
  MapOptions& m = a->map;
  vehicle::SpeedOptions& limits = m.table.limits;
  limits.speed_limit_m_per_s = 1;
  app->add_option("vehicle", m.vehicle, "Vehicle file")->required();
  app->add_option("--elevation", m.elevation, "GeoTIFF of heights [m], projected in metres");
  app->add_option("--out", m.out, "Folder to make");
  app->add_option("--soil", m.soils.soil, "One soil everywhere; default: the vehicle file's first");
  app->add_option("--soil-class", m.soils.class_raster, "GeoTIFF of classes, on the same grid");
  app->add_option("--soils", a->soils, "VALUE=SOIL,...: soil of each class")->delimiter(',');
  app->add_option("--soil-probability", a->probabilities,
                  "SOIL=GeoTIFF of its probability, once a soil; their sum is 1")
      ->take_all();
  app->add_option("--negligible", m.negligible,
                  "Speed and energy leave out the least probable soils while their sum is below it")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--limit", limits.speed_limit_m_per_s, "Never faster [m/s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_option("--worse-by-sd", limits.worse_by_sd, "Ground that must be stood")
      ->capture_default_str();
  app->add_option("--tip-margin", limits.tip_margin, "Least")->capture_default_str();
  app->add_option("--heading-nodes", m.table.headings, "Of the table, around the way up")
      ->check(CLI::Range(4, 1440))
      ->capture_default_str();
  app->add_option("--slope-nodes", m.table.slopes, "Of the table, of what is driven")
      ->check(CLI::Range(3, 400))
      ->capture_default_str();
  app->add_option("--check", a->check,
                  "Instead of a map: errors of the table at so many random states");
  app->add_option("--pictures-by", m.pictures, "Script that draws the pictures");
  app->add_flag("--no-pictures", a->no_pictures, "GeoTIFFs alone");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "What a vehicle can drive of a terrain: speed made good, P(GO), energy per metre and "
      "what binds, as GeoTIFF."};
  app.name("grouser map");
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-map " GROUSER_VERSION);
  Arguments a;
  AddOptions(&app, &a);
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    StartGdal();
    const vehicle::VehicleFile file = vehicle::ReadVehicle(a.map.vehicle);
    ReadSoilOptions(file, &a);
    if (a.check > 0) return Check(file, a);
    if (a.map.elevation.empty() || a.map.out.empty()) {
      throw std::invalid_argument("--elevation, --out: expected both (or --check N)");
    }
    if (a.no_pictures) a.map.pictures.clear();
    a.map.command = CommandOf(argc, argv);
    const HeldSignals signals;  // up to the end: then nothing is left to be cleaned up
    ProgressReport progress(&signals, isatty(STDERR_FILENO) != 0);
    const std::string no_pictures = MakeMap(a.map, signals, &progress);
    std::cout << a.map.out << "\n";
    if (no_pictures.empty()) return kOk;
    std::cerr << "grouser-map: " << no_pictures << "; " << a.map.out
              << " is complete but for its pictures\n";
    return kNoPictures;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-map: " << e.what() << "\n";
    return kUsage;
  } catch (const vehicle::yaml::InputError& e) {
    std::cerr << "grouser-map: " << e.what() << "\n";
    return kUsage;
  } catch (const std::exception& e) {
    std::cerr << "grouser-map: " << e.what() << "\n";
    return kFailed;
  }
}

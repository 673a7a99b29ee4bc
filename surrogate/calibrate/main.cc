// grouser-calibrate: measured tests to the parameters of a soil.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "proto/records/command_line.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/yaml/yaml_section.h"
#include "surrogate/calibrate/calibration.h"
#include "surrogate/calibrate/measurement_file.h"
#include "surrogate/fit/pair_errors.h"

namespace {

using namespace grouser;
using namespace grouser::surrogate;

constexpr int kOk = 0, kFailed = 1, kUsage = 2;

struct Request {
  std::vector<std::string> files;
  CommandLineTest csv;
  std::string name, out, form = "auto", published, command, within;
  bool json = false;
};

// Published soils, and of fitted Bekker models the parameters and what they were off by against
// DEM.
Typical TypicalOf(const std::string& published) {
  std::istringstream table(records::ReadInputFile(published, "the table of soils"));
  Typical typical;
  typical.soils = ReadSoils(table, published, true);
  const std::vector<PairFolder> pairs = FindPairs(SurrogateFile("pairs"));
  typical.fitted = FittedParameters(pairs);
  const ErrorSpread spread = SpreadOf(ErrorsOfFitted(pairs));
  typical.wheel_error = spread.inside;
  typical.bulldozing = spread.bulldozing;
  return typical;
}

int CalibrateToFiles(Request request) {
  const Typical typical = TypicalOf(request.published);
  MeasuredSoil soil = ReadMeasuredSoil(request.files, request.csv);
  if (!request.name.empty()) soil.name = request.name;
  const SoilCalibration calibration = CalibrateSoil(std::move(soil), typical, request.form);
  const std::string json = CalibrationJson(calibration, request.command);
  if (!request.out.empty()) {
    std::filesystem::create_directories(request.out);
    const std::string stem = request.out + "/";
    records::WriteFileDurably(stem + "soil.csv", SoilFileText(calibration, request.command));
    records::WriteFileDurably(stem + "calibration.json", json);
    fmt::print(stderr, "grouser-calibrate: wrote {0}soil.csv and {0}calibration.json\n", stem);
  }
  std::fputs(request.json ? json.c_str() : CalibrationText(calibration).c_str(), stdout);
  return kOk;
}

void AddInputOptions(CLI::App* word, Request* request) {
  word->add_option("data", request->files, "measurement files (.yaml), and CSVs")->required();
  word->add_option("--kind", request->csv.kind, "of the CSVs: plate, shear, press or wheel");
  word->add_option("--columns", request->csv.columns,
                   "of the CSVs: COLUMN=QUANTITY[:UNIT],...; not needed for names as load_n")
      ->delimiter(',');
  word->add_option("--constant", request->csv.constants, "of the CSVs: 'QUANTITY=VALUE UNIT'")
      ->delimiter(',');
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Finds the parameters of a soil that explain measured tests, and what they do not tell.");
  app.name("grouser-calibrate");
  app.set_version_flag("--version", "grouser-calibrate " GROUSER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  grouser-calibrate soil my-sand.yaml --out out/my-sand\n"
      "  grouser-calibrate soil plate.csv --kind plate --constant 'diameter=60 mm' \\\n"
      "    --columns z_mm=sinkage,F=force:N\n"
      "Measurement files (.yaml): docs/calibration.md. DEM grains: ./grouser calibrate grains.\n"
      "Exit codes: 0 ok, 1 failed, 2 usage or bad input.");
  Request request;
  request.command = "grouser-calibrate";
  for (int i = 1; i < argc; ++i) request.command += std::string(" ") + argv[i];
  request.published = PublishedSoilsFile();
  CLI::App* soil = app.add_subcommand(
      "soil", "Bekker, Reece and Janosi-Hanamoto parameters from plates, shear and wheel tests");
  AddInputOptions(soil, &request);
  soil->add_option("--name", request.name, "of the soil; else as the file says");
  soil->add_option("--form", request.form, "of pressure against sinkage")
      ->check(CLI::IsMember({"auto", "bekker", "reece"}))
      ->capture_default_str();
  soil->add_option("--published", request.published, "table of soils that says what is typical")
      ->capture_default_str();
  soil->add_option("--out", request.out, "folder for soil.csv and calibration.json");
  soil->add_flag("--json", request.json, "machine-readable output on stdout");
  CLI::App* rows = app.add_subcommand("rows", "what the files say, as JSON in SI, without a fit");
  AddInputOptions(rows, &request);
  rows->add_option("--within", request.within, "folder that the files named may not leave");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    if (rows->parsed()) {
      std::fputs(RowsJson(ReadMeasuredSoil(request.files, request.csv, request.within)).c_str(),
                 stdout);
      return kOk;
    }
    return CalibrateToFiles(std::move(request));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "grouser-calibrate: {}\n", error.what());
    return kUsage;
  } catch (const records::InputError& error) {
    fmt::print(stderr, "grouser-calibrate: {}\n", error.what());
    return kUsage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "grouser-calibrate: {}\n", error.what());
    return kFailed;
  }
}

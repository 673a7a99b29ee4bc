// grouser-measured-vehicles: what others measured of vehicles, beside what the solver says.
#include <CLI/CLI.hpp>
#include <iostream>

#include "proto/records/command_line.h"
#include "proto/records/yaml/yaml_section.h"
#include "surrogate/measured_vehicles/ways.h"

int main(int argc, char** argv) {
  using namespace grouser;
  constexpr int kOk = 0, kFailed = 1, kUsage = 2;
  CLI::App app{
      "Measured vehicles beside the vehicle solver: each row with its target and whether it is "
      "held."};
  app.name("grouser-measured-vehicles");
  app.footer(
      "Examples:\n"
      "  grouser-measured-vehicles\n"
      "  grouser-measured-vehicles --json > measured.json\n"
      "  grouser-measured-vehicles --currents RECORDINGS\n"
      "  grouser-measured-vehicles --ways\n"
      "Exit codes: 0 compared (held or not), 2 usage or a bad table.");
  app.set_version_flag("--version", "grouser-measured-vehicles " GROUSER_VERSION);
  measured::Tables tables{
      surrogate::SurrogateFile("measured_vehicles/data/drive_windows.csv"),
      surrogate::SurrogateFile("measured_vehicles/data/borealtc_husky_power.csv"), ""};
  bool json = false, ways = false;
  app.add_option("--windows", tables.windows, "Windows of skid-steered robots")
      ->capture_default_str();
  app.add_option("--power", tables.power, "Power of the Husky by terrain")->capture_default_str();
  app.add_option("--currents", tables.currents,
                 "Folder of CONCRETE_*.csv and PLOUGHED_*.csv (velL, velR, curL, curR), which are "
                 "not shipped");
  app.add_flag("--ways", ways,
               "How long ways to answer take, from one factor to the median of all soils, beside "
               "how far off they are; a table in Markdown, or with --json under 'ways'");
  app.add_flag("--json", json, "JSON on stdout");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    const measured::Comparison comparison = measured::Compare(tables);
    const auto asked = ways ? measured::WaysOf(tables, comparison) : std::vector<measured::Way>();
    std::cout << (json   ? JsonOf(comparison, asked)
                  : ways ? TableOf(comparison, asked)
                         : TextOf(comparison));
    return kOk;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-measured-vehicles: " << e.what() << "\n";
    return kUsage;
  } catch (const records::InputError& e) {
    std::cerr << "grouser-measured-vehicles: " << e.what() << "\n";
    return kUsage;
  } catch (const std::exception& e) {
    std::cerr << "grouser-measured-vehicles: " << e.what() << "\n";
    return kFailed;
  }
}

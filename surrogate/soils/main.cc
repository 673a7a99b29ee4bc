// grouser-soil: soils that are published or were calibrated, by name.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "proto/records/command_line.h"
#include "surrogate/soils/cone_table.h"
#include "surrogate/soils/soil_library.h"

namespace {

using namespace grouser::surrogate;

struct Request {
  std::vector<std::string> files, cones, bevameters;
  std::string published, name, like;
  std::optional<double> moisture;
  bool json = false;
};

SoilLibrary LibraryOf(const Request& request) {
  SoilLibrary library;
  library.Add(request.published);
  for (const std::string& file : request.files) library.Add(file);
  return library;
}

SoilsOfGrains GrainsOf(const Request& request) {
  return {BevameterSoils(request.bevameters), ConeIndices(request.cones)};
}

void Print(const std::string& text) { std::fputs(text.c_str(), stdout); }

void PrintAll(const SoilEntries& entries, const Request& request) {
  Print(request.json ? SoilListJson(entries, GrainsOf(request)) : SoilListText(entries));
}

void List(const Request& request) {
  const SoilLibrary library = LibraryOf(request);
  SoilEntries all;
  for (const SoilLibrary::Entry& e : library.entries) all.push_back(&e);
  PrintAll(all, request);
  const std::vector<ConeIndex> cones = ConeIndices(request.cones);
  if (!request.json && !cones.empty()) {
    Print("\nsoils of DEM grains, by their cone index:\n" + ConeListText(cones));
  }
}

void Show(const Request& request) {
  const SoilsOfGrains grains = GrainsOf(request);
  const SoilLibrary library = LibraryOf(request);
  if (grains.Has(request.name) && !library.Has(request.name)) {  // no line of a table of soils
    Print(request.json ? GrainsJson(request.name, grains)
                       : request.name + "\n" + GrainsText(request.name, grains));
    return;
  }
  const SoilLibrary::Entry entry = library.Find(request.name);
  Print(request.json ? SoilListJson({&entry}, grains)
                     : SoilText(entry) + GrainsText(entry.soil.name, grains));
}

void Cones(const Request& request) {
  const std::vector<ConeIndex> cones = ConeIndices(request.cones);
  Print(request.json ? ConeListJson(cones) : ConeListText(cones));
}

void Suggest(const Request& request) {
  const SoilLibrary library = LibraryOf(request);
  SoilEntries likest;
  for (const Suggestion& s : SuggestSoils(library, request.like, request.moisture)) {
    likest.push_back(s.entry);
  }
  if (likest.empty()) {
    throw std::invalid_argument("--like '" + request.like +
                                "': no soil has one of these words, expected such as sand, sandy "
                                "loam, clay, snow");
  }
  PrintAll(likest, request);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Soils by their Bekker and Mohr-Coulomb parameters, published or calibrated.");
  app.name("grouser-soil");
  app.set_version_flag("--version", "grouser-soil " GROUSER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  grouser-soil list\n"
      "  grouser-soil show 'LETE sand'\n"
      "  grouser-soil suggest --like 'sandy loam' --moisture 15\n"
      "  grouser-soil list --soils out/calibrate/soil.csv\n"
      "  grouser-soil cones\n"
      "A model of one: grouser model make --wheel W.yaml --soil NAME.\n"
      "Exit codes: 0 ok, 1 failed, 2 usage or bad input.");
  Request request;
  request.published = PublishedSoilsFile();
  const auto add = [&](const char* name, const char* text) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->add_option("--soils", request.files, "further tables, such as calibrated soils (soil.csv)")
        ->delimiter(',');
    sub->add_option("--published", request.published, "table of published soils")
        ->capture_default_str();
    sub->add_option("--bevameters", request.bevameters,
                    "further soils by bevameters (a bevameter's bevameter_soil.csv)")
        ->delimiter(',');
    sub->add_option("--cones", request.cones, "further cone indices (a bevameter's cone_index.csv)")
        ->delimiter(',');
    sub->add_flag("--json", request.json, "machine-readable output on stdout");
    return sub;
  };
  CLI::App* list = add("list", "All soils");
  CLI::App* show =
      add("show", "One soil, its source, and what is taken where nothing is published");
  show->add_option("soil", request.name, "name, or a file with one soil (.csv)")->required();
  CLI::App* cones = add("cones", "Cone indices of soils of DEM grains");
  CLI::App* suggest = add("suggest", "Soils like a description, the likest first");
  suggest->add_option("--like", request.like, "words such as 'sandy loam'")->required();
  suggest->add_option("--moisture", request.moisture, "[%]")->check(CLI::Range(0.0, 100.0));
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    if (list->parsed()) List(request);
    if (show->parsed()) Show(request);
    if (cones->parsed()) Cones(request);
    if (suggest->parsed()) Suggest(request);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "grouser-soil: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "grouser-soil: {}\n", error.what());
    return 1;
  }
}

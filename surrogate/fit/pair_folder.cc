#include "surrogate/fit/pair_folder.h"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {

namespace fs = std::filesystem;

std::vector<PairFolder> FindPairs(const std::string& root, const std::string& soils,
                                  bool accept_unusual) {
  std::vector<PairFolder> pairs;
  if (fs::exists(root + "/runs.json")) {
    return {{root, fs::weakly_canonical(root).filename().string(), soils, accept_unusual}};
  }
  if (fs::is_directory(root)) {
    for (const auto& entry : fs::directory_iterator(root)) {
      if (!fs::exists(entry.path() / "runs.json")) continue;
      pairs.push_back(
          {entry.path().string(), entry.path().filename().string(), soils, accept_unusual});
    }
  }
  if (pairs.empty()) {
    throw std::invalid_argument(root + ": expected a folder with a runs.json, or one of such");
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const PairFolder& a, const PairFolder& b) { return a.name < b.name; });
  return pairs;
}

std::optional<BekkerModel> UntunedModel(const PairFolder& pair, const v1alpha1::Scene& scene) {
  const std::string named = pair.path + "/untuned.soil";
  if (!fs::exists(named)) return std::nullopt;
  std::string name = records::ReadInputFile(named, "the name of a soil");
  name.erase(std::find(name.begin(), name.end(), '\n'), name.end());
  std::istringstream file(records::ReadInputFile(pair.soils, "the table of soils"));
  const std::vector<Soil> soils = ReadSoils(file, pair.soils, pair.accept_unusual);
  const auto soil = std::ranges::find(soils, name, &Soil::name);
  if (soil == soils.end()) {
    throw std::invalid_argument(named + ": '" + name + "', expected a soil of " + pair.soils);
  }
  return BekkerModel(FromSoil(*soil, scene.soil().gravity_m_per_s2()),
                     {scene.wheel().radius_m(), scene.wheel().width_m()});
}

}  // namespace grouser::surrogate

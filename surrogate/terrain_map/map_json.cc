#include "surrogate/terrain_map/map_json.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "proto/records/sha256.h"

namespace grouser::terrain_map {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180 / std::numbers::pi;

Json FileOf(const std::string& path) {
  return {{"file", path}, {"sha256", records::Sha256OfFile(path)}};
}

// Driven slopes straight up, down and across, and what ends them.
Json SoilOf(const SlopeTable& t, const vehicle::VehicleFile& file) {
  Json ways = Json::object();
  for (const Direction& d : kDirections) {
    if (d.way.of_grid) continue;
    const auto h =
        static_cast<std::size_t>(d.way.angle_rad / kTurn * static_cast<double>(t.headings));
    const Interval& i = t.least[t.risk * t.headings + h];
    ways[d.name] = {{"from_deg", i.any() ? Json(i.lo * kDegrees) : Json()},
                    {"to_deg", i.any() ? Json(i.hi * kDegrees) : Json()},
                    {"beyond", NameOf(t.edges[h].beyond)}};
  }
  std::string model;
  for (const std::string& source : file.sources) {
    if (source.starts_with(t.soil + ": ")) model += (model.empty() ? "" : "; ") + source;
  }
  return {{"soil", t.soil}, {"answered_by", model}, {"driven_slopes", ways}};
}

Json SoilSourcesOf(const SoilSources& s) {
  if (!s.class_raster.empty()) {
    Json classes = Json::object();
    for (const auto& [value, soil] : s.classes) classes[std::to_string(value)] = soil;
    return {{"classes", classes}, {"raster", s.class_raster}};
  }
  if (s.probabilities.empty()) return {{"everywhere", s.soil}};
  Json rasters = Json::object();
  for (const auto& [soil, raster] : s.probabilities) rasters[soil] = raster;
  return {{"probabilities", rasters}};
}

}  // namespace

std::vector<std::pair<int, std::string>> BindingNames() {
  std::vector<std::pair<int, std::string>> out;
  for (int b = 0; b <= static_cast<int>(vehicle::Binding::kInput); ++b) {
    out.emplace_back(b, NameOf(static_cast<vehicle::Binding>(b)));
  }
  out.emplace_back(kNoCell, "HOLE");
  return out;
}

void WriteMapJson(const std::filesystem::path& path, const MapOptions& o,
                  const vehicle::VehicleFile& file, const TerrainInput& terrain,
                  std::span<const SlopeTable> tables, const CellCounts& counts,
                  const std::vector<std::string>& rasters, const std::function<void()>& tick) {
  const Grid& g = terrain.grid();
  Json inputs = Json::array(), soils = Json::array(), bands = Json::array(),
       binding = Json::object(), files = Json::array();
  for (const std::string& f : terrain.files()) {
    tick();
    inputs.push_back(FileOf(f));
  }
  for (const SlopeTable& t : tables) soils.push_back(SoilOf(t, file));
  for (const Direction& d : kDirections) bands.push_back(d.name);
  for (const auto& [value, name] : BindingNames()) binding[std::to_string(value)] = name;
  for (const std::string& name : rasters) files.push_back(name + ".tif");
  const vehicle::SpeedOptions& limits = o.table.limits;
  const Json out = {{"grouser", GROUSER_VERSION},
                    {"command", o.command},
                    {"vehicle", {{"name", file.vehicle.name}, {"file", FileOf(o.vehicle)}}},
                    {"inputs", inputs},
                    {"soils_from", SoilSourcesOf(o.soils)},
                    {"soils", soils},
                    {"options",
                     {{"speed_limit_m_per_s", limits.speed_limit_m_per_s},
                      {"worse_by_sd", limits.worse_by_sd},
                      {"tip_margin", limits.tip_margin},
                      {"negligible", o.negligible},
                      {"heading_nodes", o.table.headings},
                      {"slope_nodes", o.table.slopes}}},
                    {"grid",
                     {{"columns", g.columns},
                      {"rows", g.rows},
                      {"geotransform", g.transform},
                      {"crs", g.crs_name}}},
                    {"cells",
                     {{"all", counts.cells},
                      {"holes", counts.holes},
                      {"driven_on_all_headings", counts.all_ways},
                      {"driven_on_none", counts.no_way}}},
                    {"rasters", files},
                    {"bands", bands},
                    {"binding", binding}};
  std::ofstream stream(path);
  stream << out.dump(1, ' ', false, Json::error_handler_t::replace) << "\n";
  stream.close();
  if (!stream) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace grouser::terrain_map

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "dem_offline/scenes/engine_convert.h"

namespace grouser::campaign {
namespace {

[[noreturn]] void Fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

template <typename Map>
const typename Map::mapped_type& Take(const Map& arrays, const std::string& name,
                                      const std::string& path) {
  const auto found = arrays.find(name);
  if (found == arrays.end()) Fail(path, "tile without array '" + name + "'");
  return found->second;
}

double TakeScalar(const records::TileFile& file, const std::string& name, const std::string& path) {
  const auto& values = Take(file.doubles, name, path);
  if (values.size() != 1) Fail(path, "tile scalar '" + name + "' is not one number");
  return values[0];
}

void CheckSize(const std::string& path, const std::string& name, std::size_t size,
               std::size_t expected) {
  if (size != expected) {
    Fail(path, "tile array '" + name + "' has " + std::to_string(size) + " entries, expected " +
                   std::to_string(expected));
  }
}

// Sizes that the engine indexes by without looking.
void CheckShape(const dem::Tile& tile, const std::string& path) {
  const std::size_t n = tile.radius_m.size();
  CheckSize(path, "position", tile.position.size(), 3 * n);
  CheckSize(path, "velocity", tile.velocity.size(), 3 * n);
  CheckSize(path, "spin", tile.spin.size(), 3 * n);
  CheckSize(path, "contact_first", tile.contact_first.size(), n + 1);
  const std::size_t contacts = tile.contact_partner.size();
  CheckSize(path, "contact_partner", contacts, static_cast<std::size_t>(tile.contact_first.back()));
  if (tile.contact_first.front() != 0) Fail(path, "tile contacts do not start at 0");
  for (std::size_t i = 0; i < n; ++i) {
    if (tile.contact_first[i + 1] < tile.contact_first[i]) {
      Fail(path, "tile array 'contact_first' decreases");
    }
  }
  for (const std::int32_t partner : tile.contact_partner) {
    if (partner >= 0 && static_cast<std::size_t>(partner) >= n) {
      Fail(path, "tile contact with a grain that does not exist");
    }
  }
  if (contacts > 0 && tile.contact_history.size() % contacts != 0) {
    Fail(path, "tile array 'contact_history' is no whole number of words per contact");
  }
}

}  // namespace

records::TileFile ToTileFile(const dem::Tile& tile, const std::string& tile_key) {
  records::TileFile file;
  // Keys in their order: equal beds give equal files.
  file.meta_json = nlohmann::json{{"tile_key", tile_key}, {"grains", tile.radius_m.size()}}.dump();
  file.doubles = {{"length_m", {tile.length_m}},
                  {"width_m", {tile.width_m}},
                  {"depth_m", {tile.depth_m}},
                  {"solid_fraction", {tile.solid_fraction}},
                  {"coordination", {tile.coordination}},
                  {"surface_m", {tile.surface_m}},
                  {"top_solid_fraction", {tile.top_solid_fraction}},
                  {"preparation_friction", {tile.preparation_friction[0]}},
                  {"preparation_rolling_friction", {tile.preparation_rolling_friction[0]}},
                  {"top_preparation_friction", {tile.preparation_friction[1]}},
                  {"top_preparation_rolling_friction", {tile.preparation_rolling_friction[1]}},
                  {"overlap_p99_over_radius", {tile.overlap_p99_over_radius}}};
  file.floats = {{"radius_m", tile.radius_m},
                 {"velocity", tile.velocity},
                 {"spin", tile.spin},
                 {"contact_history", tile.contact_history}};
  file.ints = {{"position", tile.position},
               {"contact_first", tile.contact_first},
               {"contact_partner", tile.contact_partner}};
  return file;
}

dem::Tile ToTile(const records::TileFile& file, const std::string& tile_key,
                 const std::string& path) {
  const auto meta = nlohmann::json::parse(file.meta_json, nullptr, /*allow_exceptions=*/false);
  if (!meta.is_object()) Fail(path, "tile meta: no JSON object");
  if (meta.value("tile_key", nlohmann::json()) != tile_key) {
    Fail(path, "holds another tile than " + tile_key);
  }
  dem::Tile tile;
  tile.length_m = TakeScalar(file, "length_m", path);
  tile.width_m = TakeScalar(file, "width_m", path);
  tile.depth_m = TakeScalar(file, "depth_m", path);
  tile.solid_fraction = TakeScalar(file, "solid_fraction", path);
  tile.coordination = TakeScalar(file, "coordination", path);
  tile.surface_m = TakeScalar(file, "surface_m", path);
  tile.top_solid_fraction = TakeScalar(file, "top_solid_fraction", path);
  tile.preparation_friction = {TakeScalar(file, "preparation_friction", path),
                               TakeScalar(file, "top_preparation_friction", path)};
  tile.preparation_rolling_friction = {TakeScalar(file, "preparation_rolling_friction", path),
                                       TakeScalar(file, "top_preparation_rolling_friction", path)};
  tile.overlap_p99_over_radius = TakeScalar(file, "overlap_p99_over_radius", path);
  tile.radius_m = Take(file.floats, "radius_m", path);
  tile.velocity = Take(file.floats, "velocity", path);
  tile.spin = Take(file.floats, "spin", path);
  tile.contact_history = Take(file.floats, "contact_history", path);
  tile.position = Take(file.ints, "position", path);
  tile.contact_first = Take(file.ints, "contact_first", path);
  tile.contact_partner = Take(file.ints, "contact_partner", path);
  CheckShape(tile, path);
  return tile;
}

}  // namespace grouser::campaign

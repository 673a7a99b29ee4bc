#include "surrogate/soils/soil_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "proto/records/durable_file.h"
#include "proto/records/yaml/nearest.h"
#include "surrogate/soils/grain_table.h"

namespace grouser::surrogate {
namespace {

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::vector<std::string> WordsOf(std::string text) {
  for (char& c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = ' ';
  }
  std::istringstream stream(Lower(text));
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// "Sandy loam 15 %" -> 15.
std::optional<double> MoistureOf(const std::string& name) {
  const auto percent = name.rfind('%');
  if (percent == std::string::npos) return std::nullopt;
  auto begin = percent;
  while (begin > 0 && std::string(" .0123456789").find(name[begin - 1]) != std::string::npos) {
    --begin;
  }
  const std::string number = name.substr(begin, percent - begin);
  char* end = nullptr;
  const double value = std::strtod(number.c_str(), &end);
  return end == number.c_str() ? std::nullopt : std::optional(value);
}

double LikenessOf(const std::vector<std::string>& wanted, const Soil& soil) {
  const std::vector<std::string> own = WordsOf(soil.name + " " + NameOf(soil.kind));
  int found = 0;
  for (const std::string& word : wanted) {
    const std::size_t allowed = word.size() / 4;
    found += std::ranges::any_of(own, [&](const std::string& other) {
      return records::EditDistance(word, other) <= allowed;
    });
  }
  return static_cast<double>(found) / static_cast<double>(std::max<std::size_t>(1, wanted.size()));
}

std::string Nearest(const SoilLibrary& library, const std::string& what) {
  std::vector<std::string> names;
  for (const Suggestion& s : SuggestSoils(library, what, MoistureOf(what))) {
    if (names.size() < 3) names.push_back(s.entry->soil.name);
  }
  if (!names.empty()) return fmt::format("{}", fmt::join(names, "; "));
  for (const SoilLibrary::Entry& e : library.entries) names.push_back(e.soil.name);
  return records::NearestOf(what.substr(0, 100), names);
}

const SoilLibrary::Entry* Named(const SoilLibrary& library, const std::string& name) {
  for (const SoilLibrary::Entry& e : library.entries) {
    if (Lower(e.soil.name) == Lower(name)) return &e;
  }
  return nullptr;
}

nlohmann::json GrainsOf(const std::string& name, const SoilsOfGrains& grains) {
  const auto only = [](const std::string& list) { return nlohmann::json::parse(list)[0]; };
  const BevameterSoil* bevameter = FindByName(grains.bevameters, name);
  const ConeIndex* cone = FindByName(grains.cones, name);
  return {{"soil", name},
          {"bevameter",
           bevameter == nullptr ? nlohmann::json() : only(BevameterListJson({*bevameter}))},
          {"cone_index", cone == nullptr ? nlohmann::json() : only(ConeListJson({*cone}))}};
}

nlohmann::json JsonOf(const SoilLibrary::Entry& e) {
  const auto optional = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  const Soil& s = e.soil;
  return {{"soil", s.name},
          {"kind", NameOf(s.kind)},
          {"n", s.n},
          {"k_c", s.k_c},
          {"k_phi", s.k_phi},
          {"cohesion_pa", s.cohesion_pa},
          {"friction_angle_rad", s.friction_angle_rad},
          {"density_kg_per_m3", optional(s.density_kg_per_m3)},
          {"shear_modulus_m", optional(s.shear_modulus_m)},
          {"source", s.source},
          {"file", e.file},
          {"unusual", e.unusual}};
}

std::string LineOf(const Soil& s) {
  const auto optional = [](const std::optional<double>& value, double unit) {
    return value ? fmt::format("{:.4g}", *value / unit) : std::string("-");
  };
  return fmt::format("{:<30} {:<5} {:>6.3g} {:>9.4g} {:>9.5g} {:>7.3g} {:>6.3g} {:>7} {:>6}\n",
                     s.name, NameOf(s.kind), s.n, s.k_c / 1e3, s.k_phi / 1e3, s.cohesion_pa / 1e3,
                     s.friction_angle_rad * 180 / std::numbers::pi,
                     optional(s.density_kg_per_m3, 1), optional(s.shear_modulus_m, 1e-3));
}
std::string Head() {
  return fmt::format("{:<30} {:<5} {:>6} {:>9} {:>9} {:>7} {:>6} {:>7} {:>6}\n", "soil", "kind",
                     "n", "k_c", "k_phi", "c kPa", "phi", "kg/m^3", "K mm");
}
constexpr const char* kUnits = "(k_c in kN/m^(n+1), k_phi in kN/m^(n+2); -: not published)\n";

}  // namespace

void SoilLibrary::Add(const std::string& file) {
  const std::string text = records::ReadInputFile(file, "a table of soils");
  std::istringstream table(text);
  for (const Soil& soil : ReadSoils(table, file, /*accept_unusual=*/true)) {
    const auto known = std::ranges::find(entries, soil.name, [](auto& e) { return e.soil.name; });
    if (known != entries.end()) {
      throw std::invalid_argument(fmt::format("{}: soil: {} is in {} already, expected each once",
                                              file, soil.name, known->file));
    }
    entries.push_back({soil, file, UnusualOf(soil)});
  }
}

SoilLibrary::Entry SoilLibrary::Find(const std::string& what) const {
  if (what.ends_with(".csv")) {
    SoilLibrary own;
    own.Add(what);
    if (own.entries.size() == 1) return own.entries[0];
    std::vector<std::string> names;
    for (const Entry& e : own.entries) names.push_back(e.soil.name);
    throw std::invalid_argument(
        fmt::format("{}: {} soils ({}), expected one; --soils {} and its "
                    "name choose one",
                    what, names.size(), fmt::join(names, "; "), what));
  }
  if (const Entry* e = Named(*this, what)) return *e;
  throw std::invalid_argument(fmt::format(
      "soil '{}' is not known, expected one of `grouser soil list` or a file (.csv); the nearest: "
      "{}",
      what, Nearest(*this, what)));
}

bool SoilLibrary::Has(const std::string& name) const { return Named(*this, name) != nullptr; }

std::vector<Suggestion> SuggestSoils(const SoilLibrary& library, const std::string& like,
                                     std::optional<double> moisture) {
  std::vector<std::string> wanted;
  for (const std::string& word : WordsOf(like)) {
    if (!std::isdigit(static_cast<unsigned char>(word[0]))) wanted.push_back(word);
  }
  std::vector<Suggestion> all;
  for (const SoilLibrary::Entry& e : library.entries) {
    const Suggestion s{&e, LikenessOf(wanted, e.soil), MoistureOf(e.soil.name)};
    if (s.likeness > 0) all.push_back(s);
  }
  double best = 0;
  for (const Suggestion& s : all) best = std::max(best, s.likeness);
  std::erase_if(all, [&](const Suggestion& s) { return s.likeness <= 0.5 * best; });
  const auto off = [&](const Suggestion& s) {
    if (!moisture) return 0.0;
    return s.moisture_percent ? std::abs(*s.moisture_percent - *moisture) : 1e3;
  };
  std::ranges::stable_sort(all, {},
                           [&](const Suggestion& s) { return std::tuple(-s.likeness, off(s)); });
  return all;
}

std::string SoilListText(const SoilEntries& entries) {
  std::string text = Head();
  for (const SoilLibrary::Entry* e : entries) text += LineOf(e->soil);
  return text + kUnits;
}

std::string SoilText(const SoilLibrary::Entry& e) {
  const BekkerParameters p = FromSoil(e.soil);
  std::string text = Head() + LineOf(e.soil) + kUnits;
  text += fmt::format("source: {}\nfile: {}\n", e.soil.source, e.file);
  if (!e.unusual.empty()) text += "outside of what published soils have: " + e.unusual + "\n";
  if (!e.soil.density_kg_per_m3) {
    text += fmt::format("density: {:.4g} kg/m^3 is taken for {}\n", p.unit_weight / 9.81,
                        NameOf(e.soil.kind));
  }
  if (!e.soil.shear_modulus_m) {
    text +=
        fmt::format("K: {:.3g} mm is taken for {}\n", p.shear_modulus * 1e3, NameOf(e.soil.kind));
  }
  return text;
}

bool SoilsOfGrains::Has(const std::string& name) const {
  return FindByName(bevameters, name) != nullptr || FindByName(cones, name) != nullptr;
}

std::string GrainsText(const std::string& name, const SoilsOfGrains& grains) {
  const BevameterSoil* bevameter = FindByName(grains.bevameters, name);
  const ConeIndex* cone = FindByName(grains.cones, name);
  return (bevameter == nullptr ? "" : BevameterText(*bevameter)) +
         (cone == nullptr ? "" : ConeText(*cone));
}

std::string GrainsJson(const std::string& name, const SoilsOfGrains& grains) {
  return nlohmann::json::array({GrainsOf(name, grains)}).dump(1) + "\n";
}

std::string SoilListJson(const SoilEntries& entries, const SoilsOfGrains& grains) {
  nlohmann::json list = nlohmann::json::array();
  for (const SoilLibrary::Entry* e : entries) {
    list.push_back(JsonOf(*e));
    list.back().update(GrainsOf(e->soil.name, grains));
  }
  return list.dump(1) + "\n";
}

}  // namespace grouser::surrogate

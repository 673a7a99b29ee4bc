#include "surrogate/soils/bevameter_table.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "surrogate/soils/grain_table.h"

namespace grouser::surrogate {

constexpr double kFoundDegree = std::numbers::pi / 180;
const std::array<FoundField, kFound> kFoundFields = {{
    {"n", "n", "n", "-", "", 1, 0.01, 5},
    {"k_c", "k_c_kN_per_m_n_plus_1", "k_c", "N/m^(n+1)", "kN/m^(n+1)", 1e3, -1e7, 1e7},
    {"k_phi", "k_phi_kN_per_m_n_plus_2", "k_phi", "N/m^(n+2)", "kN/m^(n+2)", 1e3, -1e7, 1e8},
    {"cohesion", "cohesion_kPa", "c", "Pa", "kPa", 1e3, 0, 1e4},
    {"friction_angle", "friction_angle_deg", "phi", "rad", "deg", kFoundDegree, 0, 89},
    {"shear_modulus", "shear_modulus_K_mm", "K", "m", "mm", 1e-3, 1e-3, 1e4},
    {"reece_n", "reece_n", "n", "-", "", 1, 0.01, 5},
    {"reece_k_c", "reece_k_c", "k_c'", "-", "", 1, -1e9, 1e9},
    {"reece_k_phi", "reece_k_phi", "k_phi'", "-", "", 1, -1e9, 1e9},
    {"reece_cohesion", "reece_cohesion_kPa", "c", "Pa", "kPa", 1e3, 0, 1e4},
}};

namespace {

constexpr char kBevameterWhat[] = "what bevameters find of soils of grains";

/// The header: soil, soil_sha256, three columns of each parameter, and these.
constexpr std::size_t kFirstFoundAt = 2, kBedDensityAt = kFirstFoundAt + 3 * kFound,
                      kFormAt = kBedDensityAt + 1, kTypicalAt = kFormAt + 1,
                      kBedsAt = kTypicalAt + 1, kGrainAt = kBedsAt + 1,
                      kBevameterHashAt = kGrainAt + 1, kSourceAt = kBevameterHashAt + 1;

std::vector<std::string> FoundColumns() {
  std::vector<std::string> names = {"soil", "soil_sha256"};
  for (const FoundField& field : kFoundFields) {
    for (const char* end : {"", "_low90", "_high90"})
      names.push_back(std::string(field.column) + end);
  }
  for (const char* name : {"density_kg_per_m3", "form", "not_identified", "beds", "grain_mm",
                           "bevameter_sha256", "source"}) {
    names.emplace_back(name);
  }
  return names;
}

std::optional<FoundParameter> ReadParameter(const GrainLine& row, std::size_t at) {
  const FoundField& field = kFoundFields[at];
  const std::size_t column = kFirstFoundAt + 3 * at;
  const auto value = at < kBekkerFound ? row.Number(column, field.low, field.high)
                                       : row.Maybe(column, field.low, field.high);
  if (!value) {
    for (std::size_t k = column + 1; k < column + 3; ++k) {
      if (!row.cells[k].empty()) row.Fail(k, "nothing: there is no value");
    }
    return std::nullopt;
  }
  const auto low = row.Maybe(column + 1, -1e12, *value);
  const auto high = row.Maybe(column + 2, *value, 1e12);
  const auto in_si = [&](const std::optional<double>& end) {
    return end ? std::optional(*end * field.si) : std::nullopt;
  };
  return FoundParameter{*value * field.si, in_si(low), in_si(high), true};
}

void MarkTypical(const GrainLine& row, BevameterSoil* soil) {
  std::istringstream names(row.cells[kTypicalAt]);
  for (std::string name; names >> name;) {
    const auto field = std::ranges::find(kFoundFields, name, &FoundField::name);
    const auto at = static_cast<std::size_t>(field - kFoundFields.begin());
    if (at == kFound || !soil->parameters[at]) {
      row.Fail(kTypicalAt, "names of its parameters, blanks between");
    }
    soil->parameters[at]->identified = false;
  }
}

BevameterSoil ReadBevameterSoil(const GrainLine& row) {
  BevameterSoil soil;
  soil.soil = row.cells[0];
  soil.soil_sha256 = row.Hash(1);
  for (std::size_t at = 0; at < kFound; ++at) soil.parameters[at] = ReadParameter(row, at);
  for (std::size_t at = kBekkerFound + 1; at < kFound; ++at) {
    if (soil.parameters[at].has_value() != soil.parameters[kBekkerFound].has_value()) {
      row.Fail(kFirstFoundAt + 3 * at, "all of Reece's parameters, or none");
    }
  }
  soil.density_kg_per_m3 = row.Number(kBedDensityAt, 1, 2e4);
  soil.form = row.cells[kFormAt];
  const bool has_reece = soil.parameters[kBekkerFound].has_value();
  if (soil.form != "bekker" && !(has_reece && soil.form == "reece")) {
    row.Fail(kFormAt, has_reece ? "bekker or reece" : "bekker: Reece's parameters are not there");
  }
  MarkTypical(row, &soil);
  soil.beds = row.Whole(kBedsAt, 1, 1000);
  soil.grain_m = 1e-3 * row.Number(kGrainAt, 0.01, 1000);
  soil.bevameter_sha256 = row.Hash(kBevameterHashAt);
  soil.source = row.cells[kSourceAt];
  return soil;
}

std::string FoundLine(const FoundField& field, const FoundParameter& p) {
  const auto end = [&](const std::optional<double>& value, const char* none) {
    return value ? fmt::format("{:.3g}", *value / field.si) : none;
  };
  std::string text = fmt::format("  {:<7}{:>8.3g}  {:<22}{}", field.symbol, p.value / field.si,
                                 end(p.low, "-inf") + " to " + end(p.high, "inf"), field.unit);
  if (!p.identified) text += "  not identified: rests on what is typical";
  return text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
}

}  // namespace

std::vector<BevameterSoil> ReadBevameterSoils(std::istream& table, const std::string& name) {
  const std::vector<std::string> names = FoundColumns();
  std::vector<const char*> columns;
  for (const std::string& one : names) columns.push_back(one.c_str());
  std::vector<BevameterSoil> soils;
  for (const GrainLine& line : ReadGrainLines(table, name, columns, kBevameterWhat)) {
    soils.push_back(ReadBevameterSoil(line));
  }
  return soils;
}

std::vector<BevameterSoil> BevameterSoils(const std::vector<std::string>& more_files) {
  return LinesOf(GrainTables("bevameter_soils.csv", more_files, kBevameterWhat),
                 ReadBevameterSoils);
}

std::string BevameterText(const BevameterSoil& soil) {
  std::string text = fmt::format(
      "soil parameters by a bevameter, with intervals of 90 %; they belong to grains of {:.3g} "
      "mm\n",
      1e3 * soil.grain_m);
  const auto taken = [&](const char* form) { return soil.form == form ? " (taken)" : ""; };
  text += fmt::format("by Bekker's form{}, Mohr-Coulomb and Janosi-Hanamoto:\n", taken("bekker"));
  for (std::size_t at = 0; at < kFound; ++at) {
    if (!soil.parameters[at]) continue;
    if (at == kBekkerFound) text += fmt::format("by Reece's form{}:\n", taken("reece"));
    text += FoundLine(kFoundFields[at], *soil.parameters[at]);
  }
  return text + fmt::format("  bed of {:.4g} kg/m^3, {} bed{}; {}; bevameter.json {}\n",
                            soil.density_kg_per_m3, soil.beds, soil.beds > 1 ? "s" : "",
                            soil.source, soil.bevameter_sha256.substr(0, 12));
}

std::string BevameterListJson(const std::vector<BevameterSoil>& soils) {
  const auto maybe = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  };
  nlohmann::json list = nlohmann::json::array();
  for (const BevameterSoil& soil : soils) {
    nlohmann::json parameters = nlohmann::json::object();
    for (std::size_t at = 0; at < kFound; ++at) {
      const std::optional<FoundParameter>& p = soil.parameters[at];
      if (!p) continue;
      parameters[kFoundFields[at].name] = {{"value", p->value},
                                           {"low90", maybe(p->low)},
                                           {"high90", maybe(p->high)},
                                           {"unit", kFoundFields[at].si_unit},
                                           {"identified", p->identified}};
    }
    list.push_back({{"soil", soil.soil},
                    {"soil_sha256", soil.soil_sha256},
                    {"parameters", parameters},
                    {"density_kg_per_m3", soil.density_kg_per_m3},
                    {"form", soil.form},
                    {"beds", soil.beds},
                    {"grain_m", soil.grain_m},
                    {"bevameter_sha256", soil.bevameter_sha256},
                    {"source", soil.source}});
  }
  return list.dump(1) + "\n";
}

}  // namespace grouser::surrogate

#include "surrogate/soils/soil_table.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

constexpr std::array kColumns = {"soil",
                                 "n",
                                 "k_c_kN_per_m_n_plus_1",
                                 "k_phi_kN_per_m_n_plus_2",
                                 "cohesion_kPa",
                                 "friction_angle_deg",
                                 "density_kg_per_m3",
                                 "shear_modulus_K_mm",
                                 "kind",
                                 "source"};

// Where a cell stands, for messages.
struct Place {
  const std::string& file;
  int line;

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::runtime_error(file + ":" + std::to_string(line) + ": " + what);
  }
};

// Cells of a line; quotes keep commas together.
std::vector<std::string> Cells(const std::string& line, const Place& place) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  if (quoted) place.Fail("a quote is not closed");
  if (cells.size() != kColumns.size()) {
    place.Fail(std::to_string(cells.size()) + " columns, expected " +
               std::to_string(kColumns.size()));
  }
  return cells;
}

std::optional<double> Number(const std::vector<std::string>& cells, int column, double unit,
                             const Place& place) {
  const std::string& text = cells[column];
  if (text.empty()) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    place.Fail(std::string(kColumns[column]) + ": " + text + ", expected a number");
  }
  return value * unit;
}

double Required(const std::vector<std::string>& cells, int column, double unit,
                const Place& place) {
  const std::optional<double> value = Number(cells, column, unit, place);
  if (!value) place.Fail(std::string(kColumns[column]) + ": empty, expected a number");
  return *value;
}

SoilKind Kind(const std::string& word, const Place& place) {
  if (word == "sand") return SoilKind::kSand;
  if (word == "loam") return SoilKind::kLoam;
  if (word == "clay") return SoilKind::kClay;
  if (word == "snow") return SoilKind::kSnow;
  place.Fail("kind: " + word + ", expected sand, loam, clay or snow");
}

Soil ReadSoil(const std::vector<std::string>& cells, const Place& place) {
  Soil soil;
  soil.name = cells[0];
  soil.n = Required(cells, 1, 1, place);
  soil.k_c = Required(cells, 2, 1e3, place);
  soil.k_phi = Required(cells, 3, 1e3, place);
  soil.cohesion_pa = Required(cells, 4, 1e3, place);
  soil.friction_angle_rad = Required(cells, 5, std::numbers::pi / 180, place);
  soil.density_kg_per_m3 = Number(cells, 6, 1, place);
  soil.shear_modulus_m = Number(cells, 7, 1e-3, place);
  soil.kind = Kind(cells[8], place);
  soil.source = cells[9];
  return soil;
}

double UsualDensity(SoilKind kind) {
  return kind == SoilKind::kSnow ? 300 : kind == SoilKind::kClay ? 1800 : 1600;
}

double UsualShearModulus(SoilKind kind) {
  return kind == SoilKind::kSnow ? 0.025 : kind == SoilKind::kClay ? 0.006 : 0.010;
}

}  // namespace

std::vector<Soil> ReadSoils(std::istream& table, const std::string& name) {
  std::vector<Soil> soils;
  std::string line;
  bool header = true;
  for (int number = 1; std::getline(table, line); ++number) {
    const Place place{name, number};
    if (line.empty() || line[0] == '#') continue;
    const std::vector<std::string> cells = Cells(line, place);
    if (!header) {
      soils.push_back(ReadSoil(cells, place));
      continue;
    }
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      if (cells[i] != kColumns[i]) {
        place.Fail("column " + cells[i] + ", expected " + kColumns[i]);
      }
    }
    header = false;
  }
  if (soils.empty()) throw std::runtime_error(name + ": no soil, expected a table of them");
  return soils;
}

BekkerParameters FromSoil(const Soil& soil, double gravity) {
  BekkerParameters p;
  p.n = soil.n;
  p.k_c = soil.k_c;
  p.k_phi = soil.k_phi;
  p.cohesion = soil.cohesion_pa;
  p.friction_angle = soil.friction_angle_rad;
  p.shear_modulus = soil.shear_modulus_m.value_or(UsualShearModulus(soil.kind));
  p.unit_weight = soil.density_kg_per_m3.value_or(UsualDensity(soil.kind)) * gravity;
  p.c1 = 0.18;
  p.c2 = 0.32;
  p.c3 = 0;
  p.sinkage_drive = 1.5;
  const double rankine = std::tan(std::numbers::pi / 4 + soil.friction_angle_rad / 2);
  p.side_passive = rankine * rankine;
  p.front_passive = rankine * rankine;
  p.bulldozing_length = p.shear_modulus;
  return p;
}

}  // namespace grouser::surrogate

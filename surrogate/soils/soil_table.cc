#include "surrogate/soils/soil_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "proto/records/os/root_folder.h"
#include "surrogate/soils/csv_cells.h"

namespace grouser::surrogate {
namespace {

/// A column of the table, in the table's own units. What lies outside [low, high]
/// is physically impossible or in another unit; outside [usual_low, usual_high]
/// there is no published soil (the table's own, with some room).
struct Column {
  const char* name;
  double si = 1;  ///< of one table unit
  double low = 0, high = 0, usual_low = 0, usual_high = 0;
  const char* hint = "";  ///< what a value outside may be
};
constexpr double kDegree = std::numbers::pi / 180;
constexpr Column kName{"soil"}, kKind{"kind"}, kSource{"source"};
constexpr Column kN{"n", 1, 0.05, 2.5, 0.1, 1.7, ""};
constexpr Column kKc{"k_c_kN_per_m_n_plus_1", 1e3, -1e4, 1e4, -100, 200, "N for kN?"};
constexpr Column kKPhi{"k_phi_kN_per_m_n_plus_2", 1e3, 0, 1e5, 10, 1e4, "N for kN?"};
constexpr Column kCohesion{"cohesion_kPa", 1e3, 0, 500, 0, 100, "Pa for kPa?"};
constexpr Column kAngle{"friction_angle_deg", kDegree, 0, 70, 0, 50, ""};
constexpr Column kDensity{"density_kg_per_m3", 1, 30, 4000, 100, 2300, "g/cm^3?"};
constexpr Column kShear{"shear_modulus_K_mm", 1e-3, 0.1, 500, 1, 80, "m for mm, or mm for m?"};
constexpr std::array kColumns = {kName,  kN,       kKc,    kKPhi, kCohesion,
                                 kAngle, kDensity, kShear, kKind, kSource};

// Where a cell stands, for messages.
struct Place {
  const std::string& file;
  int line;

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::invalid_argument(file + ":" + std::to_string(line) + ": " + what);
  }
};

std::vector<std::string> Cells(const std::string& line, const Place& place) {
  std::vector<std::string> cells;
  try {
    cells = CsvCells(line);
  } catch (const std::invalid_argument& error) {
    place.Fail(error.what());
  }
  if (cells.size() != kColumns.size()) {
    place.Fail(std::to_string(cells.size()) + " columns, expected " +
               std::to_string(kColumns.size()));
  }
  return cells;
}

std::string Range(double low, double high) { return fmt::format("{:g} to {:g}", low, high); }

/// A line of the table.
struct Line {
  const std::vector<std::string>& cells;
  bool accept_unusual;
  const Place& place;

  /// The cell of a column, in SI.
  std::optional<double> Number(int column) const {
    const std::string& text = cells[column];
    const Column& c = kColumns[column];
    if (text.empty()) return std::nullopt;
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      place.Fail(fmt::format("{}: {}, expected a number", c.name, text));
    }
    if (value < c.low || value > c.high) {
      const bool unit = *c.hint && (std::abs(value) > c.high || (value > 0 && value < c.low));
      place.Fail(fmt::format("{}: {}, expected {}{}{}", c.name, text, Range(c.low, c.high),
                             unit ? ": " : "", unit ? c.hint : ""));
    }
    const bool usual = value >= c.usual_low && value <= c.usual_high;
    if (!usual && !accept_unusual) {
      place.Fail(
          fmt::format("{}: {}, expected {} as published soils have; --accept-unusual takes it",
                      c.name, text, Range(c.usual_low, c.usual_high)));
    }
    return value * c.si;
  }

  double Required(int column) const {
    const std::optional<double> value = Number(column);
    if (!value) place.Fail(std::string(kColumns[column].name) + ": empty, expected a number");
    return *value;
  }
};

constexpr std::array kKinds = {"sand", "loam", "clay", "snow"};  // in the order of SoilKind

SoilKind Kind(const std::string& word, const Place& place) {
  if (const auto kind = FindSoilKind(word)) return *kind;
  place.Fail("kind: " + word + ", expected sand, loam, clay or snow");
}

Soil ReadSoil(const std::vector<std::string>& cells, bool accept_unusual, const Place& place) {
  const Line row{cells, accept_unusual, place};
  if (cells[0].empty()) place.Fail("soil: empty, expected a name");
  const Soil soil{
      cells[0],        row.Required(1), row.Required(2), row.Required(3),       row.Required(4),
      row.Required(5), row.Number(6),   row.Number(7),   Kind(cells[8], place), cells[9]};
  // No soil has an angle between none and a degree or two; radians are all there.
  const double phi = soil.friction_angle_rad;
  if (phi > 0 && phi <= std::numbers::pi / 2 * kDegree) {
    place.Fail(std::string(kAngle.name) + ": " + cells[5] + ", expected 0 or 1.6 to 70: radians?");
  }
  if (soil.k_phi == 0 && soil.k_c <= 0) {
    place.Fail(std::string(kKPhi.name) + ": 0, expected a positive number, or one for k_c");
  }
  if (phi == 0 && soil.cohesion_pa == 0) {
    place.Fail(std::string(kAngle.name) + ": 0 with cohesion 0, expected a soil that bears shear");
  }
  return soil;
}

double UsualDensity(SoilKind kind) {
  return kind == SoilKind::kSnow ? 300 : kind == SoilKind::kClay ? 1800 : 1600;
}

double UsualShearModulus(SoilKind kind) {
  return kind == SoilKind::kSnow ? 0.025 : kind == SoilKind::kClay ? 0.006 : 0.010;
}

}  // namespace

const char* NameOf(SoilKind kind) { return kKinds[static_cast<int>(kind)]; }

std::optional<SoilKind> FindSoilKind(const std::string& word) {
  const auto at = std::ranges::find(kKinds, word);
  if (at == kKinds.end()) return std::nullopt;
  return static_cast<SoilKind>(at - kKinds.begin());
}

std::vector<Soil> ReadSoils(std::istream& table, const std::string& name, bool accept_unusual) {
  std::vector<Soil> soils;
  std::map<std::string, int> line_of;
  std::string line;
  bool header = true;
  for (int number = 1; std::getline(table, line); ++number) {
    const Place place{name, number};
    if (line.empty() || line[0] == '#') continue;
    const std::vector<std::string> cells = Cells(line, place);
    if (!header) {
      soils.push_back(ReadSoil(cells, true, place));  // what is impossible is said first
      if (!accept_unusual) ReadSoil(cells, false, place);
      const auto [known, added] = line_of.emplace(cells[0], number);
      if (!added) {
        place.Fail("soil: " + cells[0] + " is in line " + std::to_string(known->second) +
                   " already, expected each name once");
      }
      continue;
    }
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      if (cells[i] != kColumns[i].name) {
        place.Fail("column " + cells[i] + ", expected " + kColumns[i].name);
      }
    }
    header = false;
  }
  if (soils.empty()) throw std::invalid_argument(name + ": no soil, expected a table of them");
  return soils;
}

std::string WriteSoils(const std::vector<Soil>& soils) {
  std::string text;
  for (const Column& column : kColumns)
    text += (text.empty() ? "" : ",") + std::string(column.name);
  text += '\n';
  for (const Soil& soil : soils) {
    const auto number = [](const Column& column, std::optional<double> si) {
      return si ? fmt::format(",{:.6g}", *si / column.si) : ",";
    };
    text += CsvCell(soil.name) + number(kN, soil.n) + number(kKc, soil.k_c) +
            number(kKPhi, soil.k_phi) + number(kCohesion, soil.cohesion_pa) +
            number(kAngle, soil.friction_angle_rad) + number(kDensity, soil.density_kg_per_m3) +
            number(kShear, soil.shear_modulus_m) + ',' + NameOf(soil.kind) + ',' +
            CsvCell(soil.source) + '\n';
  }
  return text;
}

std::string SurrogateFile(const std::string& path) {
  if (const char* root = std::getenv("GROUSER_ROOT"))
    return std::string(root) + "/surrogate/" + path;
  const std::string root = os::RootOfProgram().string();
  return (root.empty() ? "." : root) + "/surrogate/" + path;
}

std::string PublishedSoilsFile() { return SurrogateFile("soils/bekker_soils.csv"); }

std::string UnusualOf(const Soil& soil) {
  std::istringstream table(WriteSoils({soil}));
  try {
    ReadSoils(table, soil.name);
  } catch (const std::invalid_argument& error) {
    const std::string said = error.what();  // NAME:LINE: COLUMN: ...; --accept-unusual ...
    const std::string what = said.substr(said.find(": ", soil.name.size()) + 2);
    return what.substr(0, what.find(';'));
  }
  return "";
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

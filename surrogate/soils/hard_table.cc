#include "surrogate/soils/hard_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "surrogate/soils/csv_cells.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {
namespace {

struct GroundParameter {
  const char* column;  ///< without _low, _high
  double HardGround::*mean;
  double HardGround::*sd;
  double low, high;  ///< what no ground exceeds
};
constexpr std::array<GroundParameter, 3> kGroundParameters = {{
    {"friction", &HardGround::friction, &HardGround::friction_sd, 0.01, 2},
    {"rolling_resistance", &HardGround::rolling_resistance, &HardGround::rolling_resistance_sd, 0,
     0.5},
    {"slip_stiffness", &HardGround::slip_stiffness, &HardGround::slip_stiffness_sd, 0.5, 100},
}};
constexpr std::size_t kGroundColumns = 2 * kGroundParameters.size() + 2;

std::string NameOfColumn(std::size_t i) {
  if (i == 0) return "ground";
  if (i + 1 == kGroundColumns) return "source";
  return std::string(kGroundParameters[(i - 1) / 2].column) + (i % 2 == 1 ? "_low" : "_high");
}

[[noreturn]] void Fail(const std::string& place, const std::string& what) {
  throw std::invalid_argument(place + ": " + what);
}

double Number(const std::string& place, std::size_t column, const std::string& text) {
  const GroundParameter& p = kGroundParameters[(column - 1) / 2];
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size() && !text.empty();
  if (!whole || !(value >= p.low && value <= p.high)) {
    Fail(place, fmt::format("{}: {}, expected a number from {:g} to {:g}", NameOfColumn(column),
                            text.empty() ? "empty" : text, p.low, p.high));
  }
  return value;
}

PublishedHardGround ReadGround(const std::string& place, const std::vector<std::string>& cells) {
  if (cells[0].empty()) Fail(place, "ground: empty, expected a name");
  PublishedHardGround row{cells[0], {}, cells.back()};
  for (std::size_t k = 0; k < kGroundParameters.size(); ++k) {
    const std::size_t at = 1 + 2 * k;
    const double low = Number(place, at, cells[at]), high = Number(place, at + 1, cells[at + 1]);
    if (high < low) {
      Fail(place, fmt::format("{}: {:g}, expected at least {}, {:g}", NameOfColumn(at + 1), high,
                              NameOfColumn(at), low));
    }
    row.ground.*kGroundParameters[k].mean = (low + high) / 2;
    row.ground.*kGroundParameters[k].sd = (high - low) / (2 * kTwoSided90);
  }
  return row;
}

bool SameName(const std::string& a, const std::string& b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

std::vector<PublishedHardGround> ReadHardGrounds(std::istream& table, const std::string& name) {
  std::vector<PublishedHardGround> grounds;
  bool header = true;
  std::string line;
  for (int number = 1; std::getline(table, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    const std::string place = fmt::format("{}:{}", name, number);
    const std::vector<std::string> cells = CsvCells(line);
    if (cells.size() != kGroundColumns) {
      Fail(place, fmt::format("{} columns, expected {}", cells.size(), kGroundColumns));
    }
    if (!header) {
      const auto known = std::ranges::any_of(
          grounds, [&](const PublishedHardGround& g) { return SameName(g.name, cells[0]); });
      if (known) Fail(place, "ground: " + cells[0] + ", expected each name once");
      grounds.push_back(ReadGround(place, cells));
      continue;
    }
    for (std::size_t i = 0; i < kGroundColumns; ++i) {
      if (cells[i] != NameOfColumn(i)) {
        Fail(place, "column " + cells[i] + ", expected " + NameOfColumn(i));
      }
    }
    header = false;
  }
  if (grounds.empty()) Fail(name, "no ground, expected a table of them");
  return grounds;
}

std::vector<PublishedHardGround> PublishedHardGrounds() {
  const std::string path = SurrogateFile("soils/hard_grounds.csv");
  std::ifstream file(path);
  if (!file) Fail(path, "cannot be read, expected the table of hard grounds");
  return ReadHardGrounds(file, path);
}

const PublishedHardGround& FindHardGround(const std::vector<PublishedHardGround>& grounds,
                                          const std::string& name) {
  std::vector<std::string> names;
  for (const PublishedHardGround& g : grounds) {
    if (SameName(g.name, name)) return g;
    names.push_back(g.name);
  }
  Fail("ground '" + name + "'",
       fmt::format("not known, expected one of {}", fmt::join(names, ", ")));
}

void SetUsualContact(double radius_m, double width_m, HardGround* ground) {
  ground->contact_length_m = radius_m / 2;
  ground->contact_width_m = 0.9 * width_m;
}

}  // namespace grouser::surrogate

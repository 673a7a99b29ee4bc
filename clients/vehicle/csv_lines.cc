#include "clients/vehicle/csv_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "surrogate/vehicle/yaml.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t\r"), last = cell.find_last_not_of(" \t\r");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

constexpr std::uint64_t kMostBytes = 64 << 20;

}  // namespace

CsvTable ReadCsv(const std::string& file) {
  std::istringstream in(yaml::ReadInput(file, kMostBytes));
  CsvTable table;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    const std::string at = file + ":" + std::to_string(++number) + ": ";
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::vector<std::string> cells = Cells(line);
    if (table.columns.empty()) {
      table.at = at;
      table.columns = std::move(cells);
      continue;
    }
    if (cells.size() != table.columns.size()) {
      throw yaml::InputError(at + "got " + std::to_string(cells.size()) + " cells, expected " +
                             std::to_string(table.columns.size()));
    }
    table.lines.push_back({at, std::move(cells)});
  }
  return table;
}

bool HasColumn(const CsvTable& table, const std::string& column) {
  return std::find(table.columns.begin(), table.columns.end(), column) != table.columns.end();
}

void CheckColumns(const CsvTable& table, const std::vector<std::string>& known,
                  const std::string& expected) {
  for (const std::string& c : table.columns) {
    if (std::find(known.begin(), known.end(), c) == known.end() ||
        std::count(table.columns.begin(), table.columns.end(), c) > 1) {
      throw yaml::InputError(table.at + "column " + c + ": expected " + expected);
    }
  }
}

double NumberOf(const std::string& at, const std::string& column, const std::string& cell) {
  double value = 0;
  const char* end = cell.data() + cell.size();
  const auto [rest, error] = std::from_chars(cell.data(), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) {
    throw yaml::InputError(at + column + ": got '" + cell + "', expected a finite number");
  }
  return value;
}

std::uint8_t SoilOf(const std::string& at, const std::string& cell,
                    const std::vector<std::string>& soils) {
  const auto soil = std::find(soils.begin(), soils.end(), cell);
  if (soil == soils.end()) {
    throw yaml::InputError(at + "soil: got " + cell + ", expected one of the vehicle, such as " +
                           yaml::NearestOf(cell, soils));
  }
  return static_cast<std::uint8_t>(soil - soils.begin());
}

}  // namespace grouser::cli

#include "surrogate/soils/grain_table.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "surrogate/soils/csv_cells.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {
namespace {

constexpr std::size_t kSoilColumn = 0, kSoilHashColumn = 1;

[[noreturn]] void FailAt(const std::string& place, const std::string& what) {
  throw std::invalid_argument(place + ": " + what);
}

std::vector<std::string> CellsAt(const std::string& place, const std::string& line,
                                 std::size_t columns) {
  std::vector<std::string> cells;
  try {
    cells = CsvCells(line);
  } catch (const std::invalid_argument& error) {
    FailAt(place, fmt::format("{}, expected {} columns", error.what(), columns));
  }
  if (cells.size() != columns) {
    FailAt(place, fmt::format("{} columns, expected {}", cells.size(), columns));
  }
  return cells;
}

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

void GrainLine::Fail(std::size_t column, const std::string& expected) const {
  const std::string& cell = cells[column];
  FailAt(place, fmt::format("{}: {}, expected {}", columns[column], cell.empty() ? "empty" : cell,
                            expected));
}

std::optional<double> GrainLine::Maybe(std::size_t column, double low, double high) const {
  const std::string& text = cells[column];
  if (text.empty()) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || !(value >= low && value <= high)) {
    Fail(column, fmt::format("a number from {:g} to {:g}", low, high));
  }
  return value;
}

double GrainLine::Number(std::size_t column, double low, double high) const {
  const std::optional<double> value = Maybe(column, low, high);
  if (!value) Fail(column, fmt::format("a number from {:g} to {:g}", low, high));
  return *value;
}

int GrainLine::Whole(std::size_t column, int low, int high) const {
  const double value = Number(column, low, high);
  if (value != std::floor(value)) Fail(column, "a whole number");
  return static_cast<int>(value);
}

std::string GrainLine::Hash(std::size_t column) const {
  const std::string& text = cells[column];
  const auto hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (text.size() != 64 || !std::ranges::all_of(text, hex)) Fail(column, "64 hex digits");
  return text;
}

std::vector<GrainLine> ReadGrainLines(std::istream& table, const std::string& name,
                                      std::span<const char* const> columns,
                                      const std::string& what) {
  std::vector<GrainLine> lines;
  std::string line;
  bool header = true;
  for (int number = 1; std::getline(table, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    const std::string place = fmt::format("{}:{}", name, number);
    GrainLine one{place, CellsAt(place, line, columns.size()), columns};
    if (header) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        if (one.cells[i] == columns[i]) continue;
        FailAt(place, fmt::format("column {}, expected {}", one.cells[i], columns[i]));
      }
      header = false;
      continue;
    }
    if (one.cells[kSoilColumn].empty()) one.Fail(kSoilColumn, "a name");
    const std::string hash = one.Hash(kSoilHashColumn);
    const auto same = [&](const GrainLine& l) { return l.cells[kSoilHashColumn] == hash; };
    if (std::ranges::any_of(lines, same)) one.Fail(kSoilHashColumn, "each soil once");
    lines.push_back(std::move(one));
  }
  if (header) FailAt(name, "no header, expected a table of " + what);
  return lines;
}

std::vector<GrainTable> GrainTables(const std::string& shipped,
                                    const std::vector<std::string>& more_files,
                                    const std::string& what) {
  std::vector<std::string> files = more_files;
  const std::string file = SurrogateFile("soils/" + shipped);
  if (std::filesystem::exists(file)) files.insert(files.begin(), file);
  std::vector<GrainTable> tables;
  for (const std::string& one : files) {
    tables.push_back({one, records::ReadInputFile(one, "a table of " + what)});
  }
  return tables;
}

bool IsSoilNamed(const std::string& name, const std::string& soil) {
  return LowerCase(name) == LowerCase(soil) || LowerCase(name) + ", dem" == LowerCase(soil);
}

}  // namespace grouser::surrogate

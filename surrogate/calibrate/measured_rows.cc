#include "surrogate/calibrate/measured_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "proto/records/yaml/nearest.h"
#include "surrogate/soils/csv_cells.h"

namespace grouser::surrogate {

using enum Dimension;

void CsvTable::Fail(int line, const std::string& what) const {
  throw std::invalid_argument(fmt::format("{}:{}: {}", path, line, what));
}

int CsvTable::Column(const std::string& name, const std::string& place) const {
  const auto found = std::ranges::find(header, name);
  if (found == header.end()) {
    Fail(header_line,
         fmt::format("no column '{}' ({}), expected one of: {}; the nearest is '{}'", name, place,
                     fmt::join(header, ", "), records::NearestOf(name.substr(0, 100), header)));
  }
  return static_cast<int>(found - header.begin());
}

CsvTable ReadCsvTable(const std::string& path, const std::string& text) {
  CsvTable table{path, 0, {}, {}};
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::vector<std::string> cells;
    try {
      cells = CsvCells(line);
    } catch (const std::invalid_argument& error) {
      table.Fail(number, error.what());
    }
    if (cells[0].starts_with('#') || (cells.size() == 1 && cells[0].empty())) continue;
    if (table.header.empty()) {
      table.header = cells;
      table.header_line = number;
      for (auto c = cells.begin(); c != cells.end(); ++c) {
        if (std::find(cells.begin(), c, *c) != c) {
          table.Fail(number, "column '" + *c + "' stands here twice, expected each once");
        }
      }
      continue;
    }
    if (cells.size() != table.header.size()) {
      table.Fail(number, fmt::format("{} fields, expected {} as in line {}", cells.size(),
                                     table.header.size(), table.header_line));
    }
    table.lines.emplace_back(number, std::move(cells));
  }
  if (table.header.empty()) table.Fail(1, "empty, expected a header line and rows");
  return table;
}

TestSpec WithNamedColumns(TestSpec spec, const CsvTable& table) {
  for (const std::string& column : table.header) {
    const std::string quantity = QuantityOfColumn(spec.kind, column);
    const bool used = std::ranges::any_of(
        spec.columns, [&](const auto& entry) { return entry.second.column == column; });
    if (quantity.empty() || used || spec.constants.contains(quantity)) continue;
    spec.columns.emplace(quantity, ColumnSpec{column, ""});
  }
  return spec;
}

MeasuredRows::MeasuredRows(const TestSpec& spec, const CsvTable& table)
    : spec_(spec), table_(table) {
  for (const auto& [quantity, column] : spec.columns) {
    const QuantityField& field = FindQuantity(spec.kind, quantity, spec.place);
    const int at = table.Column(column.column, "for " + quantity);
    columns_[quantity] = {at, column.sign * UnitFor(column, field, quantity).si};
    if (spec.constants.contains(quantity)) {
      throw std::invalid_argument(fmt::format(
          "{}: {} is a column and a constant, expected one of both", spec.place, quantity));
    }
  }
}

bool MeasuredRows::Has(const std::string& quantity) const {
  return columns_.contains(quantity) || spec_.constants.contains(quantity);
}

double MeasuredRows::Get(const std::string& quantity, int line,
                         const std::vector<std::string>& cells) const {
  const auto constant = spec_.constants.find(quantity);
  if (constant != spec_.constants.end()) return constant->second;
  const auto column = columns_.find(quantity);
  if (column == columns_.end() || cells[column->second.at].empty()) return kMissing;
  const std::string& text = cells[column->second.at];
  const auto number = ParseNumber(text);
  if (!number) {
    table_.Fail(line, fmt::format("column '{}': got '{}', expected a finite number or an empty "
                                  "field",
                                  table_.header[column->second.at], text));
  }
  return *number * column->second.factor;
}

double MeasuredRows::SdOf(const std::string& quantity, double value, int line,
                          const std::vector<std::string>& cells) const {
  const double own = std::abs(Get(quantity + "_sd", line, cells));
  if (own == 0) table_.Fail(line, quantity + "_sd: got 0, expected a positive number or nothing");
  if (!std::isnan(own)) {
    const double repeats = Get("repeats", line, cells);
    return std::isnan(repeats) ? own : own / std::sqrt(std::max(1.0, repeats));
  }
  const auto stated = spec_.sd.find(quantity);
  if (stated == spec_.sd.end()) return kMissing;
  return stated->second.relative ? stated->second.value * std::abs(value) : stated->second.value;
}

std::string MeasuredRows::ColumnOf(const std::string& quantity) const {
  const auto column = columns_.find(quantity);
  return column == columns_.end() ? "constants" : table_.header[column->second.at];
}

Unit MeasuredRows::UnitFor(const ColumnSpec& column, const QuantityField& field,
                           const std::string& quantity) const {
  const auto named = UnitOfColumn(column.column);
  const std::string expected = "expected one of the units " + UnitsOf(field.dimension);
  if (column.unit.empty()) {
    // A standard deviation stands in the unit of what it belongs to.
    const auto own = spec_.columns.find(quantity.substr(0, quantity.rfind("_sd")));
    if (!named && quantity.ends_with("_sd") && own != spec_.columns.end()) {
      return UnitFor(own->second, field, own->first);
    }
    if (named && named->dimension == field.dimension) return *named;
    if (field.dimension == kNone && !named) return {"1", kNone, 1};
    throw std::invalid_argument(
        named ? fmt::format("{}: column '{}' is in {} by its name and {} is not, {}", spec_.place,
                            column.column, named->name, quantity, expected)
              : fmt::format("{}: column '{}' for {} has no unit in its name, {}", spec_.place,
                            column.column, quantity, expected));
  }
  const auto stated = FindUnit(column.unit);
  if (!stated || stated->dimension != field.dimension) {
    throw std::invalid_argument(fmt::format("{}: unit '{}' of column '{}' for {}, {}", spec_.place,
                                            column.unit, column.column, quantity, expected));
  }
  if (named && named->dimension == stated->dimension && named->si != stated->si) {
    throw std::invalid_argument(
        fmt::format("{}: column '{}' is stated to be in {}, its name says {}: mixed units?",
                    spec_.place, column.column, stated->name, named->name));
  }
  return *stated;
}

}  // namespace grouser::surrogate

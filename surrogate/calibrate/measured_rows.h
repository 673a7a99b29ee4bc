#pragma once

#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "surrogate/calibrate/test_spec.h"

namespace grouser::surrogate {

inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// A CSV whose header has been read; comments and empty lines are left out.
struct CsvTable {
  std::string path;
  int header_line = 0;
  std::vector<std::string> header;
  std::vector<std::pair<int, std::vector<std::string>>> lines;  ///< number in the file, cells

  /// Throws std::invalid_argument "PATH:LINE: WHAT".
  [[noreturn]] void Fail(int line, const std::string& what) const;
  /// Index of a column; fails at the header with the nearest.
  int Column(const std::string& name, const std::string& place) const;
};

/// Throws as Fail for lines of another length than the header's, equal columns, an open quote.
CsvTable ReadCsvTable(const std::string& path, const std::string& text);

/// The spec with the columns of the table that say what they are, where nothing else was said of
/// the quantity or the column.
TestSpec WithNamedColumns(TestSpec spec, const CsvTable& table);

/// A test's quantities in its table, SI, line by line. Keeps references to both.
class MeasuredRows {
 public:
  /// Throws std::invalid_argument for a column that is not there, or whose unit is not known.
  MeasuredRows(const TestSpec& spec, const CsvTable& table);

  bool Has(const std::string& quantity) const;
  /// NaN: the cell is empty, or there is no such quantity.
  double Get(const std::string& quantity, int line, const std::vector<std::string>& cells) const;
  /// Of a measured value in that line, a mean of `repeats` where those are known; NaN: not stated.
  double SdOf(const std::string& quantity, double value, int line,
              const std::vector<std::string>& cells) const;
  /// The column's name, or "constants".
  std::string ColumnOf(const std::string& quantity) const;

 private:
  struct Column {
    int at;
    double factor;
  };
  Unit UnitFor(const ColumnSpec& column, const QuantityField& field,
               const std::string& quantity) const;

  const TestSpec& spec_;
  const CsvTable& table_;
  std::map<std::string, Column> columns_;
};

}  // namespace grouser::surrogate

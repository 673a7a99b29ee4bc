#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace grouser::cli {

/// A CSV with a header. Empty lines and those that begin with '#' are left out.
struct CsvTable {
  struct Line {
    std::string at;  ///< "FILE:LINE: "
    std::vector<std::string> cells;
  };
  std::string at;                    ///< of the header
  std::vector<std::string> columns;  ///< none: the file has no line
  std::vector<Line> lines;           ///< with as many cells as there are columns
};

/// Throws InputError: a file that cannot be read or has more than 64 MiB, a line of another number
/// of cells.
CsvTable ReadCsv(const std::string& file);

/// Throws InputError where a column is none of `known` or stands twice; `expected` is what is said.
void CheckColumns(const CsvTable& table, const std::vector<std::string>& known,
                  const std::string& expected);
bool HasColumn(const CsvTable& table, const std::string& column);

/// Throws InputError "FILE:LINE: COLUMN: got 'X', expected a finite number".
double NumberOf(const std::string& at, const std::string& column, const std::string& cell);
/// Throws InputError with the nearest name there is.
std::uint8_t SoilOf(const std::string& at, const std::string& cell,
                    const std::vector<std::string>& soils);

}  // namespace grouser::cli

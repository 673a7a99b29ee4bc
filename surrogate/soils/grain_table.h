#pragma once

#include <algorithm>
#include <istream>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace grouser::surrogate {

/// A line of a table of soils of DEM grains, in table units. Its first columns are soil, a name,
/// and soil_sha256: SoilIdentity (surrogate/fit/soil_card.h), of all values of its grains.
struct GrainLine {
  std::string place;  ///< "NAME:LINE"
  std::vector<std::string> cells;
  std::span<const char* const> columns;

  /// Throws std::invalid_argument "NAME:LINE: COLUMN: VALUE, expected ...", as those below do.
  [[noreturn]] void Fail(std::size_t column, const std::string& expected) const;
  /// Within [low, high]; none: an empty cell.
  std::optional<double> Maybe(std::size_t column, double low, double high) const;
  double Number(std::size_t column, double low, double high) const;
  int Whole(std::size_t column, int low, int high) const;
  /// SHA-256.
  std::string Hash(std::size_t column) const;
};

/// The lines below the header, which has to be `columns`; lines that start with # say nothing.
/// Throws std::invalid_argument "NAME:LINE: ..., expected ..."; also where a soil stands twice.
/// `what`: of what the table is.
std::vector<GrainLine> ReadGrainLines(std::istream& table, const std::string& name,
                                      std::span<const char* const> columns,
                                      const std::string& what);

/// A table's text and the file that it is of.
struct GrainTable {
  std::string file, text;
};
/// surrogate/soils/SHIPPED of the checkout or installation, where there is one, then the others.
/// Throws "FILE: cause, expected a table of WHAT".
std::vector<GrainTable> GrainTables(const std::string& shipped,
                                    const std::vector<std::string>& more_files,
                                    const std::string& what);

/// Their lines; of a soil that comes again the last one holds.
template <typename Line>
std::vector<Line> LinesOf(const std::vector<GrainTable>& tables,
                          std::vector<Line> (*read)(std::istream&, const std::string&)) {
  std::vector<Line> all;
  for (const GrainTable& one : tables) {
    std::istringstream text(one.text);
    for (Line& line : read(text, one.file)) {
      std::erase_if(all, [&](const Line& r) { return r.soil_sha256 == line.soil_sha256; });
      all.push_back(std::move(line));
    }
  }
  return all;
}

/// Whether `soil` is `name` (letters of either case), or what the bevameter calls its calibrated
/// soil: "NAME, DEM".
bool IsSoilNamed(const std::string& name, const std::string& soil);

/// The last line of a soil's name; nullptr: none.
template <typename Line>
const Line* FindByName(const std::vector<Line>& lines, const std::string& soil) {
  const auto found = std::find_if(lines.rbegin(), lines.rend(),
                                  [&](const Line& r) { return IsSoilNamed(r.soil, soil); });
  return found == lines.rend() ? nullptr : &*found;
}

}  // namespace grouser::surrogate

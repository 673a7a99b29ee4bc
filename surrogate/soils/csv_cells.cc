#include "surrogate/soils/csv_cells.h"

#include <stdexcept>

namespace grouser::surrogate {

std::vector<std::string> CsvCells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  if (quoted) throw std::invalid_argument("a quote is not closed");
  for (std::string& cell : cells) {
    const auto first = cell.find_first_not_of(" \t");
    cell = first == std::string::npos
               ? ""
               : cell.substr(first, cell.find_last_not_of(" \t") - first + 1);
  }
  return cells;
}

std::string CsvCell(const std::string& text) {
  std::string cell;
  for (const char c : text) {
    cell += c == '\n' || c == '\r' ? ' ' : c;
    if (c == '"') cell += c;
  }
  return cell.starts_with('#') || cell.find_first_of(",\"") != std::string::npos ? '"' + cell + '"'
                                                                                 : cell;
}

}  // namespace grouser::surrogate

#pragma once

#include <string>
#include <vector>

namespace grouser::surrogate {

/// The cells of one line of a CSV, without blanks around them and without a carriage return.
/// Double quotes keep commas together and are left out; within them two stand for one. Throws
/// std::invalid_argument "a quote is not closed".
std::vector<std::string> CsvCells(const std::string& line);

/// A cell that CsvCells reads as `text`, and that begins no comment (#). A line break becomes a
/// blank.
std::string CsvCell(const std::string& text);

}  // namespace grouser::surrogate

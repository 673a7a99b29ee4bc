#pragma once

#include <string>
#include <vector>

namespace grouser::surrogate {

/// The cells of one line of a CSV, without blanks around them and without a carriage return.
/// Double quotes keep commas together and are left out. Throws std::invalid_argument "a quote is
/// not closed".
std::vector<std::string> CsvCells(const std::string& line);

}  // namespace grouser::surrogate

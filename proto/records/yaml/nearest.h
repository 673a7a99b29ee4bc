#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace grouser::records {

/// The fewest insertions, deletions and replacements of single characters that turn one word into
/// the other (Levenshtein's distance).
std::size_t EditDistance(const std::string& a, const std::string& b);

/// The candidate at the least EditDistance (the first of equals); empty: there is none.
std::string NearestOf(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace grouser::records

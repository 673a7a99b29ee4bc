#include "proto/records/yaml/neighbour.h"

#include <algorithm>
#include <filesystem>

namespace grouser::records {

std::string NeighbourOf(YamlSection& section, const std::string& key, const std::string& within) {
  namespace fs = std::filesystem;
  const std::string name = section.Text(key);
  const fs::path path = fs::path(section.file()).parent_path() / name;
  if (within.empty()) return path.string();
  std::error_code error;
  const fs::path folder = fs::canonical(within, error), real = fs::weakly_canonical(path, error);
  const auto [left, unused] = std::ranges::mismatch(folder, real);
  if (error || left != folder.end()) {
    section.Fail(key, "'" + name + "'", "a file that does not leave the folder of the request");
  }
  return real.string();
}

}  // namespace grouser::records

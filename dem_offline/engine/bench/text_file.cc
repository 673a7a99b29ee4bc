#include "dem_offline/engine/bench/text_file.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace grouser::dem::bench {

File OpenFile(const std::string& path, const char* mode) {
  File file(std::fopen(path.c_str(), mode));
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  return file;
}

}  // namespace grouser::dem::bench

#pragma once

#include <cstdio>
#include <memory>
#include <string>

namespace grouser::dem::bench {

struct CloseFile {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Throws std::runtime_error with the file's name and the reason.
File OpenFile(const std::string& path, const char* mode);

}  // namespace grouser::dem::bench

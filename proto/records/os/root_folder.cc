#include "proto/records/os/root_folder.h"

#include <system_error>

namespace grouser::os {

namespace fs = std::filesystem;

fs::path RootOf(const fs::path& program) {
  const fs::path prefix = program.parent_path().parent_path();
  for (const fs::path& root : {prefix / "share/grouser", prefix.parent_path().parent_path()}) {
    std::error_code unreadable;
    if (fs::is_directory(root / "surrogate/soils", unreadable)) return root;
  }
  return {};
}

fs::path RootOfProgram() {
  std::error_code no_proc;
  return RootOf(fs::read_symlink("/proc/self/exe", no_proc));
}

}  // namespace grouser::os

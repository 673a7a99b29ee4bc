// grouser-gpu-check: a device against the CPU's engine, and against itself.
// Plain program: builds on a machine that has nothing but compilers.
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/gpu/check/check.h"

namespace {

using namespace grouser::dem::gpu;

constexpr char kUsage[] =
    "usage: grouser-gpu-check [--device cuda|emulated] [--quick] [--json]\n"
    "Exit status: 0 all kept, 1 one was not or a run failed, 2 bad usage or no such device.\n";

int Main(int argc, char** argv) {
  std::string name = "cuda";
  bool quick = false, json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--quick") {
      quick = true;
    } else if (flag == "--json") {
      json = true;
    } else if (flag == "--device" && i + 1 < argc) {
      name = argv[++i];
    } else if (flag == "--help") {
      std::fputs(kUsage, stdout);
      return 0;
    } else {
      throw std::invalid_argument(flag + ": unknown, or no value");
    }
  }
  const auto device = OpenDevice(name);
  const auto rows = check::RunChecks(*device, quick);
  bool kept = true;
  for (const check::Row& r : rows) {
    kept = kept && r.Kept();
    if (json) continue;
    std::printf("%-4s %-66s %-10.3g limit %-8.2g %s\n", r.Kept() ? "ok" : "FAIL", r.name.c_str(),
                r.value, r.limit, r.note.c_str());
  }
  if (json) std::fputs(check::ToJson(rows, device->name()).c_str(), stdout);
  return kept ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "grouser-gpu-check: %s\n%s", error.what(), kUsage);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "grouser-gpu-check: %s\n", error.what());
    return 1;
  }
}

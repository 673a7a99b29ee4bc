// grouser-gpu-check: a device against the CPU's engine, and against itself.
// Plain program: builds on a machine that has nothing but compilers.
#include "dem_offline/engine/gpu/check/check.h"
#include "dem_offline/engine/tools/options.h"

namespace {

using namespace grouser::dem::gpu;

constexpr char kUsage[] =
    "usage: grouser-gpu-check [--device cuda|emulated] [--quick] [--json]\n"
    "Exit status: 0 all kept, 1 one was not or a run failed, 2 bad usage or no such device.\n";

int Main(int argc, char** argv) {
  std::string name = "cuda";
  bool quick = false, json = false;
  grouser::dem::Options options;
  options.Flag("--quick", &quick);
  options.Flag("--json", &json);
  options.Value("--device", &name);
  options.Parse(argc, argv);
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
  return grouser::dem::RunProgram("grouser-gpu-check", kUsage, argc, argv, Main);
}

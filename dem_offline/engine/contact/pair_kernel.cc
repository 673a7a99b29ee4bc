#include "dem_offline/engine/contact/pair_kernel.h"

#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace grouser::dem {

namespace isa_baseline { PairKernelFn Kernel(int recipe, bool energy); }
namespace isa_avx2 { PairKernelFn Kernel(int recipe, bool energy); }
namespace isa_avx512 { PairKernelFn Kernel(int recipe, bool energy); }
PairKernelFn GenericPairKernel(bool energy);

namespace {

using PickFn = PairKernelFn (*)(int, bool);

struct Choice {
  const char* name;
  PickFn pick;
};

bool HasAvx2() { return __builtin_cpu_supports("avx2") != 0; }
bool HasAvx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

PickFn PickFor(const char* isa) {
  if (std::strcmp(isa, "avx512") == 0) return HasAvx512() ? isa_avx512::Kernel : nullptr;
  if (std::strcmp(isa, "avx2") == 0) return HasAvx2() ? isa_avx2::Kernel : nullptr;
  if (std::strcmp(isa, "baseline") == 0) return isa_baseline::Kernel;
  return nullptr;
}

Choice Best() {
  const char* wish = std::getenv("GROUSER_ISA");
  for (const char* isa : {"avx512", "avx2", "baseline"}) {
    if (wish && std::strcmp(wish, "avx512") != 0 && std::strcmp(wish, isa) != 0 &&
        std::strcmp(isa, "baseline") != 0) {
      continue;
    }
    if (PickFn fn = PickFor(isa)) return {isa, fn};
  }
  return {"baseline", isa_baseline::Kernel};
}

const Choice& Chosen() {
  static const Choice choice = Best();
  return choice;
}

}  // namespace

PairKernelFn PairKernelFor(const char* isa, int recipe, bool energy) {
  const PickFn pick = PickFor(isa);
  if (!pick) return nullptr;
  return recipe < 0 ? GenericPairKernel(energy) : pick(recipe, energy);
}

PairKernelFn PairKernel(int recipe, bool energy) {
  return recipe < 0 ? GenericPairKernel(energy) : Chosen().pick(recipe, energy);
}
const char* PairKernelIsa() { return Chosen().name; }

}  // namespace grouser::dem

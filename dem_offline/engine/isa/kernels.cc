#include "dem_offline/engine/isa/kernels.h"

#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace grouser::dem {

namespace isa_baseline {
Kernels All(int combination, bool energy);
}
namespace isa_avx2 {
Kernels All(int combination, bool energy);
}
namespace isa_avx512 {
Kernels All(int combination, bool energy);
}
PairKernelFn GenericPairKernel(bool energy);

namespace {

using PickFn = Kernels (*)(int, bool);

bool HasAvx2() { return __builtin_cpu_supports("avx2") != 0; }
bool HasAvx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

PickFn PickFor(const char* isa) {
  if (std::strcmp(isa, "avx512") == 0) return HasAvx512() ? isa_avx512::All : nullptr;
  if (std::strcmp(isa, "avx2") == 0) return HasAvx2() ? isa_avx2::All : nullptr;
  if (std::strcmp(isa, "baseline") == 0) return isa_baseline::All;
  return nullptr;
}

const char* Best() {
  const char* wish = std::getenv("GROUSER_ISA");
  for (const char* isa : {"avx512", "avx2"}) {
    if (wish && std::strcmp(wish, "avx512") != 0 && std::strcmp(wish, isa) != 0) continue;
    if (PickFor(isa)) return isa;
  }
  return "baseline";
}

}  // namespace

const char* BestIsa() {
  static const char* const best = Best();
  return best;
}

Kernels KernelsFor(const char* isa, int combination, bool energy) {
  static const PickFn best = PickFor(BestIsa());  // a step asks twice
  const PickFn pick = isa ? PickFor(isa) : best;
  if (!pick) return {};
  Kernels out = pick(combination < 0 ? 0 : combination, energy);
  if (combination < 0) out.pairs = GenericPairKernel(energy);
  return out;
}

}  // namespace grouser::dem

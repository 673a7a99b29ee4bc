#include "dem_offline/engine/contact/pair_kernel.h"

#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace grouser::dem {

namespace isa_baseline { void PairForces(const PairView&); }
namespace isa_avx2 { void PairForces(const PairView&); }
namespace isa_avx512 { void PairForces(const PairView&); }

namespace {

struct Choice {
  const char* name;
  PairKernelFn fn;
};

bool HasAvx2() { return __builtin_cpu_supports("avx2") != 0; }
bool HasAvx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

Choice Best() {
  const char* wish = std::getenv("GROUSER_ISA");
  for (const char* isa : {"avx512", "avx2", "baseline"}) {
    if (wish && std::strcmp(wish, "avx512") != 0 && std::strcmp(wish, isa) != 0 &&
        std::strcmp(isa, "baseline") != 0) {
      continue;
    }
    if (PairKernelFn fn = PairKernelFor(isa)) return {isa, fn};
  }
  return {"baseline", isa_baseline::PairForces};
}

const Choice& Chosen() {
  static const Choice choice = Best();
  return choice;
}

}  // namespace

PairKernelFn PairKernelFor(const char* isa) {
  if (std::strcmp(isa, "avx512") == 0) return HasAvx512() ? isa_avx512::PairForces : nullptr;
  if (std::strcmp(isa, "avx2") == 0) return HasAvx2() ? isa_avx2::PairForces : nullptr;
  if (std::strcmp(isa, "baseline") == 0) return isa_baseline::PairForces;
  return nullptr;
}

void PairForces(const PairView& view) { Chosen().fn(view); }
const char* PairKernelIsa() { return Chosen().name; }

}  // namespace grouser::dem

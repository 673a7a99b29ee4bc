#include "surrogate/models/response_isa.h"

#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace grouser::surrogate::response {

namespace isa_baseline {
void Evaluate(const Constants& constants, Block* block);
}
#if defined(__x86_64__)
namespace isa_avx2 {
void Evaluate(const Constants& constants, Block* block);
}
namespace isa_avx512 {
void Evaluate(const Constants& constants, Block* block);
}
#endif

namespace {

BlockFn Find(const char* isa) {
#if defined(__x86_64__)
  if (std::strcmp(isa, "avx512") == 0) {
    const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                     __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
    return has ? isa_avx512::Evaluate : nullptr;
  }
  if (std::strcmp(isa, "avx2") == 0) {
    return __builtin_cpu_supports("avx2") ? isa_avx2::Evaluate : nullptr;
  }
#endif
  return std::strcmp(isa, "baseline") == 0 ? isa_baseline::Evaluate : nullptr;
}

const char* Best() {
  const char* wish = std::getenv("GROUSER_ISA");
  for (const char* isa : {"avx512", "avx2"}) {
    if (wish && std::strcmp(wish, "avx512") != 0 && std::strcmp(wish, isa) != 0) continue;
    if (Find(isa)) return isa;
  }
  return "baseline";
}

}  // namespace

const char* BestIsa() noexcept {
  static const char* const best = Best();
  return best;
}

BlockFn KernelFor(const char* isa) noexcept { return Find(isa ? isa : BestIsa()); }

}  // namespace grouser::surrogate::response

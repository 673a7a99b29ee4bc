#include "surrogate/models/isa.h"

#include <cstdlib>
#include <cstring>
#include <initializer_list>

#ifdef GROUSER_WIDE_KERNELS
#define GROUSER_EACH_ISA(DECLARE) \
  DECLARE(isa_baseline)           \
  DECLARE(isa_avx2)               \
  DECLARE(isa_avx512)
#define GROUSER_KERNELS(name) \
  { isa_baseline::name, isa_avx2::name, isa_avx512::name }
#else
#define GROUSER_EACH_ISA(DECLARE) DECLARE(isa_baseline)
#define GROUSER_KERNELS(name) \
  { isa_baseline::name, nullptr, nullptr }
#endif

namespace grouser::surrogate {
namespace {

int PlaceOf(const char* isa) {
  return std::strcmp(isa, "avx512") == 0 ? 2 : std::strcmp(isa, "avx2") == 0 ? 1 : 0;
}

bool HasIsa(const char* isa) {
#ifdef GROUSER_WIDE_KERNELS
  if (std::strcmp(isa, "avx512") == 0) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  }
  if (std::strcmp(isa, "avx2") == 0) return __builtin_cpu_supports("avx2");
#endif
  return std::strcmp(isa, "baseline") == 0;
}

const char* Best() {
  const char* wish = std::getenv("GROUSER_ISA");
  for (const char* isa : {"avx512", "avx2"}) {
    if (wish && PlaceOf(wish) < PlaceOf(isa)) continue;
    if (HasIsa(isa)) return isa;
  }
  return "baseline";
}

template <class Kernel>
Kernel Pick(const char* isa, const Kernel (&kernels)[3]) {
  const int place = IsaPlace(isa);
  return place >= 0 ? kernels[place] : nullptr;
}

}  // namespace

const char* BestIsa() noexcept {
  static const char* const best = Best();
  return best;
}

int IsaPlace(const char* isa) noexcept {
  if (isa == nullptr) isa = BestIsa();
  return HasIsa(isa) ? PlaceOf(isa) : -1;
}

namespace bekker {
#define GROUSER_DECLARE(isa)                                                              \
  namespace isa {                                                                         \
  void SolveBlock(const BekkerLaw<double>& law, const BekkerRules& rules, bool gradients, \
                  int count, StateBlock* block) noexcept;                                 \
  }
GROUSER_EACH_ISA(GROUSER_DECLARE)
#undef GROUSER_DECLARE
constexpr BlockSolver kSolvers[3] = GROUSER_KERNELS(SolveBlock);
}  // namespace bekker

BlockSolver BlockSolverFor(const char* isa) noexcept { return Pick(isa, bekker::kSolvers); }

namespace response {
#define GROUSER_DECLARE(isa)                               \
  namespace isa {                                          \
  void Evaluate(const Constants& constants, Block* block); \
  }
GROUSER_EACH_ISA(GROUSER_DECLARE)
#undef GROUSER_DECLARE
constexpr BlockFn kKernels[3] = GROUSER_KERNELS(Evaluate);
}  // namespace response

response::BlockFn KernelFor(const char* isa) noexcept { return Pick(isa, response::kKernels); }

namespace hard {
#define GROUSER_DECLARE(isa)                                  \
  namespace isa {                                             \
  void Evaluate(const Law& law, const Block& block) noexcept; \
  }
GROUSER_EACH_ISA(GROUSER_DECLARE)
#undef GROUSER_DECLARE
constexpr BlockFn kKernels[3] = GROUSER_KERNELS(Evaluate);
}  // namespace hard

hard::BlockFn HardGroundKernelFor(const char* isa) noexcept { return Pick(isa, hard::kKernels); }

namespace draws {
#define GROUSER_DECLARE(isa)                                                  \
  namespace isa {                                                             \
  void Evaluate(const Frequencies& frequencies, const Block& block) noexcept; \
  }
GROUSER_EACH_ISA(GROUSER_DECLARE)
#undef GROUSER_DECLARE
constexpr BlockFn kKernels[3] = GROUSER_KERNELS(Evaluate);
}  // namespace draws

draws::BlockFn DrawKernelFor(const char* isa) noexcept { return Pick(isa, draws::kKernels); }

}  // namespace grouser::surrogate

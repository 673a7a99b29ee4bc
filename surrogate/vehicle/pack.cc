#include "surrogate/vehicle/pack.h"

#include "surrogate/models/isa.h"

namespace grouser::vehicle::pack {

namespace isa_baseline {
extern const Kernel kKernel;
}
#ifdef GROUSER_WIDE_KERNELS
namespace isa_avx2 {
extern const Kernel kKernel;
}
namespace isa_avx512 {
extern const Kernel kKernel;
}
#endif

const Kernel* KernelFor(const char* isa) noexcept {
  switch (surrogate::IsaPlace(isa)) {
    case 0:
      return &isa_baseline::kKernel;
#ifdef GROUSER_WIDE_KERNELS
    case 1:
      return &isa_avx2::kKernel;
    case 2:
      return &isa_avx512::kKernel;
#endif
    default:
      return nullptr;
  }
}

}  // namespace grouser::vehicle::pack

// A block of states by packs of GROUSER_LANES: included once per instruction set.
#include "surrogate/models/bekker_balance.h"

namespace grouser::surrogate::bekker::GROUSER_ISA_NS {

typedef double Pack __attribute__((vector_size(GROUSER_LANES * sizeof(double))));

void SolveBlock(const BekkerLaw<double>& law, const BekkerRules& rules, bool gradients,
                StateBlock* block) noexcept {
  for (int at = 0; at < kStateBlock; at += GROUSER_LANES) {
    if (gradients) {
      SolveLanes<Pack, true>(law, rules, block, at);
    } else {
      SolveLanes<Pack, false>(law, rules, block, at);
    }
  }
}

}  // namespace grouser::surrogate::bekker::GROUSER_ISA_NS

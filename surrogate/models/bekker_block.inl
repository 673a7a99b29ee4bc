// A block of states by packs of GROUSER_LANES: included once per instruction set.
#include "surrogate/models/bekker_balance.h"

namespace grouser::surrogate::bekker::GROUSER_ISA_NS {

typedef double Pack __attribute__((vector_size(GROUSER_LANES * sizeof(double))));

void SolveBlock(const BekkerLaw<double>& law, const BekkerRules& rules, bool gradients, int count,
                StateBlock* block) noexcept {
  SolveStates<Pack>(law, rules, gradients, count, block);
}

}  // namespace grouser::surrogate::bekker::GROUSER_ISA_NS

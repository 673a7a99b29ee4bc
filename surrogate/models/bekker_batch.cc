#include "surrogate/models/bekker_batch.h"

#include <cmath>
#include <limits>

#include "surrogate/models/bekker.h"
#include "surrogate/models/isa.h"

namespace grouser::surrogate {

namespace {

bool Usable(const BekkerBatch& batch, std::size_t i) {
  return std::isfinite(batch.v_x[i]) && std::isfinite(batch.v_y[i]) &&
         std::isfinite(batch.rim_speed[i]) && std::isfinite(batch.load[i]) && batch.load[i] > 0;
}

// Unusable states get a harmless one.
void Pack(const BekkerBatch& batch, std::size_t first, int count, StateBlock* block) {
  for (int l = 0; l < count; ++l) {
    const bool usable = Usable(batch, first + l);
    block->v_x[l] = usable ? batch.v_x[first + l] : 1;
    block->v_y[l] = usable ? batch.v_y[first + l] : 0;
    block->rim_speed[l] = usable ? batch.rim_speed[first + l] : 1;
    block->load[l] = usable ? batch.load[first + l] : 1;
  }
}

void Unpack(const StateBlock& block, std::size_t first, int count, const BekkerBatch& batch) {
  const auto copy = [&](const std::span<double>& to, const double* from) {
    if (to.empty()) return;
    for (int l = 0; l < count; ++l) to[first + l] = from[l];
  };
  for (int o = 0; o < kOutputs; ++o) {
    copy(batch.value[o], block.value[o]);
    for (int i = 0; i < kInputs; ++i) copy(batch.gradient[o][i], block.gradient[o][i]);
  }
  for (int l = 0; l < count; ++l) {
    if (!batch.no_equilibrium.empty()) batch.no_equilibrium[first + l] = block.overload[l] != 0;
    if (Usable(batch, first + l)) continue;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    for (int o = 0; o < kOutputs; ++o) {
      if (!batch.value[o].empty()) batch.value[o][first + l] = kNaN;
      for (const std::span<double>& g : batch.gradient[o]) {
        if (!g.empty()) g[first + l] = kNaN;
      }
    }
  }
}

}  // namespace

void BekkerModel::SolveBatch(const BekkerBatch& batch, BlockSolver solver) const noexcept {
  bool gradients = false;
  for (const auto& of_output : batch.gradient) {
    for (const std::span<double>& g : of_output) gradients |= !g.empty();
  }
  const BlockSolver solve = solver ? solver : BlockSolverFor(nullptr);
  const BekkerRules& rules = RulesOfBekker();
  StateBlock block;
  const std::size_t n = batch.load.size();
  for (std::size_t first = 0; first < n; first += kStateBlock) {
    const int count = n - first < kStateBlock ? static_cast<int>(n - first) : kStateBlock;
    Pack(batch, first, count, &block);
    solve(law_, rules, gradients, count, &block);
    Unpack(block, first, count, batch);
  }
}

}  // namespace grouser::surrogate

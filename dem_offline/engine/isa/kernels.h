#pragma once

#include "dem_offline/engine/contact/pair_kernel.h"
#include "dem_offline/engine/core/drift_kernel.h"

namespace grouser::dem {

/// The kernels of one instruction set: one source, compiled once for each.
struct Kernels {
  PairKernelFn pairs = nullptr;
  SumKernelFn sum = nullptr;
  DriftKernelFn drift = nullptr;
};

/// For a compiled law combination, which reads the parameters of material pair
/// (0, 0) only, or -1: the generic path. `isa`: "avx512", "avx2", "baseline";
/// null: the best of this machine, which GROUSER_ISA in the environment can
/// lower (tests). All null where this machine lacks the set.
Kernels KernelsFor(const char* isa, int combination, bool energy);

/// What KernelsFor(nullptr, ...) takes.
const char* BestIsa();

}  // namespace grouser::dem

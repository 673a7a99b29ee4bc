#pragma once

#include "surrogate/models/response_kernel.h"

namespace grouser::surrogate::response {

/// The kernel of an instruction set: "avx512", "avx2" or "baseline"; null where
/// this machine lacks it. `isa` null: the best one, which GROUSER_ISA in the
/// environment can lower (tests).
BlockFn KernelFor(const char* isa) noexcept;

/// What KernelFor(nullptr) takes.
const char* BestIsa() noexcept;

}  // namespace grouser::surrogate::response

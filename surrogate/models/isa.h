#pragma once

#include "surrogate/models/bekker_lanes.h"
#include "surrogate/models/draw_field_kernel.h"
#include "surrogate/models/hard_ground_kernel.h"
#include "surrogate/models/response_kernel.h"

/// Under ASan the baseline, the same source, alone: watching the wide ones takes g++ ten times as
/// long.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define GROUSER_WIDE_KERNELS 1
#endif

/// Kernels that are compiled once for each instruction set: "avx512" (F, DQ, BW, VL),
/// "avx2" and "baseline". All sets give the same bits.
namespace grouser::surrogate {

/// The widest set of this machine, which GROUSER_ISA in the environment can lower (tests).
const char* BestIsa() noexcept;

/// Place of a set, baseline first; -1: this machine lacks it. `isa` null: BestIsa.
int IsaPlace(const char* isa) noexcept;

/// The kernel of a set, null where this machine lacks it; `isa` null: BestIsa.
BlockSolver BlockSolverFor(const char* isa) noexcept;
response::BlockFn KernelFor(const char* isa) noexcept;
hard::BlockFn HardGroundKernelFor(const char* isa) noexcept;
draws::BlockFn DrawKernelFor(const char* isa) noexcept;

}  // namespace grouser::surrogate

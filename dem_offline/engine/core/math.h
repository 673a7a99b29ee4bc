#pragma once

#include <cstdint>

#include "dem_offline/engine/core/vec3.h"

// Functions that libm would round differently from machine to machine, built
// from + - x / sqrt alone: the same bits on every instruction set and device.

namespace grouser::dem {

/// Cube root of x >= 0; relative error under 3e-7 over the normal floats
/// (zero for zero). Start from the exponent (Kahan), then three Newton steps.
GROUSER_HD float Cbrt(float x) {
  std::uint32_t bits;
  const float safe = Max(x, 1e-37f);
  __builtin_memcpy(&bits, &safe, 4);
  bits = bits / 3u + 709921077u;
  float y;
  __builtin_memcpy(&y, &bits, 4);
  for (int i = 0; i < 3; ++i) y = (2.0f * y + safe / (y * y)) * (1.0f / 3.0f);
  return x > 1e-37f ? y : 0.0f;
}

}  // namespace grouser::dem

#pragma once

#include <numbers>

#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

inline constexpr double kPi = std::numbers::pi;
inline constexpr WheelGeometry kWheel{0.0625, 0.05};

}  // namespace grouser::surrogate

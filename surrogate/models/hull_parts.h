#pragma once

#include <cstdint>

#include "surrogate/models/hull.h"

namespace grouser::surrogate {

/// What Hull::Outside looks at: the faces of the box that a state can be beyond, bits.
enum HullFace : std::uint32_t {
  kBelowSlip = 1,
  kAboveSlip = 2,
  /// Counter-rotation with the rim the faster: it shares its slip with a state where the hub is.
  kOtherSheet = 4,
  kAboveAngle = 8,
  kBelowLoad = 16,
  kAboveLoad = 32,
};
/// 0: inside.
std::uint32_t FacesBeyond(const TrainingDomain& box, const Canonical& state, double load) noexcept;

/// The terms of Hull::Excess by axis, hull distances.
struct ExcessParts {
  double slip, lateral, load, speed;
  double Sum() const noexcept { return slip + lateral + load + speed; }
};
/// fastest: Hull::Fastest.
ExcessParts ExcessOf(const TrainingDomain& box, const Canonical& state, double load,
                     double fastest) noexcept;

}  // namespace grouser::surrogate

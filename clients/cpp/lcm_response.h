#pragma once

#include <cstdint>
#include <span>

#include "grouser_lcm/wheel_measured_t.hpp"
#include "grouser_lcm/wheel_response_t.hpp"

namespace grouser::client {

/// Decodes one encoded wheel_response_t. False, and `out` unchanged, for bytes
/// that are none, and for one whose arrays are not all of the length `n`. Any
/// bytes are safe: every length is checked before lcm-gen's decoder trusts it.
bool DecodeResponse(std::span<const std::uint8_t> encoded, grouser_lcm::wheel_response_t* out);
/// The same of a wheel_measured_t, whose outputs have `n` entries or none.
bool DecodeMeasured(std::span<const std::uint8_t> encoded, grouser_lcm::wheel_measured_t* out);

}  // namespace grouser::client

#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace grouser::campaign {

/// States for a campaign file, to be written into it and so fixed before any run.
struct DrawRequest {
  bool sobol = false;  ///< else independent, by a 64-bit Mersenne twister
  int states = 60;
  std::uint64_t seed = 1;  ///< of the twister; of Sobol's sequence: points passed over
  std::array<double, 2> slip = {-1, 0.95}, angle_deg = {0, 90}, load_n = {8, 30};
  std::array<double, 2> speed = {0, 0};         ///< [m/s], even in its logarithm; 0: the rig's
  std::array<std::uint64_t, 2> tiles = {1, 1};  ///< seeds, taken in turn
};

/// List entries of extra or held_out, one a line. States that no motion has (slip
/// below -1 - cos of the angle) are left out of a Sobol draw and drawn again
/// otherwise. Equal requests give equal text. Throws InputError for empty ranges.
std::string DrawStates(const DrawRequest& request);

}  // namespace grouser::campaign

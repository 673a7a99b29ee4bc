#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Chosen states side by side, at most kBlock, and room for their answers.
template <std::size_t kBlock>
struct GatheredStates {
  std::array<std::array<double, kBlock>, 7> in;
  std::array<std::uint32_t, kBlock> pass, flags;
  std::array<std::array<std::array<double, kBlock>, kParts>, kOutputs> part;
  std::array<double, kBlock> slip, attack_angle;

  WheelStatesView Take(const WheelStatesView& from, const std::uint32_t* which, std::size_t m) {
    const std::span<const double> axes[] = {from.v_x,     from.v_y,         from.rim_speed,
                                            from.load,    from.slope_pitch, from.slope_roll,
                                            from.yaw_rate};
    std::array<std::span<const double>, 7> to;
    for (std::size_t a = 0; a < to.size(); ++a) {
      if (axes[a].empty()) continue;
      for (std::size_t i = 0; i < m; ++i) in[a][i] = axes[a][which[i]];
      to[a] = {in[a].data(), m};
    }
    std::span<const std::uint32_t> passes;
    if (!from.pass_number.empty()) {
      for (std::size_t i = 0; i < m; ++i) pass[i] = from.pass_number[which[i]];
      passes = {pass.data(), m};
    }
    return {to[0], to[1], to[2], to[3], to[4], to[5], to[6], passes};
  }
  /// The parts that `wanted` has, and the intervals.
  ResponsesView Room(const ResponsesView& wanted, std::size_t m) {
    ResponsesView view;
    for (int o = 0; o < kOutputs; ++o) {
      for (int p = 0; p < kParts; ++p) {
        const bool interval = p == kLow || p == kHigh;
        if ((wanted.output[o].*kPartMembers[p]).empty() && !interval) continue;
        view.output[o].*kPartMembers[p] = {part[o][p].data(), m};
      }
    }
    view.flags = {flags.data(), m};
    if (!wanted.slip.empty()) view.slip = {slip.data(), m};
    if (!wanted.attack_angle.empty()) view.attack_angle = {attack_angle.data(), m};
    return view;
  }
};

/// Answer i of `from` to place j of what `to` has.
inline void CopyAnswer(const ResponsesView& from, std::size_t i, const ResponsesView& to,
                       std::size_t j) {
  for (int o = 0; o < kOutputs; ++o) {
    for (const auto part : kPartMembers) {
      const std::span<double> target = to.output[o].*part;
      if (!target.empty()) target[j] = (from.output[o].*part)[i];
    }
  }
  to.flags[j] = from.flags[i];
  if (!to.slip.empty()) to.slip[j] = from.slip[i];
  if (!to.attack_angle.empty()) to.attack_angle[j] = from.attack_angle[i];
}

}  // namespace grouser::surrogate

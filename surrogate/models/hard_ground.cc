#include "surrogate/models/hard_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "surrogate/models/isa.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using G = HardGround;
constexpr HardGroundField kFields[] = {
    {"friction", &G::friction, false, true, "Coulomb's mu"},
    {"slip_stiffness", &G::slip_stiffness, false, true, "force over load and slip at slip 0"},
    {"rolling_resistance", &G::rolling_resistance, true, true, "force over load"},
    {"contact_length_m", &G::contact_length_m, false, true,
     "of the contact patch, along the wheel"},
    {"contact_width_m", &G::contact_width_m, false, true, "across"},
    {"friction_sd", &G::friction_sd, true, false, "standard deviation of mu (0)"},
    {"slip_stiffness_sd", &G::slip_stiffness_sd, true, false, "(0)"},
    {"rolling_resistance_sd", &G::rolling_resistance_sd, true, false, "(0)"},
};

void Check(const char* field, double value, bool zero_allowed) {
  if (std::isfinite(value) && (value > 0 || (zero_allowed && value == 0))) return;
  throw std::invalid_argument(std::string("hard: ") + field + ": got " + std::to_string(value) +
                              ", expected a finite number " +
                              (zero_allowed ? "from 0 on" : "above 0"));
}

// Mean distance of the points of a rectangle with half sides a and b from its middle.
double MeanRadius(double a, double b) {
  const double d = std::hypot(a, b);
  return (d + b * b / (2 * a) * std::log((a + d) / b) + a * a / (2 * b) * std::log((b + d) / a)) /
         3;
}

void Put(std::span<double> to, std::size_t i, double value) {
  if (!to.empty()) to[i] = value;
}

}  // namespace

std::span<const HardGroundField> HardGroundFields() noexcept { return kFields; }

HardGroundModel::HardGroundModel(const HardGround& ground, double radius_m, std::uint32_t flags)
    : ground_(ground), radius_m_(radius_m), kernel_(HardGroundKernelFor(nullptr)), flags_(flags) {
  for (const HardGroundField& f : kFields) Check(f.name, ground.*f.member, f.zero_allowed);
  Check("radius_m", radius_m, false);
  law_ = {.friction = ground.friction,
          .stiffness = ground.slip_stiffness / (3 * ground.friction),
          .radius = radius_m,
          .scrub_radius = MeanRadius(ground.contact_length_m / 2, ground.contact_width_m / 2),
          .half_length = ground.contact_length_m / 2,
          .resistance = ground.rolling_resistance,
          .friction_sd = ground.friction_sd,
          .grip_sd = ground.friction / ground.slip_stiffness * ground.slip_stiffness_sd,
          .resistance_sd = ground.rolling_resistance_sd};
}

bool HardGroundModel::SelectIsa(const char* isa) noexcept {
  const hard::BlockFn found = HardGroundKernelFor(isa);
  if (found == nullptr) return false;
  kernel_ = found;
  return true;
}

void HardGroundModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  const std::size_t n = in.load.size(), whole = n / hard::kGroup * hard::kGroup;
  if (whole > 0) Fill(in, out, 0, whole);
  if (whole < n) Fill(in, out, whole, n - whole);
  for (std::size_t i = 0; i < n; ++i) Finish(in, out, i);
}

// By the kernel: whole groups in place, fewer states than a group through a padded copy.
// Precondition: count > 0.
void HardGroundModel::Fill(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
                           std::size_t count) const noexcept {
  double input[5][hard::kGroup], output[kOutputs][kParts][hard::kGroup];
  const bool padded = count < hard::kGroup;
  const auto from = [&](int k, std::span<const double> values) -> const double* {
    if (values.empty()) return nullptr;
    if (!padded) return values.data() + first;
    for (std::size_t i = 0; i < hard::kGroup; ++i) {
      input[k][i] = values[first + std::min(i, count - 1)];
    }
    return input[k];
  };
  hard::Block block{.count = padded ? hard::kGroup : static_cast<int>(count),
                    .v_x = from(0, in.v_x),
                    .v_y = from(1, in.v_y),
                    .rim = from(2, in.rim_speed),
                    .load = from(3, in.load),
                    .yaw = from(4, in.yaw_rate),
                    .part = {}};
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      const std::span<double> to = out.output[o].*kPartMembers[p];
      if (!to.empty()) block.part[o][p] = padded ? output[o][p] : to.data() + first;
    }
  }
  kernel_(law_, block);
  for (int o = 0; padded && o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      if (block.part[o][p] == nullptr) continue;
      std::copy_n(output[o][p], count, (out.output[o].*kPartMembers[p]).data() + first);
    }
  }
}

// Flags and echo; the answers to what the kernel does not know.
void HardGroundModel::Finish(const WheelStatesView& in, const ResponsesView& out,
                             std::size_t i) const noexcept {
  const double v_x = in.v_x[i], v_y = in.v_y[i], rim = in.rim_speed[i], load = in.load[i];
  const double yaw = in.yaw_rate.empty() ? 0 : in.yaw_rate[i], hub2 = v_x * v_x + v_y * v_y;
  if (!out.slip.empty() || !out.attack_angle.empty()) {
    const SlipState echo = ToSlip(v_x, v_y, rim);
    Put(out.slip, i, echo.slip);
    Put(out.attack_angle, i, echo.attack_angle_rad);
  }
  if (!std::isfinite(hub2) || !std::isfinite(rim) || !std::isfinite(yaw) || !(load >= 0) ||
      !std::isfinite(load)) {
    out.flags[i] = kInvalid;
    for (const OutputView& o : out.output) {
      for (const auto part : kPartMembers) Put(o.*part, i, kNaN);
    }
    return;
  }
  if (load == 0) {
    WriteAirborne(out, i);
    return;
  }
  out.flags[i] = flags_ | (hub2 == 0 && rim == 0 && yaw == 0 ? kStatic : 0u);
}

}  // namespace grouser::surrogate

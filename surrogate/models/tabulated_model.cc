#include "surrogate/models/tabulated_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "surrogate/models/isa.h"

namespace grouser::surrogate {
namespace {

using response::kBlock;
using response::kGroup;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double At(std::span<const double> values, std::size_t i, double otherwise) {
  return values.empty() ? otherwise : values[i];
}

void Put(std::span<double> to, std::size_t i, double value) {
  if (!to.empty()) to[i] = value;
}

bool WantsGradients(const ResponsesView& out) {
  for (const OutputView& o : out.output) {
    for (int p = kDvX; p <= kDLoad; ++p) {
      if (!(o.*kPartMembers[p]).empty()) return true;
    }
  }
  return false;
}

bool HasContext(const WheelStatesView& in) {
  return !in.slope_pitch.empty() || !in.slope_roll.empty() || !in.yaw_rate.empty() ||
         !in.pass_number.empty();
}

// Flags of what was given beyond kinematics and load; kInvalid if unusable.
std::uint32_t ContextFlags(const WheelStatesView& in, std::size_t i) {
  const double pitch = At(in.slope_pitch, i, 0), roll = At(in.slope_roll, i, 0);
  const double yaw = At(in.yaw_rate, i, 0);
  if (!std::isfinite(pitch) || !std::isfinite(roll) || !std::isfinite(yaw)) return kInvalid;
  std::uint32_t flags = 0;
  if (pitch != 0 || roll != 0) flags |= kSlope;
  if (yaw != 0) flags |= kClamped;
  if (!in.pass_number.empty() && in.pass_number[i] > 1) flags |= kVirginAssumed;
  return flags;
}

bool Usable(const WheelStatesView& in, std::size_t i) {
  return std::isfinite(in.rim_speed[i]) && std::isfinite(std::hypot(in.v_x[i], in.v_y[i])) &&
         in.load[i] >= 0 && std::isfinite(in.load[i]);
}

// In every part.
void WriteNaN(const ResponsesView& out, std::size_t i) {
  for (const OutputView& o : out.output) {
    for (const auto part : kPartMembers) Put(o.*part, i, kNaN);
  }
}

// Where the kinematics allow one.
void WriteEcho(const WheelStatesView& in, const ResponsesView& out, std::size_t i) {
  const bool finite = std::isfinite(in.rim_speed[i]) && std::isfinite(in.load[i]) &&
                      std::isfinite(std::hypot(in.v_x[i], in.v_y[i]));
  SlipState slip{kNaN, kNaN, false};
  if (finite) slip = ToSlip(in.v_x[i], in.v_y[i], in.rim_speed[i]);
  Put(out.slip, i, slip.slip);
  Put(out.attack_angle, i, slip.attack_angle_rad);
}

}  // namespace

TabulatedModel::TabulatedModel(const Hull& hull, double radius_m)
    : hull_(hull), kernel_(KernelFor(nullptr)), solver_(BlockSolverFor(nullptr)) {
  constants_.radius = radius_m;
}

bool TabulatedModel::SelectIsa(const char* isa) noexcept {
  const response::BlockFn found = KernelFor(isa);
  if (found == nullptr) return false;
  kernel_ = found;
  solver_ = BlockSolverFor(isa);
  return true;
}

void TabulatedModel::SetTable(ResponseTable table, bool blended) {
  table_ = std::make_shared<const ResponseTable>(std::move(table));
  constants_ = table_->Describe(hull_, constants_.radius);
  blended_ = blended;
  if (!blended) return;
  const TableAxes& axes = table_->axes();
  const double step = (axes.log_load_max - axes.log_load_min) / axes.load;
  constants_.lowest_load = std::exp(axes.log_load_min);
  constants_.highest_load = std::exp(axes.log_load_max);
  constants_.blend_low = std::exp(axes.log_load_min + step);
  constants_.blend_high = std::exp(axes.log_load_max - step);
}

// What the scalar law has of the answer: 0 to 1 over the last interval.
double TabulatedModel::ShareBeyond(double load) const noexcept {
  if (!table_) return 1;
  if (!blended_) return 0;
  const TableAxes& axes = table_->axes();
  const double step = (axes.log_load_max - axes.log_load_min) / axes.load;
  const double log_load = std::log(load);
  const double inside = std::min(log_load - axes.log_load_min, axes.log_load_max - log_load) / step;
  const double t = std::clamp(inside, 0.0, 1.0);
  return 1 - t * t * (3 - 2 * t);
}

void TabulatedModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  const std::size_t n = in.load.size();
  if (!table_) {
    for (std::size_t i = 0; i < n; ++i) Complete(in, out, i, response::kOff);
    return;
  }
  const std::size_t whole = n / kGroup * kGroup;
  for (std::size_t first = 0; first < whole; first += kBlock) {
    const std::size_t left = std::min<std::size_t>(whole - first, kBlock);
    EvaluateSome(in, out, first, static_cast<int>(left));
  }
  if (whole < n) EvaluateRest(in, out, whole, n - whole);
}

void TabulatedModel::EvaluateSome(const WheelStatesView& in, const ResponsesView& out,
                                  std::size_t first, int count) const noexcept {
  response::Block block;
  block.count = count;
  block.gradients = WantsGradients(out);
  block.v_x = in.v_x.data() + first;
  block.v_y = in.v_y.data() + first;
  block.rim = in.rim_speed.data() + first;
  block.load = in.load.data() + first;
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      const std::span<double> to = out.output[o].*kPartMembers[p];
      block.part[o][p] = to.empty() ? nullptr : to.data() + first;
    }
  }
  block.flags = out.flags.data() + first;
  block.slip = out.slip.empty() ? nullptr : out.slip.data() + first;
  block.attack_angle = out.attack_angle.empty() ? nullptr : out.attack_angle.data() + first;
  kernel_(constants_, &block);
  const bool context = HasContext(in);
  std::uint32_t any = 0;
  for (int i = 0; i < count; ++i) any |= block.special[i];
  if (any == 0 && !context) return;
  for (int i = 0; i < count; ++i) {
    if (block.special[i] != 0 || context) Complete(in, out, first + i, block.special[i]);
  }
}

// Fewer states than a group: through a padded copy, by the same kernel.
void TabulatedModel::EvaluateRest(const WheelStatesView& in, const ResponsesView& out,
                                  std::size_t first, std::size_t count) const noexcept {
  double input[4][kGroup], output[kOutputs][kParts][kGroup], echo[2][kGroup];
  std::uint32_t flags[kGroup];
  const std::span<const double> from[4] = {in.v_x, in.v_y, in.rim_speed, in.load};
  for (int k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < kGroup; ++i) {
      input[k][i] = from[k][first + std::min(i, count - 1)];
    }
  }
  response::Block block;
  block.count = static_cast<int>(count);
  block.gradients = WantsGradients(out);
  block.v_x = input[0];
  block.v_y = input[1];
  block.rim = input[2];
  block.load = input[3];
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      block.part[o][p] = (out.output[o].*kPartMembers[p]).empty() ? nullptr : output[o][p];
    }
  }
  block.flags = flags;
  block.slip = out.slip.empty() ? nullptr : echo[0];
  block.attack_angle = out.attack_angle.empty() ? nullptr : echo[1];
  kernel_(constants_, &block);
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      if (!block.part[o][p]) continue;
      std::copy_n(output[o][p], count, (out.output[o].*kPartMembers[p]).data() + first);
    }
  }
  if (block.slip) std::copy_n(echo[0], count, out.slip.data() + first);
  if (block.attack_angle) std::copy_n(echo[1], count, out.attack_angle.data() + first);
  std::copy_n(flags, count, out.flags.data() + first);
  const bool context = HasContext(in);
  for (std::size_t i = 0; i < count; ++i) {
    if (block.special[i] != 0 || context) Complete(in, out, first + i, block.special[i]);
  }
}

void TabulatedModel::Complete(const WheelStatesView& in, const ResponsesView& out, std::size_t i,
                              std::uint32_t special) const noexcept {
  if (special & response::kOff) WriteEcho(in, out, i);
  const std::uint32_t context = ContextFlags(in, i);
  if (!Usable(in, i) || (context & kInvalid) != 0) {
    out.flags[i] = kInvalid;
    WriteNaN(out, i);
    return;
  }
  if (in.load[i] == 0) {
    WriteAirborne(out, i);
    return;
  }
  if (special & response::kOff) {
    AnswerOff(in, out, i, 1);
  } else {
    const double share = special & response::kBlend ? ShareBeyond(in.load[i]) : 0;
    if (share > 0) AnswerOff(in, out, i, share);
  }
  out.flags[i] |= context;
  if ((context & kNotAnswered) != 0) return WriteNaN(out, i);
  if (special != 0 && WantsGradients(out)) Difference(in, out, i);
}

// Mixes the scalar law's answer into what the table left; a share of 1 replaces.
void TabulatedModel::AnswerOff(const WheelStatesView& in, const ResponsesView& out, std::size_t i,
                               double share) const noexcept {
  const WheelAnswer answer = OffTable(in.v_x[i], in.v_y[i], in.rim_speed[i], in.load[i]);
  out.flags[i] = answer.flags;
  const auto mix = [&](std::span<double> to, double exact) {
    if (!to.empty()) to[i] = share == 1 ? exact : to[i] + share * (exact - to[i]);
  };
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& to = out.output[o];
    mix(to.value, answer.value[o]);
    mix(to.sd_fit, answer.sd_fit[o]);
    mix(to.sd_patch, answer.sd_patch[o]);
    mix(to.low, answer.value[o] - answer.half_width[o]);
    mix(to.high, answer.value[o] + answer.half_width[o]);
  }
}

// Central differences of what this class answers; see the class comment.
void TabulatedModel::Difference(const WheelStatesView& in, const ResponsesView& out,
                                std::size_t i) const noexcept {
  constexpr int kAxes = 4;
  constexpr double kStep = 1e-3;
  const double at[kAxes] = {in.v_x[i], in.v_y[i], in.rim_speed[i], in.load[i]};
  const double speed = std::max(std::fabs(at[2]), std::hypot(at[0], at[1]));
  double state[kAxes][2 * kAxes], value[kOutputs][2 * kAxes];
  std::uint32_t flags[2 * kAxes];
  double width[kAxes];
  for (int a = 0; a < kAxes; ++a) {
    const double step = kStep * (a == 3 ? at[3] : speed);
    for (int k = 0; k < kAxes; ++k) state[k][2 * a] = state[k][2 * a + 1] = at[k];
    state[a][2 * a] -= step;
    state[a][2 * a + 1] += step;
    width[a] = state[a][2 * a + 1] - state[a][2 * a];
  }
  ResponsesView view;
  view.flags = flags;
  for (int o = 0; o < kOutputs; ++o) view.output[o].value = value[o];
  TabulatedModel::Evaluate({state[0], state[1], state[2], state[3], {}, {}, {}, {}}, view);
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& to = out.output[o];
    const std::span<double> parts[kAxes] = {to.d_v_x, to.d_v_y, to.d_rim_speed, to.d_load};
    for (int a = 0; a < kAxes; ++a) {
      const double slope = (value[o][2 * a + 1] - value[o][2 * a]) / width[a];
      Put(parts[a], i, std::isfinite(slope) ? slope : 0);  // at rest the step is 0
    }
  }
}

WheelAnswer TabulatedModel::EvaluateOne(double v_x, double v_y, double rim_speed,
                                        double load) const noexcept {
  return AnswerOf(*this, {v_x, v_y, rim_speed}, load);
}

}  // namespace grouser::surrogate

#include "surrogate/models/form_error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kLockedRim = 1e-3;                       // of the hub's speed
constexpr double kLeastRim = 0.8 - 1e-3;                  // the same: braking by 0.2, and rounding
constexpr double kStraightTangent = 0.08748866352592401;  // tan(5 deg)
constexpr std::size_t kBlock = 128;                       // states that at a time

}  // namespace

MeasuredRegion MeasuredRegionAt(double v_x, double v_y, double rim_speed) noexcept {
  const bool backward = v_x < 0 || (v_x == 0 && rim_speed < 0);
  const double rim = backward ? -rim_speed : rim_speed;
  const double hub = std::hypot(v_x, v_y);
  if (std::fabs(rim) < kLockedRim * hub) return MeasuredRegion::kLocked;
  if (!(rim >= kLeastRim * hub)) return MeasuredRegion::kBraking;
  const bool straight = std::fabs(v_y) <= kStraightTangent * std::fabs(v_x) * (1 + 1e-9);
  return straight ? MeasuredRegion::kStraight : MeasuredRegion::kAngled;
}

FormView Cut(const FormView& to, std::size_t first, std::size_t count) noexcept {
  FormView cut;
  const auto part = [&](std::span<double> all) {
    return all.empty() ? all : all.subspan(first, count);
  };
  for (int o = 0; o < kOutputs; ++o) {
    const FormView::OfOutput& from = to.output[o];
    cut.output[o] = {part(from.sd), part(from.low), part(from.high)};
  }
  return cut;
}

FormErrors::FormErrors() {
  for (OfRegion& r : region) {
    r.sd.fill(kNaN);
    r.factor.fill(kNaN);
  }
}

bool FormErrors::OfRegion::KnowsAll() const noexcept {
  return std::ranges::none_of(kPredicted,
                              [this](Output o) { return std::isnan(sd[o] * factor[o]); });
}

bool FormErrors::KnowsAll() const noexcept {
  return std::ranges::all_of(region, [](const OfRegion& r) { return r.KnowsAll(); });
}

bool FormErrors::ClearsFlags() const noexcept {
  return std::ranges::any_of(region, &OfRegion::KnowsAll);
}

bool FormErrors::KnowsInterval(int output) const noexcept {
  return std::ranges::any_of(
      region, [&](const OfRegion& r) { return !std::isnan(r.sd[output] * r.factor[output]); });
}

double FormErrors::Sd(MeasuredRegion at, int output, double load) const noexcept {
  const double scale = output == kSinkage || middle_load_n == 0 ? 1 : load / middle_load_n;
  return scale * region[static_cast<std::size_t>(at)].sd[output];
}

double FormErrors::HalfWidth(MeasuredRegion at, int output, double load) const noexcept {
  return region[static_cast<std::size_t>(at)].factor[output] * Sd(at, output, load);
}

bool FormView::WantsIntervals() const noexcept {
  return std::ranges::any_of(output,
                             [](const OfOutput& o) { return !o.low.empty() || !o.high.empty(); });
}

bool FormView::WantsAny() const noexcept {
  return WantsIntervals() ||
         std::ranges::any_of(output, [](const OfOutput& o) { return !o.sd.empty(); });
}

namespace {

/// What a state is to sd_form: a MeasuredRegion, or one of these.
constexpr std::size_t kNothingKnown = kMeasuredRegions, kExactlyZero = kMeasuredRegions + 1;
constexpr std::size_t kCases = kMeasuredRegions + 2;

/// Sets or clears the flag.
std::size_t CaseOf(const std::array<bool, kMeasuredRegions>& knows_all, double v_x, double v_y,
                   double rim, std::uint32_t* flags) noexcept {
  if ((*flags & kInvalid) != 0) return kNothingKnown;
  if ((*flags & kAirborne) != 0) return kExactlyZero;
  *flags |= kFormUnknown;
  if ((*flags & kNotAnswered) != 0) return kNothingKnown;
  if (v_x == 0 && v_y == 0 && rim == 0) return kNothingKnown;
  const auto at = static_cast<std::size_t>(MeasuredRegionAt(v_x, v_y, rim));
  if (knows_all[at]) *flags &= ~std::uint32_t{kFormUnknown};
  return at;
}

/// Of numbers >= 0, and as quick as a root: std::hypot takes ten times as long. NaN of either: NaN.
double Hypot(double a, double b) noexcept {
  const double larger = a > b ? a : b, smaller = a > b ? b : a;  // a NaN is in one of them
  const double ratio = larger > 0 ? smaller / larger : smaller;  // squares of loads would overflow
  return larger * std::sqrt(1 + ratio * ratio);
}

/// Of one output, by case.
using ByCase = std::array<double, kCases>;
void WriteOutput(const ByCase& sd, const ByCase& half_width, const std::uint8_t* cases,
                 const double* scale, const OutputView& answered, const FormView::OfOutput& to,
                 std::size_t first, std::size_t count) noexcept {
  if (!to.sd.empty()) {
    double* out = to.sd.data() + first;
    for (std::size_t i = 0; i < count; ++i) out[i] = scale[i] * sd[cases[i]];
  }
  if (to.low.empty() && to.high.empty()) return;
  const double* low = answered.low.data() + first;
  const double* high = answered.high.data() + first;
  double middle[kBlock], half[kBlock];
  for (std::size_t i = 0; i < count; ++i) half[i] = scale[i] * half_width[cases[i]];
  for (std::size_t i = 0; i < count; ++i) {
    const double own = 0.5 * (high[i] - low[i]);
    middle[i] = 0.5 * (low[i] + high[i]);
    half[i] = Hypot(own, half[i]);
  }
  if (!to.low.empty()) {
    double* out = to.low.data() + first;
    for (std::size_t i = 0; i < count; ++i) out[i] = middle[i] - half[i];
  }
  if (!to.high.empty()) {
    double* out = to.high.data() + first;
    for (std::size_t i = 0; i < count; ++i) out[i] = middle[i] + half[i];
  }
}

/// At most kBlock states from `first` on.
void AddBlock(const FormErrors& form, const WheelStatesView& in, const ResponsesView& answered,
              const FormView& to, std::size_t first, std::size_t count) noexcept {
  std::uint8_t cases[kBlock];
  double by_load[kBlock], alike[kBlock];
  const double per_load = form.middle_load_n == 0 ? 0 : 1 / form.middle_load_n;
  std::array<bool, kMeasuredRegions> knows_all;
  for (std::size_t k = 0; k < kMeasuredRegions; ++k) knows_all[k] = form.region[k].KnowsAll();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = first + i;
    cases[i] = static_cast<std::uint8_t>(
        CaseOf(knows_all, in.v_x[k], in.v_y[k], in.rim_speed[k], &answered.flags[k]));
    by_load[i] = per_load == 0 || cases[i] >= kNothingKnown ? 1 : in.load[k] * per_load;
    alike[i] = 1;
  }
  for (int o = 0; o < kOutputs; ++o) {
    const FormView::OfOutput& view = to.output[o];
    if (view.sd.empty() && view.low.empty() && view.high.empty()) continue;
    ByCase sd{}, half{};
    sd[kNothingKnown] = half[kNothingKnown] = kNaN;
    for (std::size_t k = 0; k < kMeasuredRegions; ++k) {
      sd[k] = form.region[k].sd[o];
      half[k] = sd[k] * form.region[k].factor[o];
    }
    WriteOutput(sd, half, cases, o == kSinkage ? alike : by_load, answered.output[o], view, first,
                count);
  }
}

}  // namespace

void AddForm(const FormErrors& form, const WheelStatesView& in, const ResponsesView& answered,
             const FormView& to, std::size_t i) noexcept {
  AddBlock(form, in, answered, to, i, 1);
}

void AddForm(const FormErrors& form, const WheelStatesView& in, const ResponsesView& answered,
             const FormView& to) noexcept {
  if (!form.ClearsFlags() && !to.WantsAny()) return;
  const std::size_t n = in.load.size();
  for (std::size_t first = 0; first < n; first += kBlock) {
    AddBlock(form, in, answered, to, first, std::min(kBlock, n - first));
  }
}

void EvaluateWithForm(const WheelModel& model, const FormErrors& form, const WheelStatesView& in,
                      const ResponsesView& out, const FormView& to) noexcept {
  if (!to.WantsIntervals()) {
    model.Evaluate(in, out);
    AddForm(form, in, out, to);
    return;
  }
  std::array<std::array<std::array<double, kBlock>, 2>, kOutputs> room;
  for (std::size_t first = 0; first < in.load.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, in.load.size() - first);
    const WheelStatesView states = Cut(in, first, count);
    ResponsesView answers = Cut(out, first, count);
    for (int o = 0; o < kOutputs; ++o) {
      OutputView& view = answers.output[o];
      if (view.low.empty()) view.low = {room[o][0].data(), count};
      if (view.high.empty()) view.high = {room[o][1].data(), count};
    }
    model.Evaluate(states, answers);
    AddForm(form, states, answers, Cut(to, first, count));
  }
}

FormAnswer FormOf(const FormErrors& form, const VelocityState& motion, double load,
                  WheelAnswer* answer) noexcept {
  FormAnswer of;
  std::array<double, kOutputs> low, high;
  ResponsesView answered;
  FormView to;
  for (int o = 0; o < kOutputs; ++o) {
    low[o] = answer->value[o] - answer->half_width[o];
    high[o] = answer->value[o] + answer->half_width[o];
    answered.output[o].low = {&low[o], 1};
    answered.output[o].high = {&high[o], 1};
    to.output[o] = {{&of.sd[o], 1}, {}, {&of.half_width[o], 1}};
  }
  answered.flags = {&answer->flags, 1};
  AddForm(form,
          {{&motion.v_x, 1}, {&motion.v_y, 1}, {&motion.rim_speed, 1}, {&load, 1}, {}, {}, {}, {}},
          answered, to, 0);
  for (int o = 0; o < kOutputs; ++o) of.half_width[o] -= answer->value[o];
  return of;
}

}  // namespace grouser::surrogate

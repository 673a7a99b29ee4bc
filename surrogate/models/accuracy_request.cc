#include "surrogate/models/accuracy_request.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "surrogate/models/kinematics.h"
#include "surrogate/models/model_selector.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const double kMostAlong = std::tan(15 * std::numbers::pi / 180 + 1e-9);

/// The k-th of a sequence that fills the box evenly: its coordinates advance by
/// powers of the root of x^4 = x + 1, which repeats itself least in three axes.
struct ProbeState {
  VelocityState motion;
  double load;
};
ProbeState ProbeOf(const TrainingDomain& box, int k) {
  constexpr double kRoot = 1.2207440846057596;
  const auto part = [k](double step) { return std::fmod(0.5 + k * step, 1.0); };
  const auto between = [](double a, double b, double t) { return a + (b - a) * t; };
  const double slip = between(box.slip_min, box.slip_max, part(1 / kRoot));
  const double angle = box.attack_angle_max_rad * part(1 / (kRoot * kRoot));
  const double t = part(1 / (kRoot * kRoot * kRoot));
  return {FromSlip(slip, angle, 0.1),
          std::exp(between(std::log(box.load_min_n), std::log(box.load_max_n), t))};
}

}  // namespace

bool AccuracyRequest::HasTolerance() const {
  return share_of_load > 0 ||
         std::any_of(tolerance.begin(), tolerance.end(), [](double t) { return t > 0; });
}

std::array<double, kOutputs> AccuracyRequest::At(double load, double radius_m) const noexcept {
  std::array<double, kOutputs> at;
  for (int o = 0; o < kOutputs; ++o) {
    at[o] = tolerance[o] > 0 ? tolerance[o] : kInf;
    const bool left_out = o == kSinkage || (o == kMz && target == IntervalTarget::kMeasured);
    if (share_of_load == 0 || left_out) continue;
    at[o] = std::min(at[o], share_of_load * OutputScale(o, load, radius_m));
  }
  return at;
}

ErrorRegion ErrorRegionAt(double v_x, double v_y, double rim_speed) noexcept {
  const Canonical state = ToCanonical(v_x, v_y, rim_speed);
  if (state.lateral > kMostAlong * state.forward) return ErrorRegion::kLateral;
  const double slip = state.rim - state.forward;
  if (slip < -0.05) return ErrorRegion::kBraking;
  return slip > 0.05 ? ErrorRegion::kDriving : ErrorRegion::kTowed;
}

double ClaimedError(const SelectableModel& selectable, ErrorRegion region, int output, double low,
                    double high, double load) noexcept {
  const double unit = output == kSinkage ? 1 : OutputScale(output, load, selectable.radius_m);
  const double rms = selectable.rms_error[static_cast<std::size_t>(region)][output];
  const double half = 0.5 * (high - low), table = kTwoSided90 * rms * unit;
  if (std::isnan(half)) return kInf;
  const double claim = std::max(half, table);
  const bool exact = output == kFz || output == kSinkage || (low == 0 && high == 0);
  return claim > 0 || (selectable.hard && exact) ? claim : kInf;
}

double MeanClaim(const SelectableModel& selectable, const TrainingDomain& box) {
  constexpr int kSamples = 256;
  StateBatch batch(kSamples, {kLow, kHigh});
  for (int k = 0; k < kSamples; ++k) {
    const auto [v, load] = ProbeOf(box, k);  // NaN: a slip that this angle does not allow
    batch.Set(k, v, load);
  }
  selectable.model->Evaluate(batch.In(), batch.Out());
  double sum = 0;
  int count = 0;
  for (int k = 0; k < kSamples; ++k) {
    if ((batch.flags[k] & kInvalid) != 0) continue;
    const ErrorRegion region = ErrorRegionAt(batch.v_x[k], batch.v_y[k], batch.rim_speed[k]);
    for (int o = 0; o < kOutputs; ++o) {
      const auto& part = batch.part[o];
      sum += ClaimedError(selectable, region, o, part[kLow][k], part[kHigh][k], batch.load[k]) /
             OutputScale(o, batch.load[k], selectable.radius_m);
      ++count;
    }
  }
  return count > 0 ? sum / count : kInf;
}

double MeasureCost(const SelectableModel& selectable) {
  constexpr int kStates = 1024, kRuns = 12;
  StateBatch batch(kStates, {kValue, kSdFit, kSdPatch, kLow, kHigh});
  for (int i = 0, k = 0; i < kStates; ++k) {
    const auto [v, load] = ProbeOf(selectable.hull, k);
    if (std::isnan(v.v_x) && k < 16 * kStates) continue;
    batch.Set(i++, v, load);
  }
  SelectableModel one = selectable;
  one.cost_ns = 1;
  const ModelSelector alone({one});
  AccuracyRequest accuracy;
  accuracy.share_of_load = 1;
  double best = kInf;
  for (int run = 0; run < kRuns; ++run) {  // other programs can only add to a run's time
    const auto begin = std::chrono::steady_clock::now();
    alone.Evaluate(batch.In(), accuracy, batch.Out(), {}, nullptr);
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
    best = std::min(best, spent.count() / kStates);
  }
  return std::max(best, 1e-3);
}

}  // namespace grouser::surrogate

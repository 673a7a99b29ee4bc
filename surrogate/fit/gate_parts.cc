#include "surrogate/fit/gate_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {

std::vector<ScanState> Scan(const v1alpha1::Domain& d) {
  std::vector<ScanState> states;
  const double speed = d.speed_m_per_s() > 0 ? d.speed_m_per_s() : 0.1;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 6; ++j) {
      for (const double share : {0.0, 0.5, 1.0}) {
        const double slip = d.slip_min() + (d.slip_max() - d.slip_min()) * i / 20;
        const VelocityState v = FromSlip(slip, d.attack_angle_max_rad() * j / 6, speed);
        if (!std::isfinite(v.v_x)) continue;  // no motion has this pair
        states.push_back({v, d.load_min_n() + share * (d.load_max_n() - d.load_min_n())});
      }
    }
  }
  return states;
}

std::vector<ScanState> Drawn(const v1alpha1::Domain& d) {
  constexpr int kStates = 2000;
  constexpr double kRoot = 1.2207440846057596;  // x^4 = x + 1
  const double speed = d.speed_m_per_s() > 0 ? d.speed_m_per_s() : 0.1;
  std::vector<ScanState> states;
  std::array<double, 3> at{0.5, 0.5, 0.5};
  for (int i = 0; i < kStates; ++i) {
    for (int k = 0; k < 3; ++k) at[k] = std::fmod(at[k] + std::pow(kRoot, -(k + 1)), 1);
    const double slip = d.slip_min() + (d.slip_max() - d.slip_min()) * at[0];
    const VelocityState v = FromSlip(slip, d.attack_angle_max_rad() * at[1], speed);
    if (!std::isfinite(v.v_x)) continue;  // no motion has this pair
    states.push_back({v, d.load_min_n() + at[2] * (d.load_max_n() - d.load_min_n())});
  }
  return states;
}

WheelAnswer At(const TabulatedModel& model, const VelocityState& v, double load) {
  return model.EvaluateOne(v.v_x, v.v_y, v.rim_speed, load);
}

Moved MovedAt(const WheelAnswer& before, const WheelAnswer& after) {
  Moved most;
  for (int o = 0; o < kOutputs; ++o) {
    if (o == kFz && ((before.flags | after.flags) & kNoEquilibrium) != 0) continue;
    if (Covered(after.value[o], before.value[o], 0)) continue;
    const double by = std::fabs(after.value[o] - before.value[o]) / before.half_width[o];
    if (std::isnan(by)) return {INFINITY, o};
    if (by > most.half_widths) most = {by, o};
  }
  return most;
}

GateResult Judged(const std::string& name, double value, Side side, double limit,
                  const std::string& more) {
  const bool most = side == Side::kAtMost;
  return {name, most ? value <= limit : value >= limit, value, limit,
          fmt::format("{:.4g}, {} {:.4g}: {}", value, most ? "at most" : "at least", limit, more)};
}

Known KnownRuns(const v1alpha1::Model& base, const v1alpha1::Model& candidate) {
  Known known{SamplesOf(candidate, v1alpha1::RUN_ROLE_TEST), "runs held out"};
  if (known.rows.empty()) {
    known = {SamplesOf(base, v1alpha1::RUN_ROLE_TRAIN), "runs of the base, as none is held out"};
  }
  return known;
}

int CoveredOf(const v1alpha1::ErrorRow& row) {
  return static_cast<int>(std::lround(row.covered90() * row.n()));
}

int LeastHonest(const v1alpha1::ErrorRow& row) {
  constexpr double kLevel = 0.9;  // of covered90
  return BinomialBand(static_cast<int>(row.n()), kLevel).low;
}

}  // namespace grouser::surrogate

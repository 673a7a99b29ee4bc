#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "proto/records/model_file.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/hybrid.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate::testing {

inline v1alpha1::Model SmallMessage() { return records::ReadModelFile(GROUSER_SMALL_MODEL).model; }

/// The small model with its table: made once.
inline const HybridModel& Small() {
  static const HybridModel model = [] {
    HybridModel made = MakeHybrid(SmallMessage());
    made.Tabulate();
    return made;
  }();
  return model;
}

/// Random states inside the hull box, at any mirror.
inline StateBatch InsideHull(const TrainingDomain& hull, std::size_t n, unsigned seed) {
  StateBatch b(n);
  std::mt19937_64 random(seed);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (std::size_t i = 0; i < n;) {
    const double angle = draw(-1, 1) * hull.attack_angle_max_rad;
    const VelocityState v = FromSlip(draw(hull.slip_min, hull.slip_max), angle, draw(0.02, 0.4));
    const double mirror = draw(-1, 1) < 0 ? -1 : 1;
    const double load = std::exp(draw(std::log(hull.load_min_n), std::log(hull.load_max_n)));
    if (!std::isfinite(v.v_x)) continue;  // no motion has this slip
    b.Set(i++, mirror * v.v_x, v.v_y, mirror * v.rim_speed, load);
  }
  return b;
}

/// Random states anywhere, loads 0.02 to 400 N.
inline StateBatch Anywhere(std::size_t n, unsigned seed) {
  StateBatch b(n);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> any(0, 0.1);
  std::uniform_real_distribution<double> log_load(std::log(0.02), std::log(400.0));
  for (std::size_t i = 0; i < n; ++i) {
    b.Set(i, any(random), any(random), any(random), std::exp(log_load(random)));
  }
  return b;
}

/// OutputScale for the shipped wheel.
inline double ScaleOf(int output, double load) { return OutputScale(output, load, 0.0625); }

}  // namespace grouser::surrogate::testing

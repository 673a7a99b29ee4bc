#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "proto/records/model_file.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/hybrid.h"

namespace grouser::surrogate::testing {

inline constexpr int kValue = 0, kFit = 1, kPatch = 2, kLow = 3, kHigh = 4, kSlopes = 5;
inline constexpr int kParts = 9;  // four slopes

/// Buffers of a batch with everything asked for, echoes and gradients as well.
struct Batch {
  explicit Batch(std::size_t n) : v_x(n), v_y(n), rim(n), load(n), flags(n), slip(n), angle(n) {
    for (auto& output : part) {
      for (auto& values : output) values.assign(n, -7);
    }
  }
  WheelStatesView In() const { return {v_x, v_y, rim, load, {}, {}, {}, {}}; }
  ResponsesView Out() {
    ResponsesView view;
    for (int o = 0; o < kOutputs; ++o) {
      auto& p = part[o];
      view.output[o] = {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]};
    }
    view.flags = flags;
    view.slip = slip;
    view.attack_angle = angle;
    return view;
  }
  void Set(std::size_t i, double x, double y, double u, double n) {
    v_x[i] = x;
    v_y[i] = y;
    rim[i] = u;
    load[i] = n;
  }
  std::vector<double> v_x, v_y, rim, load;
  std::vector<std::uint32_t> flags;
  std::vector<double> slip, angle;
  std::array<std::array<std::vector<double>, kParts>, kOutputs> part;
};

inline v1alpha1::Model ShippedMessage() {
  return records::ReadModelFile(GROUSER_SHIPPED "/cmu-smooth-62.5.model").model;
}

/// The shipped model with its table: made once.
inline const HybridModel& Shipped() {
  static const HybridModel model = [] {
    HybridModel made = MakeHybrid(ShippedMessage());
    made.Tabulate();
    return made;
  }();
  return model;
}

/// Random states inside the hull box, at any mirror.
inline Batch InsideHull(const HullBox& hull, std::size_t n, unsigned seed) {
  Batch b(n);
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
inline Batch Anywhere(std::size_t n, unsigned seed) {
  Batch b(n);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> any(0, 0.1);
  std::uniform_real_distribution<double> log_load(std::log(0.02), std::log(400.0));
  for (std::size_t i = 0; i < n; ++i) {
    b.Set(i, any(random), any(random), any(random), std::exp(log_load(random)));
  }
  return b;
}

/// What counts as 1 when an output is compared.
inline double ScaleOf(int output, double load) {
  constexpr double kRadius = 0.0625;
  if (output == kSinkage) return kRadius;
  return output == kTorque || output == kMz ? load * kRadius : load;
}

}  // namespace grouser::surrogate::testing

#include "dem_offline/engine/rig/steady.h"

#include <algorithm>
#include <cmath>

namespace grouser::dem {
namespace {

std::vector<double> Blocks(std::span<const double> x, int blocks) {
  std::vector<double> out(blocks, 0.0);
  const std::size_t n = x.size();
  for (int b = 0; b < blocks; ++b) {
    const std::size_t from = n * b / blocks, to = n * (b + 1) / blocks;
    for (std::size_t i = from; i < to; ++i) out[b] += x[i];
    out[b] /= static_cast<double>(std::max<std::size_t>(1, to - from));
  }
  return out;
}

double StandardError(const std::vector<double>& blocks) {
  double mean = 0, square = 0;
  for (const double b : blocks) mean += b;
  mean /= static_cast<double>(blocks.size());
  for (const double b : blocks) square += (b - mean) * (b - mean);
  const auto n = static_cast<double>(blocks.size());
  return std::sqrt(square / (n - 1) / n);
}

}  // namespace

BlockMean AverageBlocks(std::span<const double> samples) {
  BlockMean out;
  if (samples.size() < 2 * kBlocks) return out;
  double sum = 0, square = 0;
  for (const double v : samples) sum += v;
  out.mean = sum / static_cast<double>(samples.size());
  for (const double v : samples) square += (v - out.mean) * (v - out.mean);
  out.fluctuation = std::sqrt(square / static_cast<double>(samples.size()));
  const std::vector<double> b = Blocks(samples, kBlocks);
  out.standard_error = std::max({StandardError(Blocks(samples, kBlocks / 2)), StandardError(b),
                                 StandardError(Blocks(samples, 2 * kBlocks))});
  // Straight line through the block means.
  const double mid = 0.5 * (kBlocks - 1);
  double sxx = 0, sxy = 0, rest = 0;
  for (int k = 0; k < kBlocks; ++k) {
    sxx += (k - mid) * (k - mid);
    sxy += (k - mid) * (b[k] - out.mean);
  }
  const double slope = sxy / sxx;
  for (int k = 0; k < kBlocks; ++k) {
    const double e = b[k] - out.mean - slope * (k - mid);
    rest += e * e;
  }
  out.drift = slope * kBlocks;
  const double slope_error = std::sqrt(rest / (kBlocks - 2) / sxx);
  out.drift_t = slope_error > 0 ? slope / slope_error : 0.0;
  return out;
}

double ContactLength(double radius_m, double sinkage_m) {
  const double z = std::clamp(sinkage_m, 0.0, radius_m);
  return radius_m * std::acos(1 - z / radius_m);
}

SteadyWindow FindSteady(const Series& s, std::size_t first, double load_n, double radius_m,
                        double target_relative_error) {
  struct Channel {
    const char* name;
    const std::vector<double>* data;
    double tolerance;
  };
  const Channel channels[] = {{"f_x", &s.f_x_n, 0.08 * load_n},
                              {"f_y", &s.f_y_n, 0.08 * load_n},
                              {"torque", &s.torque_n_m, 0.08 * load_n * radius_m},
                              {"sinkage", &s.sinkage_m, 0.04 * radius_m}};
  SteadyWindow window;
  window.last = s.time_s.size();
  const std::size_t n = window.last - first;
  for (const double skip : {0.25, 0.35, 0.45, 0.55}) {
    window.first = first + static_cast<std::size_t>(skip * static_cast<double>(n));
    if (window.last - window.first < 2 * kBlocks) break;
    window.drift_free = window.precise = true;
    window.drifting.clear();
    double worst = 1;
    for (const Channel& c : channels) {
      const BlockMean m =
          AverageBlocks(std::span(*c.data).subspan(window.first, window.last - window.first));
      const double excess = std::abs(m.drift) / c.tolerance;
      if (std::abs(m.drift_t) > 3.7 && excess > worst) {
        worst = excess;
        window.drift_free = false;
        window.drifting = c.name;
      }
      const bool force = c.name[0] == 'f';
      if (force && m.standard_error > target_relative_error * load_n) window.precise = false;
      if (c.data == &s.sinkage_m) window.contact_length_m = ContactLength(radius_m, m.mean);
    }
    window.travel_m = s.travel_m.size() < window.last
                          ? 0.0
                          : s.travel_m[window.last - 1] - s.travel_m[window.first];
    window.travelled = window.travel_m > 0 && window.travel_m >= window.contact_length_m;
    if (window.drift_free) break;
  }
  return window;
}

}  // namespace grouser::dem

#include "dem_offline/engine/rig/steady.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

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

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kNotFree = std::numeric_limits<double>::quiet_NaN();  // nothing is balanced

/// One column of a series, and what its mean over a steady window has to keep to.
struct Channel {
  const char* name;
  const std::vector<double>* data;
  double scale;            ///< what shares are of: load, load r, radius, speed
  double drift;            ///< largest, share of scale
  double error;            ///< largest standard error, share of scale
  double held = kNotFree;  ///< on a free axis, what the mean balances
  bool force = false, speed = false;
};

std::vector<Channel> ChannelsOf(const Series& s, const SteadyRule& r) {
  const double moment = r.load_n * r.radius_m;
  std::vector<Channel> out = {{"f_x", &s.f_x_n, r.load_n, 0.08, kLargestError, kNotFree, true},
                              {"f_y", &s.f_y_n, r.load_n, 0.08, kLargestError, kNotFree, true},
                              {"torque", &s.torque_n_m, moment, 0.08, kLargestError},
                              {"sinkage", &s.sinkage_m, r.radius_m, 0.04, kLargestError},
                              {"f_z", &s.f_z_n, r.load_n, kNoLimit, kNoLimit, r.load_n}};
  const auto free_speed = [&](const char* name, const std::vector<double>& data) {
    out.push_back({name, &data, r.speed_m_per_s, 0.08, kLargestError, kNotFree, false, true});
  };
  if (r.mode == RigMode::kFreeSlip) {
    out[0].held = r.drawbar_n;
    free_speed("v_x", s.v_x_m_per_s);
  } else if (r.mode == RigMode::kTowed) {
    out[2].held = 0;
    free_speed("rim speed", s.rim_speed_m_per_s);
  }
  return out;
}

/// Drift, balance, certainty and contact length of window's samples.
void JudgeMeans(const std::vector<Channel>& channels, const SteadyRule& rule,
                SteadyWindow* window) {
  SteadyWindow fresh;
  fresh.first = window->first;
  fresh.last = window->last;
  fresh.drift_free = fresh.precise = true;
  *window = fresh;
  double worst = 1;
  for (const Channel& c : channels) {
    const BlockMean m =
        AverageBlocks(std::span(*c.data).subspan(window->first, window->last - window->first));
    const double excess = std::abs(m.drift) / (c.drift * c.scale);
    if (std::abs(m.drift_t) > 3.7 && excess > 1) {
      window->drift_free = false;
      window->speed_drifts |= c.speed;
      if (excess > worst) window->drifting = c.name;
      worst = std::max(worst, excess);
    }
    const double net =
        std::clamp(4 * m.standard_error, 0.03 * c.scale, 0.2 * c.scale);  // the largest
    if (std::abs(m.mean - c.held) > net) window->unbalanced = c.name;     // kNotFree: never
    if (m.standard_error > c.error * c.scale) window->uncertain = c.name;
    if (c.force && m.standard_error > rule.target_relative_error * c.scale) {
      window->precise = false;
    }
    if (std::string_view(c.name) == "sinkage") {
      window->contact_length_m = ContactLength(rule.radius_m, m.mean);
    }
  }
  if (!window->drift_free) window->uncertain.clear();
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
  out.drift_t = slope == 0 ? 0.0 : slope / slope_error;  // infinite for an exact line
  return out;
}

double ContactLength(double radius_m, double sinkage_m) {
  const double z = std::clamp(sinkage_m, 0.0, radius_m);
  return radius_m * std::acos(1 - z / radius_m);
}

SteadyRule RuleOf(const WheelTestSpec& spec) {
  return {spec.state.load_n, spec.wheel.radius_m,  spec.rig.target_relative_error,
          spec.state.mode,   spec.state.drawbar_n, spec.rig.speed_m_per_s};
}

SteadyWindow FindSteady(const Series& s, std::size_t first, const SteadyRule& rule) {
  const std::vector<Channel> channels = ChannelsOf(s, rule);
  SteadyWindow window;
  window.last = s.time_s.size();
  const std::size_t n = window.last - first;
  for (const double skip : {0.25, 0.35, 0.45, 0.55}) {
    window.first = first + static_cast<std::size_t>(skip * static_cast<double>(n));
    if (window.last - window.first < 2 * kBlocks) break;
    JudgeMeans(channels, rule, &window);
    window.travel_m = s.travel_m.size() < window.last
                          ? 0.0
                          : s.travel_m[window.last - 1] - s.travel_m[window.first];
    window.travelled = window.travel_m > 0 && window.travel_m >= window.contact_length_m;
    if (window.drift_free && window.unbalanced.empty()) break;
  }
  return window;
}

}  // namespace grouser::dem

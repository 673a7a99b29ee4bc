// Dimensionless groups: a wheel test under another gravity and of another size.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

/// Lengths and density as they are; stiffness and load go with g, speed with sqrt(g),
/// times with 1/sqrt(g): overlap, Froude number and load number stay what they are.
WheelTestSpec Similar(double gravity_share, std::uint64_t seed, double time_s) {
  const double root = std::sqrt(gravity_share);
  WheelTestSpec s;
  s.soil.gravity_m_per_s2 *= gravity_share;
  s.soil.youngs_modulus_pa = 2e6 * gravity_share;
  s.soil.rolling_friction = 0.2;
  s.soil.sizes = {{0.010, 0.5}, {0.012, 0.5}};
  s.wheel.radius_m = 0.04;
  s.wheel.width_m = 0.04;
  s.rig.bed_length_m = 0.20;
  s.rig.bed_width_m = 0.12;
  s.rig.bed_depth_m = 0.05;
  s.rig.speed_m_per_s = 0.1 * root;
  s.rig.max_time_s = time_s / root;
  s.rig.target_relative_error = 1e-6;
  s.state.load_n = 6 * gravity_share;
  s.state.slip = 0.3;
  s.seed = seed;
  return s;
}

/// What does not depend on units: solid fraction and sinkage over the radius.
struct Outcome {
  double solid_fraction = 0, sinkage = 0;
};
Outcome Run(double gravity_share, std::uint64_t seed, double time_s) {
  const WheelTestSpec s = Similar(gravity_share, seed, time_s);
  const Tile tile = PrepareBed(BedOf(s), nullptr);
  const WheelTestResult r = RunWheel(s, tile);
  for (const OutputMean& o : r.outputs) {
    if (o.name == "sinkage") return {tile.solid_fraction, o.mean / s.wheel.radius_m};
  }
  throw std::runtime_error("no sinkage: " + r.reason);
}

void Gravity(Rows& rows) {
  // Powers of two scale without rounding: the runs are the same, until the least numbers
  // that a float holds, which do not scale, have grown.
  const Outcome earth = Run(1, 1, 0.2), quarter = Run(0.25, 1, 0.2);
  rows.Relative("a quarter of g: solid fraction [-]", earth.solid_fraction, quarter.solid_fraction,
                1e-6, "same dimensionless groups");
  rows.Relative("a quarter of g: sinkage over radius [-]", earth.sinkage, quarter.sinkage, 1e-3,
                "same dimensionless groups");
  std::vector<double> fraction[2], sinkage[2];
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const bool sixth : {false, true}) {
      const Outcome o = Run(sixth ? 1.0 / 6 : 1, seed, 0.8);
      fraction[sixth].push_back(o.solid_fraction);
      sinkage[sixth].push_back(o.sinkage);
    }
  }
  const Mean f[] = {MeanOf(fraction[0]), MeanOf(fraction[1])};
  const Mean z[] = {MeanOf(sinkage[0]), MeanOf(sinkage[1])};
  rows.Absolute("a sixth of g, 4 beds: solid fraction [-]", f[0].value, f[1].value, 0.004,
                "same dimensionless groups");
  rows.Relative("a sixth of g, 4 beds: sinkage over radius [-]", z[0].value, z[1].value, 0.1,
                "same dimensionless groups");
  rows.Note(
      Format("solid fraction %.5f +- %.5f on Earth, %.5f +- %.5f at a sixth of g; sinkage over "
             "radius %.4f +- %.4f and %.4f +- %.4f (standard errors of 4 beds); a quarter of g: "
             "solid fraction %.2g and sinkage %.2g off, as shares",
             f[0].value, f[0].error, f[1].value, f[1].error, z[0].value, z[0].error, z[1].value,
             z[1].error, quarter.solid_fraction / earth.solid_fraction - 1,
             quarter.sinkage / earth.sinkage - 1));
}

/// How a wheel test differs from the one it is compared with.
struct Similarity {
  const char* name;
  double length = 1, gravity = 1;
  bool scaled_stiffness = true;  ///< false: the grains keep their Young's modulus
};

/// A wheel that bulldozes at 20 degrees; all lengths with `length`, grains among them.
WheelTestSpec AngledWheel(const Similarity& by, std::uint64_t seed) {
  const double l = by.length, g = by.gravity, speed = std::sqrt(g * l);
  WheelTestSpec s;
  s.soil.gravity_m_per_s2 *= g;
  s.soil.youngs_modulus_pa = 2e6 * (by.scaled_stiffness ? g * l : 1);
  s.soil.rolling_friction = 0.2;
  s.soil.sizes = {{0.0081 * l, 0.25}, {0.009 * l, 0.5}, {0.0099 * l, 0.25}};
  s.wheel.radius_m = 0.05 * l;
  s.wheel.width_m = 0.04 * l;
  s.rig.bed_length_m = 0.20 * l;
  s.rig.bed_width_m = 0.14 * l;
  s.rig.bed_depth_m = 0.06 * l;
  s.rig.speed_m_per_s = 0.1 * speed;
  s.rig.max_time_s = 1.4 * l / speed;
  s.rig.target_relative_error = 1e-6;
  s.state.load_n = 10 * g * l * l * l;
  s.state.slip = 0.3;
  s.state.attack_angle_rad = std::numbers::pi / 9;
  s.seed = seed;
  return s;
}

constexpr const char* kAngledOutputs[] = {"f_x", "f_y", "torque", "m_z", "sinkage"};
constexpr std::size_t kAngled = std::size(kAngledOutputs);

/// Means over load, load r or r.
std::array<double, kAngled> RunAngled(const Similarity& by, std::uint64_t seed) {
  const WheelTestSpec s = AngledWheel(by, seed);
  const WheelTestResult r = RunWheel(s, PrepareBed(BedOf(s), nullptr));
  const double load = s.state.load_n, radius = s.wheel.radius_m;
  const double scale[] = {load, load, load * radius, load * radius, radius};
  std::array<double, kAngled> shares{};
  for (std::size_t o = 0; o < kAngled; ++o) {
    const auto at = std::ranges::find(r.outputs, kAngledOutputs[o], &OutputMean::name);
    if (at == r.outputs.end()) throw std::runtime_error("no mean: " + r.reason);
    shares[o] = at->mean / scale[o];
  }
  return shares;
}

/// What surrogate/models/scaled_model.h says of its intervals.
void SizeAndGravity(Rows& rows) {
  constexpr std::uint64_t kBeds = 8;
  constexpr double kMoon = 1.62 / 9.81;
  const Similarity tests[] = {{"the wheel itself"},
                              {"twice the size", 2},
                              {"lunar gravity", 1, kMoon},
                              {"twice the size, Young's modulus kept", 2, 1, false},
                              {"lunar gravity, Young's modulus kept", 1, kMoon, false}};
  std::array<Mean, kAngled> first;
  for (const Similarity& by : tests) {
    std::array<std::vector<double>, kAngled> runs;
    for (std::uint64_t seed = 1; seed <= kBeds; ++seed) {
      const auto shares = RunAngled(by, seed);
      for (std::size_t o = 0; o < kAngled; ++o) runs[o].push_back(shares[o]);
    }
    for (std::size_t o = 0; o < kAngled; ++o) {
      const Mean mean = MeanOf(runs[o]);
      rows.Note(Format("%s: %s %.4f +- %.4f (standard error of %d beds)", by.name,
                       kAngledOutputs[o], mean.value, mean.error, static_cast<int>(kBeds)));
      if (&by == tests) {
        first[o] = mean;
      } else if (by.scaled_stiffness) {  // the same but for the draw: within its scatter
        rows.Absolute(Format("%s: %s over load, load r or r [-]", by.name, kAngledOutputs[o]),
                      first[o].value, mean.value, 3 * std::hypot(first[o].error, mean.error),
                      "same dimensionless groups");
      }
    }
  }
}

}  // namespace

Cases SimilarityCases() {
  return {{"gravity_similarity", Level::kDefault, Gravity},
          {"size_and_gravity", Level::kFull, SizeAndGravity}};
}

}  // namespace grouser::dem::verify

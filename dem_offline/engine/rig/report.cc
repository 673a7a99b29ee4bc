#include "dem_offline/engine/rig/report.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/packing.h"

namespace grouser::dem {

namespace {

/// Of samples [first, last), at least 2 kBlocks.
std::vector<OutputMean> MeansOver(const Series& s, std::size_t first, std::size_t last,
                                  double v_y_m_per_s) {
  std::vector<double> slip;
  for (std::size_t i = 0; i < s.time_s.size(); ++i) {
    slip.push_back(SlipOf({s.v_x_m_per_s[i], v_y_m_per_s, s.rim_speed_m_per_s[i]}));
  }
  const std::pair<const char*, const std::vector<double>*> columns[] = {
      {"f_x", &s.f_x_n},   {"f_y", &s.f_y_n},         {"f_z", &s.f_z_n}, {"torque", &s.torque_n_m},
      {"m_z", &s.m_z_n_m}, {"sinkage", &s.sinkage_m}, {"slip", &slip}};
  std::vector<OutputMean> out;
  for (const auto& [name, column] : columns) {
    const BlockMean m = AverageBlocks(std::span(*column).subspan(first, last - first));
    out.push_back({name, m.mean, m.standard_error, m.drift, m.fluctuation});
  }
  return out;
}

}  // namespace

void FillEqualTravel(const TravelSettings& travel, const Motion& target, WheelTestResult& out) {
  out.equal_travel = {travel.compare_from_hub_m, travel.compare_to_hub_m, {}};
  const std::vector<double>& hub = out.series.hub_travel_m;
  const auto at = [&](double m) {
    return static_cast<std::size_t>(std::lower_bound(hub.begin(), hub.end(), m) - hub.begin());
  };
  const std::size_t first = at(travel.compare_from_hub_m), last = at(travel.compare_to_hub_m);
  if (last == hub.size() || last - first < 2 * kBlocks) return;
  out.equal_travel.outputs = MeansOver(out.series, first, last, target.v_y);
}

void FillMeans(const WheelTestSpec& spec, const SteadyWindow& window, const Motion& target,
               double beta, WheelTestResult& out) {
  const Series& s = out.series;
  out.attack_angle_rad = beta;
  out.v_x_m_per_s = target.v_x;
  out.v_y_m_per_s = target.v_y;
  out.rim_speed_m_per_s = target.rim;
  const std::size_t n = window.last - window.first;
  if (window.last == 0 || n < 2 * kBlocks) {
    out.slip = SlipOf(target);
    return;
  }
  out.outputs = MeansOver(s, window.first, window.last, target.v_y);
  out.slip = out.outputs.back().mean;
  if (spec.state.mode != RigMode::kRimSpeed) {  // what was free has a mean
    const auto mean = [&](const std::vector<double>& c) {
      return std::accumulate(c.begin() + window.first, c.begin() + window.last, 0.0) /
             static_cast<double>(n);
    };
    out.v_x_m_per_s = mean(s.v_x_m_per_s);
    out.rim_speed_m_per_s = mean(s.rim_speed_m_per_s);
  }
  out.blocks = kBlocks;
  out.window_start_s = s.time_s[window.first];
  out.window_end_s = s.time_s[window.last - 1];
  out.travel_m = window.travel_m;
  out.contact_length_m = window.contact_length_m;
}

void FillEnergy(const EnergyBalance& start, const EnergyBalance& end, EnergyLedger& e) {
  e.kinetic_j = end.kinetic - start.kinetic;
  e.potential_j = end.potential - start.potential;
  e.elastic_j = end.stored - start.stored;
  e.normal_damping_j = end.normal_damping - start.normal_damping;
  e.tangential_damping_j = end.tangent_damping - start.tangent_damping;
  e.slip_j = end.slip - start.slip;
  e.rolling_j = end.rolling - start.rolling;
  e.plastic_j = end.plastic - start.plastic;
  e.cohesion_j = end.cohesion - start.cohesion;
  e.frozen_j = end.frozen - start.frozen;
  e.residual_j = e.input_j - e.kinetic_j - e.potential_j - e.elastic_j - e.normal_damping_j -
                 e.tangential_damping_j - e.slip_j - e.rolling_j - e.plastic_j - e.cohesion_j -
                 e.frozen_j;
}

double EnergyError(const EnergyLedger& e) {
  const double lost = e.normal_damping_j + e.tangential_damping_j + e.slip_j + e.rolling_j +
                      e.plastic_j + e.cohesion_j;
  const double scale = std::max(std::abs(e.input_j), std::abs(lost));
  return scale > 0 ? std::abs(e.residual_j) / scale : 0.0;
}

void FillBedAndRules(const WheelTestSpec& spec, const Tile& tile, const World& world,
                     WheelTestResult& out) {
  const double d = MeanDiameter(spec.soil), r = spec.wheel.radius_m, b = spec.wheel.width_m;
  out.grains = static_cast<std::uint64_t>(world.count());
  out.mean_diameter_m = d;
  out.bulk_density_kg_per_m3 = tile.solid_fraction * spec.soil.density_kg_per_m3;
  out.list_rebuilds = world.rebuilds();
  out.particle_steps = out.use.particle_steps;
  const auto q = world.config().frame.Quantum();
  out.quantum_m = *std::max_element(q.begin(), q.end());
  std::vector<float> overlaps = world.OverlapRatios();
  std::sort(overlaps.begin(), overlaps.end());
  if (!overlaps.empty()) {
    out.overlap_mean_over_radius = std::accumulate(overlaps.begin(), overlaps.end(), 0.0) /
                                   static_cast<double>(overlaps.size());
    out.overlap_p99_over_radius = overlaps[static_cast<std::size_t>(0.99 * overlaps.size())];
    out.overlap_max_over_radius = overlaps.back();
  }
  double sinkage = 0;
  for (const double z : out.series.sinkage_m) sinkage = std::max(sinkage, z);
  const double chord =
      2 * std::sqrt(std::max(d * d, std::min(sinkage, r) * (2 * r - std::min(sinkage, r))));
  // Inertial number: shear rate speed/chord, pressure load/(chord b).
  const double pressure = spec.state.load_n / (chord * b);
  out.inertial_number =
      spec.rig.speed_m_per_s / chord * d * std::sqrt(spec.soil.density_kg_per_m3 / pressure);
  const double c = std::abs(std::cos(out.attack_angle_rad)),
               s = std::abs(std::sin(out.attack_angle_rad));
  const double across = b * c + chord * s;
  const auto rule = [&](const char* name, double value, double limit, bool kept) {
    out.rules.push_back({name, value, limit, kept});
  };
  const auto at_least = [&](const char* name, double v, double limit) {
    rule(name, v, limit, v >= limit);
  };
  const auto at_most = [&](const char* name, double v, double limit) {
    rule(name, v, limit, v <= limit);
  };
  at_least("wheel width over mean diameter", b / d, 6);
  at_least("hub travel [m]", out.hub_travel_m, TravelOf(spec).least_hub_m);
  at_least("sinkage over mean diameter", sinkage / d, 3);
  at_least("side clearance [m] against 2.5 sinkages + 5 d", 0.5 * (spec.rig.bed_width_m - across),
           2.5 * sinkage + 5 * d);
  at_least("bed depth over largest sinkage",
           sinkage > 0 ? (spec.rig.bed_depth_m + tile.surface_m) / sinkage : 99, 2);
  at_most("99th percentile of overlap over radius", out.overlap_p99_over_radius, 0.07);
  at_most("solid fraction off its target", std::abs(tile.solid_fraction - spec.soil.solid_fraction),
          kFractionTolerance);
  at_most("inertial number", out.inertial_number, 0.1);
}

void FillSceneRules(const WheelTestSpec& spec, const RigScene& scene, WheelTestResult& out) {
  if (!scene.window()) return;
  const WindowSettings& w = scene.window()->settings();
  double sinkage = 0;
  for (const double z : out.series.sinkage_m) sinkage = std::max(sinkage, z);
  const double r = spec.wheel.radius_m, z = std::min(sinkage, r);
  const double chord = std::sqrt(z * (2 * r - z));  // half of it
  const double along = chord * std::abs(std::cos(out.attack_angle_rad)) +
                       0.5 * spec.wheel.width_m * std::abs(std::sin(out.attack_angle_rad));
  // The band may stand a slab nearer than its mean place, in front and behind.
  const double nearest = std::min(w.ahead, 1 - w.ahead) * w.length_m - w.slab_m - w.band_m - along;
  const double limit = sinkage + 5 * MeanDiameter(spec.soil);
  out.rules.push_back(
      {"wheel to frozen seam [m] against sinkage + 5 d", nearest, limit, nearest >= limit});
}

}  // namespace grouser::dem

#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include "dem_offline/campaign/backend.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// What the fake engine has been asked for.
struct FakeLog {
  std::atomic<int> tiles{0};
  std::atomic<int> runs{0};
};

/// Stands for the engine: results follow from the spec by arithmetic. `pause`
/// passes in every run and tile, in ten steps with progress reports.
inline Backend FakeBackend(FakeLog* log, std::chrono::milliseconds pause = {}) {
  const auto work = [pause](const dem::ProgressFn& progress, const char* stage) {
    for (int step = 0; step < 10; ++step) {
      std::this_thread::sleep_for(pause / 10);
      if (!progress(0.1 * step, stage)) return false;
    }
    return true;
  };
  Backend backend;
  backend.validate = [](const dem::WheelTestSpec& spec) {
    if (spec.state.load_n > 1000) {
      throw std::invalid_argument("state.load_n: got more than 1000, expected less");
    }
  };
  backend.prepare_bed = [log, work](const dem::BedSpec& bed, const dem::ProgressFn& progress) {
    ++log->tiles;
    work(progress, "tile");
    dem::Tile tile;
    tile.length_m = bed.length_m;
    tile.radius_m = {0.004f, static_cast<float>(bed.seed)};
    tile.position = {0, 0, 0, 1, 1, 1};
    tile.velocity.assign(6, 0.0f);
    tile.spin.assign(6, 0.0f);
    tile.contact_first = {0, 1, 2};
    tile.contact_partner = {1, -1};
    tile.contact_history.assign(16, 0.5f);
    tile.solid_fraction = 0.58;
    return tile;
  };
  backend.run = [log, work](const dem::WheelTestSpec& spec, const dem::Tile&,
                            const dem::ProgressFn& progress) {
    ++log->runs;
    dem::WheelTestResult result;
    if (!work(progress, "run")) {
      result.reason = "stopped by caller";
      return result;
    }
    result.status = spec.state.load_n > 500 ? dem::RunStatus::kFailed : dem::RunStatus::kSteady;
    result.slip = spec.state.slip;
    result.attack_angle_rad = spec.state.attack_angle_rad;
    for (const char* name : {"f_x", "f_y", "f_z", "torque", "m_z", "sinkage", "slip"}) {
      result.outputs.push_back({name, spec.state.slip * spec.state.load_n, 0.1, 0.0, 0.2});
    }
    for (auto* series :
         {&result.series.time_s, &result.series.f_x_n, &result.series.f_y_n, &result.series.f_z_n,
          &result.series.torque_n_m, &result.series.m_z_n_m, &result.series.sinkage_m,
          &result.series.v_x_m_per_s, &result.series.rim_speed_m_per_s, &result.series.travel_m,
          &result.series.hub_travel_m}) {
      series->assign(100, spec.state.slip);
    }
    return result;
  };
  backend.engine_version = "fake-1";
  backend.isa = "none";
  return backend;
}

/// A scene that every check accepts.
inline v1alpha1::Scene SomeScene() {
  v1alpha1::Scene scene;
  scene.set_name("scene");
  auto* soil = scene.mutable_soil();
  soil->set_bulk_density_kg_per_m3(1330);
  soil->set_gravity_m_per_s2(9.81);
  auto* grains = soil->mutable_grains();
  grains->set_grain_density_kg_per_m3(2293.1);
  grains->set_youngs_modulus_pa(1e7);
  grains->set_poisson_ratio(0.3);
  grains->set_restitution(0.5);
  grains->set_solid_fraction(0.58);
  grains->add_sizes()->set_diameter_m(0.01);
  grains->mutable_sizes(0)->set_mass_fraction(1);
  scene.mutable_wheel()->set_radius_m(0.06);
  scene.mutable_wheel()->set_width_m(0.05);
  scene.mutable_wheel()->set_restitution(0.5);
  auto* rig = scene.mutable_rig();
  rig->set_bed_length_m(0.28);
  rig->set_bed_width_m(0.2);
  rig->set_bed_depth_m(0.1);
  rig->set_rayleigh_fraction(0.2);
  rig->set_speed_m_per_s(0.1);
  rig->set_max_time_s(1);
  return scene;
}

}  // namespace grouser::campaign

#include "tests/unit/surrogate/synthetic.h"

#include <cmath>
#include <random>

namespace grouser::surrogate::synthetic {
namespace {

constexpr double kSpeed = 0.1;

}  // namespace

Truth::Truth() {
  physics.n = 0.9;
  physics.k_phi = 5e5;
  physics.friction_angle = 0.42;
  physics.shear_modulus = 0.008;
  physics.c1 = 0.35;
  physics.c3 = 0.2;
  physics.sinkage_brake = 0.5;
  physics.side_passive = 6;
}

std::array<double, kOutputs> Truth::At(double slip, double angle, double load) const {
  const VelocityState v = FromSlip(slip, angle, kSpeed);
  auto value = BekkerModel(physics, kWheel).Solve(v.v_x, v.v_y, v.rim_speed, load).value;
  const double x = v.v_x / kSpeed, y = v.v_y / kSpeed, u = v.rim_speed / kSpeed;
  value[kFx] += misfit * load * std::sin(1.5 * (u - x));  // odd under (x, u) -> -(x, u)
  value[kFy] += misfit * load * y * std::cos(1.5 * (u - x));
  value[kTorque] += misfit * load * kWheel.radius_m * std::sin(u);
  value[kSinkage] += 0.3 * misfit * kWheel.radius_m * std::cos(2 * (u - x));
  return value;
}

v1alpha1::Scene MakeScene() {
  v1alpha1::Scene scene;
  scene.set_name("synthetic");
  scene.mutable_soil()->set_name("synthetic sand");
  scene.mutable_soil()->set_bulk_density_kg_per_m3(1330);
  scene.mutable_soil()->set_gravity_m_per_s2(9.81);
  scene.mutable_wheel()->set_name("synthetic wheel");
  scene.mutable_wheel()->set_radius_m(kWheel.radius_m);
  scene.mutable_wheel()->set_width_m(kWheel.width_m);
  scene.mutable_rig()->set_speed_m_per_s(kSpeed);
  return scene;
}

v1alpha1::RunSummary MakeRun(const Truth& truth, const std::string& id, double slip, double angle,
                             double load, v1alpha1::RunRole role, std::uint64_t seed) {
  v1alpha1::RunSummary run;
  run.set_run_id(id);
  run.set_file(id + ".run.h5");
  run.set_sha256("sha-of-" + id);
  run.set_role(role);
  run.set_status(v1alpha1::RUN_STATUS_STEADY);
  run.set_slip(slip);
  run.set_attack_angle_rad(angle);
  run.set_load_n(load);
  run.set_speed_m_per_s(kSpeed);
  run.set_seed(seed);
  run.set_travel_m(0.1);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const auto value = truth.At(slip, angle, load);
  for (int o = 0; o < kOutputs; ++o) {
    const double sd = truth.noise * OutputScale(o, load, kWheel.radius_m);
    run.add_mean(value[o] + sd * normal(random));
    run.add_standard_error(sd);
  }
  return run;
}

std::vector<v1alpha1::RunSummary> SmallCampaign(const Truth& truth,
                                                const std::vector<double>& loads) {
  std::vector<v1alpha1::RunSummary> runs;
  for (const double slip : {-0.6, -0.1, 0.25, 0.7}) {
    for (const double angle : {0.0, 0.5236, 1.0472}) {
      for (const double load : loads) {
        const std::size_t number = runs.size();
        runs.push_back(MakeRun(truth, "train-" + std::to_string(number), slip, angle, load,
                               v1alpha1::RUN_ROLE_TRAIN, 100 + number));
      }
    }
  }
  return runs;
}

std::vector<v1alpha1::RunSummary> RandomRuns(const Truth& truth, int n, v1alpha1::RunRole role,
                                             std::uint64_t seed, double load_min, double load_max) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<v1alpha1::RunSummary> runs;
  for (int i = 0; i < n; ++i) {
    const double slip = -0.6 + 1.3 * unit(random), angle = 1.0472 * unit(random);
    const double load = load_min + (load_max - load_min) * unit(random);
    runs.push_back(MakeRun(truth, v1alpha1::RunRole_Name(role) + std::to_string(i), slip, angle,
                           load, role, seed * 1000 + i));
  }
  return runs;
}

FitRequest MakeRequest(std::vector<v1alpha1::RunSummary> runs) {
  FitRequest request;
  request.name = "synthetic";
  request.reason = "test";
  request.set.scene = MakeScene();
  request.set.runs = std::move(runs);
  return request;
}

}  // namespace grouser::surrogate::synthetic

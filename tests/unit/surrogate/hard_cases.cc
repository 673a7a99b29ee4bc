#include "tests/unit/surrogate/hard_cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace grouser::surrogate::hard_cases {

void Batch::Add(double x, double y, double u, double w) {
  v_x.push_back(x);
  v_y.push_back(y);
  rim.push_back(u);
  load.push_back(w);
}

void Batch::Solve(const BekkerModel& model, bool gradients) {
  BekkerBatch batch{v_x, v_y, rim, load, {}, {}, {}};
  no_equilibrium.resize(size());
  batch.no_equilibrium = no_equilibrium;
  for (int o = 0; o < kOutputs; ++o) {
    value[o].resize(size());
    batch.value[o] = value[o];
    for (int i = 0; i < kInputs && gradients; ++i) {
      gradient[o][i].resize(size());
      batch.gradient[o][i] = gradient[o][i];
    }
  }
  model.SolveBatch(batch);
}

double Scale(int output, double load, double radius) {
  if (output == kSinkage) return radius;
  return output == kTorque || output == kMz ? load * radius : load;
}

BekkerParameters With(double BekkerParameters::*member, double value) {
  BekkerParameters p;
  p.*member = value;
  return p;
}

BekkerParameters Clay() {
  BekkerParameters p;
  p.friction_angle = 0;
  p.cohesion = 8e3;
  p.n = 0.5;
  p.k_phi = 4e5;
  p.c3 = 0.1;
  return p;
}

std::vector<BekkerParameters> Soils() {
  BekkerParameters loam = With(&BekkerParameters::n, 0.7);
  loam.cohesion = 2e3;
  loam.k_phi = 3e5;
  BekkerParameters short_shear = With(&BekkerParameters::shear_modulus, 0.002);
  BekkerParameters lugs = With(&BekkerParameters::grouser_height, 0.01);
  return {BekkerParameters{}, loam, Clay(), short_shear, lugs};
}

BekkerModel RandomModel(std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double a, double b) { return a + (b - a) * unit(*random); };
  const auto one_in = [&](int n) { return between(0, n) < 1; };
  const WheelGeometry wheel{std::pow(10, between(-1.5, 0)), std::pow(10, between(-1.7, -0.3))};
  BekkerParameters p;
  p.n = between(0.1, 1.6);
  p.k_phi = std::pow(10, between(4, 7.5));
  p.k_c = one_in(3) ? -between(0, 0.9) * p.k_phi * wheel.width_m : one_in(2) ? between(0, 1e5) : 0;
  p.cohesion = one_in(3) ? 0 : std::pow(10, between(1, 5));
  p.friction_angle = one_in(5) ? 0 : between(0, 0.9);
  p.shear_modulus = std::pow(10, between(-4, -1));
  p.c1 = between(0, 0.9);
  p.c2 = between(-0.9, 0.9);
  p.c3 = between(0, 1);
  p.sinkage_drive = between(0, 3);
  p.sinkage_brake = between(0, 3);
  p.sinkage_lateral = between(0, 3);
  p.side_passive = between(0, 50);
  p.front_passive = between(0, 50);
  p.bulldozing_length = std::pow(10, between(-4, -1));
  p.turn_speed = between(0.01, 1);
  p.turn_spin = between(0, 1);
  p.unit_weight = between(0, 3e4);
  if (one_in(3)) {
    p.pressure_form = kReeceForm;
    p.reece_k_c = between(0, 100);
    p.reece_k_phi = between(1, 2000);
    p.unit_weight += 100;
  }
  if (one_in(3)) p.grouser_height = between(0, 0.2) * wheel.radius_m;
  p.grouser_share = unit(*random);
  return BekkerModel(p, wheel);
}

void SolveRandomInputs(long count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-1, 1), exponent(-9, 4);
  constexpr int kEach = 2000;
  long balanced = 0, flagged = 0;
  Batch batch;
  for (int i = 0; i < kEach; ++i) batch.Add(0, 0, 0, 1);
  for (long done = 0; done < count; done += kEach) {
    const BekkerModel model = RandomModel(&random);
    for (int i = 0; i < kEach; ++i) {
      batch.v_x[i] = any(random);
      batch.v_y[i] = i % 3 == 0 ? 0 : any(random);
      batch.rim[i] = i % 7 == 0 ? batch.v_x[i] : any(random);
      if (i % 11 < 3) (i % 11 == 0 ? batch.v_x : i % 11 == 1 ? batch.v_y : batch.rim)[i] = 0;
      batch.load[i] = std::pow(10, exponent(random));
    }
    batch.Solve(model, true);
    for (int i = 0; i < kEach; ++i) {
      for (int o = 0; o < kOutputs; ++o) {
        ASSERT_TRUE(std::isfinite(batch.value[o][i])) << done << " " << i << " " << o;
        for (const auto& g : batch.gradient[o]) {
          ASSERT_TRUE(std::isfinite(g[i])) << done << " " << i << " " << o;
        }
      }
      const double load = batch.load[i], sinkage = batch.value[kSinkage][i];
      ASSERT_GT(sinkage, 0) << done << " " << i;
      ASSERT_LE(sinkage, model.max_sinkage() * (1 + 1e-9)) << done << " " << i;
      const bool still = batch.v_x[i] == 0 && batch.v_y[i] == 0 && batch.rim[i] == 0;
      if (batch.no_equilibrium[i]) {
        ++flagged;
        ASSERT_LT(batch.value[kFz][i], load) << done << " " << i;
        ASSERT_NEAR(sinkage, model.max_sinkage(), 1e-9 * sinkage) << done << " " << i;
      } else if (!still) {
        ++balanced;
        const Canonical s = ToCanonical(batch.v_x[i], batch.v_y[i], batch.rim[i]);
        const double carried = model.AtSinkage(s, sinkage, BekkerModel::Points::kLaw).value[kFz];
        ASSERT_NEAR(carried / load, 1, 1e-9)
            << done << " " << i << ": " << batch.v_x[i] << " " << batch.v_y[i] << " "
            << batch.rim[i] << " " << load << " n " << model.parameters().n;
      }
    }
  }
  std::printf("%ld balanced, %ld without equilibrium\n", balanced, flagged);
  EXPECT_GT(balanced, count / 2);
  EXPECT_GT(flagged, 0);
}

}  // namespace grouser::surrogate::hard_cases

// The stresses of the Bekker model, one by one and against its own integrals.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "surrogate/models/bekker.h"
#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

// Passive pressure on sides and blade is no stress of the rim.
BekkerParameters RimAlone() {
  BekkerParameters p;
  p.side_passive = p.front_passive = 0;
  p.cohesion = 300;
  p.grouser_height = 0.006;
  return p;
}

Canonical StateAt(double slip, double angle) {
  const VelocityState v = FromSlip(slip, angle, 0.1);
  return ToCanonical(v.v_x, v.v_y, v.rim_speed);
}

TEST(BekkerStress, IntegratesToTheForcesOfTheModel) {
  const BekkerModel model(RimAlone(), kWheel);
  const double r = kWheel.radius_m, area = r * kWheel.width_m;
  const double e = model.shear_radius_ratio();
  constexpr int kSteps = 50000;
  const double step = 3.4 / kSteps;
  std::vector<double> angle(kSteps);
  for (int i = 0; i < kSteps; ++i) angle[i] = -1.7 + (i + 0.5) * step;
  std::vector<RimStress> stress(kSteps);
  for (const double slip : {-1.3, -0.4, 0.0, 0.35, 0.9}) {
    for (const double beta : {0.0, 0.6, 1.4}) {
      const Canonical state = StateAt(slip, beta);
      if (!std::isfinite(state.forward)) continue;
      for (const double z : {0.004, 0.02, 0.06}) {
        model.StressesAt(state, z, angle, stress);
        double f_x = 0, f_y = 0, f_z = 0, torque = 0;
        for (int i = 0; i < kSteps; ++i) {
          const double s = std::sin(angle[i]), c = std::cos(angle[i]);
          f_x += area * step * (stress[i].tangential * c - stress[i].normal * s);
          f_y += area * step * stress[i].axial;
          f_z += area * step * (stress[i].normal * c + stress[i].tangential * s);
          torque += e * area * r * step * stress[i].tangential;
        }
        const auto sum = model.AtSinkage(state, z, BekkerModel::Points::kFine).value;
        const double load = sum[kFz];
        const std::string where = "slip " + std::to_string(slip) + " beta " + std::to_string(beta) +
                                  " z " + std::to_string(z);
        EXPECT_NEAR(f_z, load, 1e-5 * load) << where;
        EXPECT_NEAR(f_x, sum[kFx], 1e-5 * load) << where;
        EXPECT_NEAR(f_y, sum[kFy], 1e-5 * load) << where;
        EXPECT_NEAR(torque, sum[kTorque], 1e-5 * load * r) << where;
      }
    }
  }
}

// Wong & Reece's and Janosi & Hanamoto's formulas written out, of a driven wheel.
TEST(BekkerStress, IsThePublishedLawAtAPoint) {
  BekkerParameters p;
  p.turn_speed = 0.01;  // no swap of entry and exit, as in the formulas
  p.turn_spin = 1;
  p.c1 = 0.35;
  p.n = 0.8;
  const BekkerModel model(p, kWheel);
  const double slip = 0.4, z = 0.01, r = kWheel.radius_m;
  const double front = std::acos(1 - z / r), rear = p.c3 * front;
  const double peak = (p.c1 + p.c2 * slip) * front;
  const double depth_scale = std::exp(p.sinkage_drive * slip * slip / (slip + 0.05));
  double highest = 0, highest_at = 0;
  for (double theta = -1.2 * rear; theta < 1.1 * front; theta += 0.01 * front) {
    const RimStress at = model.StressAt(StateAt(slip, 0), z, theta);
    if (at.normal > highest) {
      highest = at.normal;
      highest_at = theta;
    }
    if (theta < -1.01 * rear || theta > 1.01 * front) {  // the swap moves the edges a little
      EXPECT_EQ(at.normal, 0);
      EXPECT_EQ(at.tangential, 0);
    }
    if (theta < -rear || theta > front) continue;
    const double mapped =
        theta >= peak ? theta : front - (theta + rear) / (peak + rear) * (front - peak);
    const double h = r * (std::cos(mapped) - std::cos(front));
    const double sigma = p.k_phi * std::pow(h / depth_scale, p.n);
    const double j = r * ((front - theta) - (1 - slip) * (std::sin(front) - std::sin(theta)));
    const double tau = sigma * std::tan(p.friction_angle) * (1 - std::exp(-j / p.shear_modulus));
    EXPECT_NEAR(at.normal, sigma, 0.01 * highest) << theta;
    EXPECT_NEAR(at.tangential, tau, 0.01 * highest) << theta;
    EXPECT_EQ(at.axial, 0);
  }
  EXPECT_NEAR(highest_at, peak, 0.02 * front);
}

}  // namespace
}  // namespace grouser::surrogate

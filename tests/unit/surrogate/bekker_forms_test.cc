#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "surrogate/models/bekker.h"
#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

// Stress a flat plate as wide as the wheel would feel, from F_z of the wheel:
// both forms with the same k must give the same wheel.
TEST(BekkerForms, ReeceIsBekkerWithTheModulusOfTheWidth) {
  BekkerParameters reece;
  reece.n = 0.8;
  reece.cohesion = 800;
  reece.unit_weight = 15e3;
  reece.pressure_form = kReeceForm;
  reece.reece_k_c = 12;
  reece.reece_k_phi = 90;
  reece.k_phi = -1;  // not read in this form
  for (const double width : {0.03, 0.05, 0.2}) {
    BekkerParameters bekker = reece;
    bekker.pressure_form = kBekkerForm;
    bekker.k_c = 0;
    bekker.k_phi = (800 * 12 + 15e3 * width * 90) / std::pow(width, 0.8);
    const auto a = BekkerModel(reece, {0.0625, width}).Solve(0.1, 0.02, 0.13, 24).value;
    const auto b = BekkerModel(bekker, {0.0625, width}).Solve(0.1, 0.02, 0.13, 24).value;
    for (int o = 0; o < kOutputs; ++o) EXPECT_NEAR(a[o], b[o], 1e-9 * (1 + std::fabs(b[o])));
  }
}

TEST(BekkerForms, RefusesAFormThatIsNone) {
  BekkerParameters p;
  p.pressure_form = 0.5;
  EXPECT_THROW(BekkerModel(p, kWheel), std::invalid_argument);
  p.pressure_form = kReeceForm;  // without its moduli
  EXPECT_THROW(BekkerModel(p, kWheel), std::invalid_argument);
  p.reece_k_phi = 50;
  EXPECT_NO_THROW(BekkerModel(p, kWheel));
}

TEST(BekkerForms, GrousersOfNoHeightOrShareChangeNoBit) {
  BekkerParameters none, unshared;
  none.grouser_share = 1;
  unshared.grouser_height = 0.02;
  unshared.grouser_share = 0;
  const BekkerModel plain(BekkerParameters{}, kWheel), a(none, kWheel), b(unshared, kWheel);
  for (double rim = -0.3; rim < 0.5; rim += 0.05) {
    const auto want = plain.Solve(0.2, 0.07, rim, 24).value;
    EXPECT_EQ(a.Solve(0.2, 0.07, rim, 24).value, want);
    EXPECT_EQ(b.Solve(0.2, 0.07, rim, 24).value, want);
  }
}

// Ding et al. 2011: tau acts at r_s on an area in proportion to it. Where the
// shear is fully mobilised (K tiny) the torque at a sinkage grows as r_s^2.
TEST(BekkerForms, GrousersShearAtTheirOwnRadius) {
  BekkerParameters p;
  p.shear_modulus = 1e-5;
  BekkerParameters lugs = p;
  lugs.grouser_height = 0.01;
  lugs.grouser_share = 0.5;
  const BekkerModel rim(p, kWheel), tips(lugs, kWheel);
  const double ratio = (0.0625 + 0.005) / 0.0625;
  EXPECT_DOUBLE_EQ(tips.shear_radius_ratio(), ratio);
  const Canonical state = ToCanonical(0.02, 0, 0.1);
  const auto fine = BekkerModel::Points::kFine;
  const auto a = rim.AtSinkage(state, 0.015, fine).value;
  const auto b = tips.AtSinkage(state, 0.015, fine).value;
  EXPECT_NEAR(b[kTorque] / a[kTorque], ratio * ratio, 1e-3);
  // At equal load: more pull and more torque than the smooth rim.
  const auto smooth = rim.Solve(0.1, 0, 0.15, 24).value,
             lugged = tips.Solve(0.1, 0, 0.15, 24).value;
  EXPECT_GT(lugged[kFx], smooth[kFx]);
  EXPECT_GT(lugged[kTorque], smooth[kTorque]);
}

}  // namespace
}  // namespace grouser::surrogate

// A model of the bekker kind as users ask it: the law itself, in batches.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "surrogate/models/hybrid.h"
#include "surrogate/models/state_batch.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/surrogate/hard_cases.h"
#include "tests/unit/surrogate/small_wheel.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using testing::Anywhere;

// Soft to hard, cohesive, short of shear, with grousers, and in Reece's form.
std::vector<BekkerParameters> Soils() {
  std::vector<BekkerParameters> soils = hard_cases::Soils();
  soils.push_back(hard_cases::With(&BekkerParameters::k_phi, 2e4));
  soils.push_back(hard_cases::With(&BekkerParameters::k_phi, 5e8));
  BekkerParameters reece = hard_cases::With(&BekkerParameters::pressure_form, kReeceForm);
  reece.reece_k_c = 30;
  reece.reece_k_phi = 900;
  reece.cohesion = 500;
  soils.push_back(reece);
  return soils;
}

HybridModel Model(const BekkerParameters& soil) {
  TrainingDomain hull;
  hull.attack_angle_max_rad = 0.6;
  hull.load_min_n = 12;
  hull.load_max_n = 60;
  Uncertainty u;
  for (int o = 0; o < kOutputs; ++o) {
    u.fit_inside[o] = u.patch[o] = 0.01 * (o + 1);
    u.fit_growth[o] = 0.3;
    u.interval_factor[o] = 1.7;
  }
  return HybridModel(BekkerModel(soil, kWheel), {}, hull, u);
}

HybridModel ByLaw(const BekkerParameters& soil) {
  HybridModel model = Model(soil);
  model.Prepare();
  return model;
}

// Braked, towed, driven, locked, turning back, across, at rest.
StateBatch Grid() {
  std::vector<std::array<double, 4>> states;
  for (const double x : {-0.2, -1e-3, 0.0, 0.05, 0.2}) {
    for (const double y : {-0.2, -1e-6, 0.0, 0.1}) {
      for (const double rim : {-0.2, 0.0, 0.05, 0.2}) {
        for (const double load : {0.1, 24.0, 90.0, 5e3}) states.push_back({x, y, rim, load});
      }
    }
  }
  StateBatch b(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    b.Set(i, states[i][0], states[i][1], states[i][2], states[i][3]);
  }
  return b;
}

void ExpectTheLaw(const HybridModel& model, StateBatch b) {
  model.Evaluate(b.In(), b.Out());
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const WheelAnswer want = model.EvaluateOne(b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]);
    ASSERT_EQ(b.flags[i], want.flags) << i;
    for (int o = 0; o < kOutputs; ++o) {
      const auto& p = b.part[o];
      ASSERT_EQ(p[kValue][i], want.value[o]) << i << " " << kOutputFields[o].name;
      const double half = want.half_width[o];
      ASSERT_NEAR(p[kHigh][i] - p[kValue][i], half, 1e-5 * half) << i;
      ASSERT_NEAR(p[kValue][i] - p[kLow][i], half, 1e-5 * half) << i;
      ASSERT_NEAR(p[kSdPatch][i], want.sd_patch[o], 1e-6 * want.sd_patch[o]) << i;
    }
  }
}

TEST(LawModel, ABatchIsTheScalarLawOnAGrid) {
  for (const BekkerParameters& soil : Soils()) ExpectTheLaw(ByLaw(soil), Grid());
}

TEST(LawModel, ABatchIsTheScalarLawAtAHundredThousandStates) {
  unsigned seed = 0;
  for (const BekkerParameters& soil : Soils()) ExpectTheLaw(ByLaw(soil), Anywhere(12500, ++seed));
}

TEST(LawModel, SaysWhereThereIsNoEquilibrium) {
  StateBatch b = Grid();
  const HybridModel model = ByLaw(Soils().front());
  model.Evaluate(b.In(), b.Out());
  int lost = 0, deep = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const double sinkage = b.part[kSinkage][kValue][i];
    if ((b.flags[i] & kNoEquilibrium) != 0) {
      ++lost;
      EXPECT_EQ(sinkage, model.physics().max_sinkage());
      EXPECT_LT(b.part[kFz][kValue][i], b.load[i]);
    } else {
      EXPECT_NEAR(b.part[kFz][kValue][i] / b.load[i], 1, 1e-9);
    }
    deep += sinkage > 0.7 * kWheel.radius_m;
    EXPECT_TRUE(sinkage <= 0.7 * kWheel.radius_m || (b.flags[i] & kExtrapolated) != 0);
  }
  EXPECT_GT(lost, 10);
  EXPECT_GT(deep, lost);
}

TEST(LawModel, GradientsAreThoseOfTheLaw) {
  const HybridModel model = ByLaw(Soils()[4]);
  StateBatch b = Anywhere(2000, 9);
  model.Evaluate(b.In(), b.Out());
  int compared = 0;
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const double hub = std::hypot(b.v_x[i], b.v_y[i]), rim = std::fabs(b.rim_speed[i]);
    const double speed = std::max(hub, rim);
    if (std::min({std::fabs(hub - rim), rim, std::fabs(b.v_x[i])}) < 1e-3 * speed) continue;
    for (int k = 0; k < kInputs; ++k) {
      double at[2][kInputs];
      const double step = 1e-5 * (k == kLoad ? b.load[i] : speed);
      WheelAnswer side[2];
      for (int s = 0; s < 2; ++s) {
        const double now[kInputs] = {b.v_x[i], b.v_y[i], b.rim_speed[i], b.load[i]};
        std::memcpy(at[s], now, sizeof now);
        at[s][k] += s == 0 ? -step : step;
        side[s] = model.EvaluateOne(at[s][kVx], at[s][kVy], at[s][kRimSpeed], at[s][kLoad]);
      }
      if (((side[0].flags ^ side[1].flags) & kNoEquilibrium) != 0) continue;
      for (int o = 0; o < kOutputs; ++o) {
        const double want = (side[1].value[o] - side[0].value[o]) / (at[1][k] - at[0][k]);
        const double unit = hard_cases::Scale(o, b.load[i], kWheel.radius_m) * 1e-5 / step;
        ASSERT_NEAR(b.part[o][kDvX + k][i], want, 1e-4 * unit + 1e-4 * std::fabs(want))
            << i << " " << kOutputFields[o].name << " by " << k;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 20000);
}

TEST(LawModel, EveryInstructionSetGivesTheSameBits) {
  HybridModel model = ByLaw(Soils()[1]);
  StateBatch plain = Anywhere(301, 3), wide = plain;
  ASSERT_TRUE(model.SelectIsa("baseline"));
  model.Evaluate(plain.In(), plain.Out());
  for (const char* isa : {"avx2", "avx512"}) {
    if (!model.SelectIsa(isa)) continue;  // not this machine's
    model.Evaluate(wide.In(), wide.Out());
    EXPECT_EQ(wide.flags, plain.flags);
    for (int o = 0; o < kOutputs; ++o) {
      for (int p = 0; p < kParts; ++p) {
        EXPECT_EQ(std::memcmp(wide.part[o][p].data(), plain.part[o][p].data(), 301 * 8), 0)
            << isa << " " << kOutputFields[o].name << " " << p;
      }
    }
  }
}

TEST(LawModel, BadStatesHarmNoOtherAndNothingIsAllocated) {
  const HybridModel model = ByLaw(Soils().front());
  StateBatch b = Anywhere(100, 4), good = b;
  model.Evaluate(good.In(), good.Out());
  b.Set(3, std::nan(""), 0, 0, 24);
  b.Set(40, 0.1, 0, 0.1, -1);
  const auto in = b.In();
  const auto out = b.Out();
  const long before = g_allocations;
  model.Evaluate(in, out);
  EXPECT_EQ(g_allocations, before);
  for (std::size_t i = 0; i < b.load.size(); ++i) {
    const bool bad = i == 3 || i == 40;
    EXPECT_EQ((b.flags[i] & kInvalid) != 0, bad);
    for (int o = 0; o < kOutputs; ++o) {
      if (bad) {
        EXPECT_TRUE(std::isnan(b.part[o][kValue][i]));
        EXPECT_TRUE(std::isnan(b.part[o][kDvX][i]));
      } else {
        EXPECT_EQ(b.part[o][kValue][i], good.part[o][kValue][i]);
      }
    }
  }
}

}  // namespace
}  // namespace grouser::surrogate

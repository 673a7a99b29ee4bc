// States and soils where terramechanics codes break: each must give a finite,
// balanced, continuous answer, or say that there is none.
#include "tests/unit/surrogate/hard_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "surrogate/models/hybrid.h"
#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

using hard_cases::Batch;
using hard_cases::Clay;
using hard_cases::Soils;
using hard_cases::With;

void ExpectSane(const BekkerModel& model, Batch* batch) {
  batch->Solve(model, true);
  for (std::size_t i = 0; i < batch->size(); ++i) {
    const double load = batch->load[i];
    const auto scalar = model.Solve(batch->v_x[i], batch->v_y[i], batch->rim[i], load);
    ASSERT_EQ(scalar.no_equilibrium, batch->no_equilibrium[i] != 0) << i << " load " << load;
    for (int o = 0; o < kOutputs; ++o) {
      ASSERT_TRUE(std::isfinite(batch->value[o][i])) << i << " " << o;
      ASSERT_EQ(batch->value[o][i], scalar.value[o]) << i << " " << o;
      for (const auto& g : batch->gradient[o]) ASSERT_TRUE(std::isfinite(g[i])) << i << " " << o;
    }
    if (!batch->no_equilibrium[i]) {
      ASSERT_NEAR(batch->value[kFz][i] / load, 1, 1e-9);
    }
  }
}

// Every soil as a table: where it says that there is no equilibrium, so does the law.
TEST(HardCases, TablesOfAnySoilKnowWhereTheLoadIsTooLarge) {
  TrainingDomain hull;
  hull.attack_angle_max_rad = 1.5;
  hull.load_min_n = 20;
  hull.load_max_n = 5000;
  int lost = 0, all = 0, other = 0;
  for (const BekkerParameters& soil : Soils()) {
    HybridModel model(BekkerModel(soil, kWheel), {}, hull, Uncertainty{});
    model.Tabulate({30, 12, 0.5});
    const HybridModel law(BekkerModel(soil, kWheel), {}, hull, Uncertainty{});
    for (const double slip : {-0.95, -0.5, -0.1, 0.2, 0.7}) {
      for (const double angle : {0.0, 0.4, 1.1, 1.5}) {
        const VelocityState v = FromSlip(slip, angle, 0.1);
        for (double load = 20; load < 5000; load *= 1.3) {
          const WheelAnswer tabulated = AnswerOf(model, v, load);
          const double f_z = tabulated.value[kFz];
          const std::uint32_t flags = tabulated.flags;
          const WheelAnswer exact = law.EvaluateOne(v.v_x, v.v_y, v.rim_speed, load);
          ASSERT_TRUE(std::isfinite(f_z));
          ASSERT_GE(f_z, 0);
          ASSERT_LE(f_z, load * (1 + 1e-6));
          lost += (exact.flags & kNoEquilibrium) != 0;
          other += ((exact.flags ^ flags) & kNoEquilibrium) != 0;
          ++all;
        }
      }
    }
  }
  RecordProperty("other", other);
  EXPECT_GT(lost, all / 20);
  EXPECT_LT(other, all / 50);  // a coarse grid, near the border
}

Batch AllKindsOfMotion(double load) {
  Batch b;
  for (const double x : {-1.0, -0.3, 0.0, 0.2, 1.0}) {
    for (const double y : {-0.7, 0.0, 1e-9, 0.4}) {
      for (const double u : {-1.0, -0.2, 0.0, 0.2, 0.6}) {
        if (x != 0 || y != 0 || u != 0) b.Add(x, y, u, load);
      }
    }
  }
  return b;
}

TEST(HardCases, TinyLoads) {
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    double last = 0;
    for (double load = 1e-9; load < 1e-2; load *= 10) {
      Batch b = AllKindsOfMotion(load);
      ExpectSane(model, &b);
      EXPECT_GT(b.value[kSinkage][0], last);
      last = b.value[kSinkage][0];
      for (std::size_t i = 0; i < b.size(); ++i) {  // forces vanish with the load
        EXPECT_LT(std::hypot(b.value[kFx][i], b.value[kFy][i]), 3 * load) << i << " " << load;
      }
    }
  }
}

TEST(HardCases, Overload) {
  const BekkerModel model(With(&BekkerParameters::k_phi, 1e3), kWheel);
  for (const double load : {50.0, 1e3, 1e9, 1e300}) {
    Batch b = AllKindsOfMotion(load);
    b.Solve(model, true);
    for (std::size_t i = 0; i < b.size(); ++i) {
      ASSERT_TRUE(b.no_equilibrium[i]);
      EXPECT_NEAR(b.value[kSinkage][i], model.max_sinkage(), 1e-12);
      EXPECT_LT(b.value[kFz][i], load);
      for (int o = 0; o < kOutputs; ++o) {
        EXPECT_TRUE(std::isfinite(b.value[o][i]));
        EXPECT_EQ(b.gradient[o][kLoad][i], 0);
      }
    }
  }
}

TEST(HardCases, Static) {
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    Batch b;
    for (double load = 1e-6; load < 1e3; load *= 7) b.Add(0, 0, 0, load);
    b.Solve(model, true);
    for (std::size_t i = 0; i < b.size(); ++i) {
      const auto want = model.Solve(0, 0, 0, b.load[i]);
      ASSERT_EQ(want.no_equilibrium, b.no_equilibrium[i] != 0);
      for (const Output o : {kFx, kFy, kTorque, kMz}) EXPECT_EQ(b.value[o][i], 0);
      EXPECT_EQ(b.value[kSinkage][i], want.value[kSinkage]);
      for (int o = 0; o < kOutputs; ++o) {
        for (const int k : {kVx, kVy, kRimSpeed}) EXPECT_EQ(b.gradient[o][k][i], 0);
      }
      if (!want.no_equilibrium) {
        EXPECT_GT(b.gradient[kSinkage][kLoad][i], 0);
      }
    }
  }
}

TEST(HardCases, CohesionlessAndPurelyCohesive) {
  for (const BekkerParameters& soil : {With(&BekkerParameters::cohesion, 0), Clay()}) {
    Batch b = AllKindsOfMotion(24);
    ExpectSane(BekkerModel(soil, kWheel), &b);
  }
}

TEST(HardCases, SinkageExponentFromATenthToOneAndAHalf) {
  for (double n = 0.1; n < 1.61; n += 0.1) {
    const BekkerModel model(With(&BekkerParameters::n, n), kWheel);
    for (const double load : {1e-3, 1.0, 24.0, 200.0}) {
      Batch b = AllKindsOfMotion(load);
      ExpectSane(model, &b);
    }
  }
}

TEST(HardCases, FrictionAngleNearZero) {
  for (const double angle : {0.0, 1e-300, 1e-12, 1e-3}) {
    Batch b = AllKindsOfMotion(24);
    ExpectSane(BekkerModel(With(&BekkerParameters::friction_angle, angle), kWheel), &b);
  }
  // Nothing shears: rolling resistance alone, no torque, no side force but the heap's.
  BekkerParameters slick;
  slick.friction_angle = 0;
  slick.side_passive = 0;
  Batch b;
  b.Add(0.1, 0.05, 0.2, 24);
  b.Solve(BekkerModel(slick, kWheel));
  EXPECT_EQ(b.value[kTorque][0], 0);
  EXPECT_EQ(b.value[kFy][0], 0);
  EXPECT_LT(b.value[kFx][0], 0);
}

TEST(HardCases, NegativeCohesiveModulus) {
  BekkerParameters p;
  p.k_phi = 3581.8e3;
  p.k_c = -44.06e3;  // KLS-1
  p.n = 1.2594;
  Batch b = AllKindsOfMotion(24);
  ExpectSane(BekkerModel(p, kWheel), &b);
  p.k_c = -0.999 * p.k_phi * kWheel.width_m;  // hardly any modulus left
  Batch soft = AllKindsOfMotion(0.1);
  ExpectSane(BekkerModel(p, kWheel), &soft);
}

// (Ten million: hard_cases_slow_test.cc.)
TEST(HardCases, RandomInputsWithoutAFailedSolve) { hard_cases::SolveRandomInputs(200'000, 11); }

TEST(HardCases, MirrorSymmetryIsExact) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int soil = 0; soil < 20; ++soil) {
    const BekkerModel model = hard_cases::RandomModel(&random);
    Batch b, left, back;
    for (int i = 0; i < 500; ++i) {
      const double x = any(random), y = any(random), u = any(random);
      const double load = std::pow(10, 3 * any(random));
      b.Add(x, y, u, load);
      left.Add(x, -y, u, load);
      back.Add(-x, y, -u, load);
    }
    for (Batch* each : {&b, &left, &back}) each->Solve(model, true);
    for (std::size_t i = 0; i < b.size(); ++i) {
      for (int o = 0; o < kOutputs; ++o) {
        const double odd_y = o == kFy || o == kMz ? -1 : 1;
        const double odd_x = o == kFx || o == kTorque || o == kMz ? -1 : 1;
        ASSERT_EQ(b.value[o][i], odd_y * left.value[o][i]);
        ASSERT_EQ(b.value[o][i], odd_x * back.value[o][i]);
        for (int k = 0; k < kInputs; ++k) {
          const double turn_y = k == kVy ? -odd_y : odd_y;
          const double turn_x = k == kVx || k == kRimSpeed ? -odd_x : odd_x;
          ASSERT_EQ(b.gradient[o][k][i], turn_y * left.gradient[o][k][i]);
          ASSERT_EQ(b.gradient[o][k][i], turn_x * back.gradient[o][k][i]);
        }
      }
    }
  }
}

TEST(HardCases, TheSoilNeverGivesPower) {
  std::mt19937_64 random(22);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    Batch b;
    for (int i = 0; i < 20000; ++i) {
      b.Add(any(random), i % 2 == 0 ? 0 : any(random), any(random), std::pow(10, 2 * any(random)));
    }
    b.Solve(model);
    for (std::size_t i = 0; i < b.size(); ++i) {
      const double power = b.value[kTorque][i] * b.rim[i] / kWheel.radius_m -
                           b.value[kFx][i] * b.v_x[i] - b.value[kFy][i] * b.v_y[i];
      const double speed = std::max(std::hypot(b.v_x[i], b.v_y[i]), std::fabs(b.rim[i]));
      ASSERT_GT(power, -1e-3 * b.load[i] * speed)
          << b.v_x[i] << " " << b.v_y[i] << " " << b.rim[i] << " " << b.load[i] << " z "
          << b.value[kSinkage][i];
    }
  }
}

TEST(HardCases, SinkageGrowsWithLoad) {
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    for (double angle = 0; angle < 2 * kPi; angle += 0.3) {
      for (const double y : {0.0, 0.5}) {
        Batch b;
        for (double load = 1e-9; load < 1e5; load *= 1.05) {
          b.Add(std::cos(angle), y, std::sin(angle), load);
        }
        b.Solve(model, true);
        for (std::size_t i = 1; i < b.size(); ++i) {
          const double before = b.value[kSinkage][i - 1], now = b.value[kSinkage][i];
          if (b.no_equilibrium[i - 1]) {
            ASSERT_EQ(now, before);
          } else {
            ASSERT_GT(now, before) << "angle " << angle << " load " << b.load[i];
            ASSERT_GT(b.gradient[kSinkage][kLoad][i - 1], 0);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace grouser::surrogate

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "surrogate/models/bekker.h"
#include "surrogate/models/bekker_batch.h"
#include "surrogate/models/isa.h"
#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

struct States {
  std::vector<double> v_x, v_y, rim, load;

  std::size_t size() const { return load.size(); }
  void Add(double x, double y, double u, double w) {
    v_x.push_back(x);
    v_y.push_back(y);
    rim.push_back(u);
    load.push_back(w);
  }
};

struct Results {
  std::array<std::vector<double>, kOutputs> value;
  std::array<std::array<std::vector<double>, kInputs>, kOutputs> gradient;
  std::vector<std::uint8_t> no_equilibrium;
};

Results SolveAll(const BekkerModel& model, const States& s, bool gradients) {
  Results r;
  BekkerBatch batch;
  batch.v_x = s.v_x;
  batch.v_y = s.v_y;
  batch.rim_speed = s.rim;
  batch.load = s.load;
  r.no_equilibrium.resize(s.size());
  batch.no_equilibrium = r.no_equilibrium;
  for (int o = 0; o < kOutputs; ++o) {
    r.value[o].resize(s.size());
    batch.value[o] = r.value[o];
    for (int i = 0; i < kInputs && gradients; ++i) {
      r.gradient[o][i].resize(s.size());
      batch.gradient[o][i] = r.gradient[o][i];
    }
  }
  model.SolveBatch(batch);
  return r;
}

// Braking, towed, driven, lateral and mixed states in turn.
States RandomStates(int n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-1, 1), unit(0, 1);
  States s;
  for (int i = 0; i < n; ++i) {
    const double load = 24 * std::exp(1.2 * any(random)), v = 0.1 + 0.4 * unit(random);
    switch (i % 5) {
      case 0:
        s.Add(v, 0, v * unit(random), load);
        break;  // braking
      case 1:
        s.Add(v, 0.02 * any(random), v * (1 + 0.05 * any(random)), load);
        break;  // towed
      case 2:
        s.Add(v * unit(random), 0, v, load);
        break;  // driven
      case 3:
        s.Add(0.2 * v * any(random), v, v * any(random), load);
        break;  // lateral
      default:
        s.Add(any(random), any(random), any(random), load);
    }
  }
  return s;
}

std::vector<BekkerParameters> SomeSoils() {
  std::vector<BekkerParameters> soils(4);
  soils[1].n = 0.6;
  soils[1].cohesion = 3e3;
  soils[1].friction_angle = 0.3;
  soils[1].k_phi = 1.5e5;
  soils[2].n = 1.3;
  soils[2].shear_modulus = 0.03;
  soils[2].c3 = 0;
  soils[2].k_phi = 3e6;
  soils[3].n = 0.9;
  soils[3].grouser_height = 0.01;
  soils[3].side_passive = 12;
  soils[3].bulldozing_length = 0.004;
  return soils;
}

double Scale(int output, double load) {
  if (output == kSinkage) return kWheel.radius_m;
  return output == kTorque || output == kMz ? load * kWheel.radius_m : load;
}

TEST(Batch, GivesTheScalarCodesForcesAtItsOwnSinkageAndBalancesTheLoad) {
  for (const BekkerParameters& soil : SomeSoils()) {
    const BekkerModel model(soil, kWheel);
    const States s = RandomStates(4000, 1);
    const Results r = SolveAll(model, s, false);
    for (std::size_t i = 0; i < s.size(); ++i) {
      const Canonical state = ToCanonical(s.v_x[i], s.v_y[i], s.rim[i]);
      auto want = model.AtSinkage(state, r.value[kSinkage][i], BekkerModel::Points::kLaw).value;
      ApplyMirrors(state, &want);
      ASSERT_LE(r.value[kSinkage][i], model.max_sinkage() * (1 + 1e-12));
      if (r.no_equilibrium[i]) {
        EXPECT_LT(want[kFz], s.load[i]);
      } else {
        ASSERT_NEAR(want[kFz] / s.load[i], 1, 1e-9) << i;
      }
      for (int o = 0; o < kOutputs; ++o) {
        ASSERT_NEAR(r.value[o][i], want[o], 1e-9 * Scale(o, s.load[i])) << i << " " << o;
      }
    }
  }
}

TEST(Batch, IsTheScalarSolverBitByBit) {
  for (const BekkerParameters& soil : SomeSoils()) {
    const BekkerModel model(soil, kWheel);
    const States s = RandomStates(25000, 7);
    const Results r = SolveAll(model, s, false);
    for (std::size_t i = 0; i < s.size(); ++i) {
      const auto scalar = model.Solve(s.v_x[i], s.v_y[i], s.rim[i], s.load[i]);
      ASSERT_EQ(scalar.no_equilibrium, r.no_equilibrium[i] != 0) << i;
      for (int o = 0; o < kOutputs; ++o) ASSERT_EQ(scalar.value[o], r.value[o][i]) << i << " " << o;
    }
  }
}

TEST(Batch, AgreesWithAFineQuadrature) {
  for (const BekkerParameters& soil : SomeSoils()) {
    const BekkerModel model(soil, kWheel);
    const States s = RandomStates(2000, 2);
    const Results r = SolveAll(model, s, false);
    std::vector<double> errors;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (r.no_equilibrium[i]) continue;
      const Canonical state = ToCanonical(s.v_x[i], s.v_y[i], s.rim[i]);
      auto fine = model.AtSinkage(state, r.value[kSinkage][i], BekkerModel::Points::kFine).value;
      ApplyMirrors(state, &fine);
      double error = 0;
      for (int o = 0; o < kOutputs; ++o) {
        const double scale = Scale(o, s.load[i]);
        error = std::max(error, std::fabs(r.value[o][i] - fine[o]) / scale);
      }
      errors.push_back(error);
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 3e-5);
    EXPECT_LT(errors[errors.size() * 99 / 100], 1e-4);
    EXPECT_LT(errors.back(), 1e-4);
  }
}

// Distance of a state from where the model has a corner (see BekkerBatch).
double FromCorner(const States& s, std::size_t i) {
  const double hub = std::hypot(s.v_x[i], s.v_y[i]), rim = std::fabs(s.rim[i]);
  return std::min({std::fabs(hub - rim), rim, std::fabs(s.v_x[i])}) / std::max(hub, rim);
}

TEST(Batch, GradientsAgreeWithCentralDifferences) {
  int compared = 0;
  for (const BekkerParameters& soil : SomeSoils()) {
    const BekkerModel model(soil, kWheel);
    const States s = RandomStates(3000, 3);
    const Results r = SolveAll(model, s, true);
    for (int input = 0; input < kInputs; ++input) {
      States up = s, down = s;
      std::vector<double> step(s.size());
      for (std::size_t i = 0; i < s.size(); ++i) {
        const double speed = std::max(std::hypot(s.v_x[i], s.v_y[i]), std::fabs(s.rim[i]));
        step[i] = 1e-5 * (input == kLoad ? s.load[i] : speed);
        auto at = [&](States& t) -> double& {
          return (input == kVx         ? t.v_x
                  : input == kVy       ? t.v_y
                  : input == kRimSpeed ? t.rim
                                       : t.load)[i];
        };
        at(up) += step[i];
        at(down) -= step[i];
      }
      const Results more = SolveAll(model, up, false), less = SolveAll(model, down, false);
      for (std::size_t i = 0; i < s.size(); ++i) {
        if (FromCorner(s, i) < 1e-4) continue;
        if (more.no_equilibrium[i] != less.no_equilibrium[i]) continue;
        for (int o = 0; o < kOutputs; ++o) {
          const double want = (more.value[o][i] - less.value[o][i]) / (2 * step[i]);
          const double unit = Scale(o, s.load[i]) * 1e-5 / step[i];  // of output per input
          ASSERT_NEAR(r.gradient[o][input][i], want, 1e-4 * unit + 1e-4 * std::fabs(want))
              << "output " << o << " input " << input << " state " << i << ": " << s.v_x[i] << " "
              << s.v_y[i] << " " << s.rim[i] << " " << s.load[i];
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 200000);
}

TEST(Batch, BalanceHoldsInTheGradients) {
  const BekkerModel model(BekkerParameters{}, kWheel);
  const States s = RandomStates(500, 4);
  const Results r = SolveAll(model, s, true);
  for (std::size_t i = 0; i < s.size(); ++i) {
    ASSERT_FALSE(r.no_equilibrium[i]);
    for (const int input : {kVx, kVy, kRimSpeed}) EXPECT_EQ(r.gradient[kFz][input][i], 0);
    EXPECT_NEAR(r.gradient[kFz][kLoad][i], 1, 1e-12);
    EXPECT_GT(r.gradient[kSinkage][kLoad][i], 0);
    // Speed alone changes nothing: the derivative along the velocities is 0.
    for (int o = 0; o < kOutputs; ++o) {
      const auto& g = r.gradient[o];
      const double along = g[kVx][i] * s.v_x[i] + g[kVy][i] * s.v_y[i] + g[kRimSpeed][i] * s.rim[i];
      EXPECT_NEAR(along, 0, 1e-11 * Scale(o, s.load[i]));
    }
  }
}

States Some(const States& s, std::size_t first, std::size_t count) {
  States some;
  for (std::size_t i = first; i < std::min(first + count, s.size()); ++i) {
    some.Add(s.v_x[i], s.v_y[i], s.rim[i], s.load[i]);
  }
  return some;
}

// Alone, by packs of points; in packs of states; across blocks.
TEST(Batch, AnswersDependNeitherOnPlaceNorNeighboursNorGradients) {
  const BekkerModel model(SomeSoils()[1], kWheel);
  const States s = RandomStates(203, 5);
  const Results all = SolveAll(model, s, true), plain = SolveAll(model, s, false);
  for (int o = 0; o < kOutputs; ++o) ASSERT_EQ(plain.value[o], all.value[o]) << o;
  for (const std::size_t size : {1, 2, 3, 5, 8, 11, 70}) {
    for (std::size_t first = 0; first < s.size(); first += size) {
      const Results some = SolveAll(model, Some(s, first, size), true);
      for (std::size_t i = 0; i < some.no_equilibrium.size(); ++i) {
        for (int o = 0; o < kOutputs; ++o) {
          ASSERT_EQ(some.value[o][i], all.value[o][first + i]) << size << " " << i << " " << o;
          for (int k = 0; k < kInputs; ++k) {
            ASSERT_EQ(some.gradient[o][k][i], all.gradient[o][k][first + i]) << size << " " << i;
          }
        }
      }
    }
  }
}

TEST(Batch, EveryInstructionSetGivesTheSameBits) {
  int sets = 0;
  for (const BekkerParameters& soil : SomeSoils()) {
    const BekkerModel model(soil, kWheel);
    const States s = RandomStates(800, 6);
    for (std::size_t first = 0; first < s.size(); first += kStateBlock) {
      StateBlock in{};
      const int count = static_cast<int>(std::min<std::size_t>(s.size() - first, kStateBlock));
      for (int l = 0; l < count; ++l) {
        in.v_x[l] = s.v_x[first + l];
        in.v_y[l] = s.v_y[first + l];
        in.rim_speed[l] = s.rim[first + l];
        in.load[l] = s.load[first + l];
      }
      StateBlock want = in;
      BlockSolverFor("baseline")(model.law(), RulesOfBekker(), true, count, &want);
      for (const char* set : {"avx2", "avx512"}) {
        const BlockSolver solve = BlockSolverFor(set);
        if (solve == nullptr) continue;
        ++sets;
        StateBlock got = in;
        solve(model.law(), RulesOfBekker(), true, count, &got);
        ASSERT_EQ(std::memcmp(got.value, want.value, sizeof(want.value)), 0) << set;
        ASSERT_EQ(std::memcmp(got.gradient, want.gradient, sizeof(want.gradient)), 0) << set;
      }
    }
  }
  if (sets == 0) GTEST_SKIP() << "only one instruction set here";
}

TEST(Batch, ABadStateGivesNaNAndHarmsNoOther) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const BekkerModel model(BekkerParameters{}, kWheel);
  States good, mixed;
  for (int i = 0; i < 10; ++i) good.Add(0.1, 0.02 * i, 0.12, 20 + i);
  mixed = good;
  mixed.v_x[1] = kNaN;
  mixed.load[2] = 0;
  mixed.load[3] = -5;
  mixed.rim[5] = kInf;
  mixed.load[6] = kInf;
  const Results want = SolveAll(model, good, true), got = SolveAll(model, mixed, true);
  for (int i = 0; i < 10; ++i) {
    const bool bad = i == 1 || i == 2 || i == 3 || i == 5 || i == 6;
    for (int o = 0; o < kOutputs; ++o) {
      if (bad) {
        EXPECT_TRUE(std::isnan(got.value[o][i]));
        for (int k = 0; k < kInputs; ++k) EXPECT_TRUE(std::isnan(got.gradient[o][k][i]));
      } else {
        EXPECT_EQ(got.value[o][i], want.value[o][i]);
      }
    }
  }
}

}  // namespace
}  // namespace grouser::surrogate

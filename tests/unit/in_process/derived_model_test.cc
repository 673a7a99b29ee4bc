// Models made of opened ones: similar wheels, mixtures of soils.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "grouser/model.h"
#include "tests/unit/in_process/batch.h"
#include "tests/unit/in_process/on_floor.h"

namespace grouser {
namespace {

constexpr double kMoon = 1.62;
// The same wheel; other grains.
constexpr char kOther[] = GROUSER_OTHER_MODEL;

void ExpectSameAnswers(const Answer& a, const Answer& b) {
  EXPECT_EQ(a.flags, b.flags);
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const OutputAnswer &x = a.output[o], &y = b.output[o];
    EXPECT_TRUE(
        SameBits({x.value, x.sd_fit, x.sd_patch, x.low, x.high, x.d_v_x, x.d_load, x.sd_form},
                 {y.value, y.sd_fit, y.sd_patch, y.low, y.high, y.d_v_x, y.d_load, y.sd_form}))
        << o;
  }
}

TEST(ModelScaled, AsksTheOwnWheelInItsUnits) {
  const Model own = Model::Open(kSmall);
  const double l = 3, g = kMoon / 9.81, force = g * l * l * l, speed = std::sqrt(g * l);
  const Model similar = own.Scaled(3 * 0.0625, kMoon);
  EXPECT_EQ(similar.radius_m(), 3 * 0.0625);
  EXPECT_DOUBLE_EQ(similar.width_m(), 0.15);
  EXPECT_EQ(similar.gravity_m_per_s2(), kMoon);
  EXPECT_EQ(own.gravity_m_per_s2(), 9.81);
  EXPECT_NEAR(similar.domain().load_max_n, force * own.domain().load_max_n, 1e-9);
  EXPECT_NEAR(similar.domain().speed_m_per_s, speed * own.domain().speed_m_per_s, 1e-12);
  EXPECT_EQ(similar.domain().slip_min, own.domain().slip_min);
  EXPECT_EQ(similar.has_gradients(), own.has_gradients());
  const Answer direct = own.Evaluate(State{0.08, 0.02, 0.1, 24});
  const Answer mapped =
      similar.Evaluate(State{0.08 * speed, 0.02 * speed, 0.1 * speed, 24 * force});
  EXPECT_EQ(mapped.flags, direct.flags);
  const double unit[kOutputs] = {force, force, force, force * l, force * l, l};
  for (std::size_t o = 0; o < kOutputs; ++o) {
    EXPECT_NEAR(mapped.output[o].value, unit[o] * direct.output[o].value, 1e-12 * unit[o] * 24);
    EXPECT_NEAR(mapped.output[o].d_v_x, unit[o] / speed * direct.output[o].d_v_x,
                1e-9 * unit[o] / speed * 24);
    EXPECT_GE(mapped.output[o].high - mapped.output[o].low,
              unit[o] * (direct.output[o].high - direct.output[o].low) * (1 - 1e-12));
    EXPECT_EQ(mapped.output[o].sd_soil, 0);
  }
}

TEST(ModelScaled, TheLastOfSeveralCountsAndBackIsTheWheelItself) {
  const Model own = Model::Open(kSmall);
  const State state{0.2, 0.03, 0.23, 60};
  const Model once = own.Scaled(0.125, kMoon);
  ExpectSameAnswers(own.Scaled(0.3, 3.7).Scaled(0.125, kMoon).Evaluate(state),
                    once.Evaluate(state));
  ExpectSameAnswers(once.Scaled(0.0625, 9.81).Evaluate(state), own.Evaluate(state));
  EXPECT_EQ(once.Scaled(0.0625, 9.81).domain().load_max_n, own.domain().load_max_n);
}

TEST(ModelScaled, OutlivesWhatItWasMadeOfAndRefusesNoSize) {
  const Model similar = [] { return Model::Open(kSmall).Scaled(0.1, kMoon); }();
  EXPECT_TRUE(std::isfinite(similar.Evaluate(State{0.1, 0, 0.12, 15}).output[kFx].value));
  EXPECT_THROW(similar.Scaled(-1, 9.81), std::invalid_argument);
  EXPECT_THROW(similar.Scaled(0.1, kNaN), std::invalid_argument);
}

TEST(ModelMixture, IsThatOfItsModels) {
  const Model own = Model::Open(kSmall), other = Model::Open(kOther);
  const Model* both[] = {&own, &other};
  const double weights[] = {3, 1};
  const Model mixture = Model::Mixture(both, weights);
  EXPECT_EQ(mixture.kind(), "mixture");
  EXPECT_EQ(mixture.digest(), "");
  EXPECT_EQ(mixture.soil(), own.soil() + " or " + other.soil());
  EXPECT_GE(mixture.domain().load_min_n, own.domain().load_min_n);
  const State state{0.08, 0.02, 0.1, 24};
  const Answer a = own.Evaluate(state), b = other.Evaluate(state), m = mixture.Evaluate(state);
  EXPECT_EQ(m.flags & ~std::uint32_t{kFormUnknown},
            (a.flags | b.flags) & ~std::uint32_t{kFormUnknown});
  double apart = 0;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const double x = a.output[o].value, y = b.output[o].value;
    const double value = 0.75 * x + 0.25 * y, sd_soil = std::sqrt(3) / 4 * std::fabs(x - y);
    EXPECT_NEAR(m.output[o].value, value, 1e-12 * 24);
    EXPECT_NEAR(m.output[o].sd_soil, sd_soil, 1e-9);
    const double half_a = a.output[o].high - x, half_b = b.output[o].high - y;
    const double half = std::sqrt(0.75 * half_a * half_a + 0.25 * half_b * half_b +
                                  1.6448536269514722 * 1.6448536269514722 * sd_soil * sd_soil);
    EXPECT_NEAR(m.output[o].high, value + half, 1e-9);
    apart += sd_soil;
  }
  EXPECT_GT(apart, 0.1);
}

TEST(ModelMixture, RefusesModelsThatShareNoLoadOrSlip) {
  const Model own = Model::Open(kSmall);
  const Domain d = own.domain();
  const auto refusal = [&](const Model& other, double weight) -> std::string {
    const Model* both[] = {&own, &other};
    const double weights[] = {1, weight};
    try {
      const Domain common = Model::Mixture(both, weights).domain();
      EXPECT_LE(common.load_min_n, common.load_max_n);
      EXPECT_LE(common.slip_min, common.slip_max);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const Model heavy = OnFloor(2 * d.load_max_n, 4 * d.load_max_n, d.slip_min, d.slip_max);
  const std::string text = refusal(heavy, 1);
  std::ostringstream range;
  range << d.load_min_n << " to " << d.load_max_n;
  EXPECT_EQ(text.find("mixture: loads [N] of floor: "), 0u) << text;
  EXPECT_NE(text.find(range.str()), std::string::npos) << text;
  EXPECT_EQ(refusal(heavy, 0), "");  // left out
  EXPECT_EQ(refusal(OnFloor(0.5 * d.load_max_n, 4 * d.load_max_n, d.slip_min, d.slip_max), 1), "");
  const std::string slips =
      refusal(OnFloor(d.load_min_n, d.load_max_n, d.slip_max + 0.1, d.slip_max + 0.2), 1);
  EXPECT_EQ(slips.find("mixture: slips of floor: "), 0u) << slips;
}

// A certain soil's draws, and a half's.
TEST(ModelMixture, ADrawIsThatOfOneModel) {
  const Model own = Model::Open(kSmall), other = Model::Open(kOther);
  const Model* both[] = {&own, &other};
  const double weights[] = {1, 1};
  const Model mixture = Model::Mixture(both, weights);
  const Draws draws(mixture.soil(), 40);
  const auto drawn = [&](const Model& model, std::uint32_t k) {
    Batch batch = MakeBatch(20);
    const std::vector<std::uint32_t> all(20, k);
    EXPECT_TRUE(model.EvaluateDraws(batch.states(), draws, all, batch.answers()));
    batch.out[kFx][0].resize(17);  // not the bad ones
    return batch.out[kFx][0];
  };
  int of_own = 0;
  for (std::uint32_t k = 0; k < 40; ++k) {
    const std::vector<double> got = drawn(mixture, k);
    const bool is_own = SameBits(got, drawn(own, k));
    EXPECT_TRUE(is_own || SameBits(got, drawn(other, k))) << k;
    of_own += is_own;
  }
  EXPECT_GT(of_own, 5);
  EXPECT_LT(of_own, 35);
}

TEST(ModelMixture, RefusesWhatIsNone) {
  const Model own = Model::Open(kSmall);
  const Model larger = own.Scaled(0.1, 9.81), lunar = own.Scaled(0.0625, kMoon);
  const auto refuse = [](std::vector<const Model*> models, std::vector<double> weights) {
    EXPECT_THROW(Model::Mixture(models, weights), std::invalid_argument);
  };
  refuse({}, {});
  refuse({&own}, {1, 2});
  refuse({&own, nullptr}, {1, 2});
  refuse({&own, &own}, {1, -2});
  refuse({&own, &own}, {0, 0});
  refuse({&own, &larger}, {1, 1});
  refuse({&own, &lunar}, {1, 1});
  const Model* both[] = {&own, &own};
  const double weights[] = {1, 1};
  EXPECT_THROW(Model::Mixture(both, weights).Scaled(0.1, kMoon), std::invalid_argument);
}

}  // namespace
}  // namespace grouser

// Hard ground as a model file: the way from table to message to answers, and what is refused.
#include "surrogate/fit/hard_model.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <sstream>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/selectable_model.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/model_selector.h"
#include "surrogate/models/state_batch.h"
#include "surrogate/soils/hard_table.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/refusal.h"

namespace grouser::surrogate {
namespace {

using ::testing::HasSubstr;

HardGround Ground() {
  HardGround ground{.friction = 0.7,
                    .slip_stiffness = 9,
                    .rolling_resistance = 0.02,
                    .friction_sd = 0.05,
                    .slip_stiffness_sd = 2,
                    .rolling_resistance_sd = 0.005};
  SetUsualContact(0.165, 0.114, &ground);
  return ground;
}

v1alpha1::Model Message() {
  HardModelRequest request{.name = "tyre-asphalt", .ground = "asphalt", .source = "a test"};
  request.wheel.set_name("tyre");
  request.wheel.set_radius_m(0.165);
  request.wheel.set_width_m(0.114);
  request.parameters = Ground();
  return MakeHardModel(request);
}

TEST(HardModel, AFileAnswersAsTheLawBitByBit) {
  const records::TempFolder folder;
  WriteTestedModel(folder / "hard.model", Message());
  const auto model = MakeTestedModel(ReadModel(folder / "hard.model").model);
  const HardGroundModel law(Ground(), 0.165);
  for (const VelocityState& v : {VelocityState{0.4, 0.1, 0.5}, {-0.3, 0, -0.3}, {0, 0.2, 0.1}}) {
    const WheelAnswer a = AnswerOf(*model, v, 150), b = AnswerOf(law, v, 150);
    for (int o = 0; o < kOutputs; ++o) {
      EXPECT_EQ(a.value[o], b.value[o]) << kOutputFields[o].name;
      EXPECT_EQ(a.half_width[o], b.half_width[o]) << kOutputFields[o].name;
    }
    EXPECT_EQ(a.flags, kUntuned | kFormUnknown);
    EXPECT_EQ(b.flags, 0u);
  }
  EXPECT_TRUE(model->UsesYawRate());
  EXPECT_EQ(AnswerOf(*model, {0.4, 0.1, 0.5}, 0).flags, kAirborne);
  EXPECT_EQ(AnswerOf(*model, {0, 0, 0}, 10).flags, kStatic | kUntuned | kFormUnknown);
}

TEST(HardModel, RefusesMessagesThatAreIncomplete) {
  const auto said = [](const std::function<void(v1alpha1::Model*)>& change) {
    v1alpha1::Model message = Message();
    change(&message);
    return Refusal([&] { MakeModel(message); });
  };
  EXPECT_EQ(said([](v1alpha1::Model*) {}), "");
  EXPECT_THAT(said([](auto* m) { m->mutable_hard()->clear_friction(); }),
              HasSubstr("tyre-asphalt: hard: no friction"));
  EXPECT_THAT(said([](auto* m) { m->mutable_hard()->set_friction(-1); }),
              HasSubstr("hard: friction: got -1"));
  EXPECT_THAT(said([](auto* m) { m->clear_hard(); }), HasSubstr("hard: expected parameters"));
  EXPECT_THAT(said([](auto* m) { m->mutable_residual(); }),
              HasSubstr("expected neither bekker nor residual"));
  EXPECT_THAT(said([](auto* m) { m->mutable_golden(3)->set_value(0, 1e3); }),
              HasSubstr("golden[3].f_x: computed"));
  EXPECT_THAT(said([](auto* m) { m->clear_golden(); }), HasSubstr("golden: none"));
  EXPECT_THAT(said([](auto* m) { m->clear_domain(); }),
              HasSubstr("domain: loads 0 to 0 N, expected 0 < load_min_n"));
  EXPECT_THAT(said([](auto* m) { m->mutable_domain()->set_load_max_n(5); }), HasSubstr("domain:"));
  EXPECT_THAT(said([](auto* m) { m->mutable_domain()->set_load_max_n(INFINITY); }),
              HasSubstr("10 to inf N"));
  EXPECT_THAT(Refusal([] { MakeScalar(Message()); }), HasSubstr("expected a model of a soil"));
}

TEST(HardModel, AnswersForOthersOfItsParametersAlone) {
  v1alpha1::Model a = Message(), b = Message();
  b.set_name("else");
  EXPECT_EQ(PairKey(a), PairKey(b));
  b.mutable_hard()->set_friction(0.3);
  EXPECT_NE(PairKey(a), PairKey(b));
}

/// Answers of the file's own model under a share of the load.
struct Asked {
  explicit Asked(const WheelStatesView& in, double share) : flags(in.load.size()) {
    const v1alpha1::Model message = Message();
    const auto model = MakeModel(message);
    AccuracyRequest accuracy;
    accuracy.share_of_load = share;
    accuracy.tolerance[kSinkage] = 1e-6;
    ResponsesView out;
    out.flags = flags;
    ModelSelector({MakeSelectableModel(message, *model)}).Evaluate(in, accuracy, out, {}, &worst);
  }
  bool Unmet(std::size_t i) const { return (flags[i] & kToleranceUnmet) != 0; }
  std::vector<std::uint32_t> flags;
  Shortfall worst;
};

// Load and sinkage are exact, a yaw rate is used, and no DEM run is proposed.
TEST(HardModel, KeepsATolerance) {
  StateBatch batch(4);
  batch.Set(0, 0.48, 0, 0.5, 100);    // straight on
  batch.Set(1, 0.48, 0, 0.5, 100);    // and turning
  batch.Set(2, 0.48, 0.1, 0.5, 100);  // nothing tells how far the aligning moment is off
  batch.Set(3, 0, 0, 0, 100);
  const std::vector<double> yaw = {0, 0.4, 0, 0};
  WheelStatesView in = batch.In();
  in.yaw_rate = yaw;
  const Asked wide(in, 0.5), narrow(in, 1e-3);
  EXPECT_FALSE(wide.Unmet(0));
  EXPECT_FALSE(wide.Unmet(1));
  EXPECT_TRUE(wide.Unmet(2));
  EXPECT_TRUE(wide.Unmet(3));
  EXPECT_EQ(wide.worst.excess, 0);
  EXPECT_TRUE(narrow.Unmet(0) && narrow.Unmet(1));
  EXPECT_EQ(narrow.worst.excess, 0);
}

TEST(HardModel, RefusesLoadsAndNumbersThatAreNone) {
  HardModelRequest request{.name = "x", .ground = "y"};
  request.wheel.set_radius_m(0.165);
  request.wheel.set_width_m(0.1);
  request.parameters = Ground();
  request.load_min_n = 10;
  request.load_max_n = 10;
  EXPECT_THAT(Refusal([&] { MakeHardModel(request); }), HasSubstr("expected 0 < least < most"));
  request.load_max_n = 20;
  request.parameters.slip_stiffness = 0;
  EXPECT_THAT(Refusal([&] { MakeHardModel(request); }), HasSubstr("slip_stiffness: got 0"));
}

TEST(HardModel, TakesATablesGroundAndNumbersInsteadOfItsOwn) {
  HardModelRequest request;
  request.wheel.set_radius_m(0.2);
  request.wheel.set_width_m(0.1);
  std::array<std::optional<double>, 8> given;
  SetGround("Ice", given, &request);
  EXPECT_EQ(request.ground, "ice");
  EXPECT_NEAR(request.parameters.friction, 0.1, 1e-12);
  EXPECT_DOUBLE_EQ(request.parameters.contact_length_m, 0.1);
  given[0] = 0.07;
  SetGround("ice", given, &request);
  EXPECT_DOUBLE_EQ(request.parameters.friction, 0.07);
  EXPECT_THAT(request.source, HasSubstr("as given: friction"));
  EXPECT_THAT(Refusal([&] { SetGround("", given, &request); }),
              HasSubstr("--slip-stiffness: not given"));
  EXPECT_THAT(Refusal([&] { SetGround("mud", given, &request); }), HasSubstr("ground 'mud'"));
}

// sd_fit^2 = sum of (d answer/d parameter sd)^2, here by differences.
TEST(HardModel, IntervalsAreThoseOfTheParametersSpread) {
  const HardGround ground = Ground();
  const HardGroundModel model(ground, 0.165);
  const std::pair<double HardGround::*, double HardGround::*> kSpread[] = {
      {&HardGround::friction, &HardGround::friction_sd},
      {&HardGround::slip_stiffness, &HardGround::slip_stiffness_sd},
      {&HardGround::rolling_resistance, &HardGround::rolling_resistance_sd}};
  for (const VelocityState& v :
       {VelocityState{0.49, 0.004, 0.5}, {0.45, 0.02, 0.5}, {0.3, 0.2, 0.5}, {-0.48, 0.01, -0.5}}) {
    const WheelAnswer at = AnswerOf(model, v, 200);
    for (const Output o : {kFx, kFy, kTorque}) {
      double sum = 0;
      for (const auto& [mean, sd] : kSpread) {
        HardGround more = ground, less = ground;
        more.*mean *= 1 + 1e-5;
        less.*mean *= 1 - 1e-5;
        const double slope = (AnswerOf(HardGroundModel(more, 0.165), v, 200).value[o] -
                              AnswerOf(HardGroundModel(less, 0.165), v, 200).value[o]) /
                             (2e-5 * ground.*mean);
        sum += slope * slope * ground.*sd * ground.*sd;
      }
      EXPECT_NEAR(at.sd_fit[o], std::sqrt(sum), 1e-4 * std::sqrt(sum) + 1e-9)
          << kOutputFields[o].name << " at v_x " << v.v_x;
      EXPECT_DOUBLE_EQ(at.half_width[o], kTwoSided90 * at.sd_fit[o]);
    }
  }
}

// Along lines through all that the law tells apart: no step is larger than steep gradients explain.
TEST(HardModel, IsContinuous) {
  const HardGroundModel model(Ground(), 0.165);
  const VelocityState ends[][2] = {{{0.5, 0.05, -0.02}, {0.5, 0.05, 0.02}},  // a locked rim
                                   {{0.5, 0.01, 0.5}, {0.2, 0.01, 0.5}},     // from stick to slide
                                   {{0.5, -0.3, 0.5}, {0.5, 0.3, 0.5}},      // through straight on
                                   {{-0.02, 0.1, 0.3}, {0.02, 0.1, 0.3}}};   // through the side
  constexpr int kSteps = 20000;
  for (const auto& line : ends) {
    const auto at = [&](int i) {
      const double s = static_cast<double>(i) / kSteps;
      const auto mix = [s](double a, double b) { return a + s * (b - a); };
      return AnswerOf(model,
                      {mix(line[0].v_x, line[1].v_x), mix(line[0].v_y, line[1].v_y),
                       mix(line[0].rim_speed, line[1].rim_speed)},
                      100);
    };
    WheelAnswer before = at(0);
    for (int i = 1; i <= kSteps; ++i) {
      const WheelAnswer here = at(i);
      for (int o = 0; o < kOutputs; ++o) {
        const double scale = OutputScale(o, 100, 0.165);
        ASSERT_NEAR(here.value[o], before.value[o], 2e-3 * scale)
            << kOutputFields[o].name << " step " << i << " from v_x " << line[0].v_x;
      }
      before = here;
    }
  }
}

TEST(HardModel, EvaluatesWithoutAllocating) {
  const HardGroundModel model(Ground(), 0.165);
  StateBatch batch(64);
  for (std::size_t i = 0; i < 64; ++i) batch.Set(i, 0.4, 0.01 * static_cast<double>(i), 0.5, 100);
  const auto in = batch.In();
  const auto out = batch.Out();
  const long before = g_allocations;
  model.Evaluate(in, out);
  EXPECT_EQ(g_allocations - before, 0);
}

TEST(HardTable, TheShippedOneGivesMiddlesAndSpreads) {
  const auto grounds = PublishedHardGrounds();
  const PublishedHardGround& ice = FindHardGround(grounds, "ICE");
  EXPECT_EQ(ice.name, "ice");
  EXPECT_NEAR(ice.ground.friction, 0.10, 1e-12);
  EXPECT_NEAR(ice.ground.friction_sd, 0.10 / (2 * 1.645), 1e-5);
  EXPECT_THAT(Refusal([&] { FindHardGround(grounds, "asfalt"); }),
              HasSubstr("ground 'asfalt': not known, expected one of asphalt, wet asphalt"));
  for (const PublishedHardGround& g : grounds) {
    HardGround ground = g.ground;
    SetUsualContact(0.2, 0.1, &ground);
    EXPECT_NO_THROW(HardGroundModel(ground, 0.2)) << g.name;
    EXPECT_FALSE(g.source.empty()) << g.name;
  }
}

TEST(HardTable, RefusesByLineAndColumn) {
  const std::string head =
      "ground,friction_low,friction_high,rolling_resistance_low,rolling_resistance_high,"
      "slip_stiffness_low,slip_stiffness_high,source\n";
  const auto said = [&](const std::string& rows) {
    std::istringstream table(head + rows);
    return Refusal([&] { ReadHardGrounds(table, "t.csv"); });
  };
  EXPECT_EQ(said("a,0.5,0.6,0.01,0.02,5,9,x\n"), "");
  EXPECT_THAT(said("a,0.5,0.4,0.01,0.02,5,9,x\n"),
              HasSubstr("t.csv:2: friction_high: 0.4, expected"));
  EXPECT_THAT(said("a,50,60,0.01,0.02,5,9,x\n"),
              HasSubstr("t.csv:2: friction_low: 50, expected a number from 0.01 to 2"));
  EXPECT_THAT(said("a,0.5,0.6,nan,0.02,5,9,x\n"), HasSubstr("rolling_resistance_low: nan"));
  EXPECT_THAT(said("a,0.5,0.6\n"), HasSubstr("3 columns, expected 8"));
  EXPECT_THAT(said("a,0.5,0.6,0,0,5,9,x\nA,0.5,0.6,0,0,5,9,x\n"), HasSubstr("t.csv:3: ground: A"));
  EXPECT_THAT(said(""), HasSubstr("no ground"));
}

}  // namespace
}  // namespace grouser::surrogate

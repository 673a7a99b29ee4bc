#include "grouser/model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "proto/records/model_file.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"
#include "tests/unit/count_allocations.h"
#include "tests/unit/in_process/batch.h"

namespace grouser {
namespace {

void ExpectSame(const Batch& a, const Batch& b, std::size_t fields) {
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (std::size_t f = 0; f < fields; ++f) {
      EXPECT_TRUE(SameBits(a.out[o][f], b.out[o][f])) << "output " << o << " field " << f;
    }
  }
  EXPECT_TRUE(SameBits(a.echo[0], b.echo[0]));
  EXPECT_TRUE(SameBits(a.echo[1], b.echo[1]));
  EXPECT_EQ(a.flags, b.flags);
}

TEST(Model, TellsWhatTheFileSays) {
  const records::LoadedModel file = records::ReadModelFile(kSmall);
  const Model model = Model::Open(kSmall);
  EXPECT_EQ(model.name(), "cmu-smooth-62.5");
  EXPECT_EQ(model.soil(), file.model.soil().name());
  EXPECT_EQ(model.wheel(), "smooth-62.5");
  EXPECT_EQ(model.digest(), file.digest);
  EXPECT_EQ(model.radius_m(), 0.0625);
  EXPECT_EQ(model.width_m(), 0.05);
  EXPECT_EQ(model.interval_level(), file.model.interval_level());
  EXPECT_EQ(model.domain().slip_min, file.model.domain().slip_min());
  EXPECT_EQ(model.domain().slip_max, file.model.domain().slip_max());
  EXPECT_EQ(model.domain().attack_angle_max_rad, file.model.domain().attack_angle_max_rad());
  EXPECT_EQ(model.domain().load_min_n, file.model.domain().load_min_n());
  EXPECT_EQ(model.domain().load_max_n, file.model.domain().load_max_n());
  EXPECT_EQ(model.domain().speed_m_per_s, file.model.domain().speed_m_per_s());
}

TEST(Model, NamesTheKind) {
  v1alpha1::ModelKind expected = records::ReadModelFile(kSmall).model.kind(), model;
  if (expected == v1alpha1::MODEL_KIND_UNSPECIFIED) expected = v1alpha1::MODEL_KIND_HYBRID;
  std::string name = Model::Open(kSmall).kind();
  for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  ASSERT_TRUE(v1alpha1::ModelKind_Parse("MODEL_KIND_" + name, &model)) << name;
  EXPECT_EQ(model, expected);
}

TEST(Model, OpensHardGroundAsAnyOther) {
  v1alpha1::Model message;
  message.set_name("tyre-ice");
  message.set_kind(v1alpha1::MODEL_KIND_HARD);
  message.mutable_wheel()->set_radius_m(0.165);
  message.mutable_wheel()->set_width_m(0.114);
  message.mutable_soil()->set_name("ice");
  message.mutable_domain()->set_load_min_n(1);
  message.mutable_domain()->set_load_max_n(1000);
  const surrogate::HardGround ice{.friction = 0.1,
                                  .slip_stiffness = 9,
                                  .rolling_resistance = 0.02,
                                  .contact_length_m = 0.08,
                                  .contact_width_m = 0.1,
                                  .friction_sd = 0.03};
  surrogate::SetHard(ice, &message);
  surrogate::SetGoldenVectors(&message);
  const std::string file = ::testing::TempDir() + "/grouser_in_process_ice.model";
  surrogate::WriteTestedModel(file, message);
  const Model model = Model::Open(file);
  EXPECT_EQ(model.kind(), "hard");
  EXPECT_EQ(model.soil(), "ice");
  EXPECT_TRUE(model.has_gradients());
  const Answer sliding = model.Evaluate(State{0.2, 0, 0.5, 300});
  EXPECT_DOUBLE_EQ(sliding.output[kFx].value, 0.1 * 300);
  EXPECT_NEAR(sliding.output[kFx].high, (0.1 + 1.645 * 0.03) * 300, 1e-2);
  EXPECT_EQ(sliding.flags & ~std::uint32_t{kFormUnknown}, 0u);
}

TEST(Model, AnswersAsTheEvaluatorBitByBit) {
  const auto evaluator = surrogate::MakeModel(records::ReadModelFile(kSmall).model);
  const Model model = Model::Open(kSmall);
  Batch ours = MakeBatch(500), theirs = MakeBatch(500);
  ASSERT_TRUE(model.Evaluate(ours.states(), ours.answers()));
  evaluator->Evaluate({theirs.in[0], theirs.in[1], theirs.in[2], theirs.in[3], {}, {}, {}, {}},
                      theirs.Into<surrogate::ResponsesView>());
  ExpectSame(ours, theirs, model.has_gradients() ? kFields : 5);
  EXPECT_EQ(ours.flags[499], kInvalid);
  EXPECT_EQ(ours.flags[498], kInvalid);
  EXPECT_TRUE(ours.flags[497] & kStatic);
  EXPECT_TRUE(std::isfinite(ours.out[kFx][0][0]));
}

TEST(Model, AWheelOffTheGroundAnswersZeros) {
  const Model model = Model::Open(kSmall);
  for (const State& state : {State{0.1, 0.02, 0.12, 0}, State{0, 0, 0, 0}}) {
    const Answer answer = model.Evaluate(state);
    EXPECT_EQ(answer.flags, std::uint32_t{kAirborne});
    for (const OutputAnswer& o : answer.output) {
      for (const double x : {o.value, o.sd_fit, o.sd_patch, o.low, o.high}) EXPECT_EQ(x, 0);
      EXPECT_EQ(o.d_load, model.has_gradients() ? 0 : o.d_load);
    }
  }
  EXPECT_EQ(model.Evaluate(State{0.1, 0, 0.1, -1e-9}).flags, std::uint32_t{kInvalid});
}

TEST(Model, LeavesNoOldMemoryWhereAGradientBelongs) {
  const Model model = Model::Open(kSmall);
  Batch batch(1);
  const double state[4] = {0.09, 0.01, 0.1, 20};
  for (int k = 0; k < 4; ++k) batch.in[k][0] = state[k];
  ASSERT_TRUE(model.Evaluate(batch.states(), batch.answers()));
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (std::size_t f = 5; f < kFields; ++f) {
      EXPECT_EQ(std::isfinite(batch.out[o][f][0]), model.has_gradients()) << o << " " << f;
      EXPECT_NE(batch.out[o][f][0], kUntouched);
    }
  }
}

TEST(Model, OneStateIsTheBatchOfOne) {
  const Model model = Model::Open(kSmall);
  const Batch states = MakeBatch(20);
  Batch all = MakeBatch(20);
  ASSERT_TRUE(model.Evaluate(states.states(), all.answers()));
  for (std::size_t i = 0; i < 20; ++i) {
    const Answer one =
        model.Evaluate({states.in[0][i], states.in[1][i], states.in[2][i], states.in[3][i]});
    EXPECT_EQ(one.flags, all.flags[i]);
    for (std::size_t o = 0; o < kOutputs; ++o) {
      const OutputAnswer& a = one.output[o];
      const double fields[5] = {a.value, a.sd_fit, a.sd_patch, a.low, a.high};
      for (int f = 0; f < 5; ++f) {
        EXPECT_TRUE(SameBits({fields[f]}, {all.out[o][f][i]})) << i << " " << o << " " << f;
      }
    }
  }
}

TEST(Model, WritesOnlyTheSpansThatAreGiven) {
  const Model model = Model::Open(kSmall);
  Batch some = MakeBatch(30), all = MakeBatch(30);
  ASSERT_TRUE(model.Evaluate(all.states(), all.answers()));
  Answers out;
  out.flags = some.flags;
  out.output[kTorque].value = some.out[kTorque][0];
  ASSERT_TRUE(model.Evaluate(some.states(), out));
  EXPECT_TRUE(SameBits(some.out[kTorque][0], all.out[kTorque][0]));
  EXPECT_EQ(some.flags, all.flags);
  EXPECT_EQ(some.out[kFx][0], std::vector<double>(30, kUntouched));
}

TEST(Model, AnEmptyBatchIsFine) {
  const Model model = Model::Open(kSmall);
  EXPECT_TRUE(model.Evaluate(States{}, Answers{}));
  EXPECT_EQ(Model::SizeProblem(States{}, Answers{}), "");
}

TEST(Model, AllocatesNothingWhileItAnswers) {
  const Model model = Model::Open(kSmall);
  Batch batch = MakeBatch(200);
  const States in = batch.states();
  const Answers out = batch.answers();
  const long before = g_allocations;
  const bool done = model.Evaluate(in, out);
  const bool refused = !model.Evaluate(in, Answers{});
  const Answer one = model.Evaluate(State{0.1, 0.02, 0.12, 20});
  const long after = g_allocations;
  EXPECT_EQ(after, before);
  EXPECT_TRUE(done && refused && std::isfinite(one.output[kFx].value));
  const Model second = Model::Open(kSmall);
  EXPECT_GT(g_allocations, after) << "the library's allocations are not counted";
}

// 5 and 95 % of the draws are the interval, at every state: 4.5 standard errors. The small model
// answers of a soil; a sinkage is no less than 0.
TEST(Model, DrawsAreTheInterval) {
  const Model model = Model::Open(kSmall);
  const std::size_t n = 40;
  Batch mean = MakeBatch(n + 3), drawn = mean;  // three bad ones at the end
  const Draws draws(model.soil(), 1000);
  ASSERT_TRUE(model.Evaluate(mean.states(), mean.answers()));
  std::array<std::vector<std::array<double, 2>>, kOutputs> outside;
  for (auto& of : outside) of.resize(n);
  const Answers out = drawn.answers();
  std::vector<std::uint32_t> k(n + 3);
  const long before = g_allocations;
  for (std::uint32_t draw = 0; draw < draws.size(); ++draw) {
    std::fill(k.begin(), k.end(), draw);
    ASSERT_TRUE(model.EvaluateDraws(drawn.states(), draws, k, out));
    for (std::size_t o = 0; o < kOutputs; ++o) {
      for (std::size_t i = 0; i < n; ++i) {
        const double value = drawn.out[o][0][i];
        outside[o][i][0] += value < mean.out[o][3][i];
        outside[o][i][1] += value > mean.out[o][4][i];
      }
    }
  }
  EXPECT_EQ(g_allocations, before);
  const double limit = 4.5 * std::sqrt(0.05 * 0.95 / 1000);
  for (const Output o : {kFx, kFy, kTorque, kMz, kSinkage}) {
    for (std::size_t i = 0; i < n; ++i) {
      if (o != kSinkage || mean.out[o][3][i] > 0) {
        EXPECT_NEAR(outside[o][i][0] / 1000, 0.05, limit) << o << " " << i;
      }
      EXPECT_NEAR(outside[o][i][1] / 1000, 0.05, limit) << o << " " << i;
    }
  }
  // All else is the mean's, and bad states stay bad.
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (std::size_t f = 1; f < kFields; ++f) {
      EXPECT_TRUE(SameBits(mean.out[o][f], drawn.out[o][f])) << o << " " << f;
    }
    EXPECT_TRUE(std::isnan(drawn.out[o][0][n + 1]));
  }
  EXPECT_EQ(mean.flags, drawn.flags);
  // Another model of the soil, another count of draws, other states beside it: the same bits.
  const Model again = Model::Open(kSmall);
  const Draws few(model.soil(), 8);
  const std::vector<std::uint32_t> seven(1, 7);
  Batch one(1);
  for (std::size_t i = 0; i < 4; ++i) one.in[i][0] = drawn.in[i][5];
  ASSERT_TRUE(again.EvaluateDraws(one.states(), few, seven, one.answers()));
  std::fill(k.begin(), k.end(), 7u);
  ASSERT_TRUE(model.EvaluateDraws(drawn.states(), draws, k, out));
  for (std::size_t o = 0; o < kOutputs; ++o) EXPECT_EQ(one.out[o][0][0], drawn.out[o][0][5]);
  // What is no draw, and sizes, are refused.
  Batch refused = MakeBatch(5);
  EXPECT_FALSE(model.EvaluateDraws(refused.states(), few, seven, refused.answers()));
  const std::vector<std::uint32_t> eight(5, 8);
  EXPECT_FALSE(model.EvaluateDraws(refused.states(), few, eight, refused.answers()));
  EXPECT_TRUE(refused.Untouched());
  EXPECT_THROW(Draws("sand", 0), std::invalid_argument);
}

TEST(Model, TwoThreadsGetTheSameBits) {
  const Model model = Model::Open(kSmall);
  Batch alone = MakeBatch(400);
  ASSERT_TRUE(model.Evaluate(alone.states(), alone.answers()));
  std::array<Batch, 2> both = {MakeBatch(400), MakeBatch(400)};
  std::atomic<int> ready{0}, failed{0};
  const auto work = [&](Batch* batch) {
    ++ready;
    while (ready < 2) std::this_thread::yield();
    for (int k = 0; k < 20; ++k) failed += !model.Evaluate(batch->states(), batch->answers());
  };
  std::thread first(work, &both[0]), second(work, &both[1]);
  first.join();
  second.join();
  EXPECT_EQ(failed, 0);
  for (const Batch& batch : both) ExpectSame(batch, alone, 5);
}

}  // namespace
}  // namespace grouser

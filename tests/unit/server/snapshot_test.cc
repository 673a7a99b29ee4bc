#include "server/core/snapshot_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "proto/records/model_file.h"
#include "server/core/evaluator.h"
#include "tests/unit/server/fake_model.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser::server {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

class SnapshotTest : public ::testing::Test {
 protected:
  SnapshotTest() : repository_(dir_.path(), ""), store_(repository_, testing::MakeFakeModel) {}

  std::string Publish(const v1alpha1::Model& message) {
    const std::string path = dir_ / "new.model";
    records::WriteModelFile(path, message);
    return repository_.Publish(path);
  }
  std::string MakeStable(double gain) {
    const auto digest = Publish(testing::FakeMessage("sand", gain));
    repository_.SetAlias("sand", "stable", digest, "test", "");
    return digest;
  }
  std::string StableDigest() const {
    const auto snapshot = store_.Current();
    const ServedModel* model = nullptr;
    return snapshot->Find("sand", &model).ok() ? model->digest : "none";
  }

  testing::TempDir dir_;
  Repository repository_;
  SnapshotStore store_;
};

TEST_F(SnapshotTest, FollowsTheRepository) {
  EXPECT_TRUE(store_.Refresh().changed);
  EXPECT_TRUE(store_.Current()->models().empty());
  EXPECT_FALSE(store_.Refresh().changed);
  const auto a = MakeStable(0.1);
  EXPECT_TRUE(store_.Refresh().changed);
  EXPECT_EQ(StableDigest(), a);
  EXPECT_EQ(store_.Current()->generation(), 1u);
  const auto b = MakeStable(0.2);
  EXPECT_EQ(StableDigest(), a);
  EXPECT_THAT(store_.Refresh().problems, SizeIs(0));
  EXPECT_EQ(StableDigest(), b);
  const ServedModel* previous = nullptr;
  const auto snapshot = store_.Current();
  ASSERT_TRUE(snapshot->Find("sand@previous", &previous).ok());
  EXPECT_EQ(previous->digest, a);
}

TEST_F(SnapshotTest, LoadedModelsAreReused) {
  MakeStable(0.1);
  store_.Refresh();
  const auto before = store_.Current()->models().front();
  Publish(testing::FakeMessage("sand", 0.2));
  store_.Refresh();
  const auto after = store_.Current();
  EXPECT_THAT(after->models(), ::testing::Contains(before));
  EXPECT_THAT(after->models(), SizeIs(2));
}

TEST_F(SnapshotTest, ModelThatFailsItsGoldenVectorsNeverReplacesAGoodOne) {
  const auto good = MakeStable(0.1);
  store_.Refresh();
  auto lying = testing::FakeMessage("sand", 0.2);
  lying.mutable_golden(0)->set_value(0, lying.golden(0).value(0) * (1 + 1e-6));
  const auto bad = Publish(lying);
  repository_.SetAlias("sand", "stable", bad, "test", "");
  const auto outcome = store_.Refresh();
  ASSERT_THAT(outcome.problems, SizeIs(2));
  EXPECT_THAT(outcome.problems[0], HasSubstr("golden[0].f_x"));
  EXPECT_THAT(outcome.problems[1], HasSubstr("kept " + good));
  EXPECT_EQ(StableDigest(), good);
}

TEST_F(SnapshotTest, ModelWithoutEvaluatorOrGoldenVectorsIsLeftOut) {
  Publish(testing::FakeMessage("sand", 0));
  auto untested = testing::FakeMessage("clay", 0.1);
  untested.clear_golden();
  Publish(untested);
  MakeStable(0.3);
  const auto outcome = store_.Refresh();
  EXPECT_THAT(outcome.problems,
              ::testing::UnorderedElementsAre(HasSubstr("bekker.gain"), HasSubstr("golden: none")));
  EXPECT_THAT(store_.Current()->models(), SizeIs(1));
}

TEST_F(SnapshotTest, DamagedFileOfTheLiveModelKeepsItLive) {
  const auto digest = MakeStable(0.1);
  store_.Refresh();
  std::ofstream(dir_ / ("models/" + digest + ".model")) << "damaged";
  EXPECT_THAT(store_.Refresh().problems, SizeIs(2));
  EXPECT_EQ(StableDigest(), digest);
}

TEST_F(SnapshotTest, UnreadableRepositoryThrowsAndIsTriedAgain) {
  const auto digest = MakeStable(0.1);
  store_.Refresh();
  std::ofstream(dir_ / "models/aliases.json") << "{";
  EXPECT_THROW(store_.Refresh(), std::runtime_error);
  EXPECT_THROW(store_.Refresh(), std::runtime_error);
  EXPECT_EQ(StableDigest(), digest);
}

TEST_F(SnapshotTest, OldSnapshotLivesWhileAQueryHoldsIt) {
  MakeStable(0.1);
  store_.Refresh();
  auto held = store_.Current();
  const std::weak_ptr<const Snapshot> watched = held;
  MakeStable(0.2);
  store_.Refresh();
  MakeStable(0.3);
  store_.Refresh();
  EXPECT_FALSE(watched.expired());
  held.reset();
  EXPECT_FALSE(watched.expired()) << "a query thread must not be the one that frees it";
  store_.Refresh();
  EXPECT_TRUE(watched.expired());
}

// Every answer must come whole from one model: gain, digest and generation fit.
TEST_F(SnapshotTest, SwapsUnderConcurrentQueries) {
  MakeStable(1);
  store_.Refresh();
  std::atomic<bool> stop = false;
  std::atomic<int> answers = 0;
  std::atomic<int> wrong = 0;
  const auto query = [&] {
    v1alpha1::WheelStates states;
    states.mutable_velocity()->add_v_x_m_per_s(0.05);
    states.mutable_velocity()->add_v_y_m_per_s(0);
    states.mutable_velocity()->add_rim_speed_m_per_s(0.1);
    states.add_closure_value(24);
    v1alpha1::WheelResponses responses;
    while (!stop) {
      const auto snapshot = store_.Current();
      const ServedModel* model = nullptr;
      const auto status = Evaluate(*snapshot, "sand", states, false, &model, &responses);
      const bool whole =
          status.ok() && responses.f_x().value(0) == model->message.golden(0).value(0) &&
          model->message.bekker().values().at("gain") == static_cast<double>(snapshot->generation());
      if (!whole) ++wrong;
      ++answers;
    }
  };
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) threads.emplace_back(query);
  for (int generation = 2; generation <= 20; ++generation) {
    const int before = answers;
    MakeStable(generation);
    store_.Refresh();
    while (answers < before + 10) std::this_thread::yield();
  }
  stop = true;
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(answers, 190);
  EXPECT_EQ(store_.Current()->generation(), 20u);
}

}  // namespace
}  // namespace grouser::server

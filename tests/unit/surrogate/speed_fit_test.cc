// Runs at several speeds make a model with a speed axis.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "surrogate/fit/fit_model.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/models/residual_table.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate {
namespace {

using synthetic::MakeRequest;
using synthetic::RandomRuns;
using synthetic::Truth;

constexpr double kRadius = 0.0625, kGravity = 9.81;

/// The runs at other speeds, Froude numbers of 0.1 to 2; inertia adds a share of the
/// load that goes with the Froude number.
std::vector<v1alpha1::RunSummary> AtSpeeds(std::vector<v1alpha1::RunSummary> runs, unsigned seed) {
  std::mt19937_64 random(seed);
  for (v1alpha1::RunSummary& run : runs) {
    const double froude = 0.1 * std::pow(20, std::uniform_real_distribution<double>(0, 1)(random));
    run.set_speed_m_per_s(std::sqrt(froude * kGravity * kRadius));
    const VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), run.speed_m_per_s());
    const double load = run.load_n(), m = run.speed_m_per_s();
    run.set_mean(kFx, run.mean(kFx) - 0.2 * froude * load * v.v_x / m);
    run.set_mean(kFy, run.mean(kFy) - 0.3 * froude * load * v.v_y / m);
  }
  return runs;
}

double RmsOf(const v1alpha1::Model& model, const std::string& output) {
  for (const v1alpha1::ErrorRow& row : model.errors()) {
    if (row.set() == "held_out" && row.output() == output && row.region() == v1alpha1::REGION_ALL) {
      return row.rmse();
    }
  }
  throw std::runtime_error("no row of " + output);
}

FitRequest Request(bool know_speeds) {
  Truth truth;
  truth.misfit = 0.03;
  truth.noise = 0.005;
  auto runs = AtSpeeds(RandomRuns(truth, 46, v1alpha1::RUN_ROLE_TRAIN, 61, 15, 25), 1);
  for (auto& run : AtSpeeds(RandomRuns(truth, 30, v1alpha1::RUN_ROLE_TEST, 62, 15, 25), 2)) {
    runs.push_back(run);
  }
  for (auto& run : runs) {
    if (!know_speeds) run.set_speed_m_per_s(0.5);
  }
  return MakeRequest(runs);
}

TEST(SpeedFit, RunsAtSeveralSpeedsMakeASpeedAxis) {
  const v1alpha1::Model blind = FitModel(Request(false));
  EXPECT_EQ(blind.residual().rate_coefficients_size(), 0);
  const v1alpha1::Model model = FitModel(Request(true));
  ASSERT_EQ(model.residual().rate_coefficients_size(), ResidualTable::kChannels);
  EXPECT_NEAR(model.residual().froude_max(), 2, 0.2);
  EXPECT_GT(RmsOf(blind, "f_x"), 3 * RmsOf(model, "f_x"));
  EXPECT_GT(RmsOf(blind, "f_y"), 3 * RmsOf(model, "f_y"));
  EXPECT_LT(RmsOf(model, "f_x"), 0.04 * 20);
  EXPECT_NO_THROW(MakeModel(model));  // golden vectors at several speeds included
}

TEST(SpeedFit, TheLookupRungHasOneToo) {
  FitRequest request = Request(true);
  request.kind = v1alpha1::MODEL_KIND_LOOKUP;
  const v1alpha1::Model model = FitModel(request);
  ASSERT_EQ(model.residual().rate_coefficients_size(), ResidualTable::kChannels);
  EXPECT_LT(RmsOf(model, "f_y"), 0.06 * 20);
  EXPECT_NO_THROW(MakeModel(model));
  request.kind = v1alpha1::MODEL_KIND_BEKKER;  // quasi-static
  EXPECT_EQ(FitModel(request).residual().rate_coefficients_size(), 0);
}

}  // namespace
}  // namespace grouser::surrogate

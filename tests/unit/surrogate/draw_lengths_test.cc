// The lengths of coherent draws beside what the pairs' models are off by at runs that no fit saw.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/models/draw_field.h"

namespace grouser::surrogate {
namespace {

struct HeldOut {
  std::array<double, 3> direction;  // of (v_x, v_y, r w)
  double log_load;
  std::array<double, kOutputs> error;  // over the standard deviation of the interval
};

std::vector<HeldOut> ErrorsOf(const v1alpha1::Model& message, const WheelModel& model) {
  std::vector<HeldOut> all;
  for (const v1alpha1::RunSummary& run : message.provenance().runs()) {
    if (run.status() != v1alpha1::RUN_STATUS_STEADY || run.role() != v1alpha1::RUN_ROLE_TEST) {
      continue;
    }
    const VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), run.speed_m_per_s());
    const WheelAnswer answer = AnswerOf(model, v, run.load_n());
    const double size = std::sqrt(v.v_x * v.v_x + v.v_y * v.v_y + v.rim_speed * v.rim_speed);
    HeldOut row{{v.v_x / size, v.v_y / size, v.rim_speed / size}, std::log(run.load_n()), {}};
    for (const Output o : kPredicted) {
      row.error[o] = (run.mean(o) - answer.value[o]) / (answer.half_width[o] / kTwoSided90);
    }
    all.push_back(row);
  }
  return all;
}

/// Correlation of two runs' errors, mean over outputs, by how far apart they are: 0 to 0.4, 0.8,
/// 1.2 of the lengths of physics.
std::array<double, 3> ByDistance(const std::vector<HeldOut>& rows) {
  std::array<double, 3> mean{};
  for (const Output o : kPredicted) {
    std::array<double, 3> sum{}, count{};
    double square = 0;
    for (const HeldOut& a : rows) square += a.error[o] * a.error[o];
    square /= static_cast<double>(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        constexpr DrawLengths kOver = DrawLengths::OfPhysics();
        const HeldOut &a = rows[i], &b = rows[j];
        const double distance =
            std::sqrt(std::pow((a.direction[0] - b.direction[0]) / kOver.plane, 2) +
                      std::pow((a.direction[1] - b.direction[1]) / kOver.lateral, 2) +
                      std::pow((a.direction[2] - b.direction[2]) / kOver.plane, 2) +
                      std::pow((a.log_load - b.log_load) / kOver.log_load, 2));
        const auto bin = static_cast<std::size_t>(distance / 0.4);
        if (bin >= sum.size()) continue;
        sum[bin] += a.error[o] * b.error[o] / square;
        ++count[bin];
      }
    }
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += sum[k] / count[k] / 5;
  }
  return mean;
}

// Errors of a fit to runs have little in common beyond near states, those of physics alone much.
// The draws' correlation is not less than what was found: it falls as exp(-d^2/2), half of it of
// physics over four times the lengths.
TEST(DrawLengths, AreThoseOfErrorsAtRunsThatNoFitSaw) {
  for (const char* kind : {"hybrid", "lookup", "bekker"}) {
    const std::string file = std::string(GROUSER_DENSE_PAIR) + "/" + kind + ".model";
    const v1alpha1::Model message = ReadModel(file).model;
    const auto model = MakeModel(message);
    const std::vector<HeldOut> rows = ErrorsOf(message, *model);
    ASSERT_GT(rows.size(), 30u);
    const bool of_physics = model->Errors().of_physics;
    EXPECT_EQ(of_physics, std::string(kind) == "bekker");
    const std::array<double, 3> found = ByDistance(rows);
    std::printf("%s: %zu runs, correlation %.2f, %.2f, %.2f at 0.2, 0.6, 1 lengths\n", kind,
                rows.size(), found[0], found[1], found[2]);
    for (std::size_t k = 0; k < found.size(); ++k) {
      const double d = 0.2 + 0.4 * static_cast<double>(k);
      const double of_draws =
          of_physics ? (std::exp(-d * d / 2) + std::exp(-d * d / 32)) / 2 : std::exp(-2 * d * d);
      EXPECT_LT(found[k], of_draws) << kind << " " << d;
    }
    if (of_physics) {
      EXPECT_GT(found[0], 0.6);
      EXPECT_GT(found[2], 0.3);
    } else {
      EXPECT_GT(found[0], 0.1);
      EXPECT_LT(std::fabs(found[2]), 0.15);
    }
  }
}

}  // namespace
}  // namespace grouser::surrogate

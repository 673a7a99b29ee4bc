// A similar wheel by units alone: against a model whose every parameter was scaled by hand.
#include "surrogate/models/scaled_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/similar_wheel.h"
#include "surrogate/models/hard_ground.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using testing::InsideHull;
using testing::SmallMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Similarity kMoonTwice{2, 1.62 / 9.81};

std::shared_ptr<const WheelModel> Shared(const v1alpha1::Model& message) {
  return MakeLaw(message);
}

/// Loads x F, speeds x sqrt(g l).
StateBatch ForSimilar(const StateBatch& own, const Similarity& by) {
  StateBatch b(own.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    b.Set(i, own.v_x[i] * by.Speed(), own.v_y[i] * by.Speed(), own.rim_speed[i] * by.Speed(),
          own.load[i] * by.Force());
  }
  return b;
}

void ExpectClose(double expected, double got, double share, double scale, const std::string& of) {
  if (std::isnan(expected) && std::isnan(got)) return;
  EXPECT_NEAR(got, expected, share * std::fmax(std::fabs(expected), scale)) << of;
}

/// The interval and sd_fit that widening makes of an answer.
struct Widened {
  double sd_fit, low, high;
};
Widened Widen(int o, double sd_fit, double low, double high, double load, double radius,
              const Similarity& by) {
  const double stress = by.gravity * by.length;
  const double sd = OutputScale(o, load, radius) *
                    (stress > 1 ? kSdPerDoubling[o] * std::log(stress) / std::log(2)
                                : kSdPerHalving[o] * std::log(1 / stress) / std::log(2));
  const double middle = (low + high) / 2, half = std::hypot((high - low) / 2, kTwoSided90 * sd);
  return {std::hypot(sd_fit, sd), middle - half, middle + half};
}

TEST(ScaledModel, AnswersInUnitsOfItsOwn) {
  const v1alpha1::Model message = SmallMessage();
  const std::shared_ptr<const WheelModel> own = MakeModel(message);
  for (const Similarity by : {kMoonTwice, Similarity{0.3, 4}, Similarity{1, 0.2}, {3, 1.0 / 3}}) {
    const ScaledModel similar(own, 0.0625, by, true);
    StateBatch direct = InsideHull(HullOf(message), 300, 3);
    direct.Set(0, 0, 0, 0, 20);
    direct.Set(1, 0.1, 0, 0.1, 0);
    direct.Set(2, kNaN, 0, 0.1, 20);
    direct.Set(3, 0.1, 0.02, 0.1, 900);  // beyond the runs
    direct.Set(4, 3, 0.02, 3.1, 20);     // faster than they
    StateBatch mapped = ForSimilar(direct, by);
    own->Evaluate(direct.In(), direct.Out());
    similar.Evaluate(mapped.In(), mapped.Out());
    EXPECT_TRUE((direct.flags[3] & kExtrapolated) != 0 && (direct.flags[4] & kRate) != 0);
    for (std::size_t i = 0; i < direct.size(); ++i) {
      EXPECT_EQ(mapped.flags[i], direct.flags[i]);
      ExpectClose(direct.slip[i], mapped.slip[i], 1e-12, 1, "slip");
      const double load = mapped.load[i], radius = 0.0625 * by.length;
      for (int o = 0; o < kOutputs; ++o) {
        const auto& from = direct.part[o];
        const double f = by.Of(o), scale = OutputScale(o, load, radius);
        const bool grows = load > 0;
        const Widened w = Widen(o, f * from[kSdFit][i], f * from[kLow][i], f * from[kHigh][i],
                                grows ? load : 0, grows ? radius : 0, by);
        const double expected[kParts] = {f * from[kValue][i],
                                         w.sd_fit,
                                         f * from[kSdPatch][i],
                                         w.low,
                                         w.high,
                                         f / by.Speed() * from[kDvX][i],
                                         f / by.Speed() * from[kDvY][i],
                                         f / by.Speed() * from[kDRim][i],
                                         f / by.Force() * from[kDLoad][i]};
        for (int p = 0; p < kParts; ++p) {
          // Differences at rest magnify the rounding of the state.
          const double share = p < kDvX ? 1e-12 : 1e-9;
          ExpectClose(expected[p], mapped.part[o][p][i], share, p < kDvX ? scale : 0,
                      std::string(kOutputFields[o].name) + " part " + std::to_string(p) +
                          " state " + std::to_string(i));
        }
      }
    }
  }
}

/// The small model's law with every parameter that has a unit scaled by its unit.
v1alpha1::Model ScaledByHand(v1alpha1::Model m, const Similarity& by) {
  const double stress = by.gravity * by.length, l = by.length;
  m.set_kind(v1alpha1::MODEL_KIND_BEKKER);
  m.clear_residual();
  v1alpha1::BekkerParameters* p = m.mutable_bekker();
  p->set_k_phi_n_per_m_n_plus_2(p->k_phi_n_per_m_n_plus_2() * stress / std::pow(l, p->n()));
  p->set_cohesion_pa(p->cohesion_pa() * stress);
  p->set_shear_modulus_m(p->shear_modulus_m() * l);
  p->set_bulldozing_length_m(p->bulldozing_length_m() * l);
  p->set_unit_weight_n_per_m3(p->unit_weight_n_per_m3() * by.gravity);
  p->set_grouser_height_m(p->grouser_height_m() * l);
  m.mutable_soil()->set_gravity_m_per_s2(m.soil().gravity_m_per_s2() * by.gravity);
  m.mutable_wheel()->set_radius_m(m.wheel().radius_m() * l);
  m.mutable_wheel()->set_width_m(m.wheel().width_m() * l);
  v1alpha1::Domain* d = m.mutable_domain();
  d->set_load_min_n(d->load_min_n() * by.Force());
  d->set_load_max_n(d->load_max_n() * by.Force());
  for (int o = 0; o < kOutputs; ++o) {
    m.set_sd_fit_inside(o, m.sd_fit_inside(o) * by.Of(o));
    m.set_sd_fit_growth(o, m.sd_fit_growth(o) * by.Of(o));
    m.set_sd_patch(o, m.sd_patch(o) * by.Of(o));
  }
  return m;
}

TEST(ScaledModel, IsTheModelOfParametersInOtherUnits) {
  const v1alpha1::Model message = ScaledByHand(SmallMessage(), {});
  for (const Similarity by : {kMoonTwice, Similarity{0.4, 3}}) {
    const auto scaled = MakeScaled(message, Shared(message), by);
    const auto by_hand = MakeLaw(ScaledByHand(message, by));
    StateBatch expected = ForSimilar(InsideHull(HullOf(message), 60, 5), by), got = expected;
    by_hand->Evaluate(expected.In(), expected.Out());
    scaled->Evaluate(got.In(), got.Out());
    const double radius = message.wheel().radius_m() * by.length;
    for (std::size_t i = 0; i < got.size(); ++i) {
      EXPECT_EQ(got.flags[i], expected.flags[i]);
      for (int o = 0; o < kOutputs; ++o) {
        const auto& e = expected.part[o];
        const double scale = OutputScale(o, got.load[i], radius);
        const Widened w = Widen(o, e[kSdFit][i], e[kLow][i], e[kHigh][i], got.load[i], radius, by);
        const double answers[] = {e[kValue][i], w.sd_fit, e[kSdPatch][i], w.low, w.high};
        for (int p = 0; p <= kHigh; ++p) {
          EXPECT_NEAR(got.part[o][p][i], answers[p], 1e-8 * scale)
              << kOutputFields[o].name << " part " << p;
        }
      }
    }
  }
}

TEST(ScaledModel, HardGroundScalesWithItsPatch) {
  const HardGround own{.friction = 0.7,
                       .slip_stiffness = 9,
                       .rolling_resistance = 0.02,
                       .contact_length_m = 0.03,
                       .contact_width_m = 0.05,
                       .friction_sd = 0.1};
  HardGround twice = own;
  twice.contact_length_m *= 2;
  twice.contact_width_m *= 2;
  const ScaledModel scaled(std::make_shared<HardGroundModel>(own, 0.1), 0.1, {2, 1}, false);
  const HardGroundModel expected(twice, 0.2);
  StateBatch a(3), b(3);
  for (StateBatch* batch : {&a, &b}) {
    batch->Set(0, 0.5, 0.02, 0.52, 100);
    batch->Set(1, 0, 0, 0, 40);
    batch->Set(2, 0.3, -0.1, 0.1, 400);
    batch->yaw_rate = {0.4, 1.0, -0.2};
  }
  scaled.Evaluate(a.In(), a.Out());
  expected.Evaluate(b.In(), b.Out());
  EXPECT_TRUE(scaled.UsesYawRate());
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      for (std::size_t i = 0; i < 3; ++i) {
        ExpectClose(b.part[o][p][i], a.part[o][p][i], 1e-12, 1e-9,
                    std::string(kOutputFields[o].name) + " part " + std::to_string(p));
      }
    }
  }
}

TEST(ScaledModel, TheWheelItselfKeepsItsBits) {
  const v1alpha1::Model message = SmallMessage();
  const std::shared_ptr<const WheelModel> own = MakeModel(message);
  const Similarity same = SimilarityTo(message, 0.0625, message.soil().gravity_m_per_s2());
  EXPECT_TRUE(same.IsIdentity());
  StateBatch a = testing::Anywhere(300, 7), b = a;
  own->Evaluate(a.In(), a.Out());
  MakeScaled(message, own, same)->Evaluate(b.In(), b.Out());
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(0, std::memcmp(a.slip.data(), b.slip.data(), 300 * sizeof(double)));
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) {
      EXPECT_EQ(0, std::memcmp(a.part[o][p].data(), b.part[o][p].data(), 300 * sizeof(double)));
    }
  }
}

TEST(ScaledModel, WidensWhatIsAskedAlone) {
  const v1alpha1::Model message = SmallMessage();
  const auto scaled = MakeScaled(message, Shared(message), kMoonTwice);
  StateBatch all = ForSimilar(InsideHull(HullOf(message), 200, 9), kMoonTwice);
  StateBatch some = all;
  scaled->Evaluate(all.In(), all.Out());
  for (const Part part : {kLow, kHigh, kSdFit}) {
    ResponsesView out;
    for (int o = 0; o < kOutputs; ++o) {
      out.output[o].*kPartMembers[part] = some.part[o][part];
    }
    out.flags = some.flags;
    scaled->Evaluate(some.In(), out);
    for (int o = 0; o < kOutputs; ++o) EXPECT_EQ(some.part[o][part], all.part[o][part]) << part;
  }
}

TEST(ScaledModel, GradientsAreThoseOfItsAnswers) {
  const v1alpha1::Model message = SmallMessage();
  const auto scaled = MakeScaled(message, MakeModel(message), kMoonTwice);
  StateBatch b(1);
  const double state[] = {0.12 * kMoonTwice.Speed(), 0.03 * kMoonTwice.Speed(),
                          0.15 * kMoonTwice.Speed(), 22 * kMoonTwice.Force()};
  b.Set(0, state[0], state[1], state[2], state[3]);
  scaled->Evaluate(b.In(), b.Out());
  for (int k = 0; k < 4; ++k) {
    double up[4], down[4];
    for (int j = 0; j < 4; ++j) up[j] = down[j] = state[j];
    const double step = 2e-3 * state[k];
    up[k] += step;
    down[k] -= step;
    const auto at = [&](const double* s) { return AnswerOf(*scaled, {s[0], s[1], s[2]}, s[3]); };
    const WheelAnswer high = at(up), low = at(down);
    for (int o = 0; o < kOutputs; ++o) {
      const double difference = (high.value[o] - low.value[o]) / (2 * step);
      const double scale = OutputScale(o, state[3], 0.125) / state[k];
      EXPECT_NEAR(b.part[o][kDvX + k][0], difference, 3e-3 * scale)
          << kOutputFields[o].name << " by input " << k;
    }
  }
}

TEST(SimilarWheel, CarriesTheErrorAgainstMeasurements) {
  FormErrors form;
  form.middle_load_n = 20;
  form.region[0].sd = {1, 2, 0, 0.1, kNaN, 0.003};
  const FormErrors scaled = Scaled(form, kMoonTwice);
  const double f = kMoonTwice.Force();
  EXPECT_DOUBLE_EQ(scaled.Sd(MeasuredRegion::kStraight, kFx, 10 * f), 0.5 * f);
  EXPECT_DOUBLE_EQ(scaled.Sd(MeasuredRegion::kStraight, kTorque, 20 * f), 0.2 * f);
  EXPECT_DOUBLE_EQ(scaled.Sd(MeasuredRegion::kStraight, kSinkage, 10 * f), 0.006);
  EXPECT_TRUE(std::isnan(scaled.Sd(MeasuredRegion::kStraight, kMz, 10 * f)));
}

std::string RefusalOf(const v1alpha1::Model& message, double radius, double gravity) {
  try {
    SimilarityTo(message, radius, gravity);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(SimilarWheel, RefusesSoilThatCoheres) {
  v1alpha1::Model message = SmallMessage();
  EXPECT_GT(message.bekker().cohesion_pa(), 0) << "a fit to dry grains has some, too";
  EXPECT_EQ(RefusalOf(message, 0.1, 1.62), "");
  v1alpha1::Model untuned = message;
  untuned.set_untuned(true);
  EXPECT_NE(RefusalOf(untuned, 0.1, 1.62).find("cohesion"), std::string::npos);
  untuned.mutable_bekker()->set_cohesion_pa(0);
  untuned.mutable_bekker()->set_k_c_n_per_m_n_plus_1(0);
  untuned.mutable_bekker()->set_reece_k_c(0);
  EXPECT_EQ(RefusalOf(untuned, 0.1, 1.62), "");
  for (const auto set :
       {+[](v1alpha1::ContactLaws* c) { c->set_cohesion("jkr"); },
        +[](v1alpha1::ContactLaws* c) { c->set_surface_energy_j_per_m2(0.1); },
        +[](v1alpha1::ContactLaws* c) { c->mutable_wheel()->set_surface_energy_j_per_m2(0.1); }}) {
    v1alpha1::Model sticky = message;
    set(sticky.mutable_soil()->mutable_grains()->mutable_contact());
    EXPECT_NE(RefusalOf(sticky, 0.1, 1.62).find("cohere"), std::string::npos);
  }
}

TEST(SimilarWheel, RefusesNumbersThatAreNoSizeOrGravity) {
  const v1alpha1::Model message = SmallMessage();
  for (const double bad : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity(), 1e300}) {
    EXPECT_NE(RefusalOf(message, bad, 9.81), "") << bad;
    if (bad == 1e300) continue;
    EXPECT_NE(RefusalOf(message, 0.1, bad).find("gravity"), std::string::npos);
  }
  EXPECT_THROW(ScaledModel(nullptr, 0.1, {}, false), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::surrogate

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

v1alpha1::Model MakeMessage() {
  v1alpha1::Model m;
  m.set_name("little");
  m.set_kind(v1alpha1::MODEL_KIND_HYBRID);
  m.mutable_wheel()->set_radius_m(0.0625);
  m.mutable_wheel()->set_width_m(0.05);
  m.mutable_soil()->set_gravity_m_per_s2(9.81);
  m.mutable_domain()->set_slip_min(-1);
  m.mutable_domain()->set_slip_max(0.9);
  m.mutable_domain()->set_attack_angle_max_rad(1);
  m.mutable_domain()->set_load_min_n(12);
  m.mutable_domain()->set_load_max_n(30);
  for (int o = 0; o < kOutputs; ++o) {
    m.add_sd_fit_inside(0.1);
    m.add_sd_fit_growth(1);
    m.add_sd_patch(0.2);
    m.add_interval_factor(1.8);
  }
  SetBekker(BekkerParameters{}, &m);
  const TableAxes axes{6, 3, 4, 1.0, 5.0};
  TableCoefficients coefficients;
  coefficients[kSinkage].assign(ResidualTable::Size(axes), 0.01);
  SetResidual(axes, coefficients, &m);
  SetGoldenVectors(&m);
  return m;
}

TEST(MakeModel, ReproducesThePartsItWasMadeFrom) {
  const v1alpha1::Model message = MakeMessage();
  const auto model = MakeModel(message);
  const double sinkage = AnswerOf(*model, {0.1, 0.02, 0.12}, 20).value[kSinkage];
  const double physics =
      BekkerModel(BekkerParameters{}, {0.0625, 0.05}).Solve(0.1, 0.02, 0.12, 20).value[kSinkage];
  const double whole = physics + 0.01 * 0.0625;
  EXPECT_NEAR(MakeHybrid(message).EvaluateOne(0.1, 0.02, 0.12, 20).value[kSinkage], whole, 1e-12);
  EXPECT_NEAR(sinkage, whole, 1e-4 * whole);  // by its table
  v1alpha1::Model back;
  ASSERT_TRUE(back.ParseFromString(message.SerializeAsString()));
  EXPECT_NO_THROW(MakeModel(back));
}

// Soft soil: most states of the domain are overloads, where tables are coarse.
TEST(SetGoldenVectors, KeepsClearOfOverloads) {
  v1alpha1::Model soft = MakeMessage();
  BekkerParameters weak;
  weak.k_phi = 4e4;
  SetBekker(weak, &soft);
  SetGoldenVectors(&soft);
  int lighter = 0;
  for (const v1alpha1::GoldenVector& g : soft.golden()) {
    EXPECT_LE(g.value(kSinkage), 0.5 * 0.0625);
    lighter += g.load_n() < 12;
  }
  EXPECT_EQ(soft.golden_size(), 24);
  EXPECT_GT(lighter, 0);
  const auto tabulated = MakeModel(soft);  // as the server's self-test does
  for (const v1alpha1::GoldenVector& g : soft.golden()) {
    const VelocityState motion{g.v_x_m_per_s(), g.v_y_m_per_s(), g.rim_speed_m_per_s()};
    const double pull = AnswerOf(*tabulated, motion, g.load_n()).value[kFx];
    EXPECT_NEAR(pull, g.value(kFx), tabulated->Tolerance() * g.load_n());
  }
}

// What MakeModel says about a message with one change.
std::string Complaint(const std::function<void(v1alpha1::Model*)>& change) {
  v1alpha1::Model message = MakeMessage();
  change(&message);
  try {
    MakeModel(message);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

// Files of before the forms and grousers: what is absent is the default.
TEST(MakeModel, TakesAFileWithoutTheOptionalParameters) {
  EXPECT_EQ(Complaint([](v1alpha1::Model* m) {
              v1alpha1::BekkerParameters* bekker = m->mutable_bekker();
              bekker->clear_pressure_form();
              bekker->clear_reece_k_c();
              bekker->clear_reece_k_phi();
              bekker->clear_grouser_height_m();
              bekker->clear_grouser_share();
            }),
            "accepted");
}

TEST(MakeModel, NamesTheFieldThatIsWrong) {
  using testing::HasSubstr;
  using M = v1alpha1::Model*;
  EXPECT_THAT(Complaint([](M m) { m->clear_name(); }), HasSubstr("name"));
  EXPECT_THAT(Complaint([](M m) { m->set_name(std::string(129, 'n')); }),
              HasSubstr("name: 129 bytes, expected at most 128"));
  EXPECT_THAT(Complaint([](M m) { m->set_name("a@b"); }),
              HasSubstr("name: expected one without '@'"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_soil()->set_name(std::string(1001, 's')); }),
              HasSubstr("soil.name: 1001 bytes, expected at most 1000"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_wheel()->set_radius_m(0); }),
              HasSubstr("wheel radius"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_bekker()->clear_n(); }), HasSubstr("bekker: no n"));
  EXPECT_THAT(Complaint([](M m) {
                const auto later = std::string("\xf8\x3f\x01", 3);  // field 1023
                m->mutable_bekker()->MergeFromString(later);
              }),
              HasSubstr("bekker: a parameter that this version does not know"));
  EXPECT_THAT(Complaint([](M m) { m->clear_sd_patch(); }), HasSubstr("sd_patch: 0 numbers"));
  EXPECT_THAT(Complaint([](M m) { m->add_sd_bulldozing(1); }),
              HasSubstr("sd_bulldozing: 1 numbers"));
  EXPECT_THAT(Complaint([](M m) { m->set_interval_factor(2, -1); }),
              HasSubstr("interval_factor[2]"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_domain()->set_load_min_n(0); }),
              HasSubstr("load_min_n"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_soil()->clear_gravity_m_per_s2(); }),
              HasSubstr("gravity"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_residual()->set_log_load_knots(1, 4); }),
              HasSubstr("log_load_knots"));
  EXPECT_THAT(
      Complaint([](M m) { m->mutable_residual()->mutable_coefficients(kSinkage)->add_values(1); }),
      HasSubstr("coefficients[5]"));
  EXPECT_THAT(Complaint([](M m) { m->clear_golden(); }), HasSubstr("golden"));
  EXPECT_THAT(Complaint([](M m) { m->mutable_golden(3)->set_load_n(-1); }), HasSubstr("golden[3]"));
}

TEST(MakeModel, GoldenVectorsCatchASwappedParameter) {
  EXPECT_THAT(Complaint([](v1alpha1::Model* m) {
                auto* bekker = m->mutable_bekker();
                bekker->set_k_phi_n_per_m_n_plus_2(bekker->k_phi_n_per_m_n_plus_2() * (1 + 1e-6));
              }),
              testing::HasSubstr("golden["));
}

}  // namespace
}  // namespace grouser::surrogate

// Explanations: against brute force, the evaluator's own answers, and files that lack things.
#include "surrogate/model_io/explain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "surrogate/model_io/explanation_text.h"
#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/upgrade.h"
#include "tests/unit/surrogate/tabulated.h"

namespace grouser::surrogate {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using v1alpha1::Explanation;
using v1alpha1::NearRun;
using v1alpha1::WheelStates;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A model file and what answers by it.
struct Loaded {
  v1alpha1::Model message;
  std::unique_ptr<const WheelModel> evaluator;

  explicit Loaded(v1alpha1::Model m) : message(std::move(m)), evaluator(MakeModel(message)) {}
  /// Without its table, which takes time to make.
  static Loaded ByLaw(const v1alpha1::Model& m) { return {m, MakeLaw(m)}; }
  explicit Loaded(const std::string& path) : Loaded(ReadModel(path).model) {}
  Loaded(v1alpha1::Model m, std::unique_ptr<const WheelModel> e)
      : message(std::move(m)), evaluator(std::move(e)) {}
  Explanation Explain(const WheelStates& state, int runs = kUsualRuns) const {
    return surrogate::Explain({message, message.name() + "@sha256:0", *evaluator}, state, runs);
  }
};

const Loaded& Cmu() {
  static const Loaded model(GROUSER_DENSE_PAIR "/hybrid.model");
  return model;
}
const Loaded& AtSpeeds() {
  static const Loaded model =
      Loaded::ByLaw(ReadModel(GROUSER_PAIRS "/atv-20x10-lugged-20mm/hybrid.model").model);
  return model;
}
const Loaded& OfSmall() {
  static const Loaded model = Loaded::ByLaw(testing::SmallMessage());
  return model;
}

WheelStates BySlip(double slip, double angle_deg, double load) {
  WheelStates s;
  s.mutable_slip()->add_slip(slip);
  s.mutable_slip()->add_attack_angle_rad(angle_deg * std::numbers::pi / 180);
  s.add_load_n(load);
  return s;
}

WheelStates ByVelocity(const VelocityState& v, double load) {
  WheelStates s;
  s.mutable_velocity()->add_v_x_m_per_s(v.v_x);
  s.mutable_velocity()->add_v_y_m_per_s(v.v_y);
  s.mutable_velocity()->add_rim_speed_m_per_s(v.rim_speed);
  s.add_load_n(load);
  return s;
}

WheelStates StateOf(const StateBatch& b, std::size_t i) {
  return ByVelocity({b.v_x[i], b.v_y[i], b.rim_speed[i]}, b.load[i]);
}

double SpeedOf(const VelocityState& v) {
  return std::max(std::fabs(v.rim_speed), std::hypot(v.v_x, v.v_y));
}

/// By the angle between the directions, in closed form over the mirrors: independent of
/// NearestRuns.
double Oracle(const v1alpha1::Model& m, const VelocityState& a, double load,
              const v1alpha1::RunSummary& run) {
  const VelocityState b = FromSlip(run.slip(), run.attack_angle_rad(), run.speed_m_per_s());
  const double norms = std::sqrt((a.v_x * a.v_x + a.v_y * a.v_y + a.rim_speed * a.rim_speed) *
                                 (b.v_x * b.v_x + b.v_y * b.v_y + b.rim_speed * b.rim_speed));
  const double cosine =
      (std::fabs(a.v_x * b.v_x + a.rim_speed * b.rim_speed) + std::fabs(a.v_y * b.v_y)) / norms;
  const double chord = 2 * std::sin(std::acos(std::min(1.0, cosine)) / 2);
  const double log_load = std::log(load / run.load_n());
  double speed = 0;
  if (m.residual().froude_max() > 0) {
    const double gr = m.soil().gravity_m_per_s2() * m.wheel().radius_m();
    const auto scaled = [&](const VelocityState& v) {
      const double froude = std::min(std::pow(SpeedOf(v), 2) / gr, m.residual().froude_max());
      return froude / (1 + m.residual().froude_saturation() * froude);
    };
    const double high = m.residual().froude_max();
    speed = (scaled(a) - scaled(b)) / (high / (1 + m.residual().froude_saturation() * high));
  }
  return std::sqrt(std::pow(chord / 0.3, 2) + std::pow(log_load / 0.405, 2) + speed * speed);
}

bool Trained(const v1alpha1::RunSummary& run) {
  const bool usable = run.status() == v1alpha1::RUN_STATUS_STEADY ||
                      (run.status() == v1alpha1::RUN_STATUS_UNSTEADY && run.drift_size() == 6);
  return usable && run.role() == v1alpha1::RUN_ROLE_TRAIN;
}

TEST(Explain, NearestRunsAreThoseOfBruteForce) {
  for (const Loaded* model : {&Cmu(), &AtSpeeds(), &OfSmall()}) {
    StateBatch states = testing::Anywhere(40, 3);
    for (std::size_t i = 0; i < states.size(); ++i) {
      const double load =
          states.load[i] * std::sqrt(model->message.domain().load_min_n() * 10) / 10;
      const VelocityState v{states.v_x[i], states.v_y[i], states.rim_speed[i]};
      std::vector<double> expected;
      for (const auto& run : model->message.provenance().runs()) {
        if (Trained(run)) expected.push_back(Oracle(model->message, v, load, run));
      }
      std::ranges::sort(expected);
      const Explanation e = model->Explain(ByVelocity(v, load), kMostRuns);
      ASSERT_EQ(e.nearest_size(), kMostRuns);
      EXPECT_EQ(e.runs_fitted(), expected.size());
      for (int k = 0; k < kMostRuns; ++k) {
        const NearRun& near = e.nearest(k);
        EXPECT_NEAR(near.distance(), expected[k], 1e-6);
        EXPECT_NEAR(near.distance(), Oracle(model->message, v, load, near.run()), 1e-6);
        EXPECT_NEAR(
            near.distance(),
            std::hypot(near.direction_distance(), near.load_distance(), near.speed_distance()),
            1e-12);
      }
    }
  }
}

/// The run's own motion, with the mirrors.
VelocityState Motion(const v1alpha1::RunSummary& run, bool x, bool y) {
  VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), run.speed_m_per_s());
  if (x) v.v_x = -v.v_x, v.rim_speed = -v.rim_speed;
  if (y) v.v_y = -v.v_y;
  return v;
}

TEST(Explain, ARunsOwnStateHasThatRunAtDistanceZeroOnEverySide) {
  const Loaded& model = Cmu();
  int checked = 0;
  for (const auto& run : model.message.provenance().runs()) {
    if (!Trained(run) || ++checked % 6 != 0) continue;
    for (const bool x : {false, true}) {
      for (const bool y : {false, true}) {
        const Explanation e = model.Explain(ByVelocity(Motion(run, x, y), run.load_n()));
        const auto here = std::ranges::find(e.nearest(), run.run_id(),
                                            [](const NearRun& n) { return n.run().run_id(); });
        ASSERT_NE(here, e.nearest().end()) << run.run_id();
        EXPECT_LT(here->distance(), 1e-6);
        EXPECT_EQ(here->run().sha256(), run.sha256());
        // Without lateral or forward motion a mirror changes nothing, and none is taken.
        const bool turned_x = here->mirrored_x(), turned_y = here->mirrored_y();
        EXPECT_TRUE(turned_x == x || std::fabs(run.attack_angle_rad()) > 1.5);
        EXPECT_TRUE(turned_y == y || run.attack_angle_rad() == 0);
        for (int o = 0; o < kOutputs; ++o) {
          const double sign = (turned_x ? kOutputFields[o].parity_x : 1) *
                              (turned_y ? kOutputFields[o].parity_y : 1);
          EXPECT_EQ(here->mean(o), sign * run.mean(o)) << kOutputFields[o].name;
          EXPECT_EQ(here->run().mean(o), run.mean(o)) << "as the file has it";
          // The model's answer at the run is that at this state: the same place.
          EXPECT_NEAR(here->model_value(o), e.outputs(o).value(),
                      1e-6 * OutputScale(o, run.load_n(), 0.0625))
              << kOutputFields[o].name;
        }
        const auto& stress = here->stress();
        ASSERT_EQ(stress.normal_pa_size(), run.stress().normal_pa_size());
        const int last = stress.normal_pa_size() - 1;
        for (int k = 0; k <= last; ++k) {
          const int from = turned_x ? last - k : k;
          EXPECT_EQ(stress.normal_pa(k), run.stress().normal_pa(from));
          EXPECT_EQ(stress.shear_tangential_pa(k),
                    (turned_x ? -1 : 1) * run.stress().shear_tangential_pa(from));
        }
      }
    }
  }
  EXPECT_GT(checked, 100);
}

/// Reasons of one flag, joined.
std::string ReasonsOf(const Explanation& e, Flag flag) {
  std::string text;
  for (const auto& reason : e.reasons()) {
    if (static_cast<std::uint32_t>(reason.flag()) == flag) text += reason.text() + "; ";
  }
  return text;
}

/// What the evaluator says to it, by another way.
WheelAnswer Direct(const Loaded& model, const VelocityState& v, double load) {
  WheelAnswer answer = AnswerOf(*model.evaluator, v, load);
  FormOf(FormErrorsOf(model.message), v, load, &answer);
  return answer;
}

struct Tally {
  int flags = 0, general = 0;
  double worst = 0;  // of sd_fit by the hull distance that is told, relative
};

/// Everything that holds of any explanation.
void CheckWhole(const Loaded& model, const WheelStates& state, Tally* tally) {
  const Explanation e = model.Explain(state, 2);
  const VelocityState v{e.v_x_m_per_s(), e.v_y_m_per_s(), e.rim_speed_m_per_s()};
  const WheelAnswer direct = Direct(model, v, e.load_n());
  ASSERT_EQ(e.flags(), direct.flags);
  std::uint32_t said = 0;
  for (const auto& reason : e.reasons()) {
    said |= reason.flag();
    EXPECT_FALSE(reason.text().empty());
    tally->general += reason.text().starts_with("at the ") ? 1 : 0;
    if (!reason.quantity().empty() && reason.flag() != v1alpha1::STATE_FLAG_INVALID) {
      EXPECT_TRUE(std::isfinite(reason.value()) && std::isfinite(reason.limit())) << reason.text();
    }
  }
  EXPECT_EQ(said, e.flags()) << "every flag has a reason, and no other";
  tally->flags += std::popcount(e.flags());
  ASSERT_EQ(e.outputs_size(), kOutputs);
  double adds = 0;
  for (const auto& axis : e.axes()) adds += axis.hull_distance();
  if (!e.axes().empty()) {
    EXPECT_NEAR(e.hull_distance(), e.table_distance() + adds, 1e-9 * (1 + adds));
  }
  for (int o = 0; o < kOutputs; ++o) {
    const auto& out = e.outputs(o);
    if (std::isnan(out.value())) continue;
    EXPECT_EQ(out.value(), direct.value[o]);
    EXPECT_EQ(out.sd_fit(), direct.sd_fit[o]);
    EXPECT_EQ(out.sd_patch(), direct.sd_patch[o]);
    const double half = out.high() - out.value();
    if ((e.flags() & kAirborne) != 0) {
      EXPECT_EQ(half, 0);
      continue;
    }
    const double scale = OutputScale(o, e.load_n(), model.message.wheel().radius_m());
    const double slack = 1e-5 * half + 1e-6 * (scale + std::fabs(out.value()));
    if (model.message.kind() != v1alpha1::MODEL_KIND_HARD) {
      EXPECT_NEAR(std::hypot(out.sd_fit_inside(), out.sd_fit_beyond()), out.sd_fit(),
                  1e-5 * out.sd_fit());
      EXPECT_NEAR(out.interval_factor() * std::hypot(out.sd_fit(), out.sd_patch()), half, slack);
      // The hull distance that is told is what the interval grew with.
      const v1alpha1::Domain& domain = model.message.domain();
      const double ratio = e.load_n() / std::sqrt(domain.load_min_n() * domain.load_max_n());
      const double grown = out.bulldozing_growth() * (o == kSinkage ? 1 : ratio) *
                           model.message.sd_fit_growth(o) * e.hull_distance();
      const double law = std::hypot(out.sd_fit_inside(), grown);
      // (A lookup's intervals grow no more beyond 1e29 N.)
      const bool held = e.load_n() < 1e-20 || e.load_n() > 1e20;
      if (!held) tally->worst = std::max(tally->worst, std::fabs(law / out.sd_fit() - 1));
    } else {
      EXPECT_NEAR(out.interval_factor() * out.sd_fit(), half, slack);
    }
    if (!std::isnan(out.measured_high())) {
      EXPECT_NEAR(std::hypot(half, out.form_factor() * out.sd_form()),
                  out.measured_high() - out.value(), slack);
    }
  }
  EXPECT_FALSE(ExplanationText(e).empty());
}

TEST(Explain, FlagsHaveReasonsAndPartsAddUpOnEveryKind) {
  v1alpha1::Model hard;
  hard.set_name("ice");
  hard.set_kind(v1alpha1::MODEL_KIND_HARD);
  hard.set_untuned(true);
  hard.set_interval_level(0.9);
  hard.mutable_wheel()->set_radius_m(0.0625);
  hard.mutable_domain()->set_load_min_n(1);
  hard.mutable_domain()->set_load_max_n(100);
  SetHard({.friction = 0.1,
           .slip_stiffness = 5,
           .rolling_resistance = 0.02,
           .contact_length_m = 0.01,
           .contact_width_m = 0.05,
           .friction_sd = 0.02},
          &hard);
  SetGoldenVectors(&hard);
  const Loaded ice(hard);
  const Loaded calibrated(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/hybrid.model");  // knows sd_form
  const Loaded bekker(GROUSER_DENSE_PAIR "/bekker.model");
  const Loaded lookup(GROUSER_DENSE_PAIR "/lookup.model");
  for (const Loaded* model :
       {&Cmu(), &AtSpeeds(), &OfSmall(), &calibrated, &bekker, &lookup, &ice}) {
    SCOPED_TRACE(model->message.name());
    Tally tally;
    const StateBatch any = testing::Anywhere(80, 5);
    for (std::size_t i = 0; i < any.size(); ++i) CheckWhole(*model, StateOf(any, i), &tally);
    if (model != &ice) {
      const StateBatch inside = testing::InsideHull(HullOf(model->message), 80, 7);
      for (std::size_t i = 0; i < inside.size(); ++i)
        CheckWhole(*model, StateOf(inside, i), &tally);
    }
    for (const double x : {0.0, 1e-300, 1e-30, 1e30, 1e300, kInfinity, -kInfinity, kNaN}) {
      CheckWhole(*model, ByVelocity({x, 0.1 * x, 1.1 * x}, 20), &tally);
      CheckWhole(*model, ByVelocity({0.1, 0.02, 0.11}, x), &tally);
      CheckWhole(*model, ByVelocity({0, 0, 0}, x), &tally);
    }
    EXPECT_GT(tally.flags, 100);
    EXPECT_LE(tally.general, 2) << "without a reason of their own, of " << tally.flags;
    EXPECT_LT(tally.worst, 0.02)
        << "hybrids interpolate the distance once more, in their fine table";
  }
}

TEST(Explain, TellsWhichAxisIsLeftAndByHowMuch) {
  const Loaded& m = OfSmall();  // slip -0.5 to 0.9, 60 deg, 10.91 to 39.6 N, 0.1 m/s
  const auto why = [&](const WheelStates& s, Flag flag) { return ReasonsOf(m.Explain(s), flag); };
  EXPECT_THAT(why(BySlip(-0.7, 0, 20), kExtrapolated),
              HasSubstr("slip -0.7 is below the training runs' -0.5 to 0.9, by 0.2"));
  EXPECT_THAT(why(BySlip(0.95, 0, 20), kExtrapolated), HasSubstr("slip 0.95 is above"));
  EXPECT_THAT(why(BySlip(0.2, 75, 20), kExtrapolated),
              HasSubstr("attack angle 75 deg is above the training runs' 60 deg, by 15 deg"));
  EXPECT_THAT(why(BySlip(0.2, 0, 79.2), kExtrapolated),
              HasSubstr("load 79.2 N is above the training runs' 10.91 to 39.6 N, 2 times"));
  EXPECT_THAT(why(BySlip(0.2, 0, 2), kExtrapolated), HasSubstr("load 2 N is below"));
  EXPECT_THAT(why(ByVelocity({0.01, 0, -0.1}, 20), kExtrapolated),
              HasSubstr("the rim turns against the travel"));
  EXPECT_THAT(why(BySlip(0.2, 0, 500), kExtrapolated), HasSubstr("hull distance"));
  WheelStates fast = BySlip(0.2, 0, 20);
  fast.mutable_slip()->add_speed_m_per_s(0.6);
  EXPECT_THAT(why(fast, kRate), HasSubstr("0.6 m/s (Froude number 0.587) is above 0.2 m/s"));
  const Explanation e = m.Explain(BySlip(-0.7, 0, 20));
  ASSERT_EQ(e.axes_size(), 4);
  EXPECT_EQ(e.axes(0).quantity(), "slip");
  EXPECT_NEAR(e.axes(0).beyond(), -0.2, 1e-12);
  EXPECT_GT(e.axes(0).hull_distance(), 0);
  EXPECT_EQ(e.axes(2).beyond(), 0);
}

TEST(Explain, TellsTheReasonOfEveryOtherFlag) {
  const Loaded& m = OfSmall();
  const auto why = [&](const WheelStates& s, Flag flag) { return ReasonsOf(m.Explain(s), flag); };
  EXPECT_THAT(why(BySlip(1.8, 90, 20), kInvalid),
              HasSubstr("slip 1.8 at attack angle 90 deg, which no motion has: -1 to 1 there"));
  EXPECT_THAT(why(BySlip(kNaN, 0, 20), kInvalid), HasSubstr("slip nan"));
  EXPECT_THAT(why(BySlip(0.1, 400, 20), kInvalid), HasSubstr("attack angle 400 deg"));
  EXPECT_THAT(why(BySlip(0.1, 0, -3), kInvalid), HasSubstr("load -3 N"));
  EXPECT_THAT(why(ByVelocity({kInfinity, 0, 1}, 20), kInvalid), HasSubstr("v_x inf"));
  WheelStates at = BySlip(0.1, 0, 20);
  at.mutable_slip()->add_speed_m_per_s(-1);
  EXPECT_THAT(why(at, kInvalid), HasSubstr("speed -1 m/s"));
  at = BySlip(0.1, 0, 20);
  at.add_slope_roll_rad(kNaN);
  EXPECT_THAT(why(at, kInvalid), HasSubstr("ground slope along y [rad] nan"));
  at = BySlip(0.1, 0, 20);
  at.add_slope_pitch_rad(std::numbers::pi / 18);
  at.add_pass_number(3);
  at.add_yaw_rate_rad_per_s(0.5);
  const Explanation context = m.Explain(at);
  EXPECT_THAT(ReasonsOf(context, kSlope), HasSubstr("a ground slope of 10 deg along x"));
  EXPECT_THAT(ReasonsOf(context, kVirginAssumed), HasSubstr("pass 3"));
  EXPECT_THAT(ReasonsOf(context, kClamped), HasSubstr("a yaw rate of 0.5 rad/s"));
  EXPECT_TRUE(std::isnan(context.outputs(0).value()));
  EXPECT_THAT(why(ByVelocity({0, 0, 0}, 20), kStatic), HasSubstr("stand still"));
  EXPECT_THAT(why(ByVelocity({0, 0, 0}, 20), kExtrapolated), HasSubstr("a wheel at rest"));
  EXPECT_THAT(why(BySlip(0.1, 0, 0), kAirborne), HasSubstr("load 0"));
  const Explanation heavy = m.Explain(BySlip(0.1, 0, 3000));
  EXPECT_THAT(ReasonsOf(heavy, kNoEquilibrium), HasSubstr("of 3000 N at a sinkage of 1.2 radii"));
  EXPECT_THAT(ReasonsOf(heavy, kClamped), HasSubstr("held at 1.2 radii, 75.0 mm"));
  EXPECT_THAT(ReasonsOf(heavy, kExtrapolated), HasSubstr("is above 0.7 of the radius, 43.8 mm"));
}

// Of an answer that is physics' in part, the sinkage is not the one at which they end.
TEST(Explain, SaysWhatPartOfAnOverloadedAnswerIsPhysics) {
  v1alpha1::Model message = testing::SmallMessage();
  v1alpha1::ResidualTable* table = message.mutable_residual();
  const int size = table->coefficients(ResidualTable::kDistance).values_size();
  auto* share = table->mutable_coefficients(ResidualTable::kShare)->mutable_values();
  share->Clear();
  share->Resize(size, 0.2);
  const Explanation heavy = Loaded::ByLaw(message).Explain(BySlip(0.1, 0, 3000));
  const std::string carries = ReasonsOf(heavy, kNoEquilibrium);
  const std::string held = ReasonsOf(heavy, kClamped);
  EXPECT_THAT(carries, HasSubstr("of 3000 N: the law of the physics does not carry the load"));
  for (const std::string& text : {carries, held}) {
    EXPECT_THAT(text, HasSubstr("80 % of the answer is theirs"));
  }
  EXPECT_THAT(held, ::testing::Not(HasSubstr("75.0 mm")));
}

TEST(Explain, TellsWhatWasNeverMeasuredOrFitted) {
  v1alpha1::Model message = testing::SmallMessage();
  message.clear_form_by_region();
  message.clear_sd_form();
  message.set_untuned(true);
  const Explanation none = Loaded::ByLaw(message).Explain(BySlip(0.1, 0, 20));
  EXPECT_THAT(ReasonsOf(none, kFormUnknown), HasSubstr("never compared with measurements"));
  EXPECT_THAT(ReasonsOf(none, kUntuned), HasSubstr("nothing was fitted"));
  v1alpha1::FormError* form = message.add_form_by_region();
  form->set_region(v1alpha1::MEASURED_REGION_STRAIGHT);
  for (int o = 0; o < kOutputs; ++o) {
    form->add_rows(3);
    form->add_sd(o == kMz || o == kFy ? kNaN : 0.5);
    form->add_factor(2);
  }
  const Loaded some = Loaded::ByLaw(message);
  const Explanation straight = some.Explain(BySlip(0.1, 0, 20));
  EXPECT_THAT(ReasonsOf(straight, kFormUnknown),
              HasSubstr("a measurement of f_y, m_z in the region \"straight\""));
  EXPECT_EQ(straight.measured_region(), v1alpha1::MEASURED_REGION_STRAIGHT);
  EXPECT_THAT(ReasonsOf(some.Explain(BySlip(-1, 0, 20)), kFormUnknown),
              HasSubstr("f_x, f_y, torque, m_z, sinkage in the region \"locked\""));
  EXPECT_THAT(ReasonsOf(some.Explain(ByVelocity({0, 0, 0}, 20)), kFormUnknown),
              HasSubstr("a wheel at rest"));
}

TEST(Explain, OldFilesSayWhatTheyDoNotHold) {
  const Explanation no_stress = OfSmall().Explain(BySlip(0.2, 10, 20));
  EXPECT_THAT(no_stress.notes(), ElementsAre(HasSubstr("no stresses on the rim recorded in this")));
  ASSERT_EQ(no_stress.nearest_size(), kUsualRuns);
  EXPECT_FALSE(no_stress.nearest(0).has_stress());
  EXPECT_THAT(no_stress.nearest(0).no_stress(), HasSubstr("holds no stresses"));
  EXPECT_EQ(no_stress.nearest(0).run().sha256().size(), 64u);
  // One run in its provenance, of model version 001.
  const Loaded earlier(GROUSER_EARLIER "/bekker.model");
  const Explanation first = earlier.Explain(BySlip(0.2, 10, 20));
  EXPECT_EQ(
      first.runs_fitted() + first.runs_held_out() + first.runs_repeats() + first.runs_of_no_use(),
      1u);
  v1alpha1::Model bare = testing::SmallMessage();
  bare.clear_provenance();
  const Explanation none = Loaded::ByLaw(bare).Explain(BySlip(0.2, 10, 20));
  EXPECT_THAT(none.notes(), ElementsAre("no runs recorded in this model file"));
  EXPECT_EQ(none.nearest_size(), 0);
  EXPECT_THAT(ExplanationText(none), Not(HasSubstr("nearest")));
  EXPECT_EQ(Cmu().Explain(BySlip(0.2, 10, 20)).notes_size(), 0);
}

TEST(Explain, TextOfADamagedAnswerSaysWhatIsMissing) {
  const Explanation whole = Cmu().Explain(BySlip(0.2, 10, 20), 1);
  ASSERT_THAT(ExplanationText(whole), Not(AnyOf(HasSubstr("no means"), HasSubstr("no stress"))));
  Explanation e = whole;  // as a server of another version, or none of ours, may send it
  e.mutable_nearest(0)->mutable_stress()->clear_shear_tangential_pa();
  e.mutable_physics_stress()->add_normal_pa(1);
  EXPECT_THAT(ExplanationText(e), AllOf(HasSubstr("rim: no stress: "), HasSubstr(" 0 of shear"),
                                        HasSubstr("no stress: 73 bins of normal, 72 of shear")));
  const auto no_means = [&](const auto& change) {
    e = whole;
    change(e.mutable_nearest(0));
    EXPECT_THAT(ExplanationText(e), HasSubstr("no means"));
  };
  no_means([](NearRun* n) { n->clear_mean(); });
  no_means([](NearRun* n) { n->clear_model_value(); });
  no_means([](NearRun* n) { n->mutable_model_low()->Truncate(5); });
  no_means([](NearRun* n) { n->clear_model_high(); });
}

TEST(Explain, PhysicsStressCarriesTheLoadOnTheStatesOwnSide) {
  for (const double x : {1.0, -1.0}) {
    const VelocityState v{0.08 * x, 0, 0.1 * x};
    const Explanation e = Cmu().Explain(ByVelocity(v, 20));
    const auto& s = e.physics_stress();
    double f_z = 0, moment = 0;
    for (int k = 0; k < s.normal_pa_size(); ++k) {
      const double at = s.first_angle_rad() + (k + 0.5) * s.angle_step_rad();
      const double area = 0.0625 * Cmu().message.wheel().width_m() * s.angle_step_rad();
      f_z += area * (s.normal_pa(k) * std::cos(at) + s.shear_tangential_pa(k) * std::sin(at));
      moment += area * s.normal_pa(k) * at;
    }
    EXPECT_NEAR(f_z, 20, 0.05 * 20) << "bins of 5 degrees";
    EXPECT_GT(moment * x, 0) << "the peak is ahead";
  }
}

TEST(Explain, DamagedAndHugeProvenanceStaysBoundedAndIsNotUsed) {
  v1alpha1::Model message = testing::SmallMessage();
  auto* runs = message.mutable_provenance()->mutable_runs();
  const auto find = [&] { return std::ranges::find_if(*runs, Trained); };
  const v1alpha1::RunSummary good = *find();
  const int before = static_cast<int>(std::ranges::count_if(*runs, Trained));
  const std::size_t kMany = 2'000'000;
  const auto add = [&](const auto& change) {
    v1alpha1::RunSummary run = good;
    change(&run);
    *runs->Add() = run;
  };
  add([](auto* r) { r->set_slip(99); });
  add([](auto* r) { r->set_load_n(kNaN); });
  add([](auto* r) { r->set_load_n(-1); });
  add([](auto* r) { r->set_mean(2, kInfinity); });
  add([](auto* r) { r->mutable_mean()->Truncate(3); });
  add([](auto* r) { r->mutable_stress()->add_normal_pa(1); });  // and no shear
  add([](auto* r) { r->set_role(static_cast<v1alpha1::RunRole>(77)); });
  add([&](auto* r) {  // all of it beyond any sense, but a motion and a load
    for (auto* text :
         {r->mutable_run_id(), r->mutable_file(), r->mutable_sha256(), r->mutable_reason()}) {
      text->assign(kMany, 'x');
    }
    r->mutable_drift()->Resize(100'000, 1);
    r->mutable_stress()->set_angle_step_rad(1e-6);
    r->mutable_stress()->mutable_normal_pa()->Resize(100'000, 1e4);
    r->mutable_stress()->mutable_shear_tangential_pa()->Resize(100'000, 1e3);
  });
  const Loaded model = Loaded::ByLaw(message);
  const Explanation e =
      model.Explain(ByVelocity(Motion(good, false, false), good.load_n()), kMostRuns);
  EXPECT_EQ(e.runs_fitted(), static_cast<std::uint32_t>(before + 1)) << "the last one alone";
  EXPECT_LT(e.ByteSizeLong(), 100'000u);  // 30 runs, one of them huge
  const auto huge = std::ranges::find(e.nearest(), "(2000000 bytes)",
                                      [](const NearRun& n) { return n.run().run_id(); });
  ASSERT_NE(huge, e.nearest().end());
  EXPECT_THAT(huge->no_stress(), HasSubstr("100000 bins, expected at most 360"));
  EXPECT_LT(huge->distance(), 1e-6);
}

TEST(Explain, StaysBelowAMegabyteWhereEverythingIsAsLongAsItMayBe) {
  v1alpha1::Model message = testing::SmallMessage();
  const std::string text(1000, 'x');
  message.mutable_provenance()->set_command(text);
  auto* runs = message.mutable_provenance()->mutable_runs();
  v1alpha1::RunSummary run = *std::ranges::find_if(*runs, Trained);
  for (auto* field :
       {run.mutable_run_id(), run.mutable_file(), run.mutable_sha256(), run.mutable_reason()}) {
    *field = text;
  }
  run.mutable_stress()->set_angle_step_rad(2 * std::numbers::pi / 360);
  run.mutable_stress()->mutable_normal_pa()->Resize(360, 1e4);
  run.mutable_stress()->mutable_shear_tangential_pa()->Resize(360, 1e3);
  for (int i = 0; i < kMostRuns; ++i) {
    run.set_status(v1alpha1::RUN_STATUS_STEADY);
    run.set_role(v1alpha1::RUN_ROLE_TRAIN);
    *runs->Add() = run;
    run.set_role(v1alpha1::RUN_ROLE_TEST);
    *runs->Add() = run;
    run.set_status(v1alpha1::RUN_STATUS_OVERLOAD);
    *runs->Add() = run;
  }
  const Explanation e = Loaded::ByLaw(message).Explain(
      ByVelocity(Motion(run, false, false), run.load_n()), kMostRuns);
  for (const auto* list : {&e.nearest(), &e.held_out(), &e.overloads()}) {
    ASSERT_EQ(list->size(), kMostRuns);
    EXPECT_EQ((*list)[1].stress().normal_pa_size(), 360);
    EXPECT_EQ((*list)[1].run().file(), text);
  }
  EXPECT_GT(e.ByteSizeLong(), 500'000u);
  EXPECT_LT(e.ByteSizeLong(), 1'000'000u);
}

TEST(Explain, RefusesWhatIsNotOneState) {
  const auto complaint = [](const WheelStates& s, int runs = 1) -> std::string {
    try {
      OfSmall().Explain(s, runs);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(complaint(BySlip(0.1, 0, 20)), "accepted");
  EXPECT_THAT(complaint({}), HasSubstr("state.kinematics: missing"));
  WheelStates two = BySlip(0.1, 0, 20);
  two.add_load_n(21);
  EXPECT_THAT(complaint(two), HasSubstr("state.load_n: 2 entries, expected one"));
  WheelStates slips = BySlip(0.1, 0, 20);
  slips.mutable_slip()->add_slip(0.2);
  EXPECT_THAT(complaint(slips), HasSubstr("state.slip.slip: 2 entries"));
  WheelStates half;
  half.mutable_velocity()->add_v_x_m_per_s(1);
  half.add_load_n(20);
  EXPECT_THAT(complaint(half), HasSubstr("state.velocity.v_y_m_per_s: 0 entries"));
  WheelStates passes = BySlip(0.1, 0, 20);
  passes.mutable_pass_number()->Resize(3, 1);
  EXPECT_THAT(complaint(passes), HasSubstr("state.pass_number: 3 entries"));
  EXPECT_THAT(complaint(BySlip(0.1, 0, 20), kMostRuns + 1), HasSubstr("max_runs: 21"));
  EXPECT_THAT(complaint(BySlip(0.1, 0, 20), -1), HasSubstr("max_runs: -1"));
}

}  // namespace
}  // namespace grouser::surrogate

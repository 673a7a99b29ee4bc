#include "surrogate/model_io/explain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "surrogate/model_io/asked_motion.h"
#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/state_facts.h"
#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

using google::protobuf::RepeatedField;
using v1alpha1::Explanation;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSingle = 1e-5;  // what kernels round, in squares
constexpr int kPhysicsBins = 72;  // of 5 degrees
constexpr double kPhysicsStep = 2 * std::numbers::pi / kPhysicsBins;

bool IsHard(const v1alpha1::Model& m) { return m.kind() == v1alpha1::MODEL_KIND_HARD; }
bool HasPhysics(const v1alpha1::Model& m) {
  return !IsHard(m) && m.kind() != v1alpha1::MODEL_KIND_LOOKUP;
}

void CheckOne(const v1alpha1::WheelStates& s) {
  const bool slip = s.has_slip(), velocity = s.has_velocity();
  const auto check = [](const char* name, int size, bool needed) {
    if (size == 1 || (size == 0 && !needed)) return;
    throw std::invalid_argument(std::string("state.") + name + ": " + std::to_string(size) +
                                " entries, expected one");
  };
  if (!slip && !velocity) {
    throw std::invalid_argument("state.kinematics: missing, expected velocity or slip");
  }
  check("load_n", s.load_n_size(), true);
  check("velocity.v_x_m_per_s", s.velocity().v_x_m_per_s_size(), velocity);
  check("velocity.v_y_m_per_s", s.velocity().v_y_m_per_s_size(), velocity);
  check("velocity.rim_speed_m_per_s", s.velocity().rim_speed_m_per_s_size(), velocity);
  check("slip.slip", s.slip().slip_size(), slip);
  check("slip.attack_angle_rad", s.slip().attack_angle_rad_size(), slip);
  check("slip.speed_m_per_s", s.slip().speed_m_per_s_size(), false);
  check("pass_number", s.pass_number_size(), false);
  check("slope_pitch_rad", s.slope_pitch_rad_size(), false);
  check("slope_roll_rad", s.slope_roll_rad_size(), false);
  check("yaw_rate_rad_per_s", s.yaw_rate_rad_per_s_size(), false);
}

double FirstOr(const RepeatedField<double>& values, double otherwise) {
  return values.empty() ? otherwise : values[0];
}

StateFacts FactsOf(const ExplainedModel& model, const v1alpha1::WheelStates& s, Explanation* e) {
  StateFacts f;
  f.model = &model.message;
  f.evaluator = &model.evaluator;
  f.form = FormErrorsOf(model.message);
  f.load = s.load_n(0);
  f.pitch = FirstOr(s.slope_pitch_rad(), 0);
  f.roll = FirstOr(s.slope_roll_rad(), 0);
  f.yaw = FirstOr(s.yaw_rate_rad_per_s(), 0);
  f.pass = s.pass_number().empty() ? 1 : s.pass_number(0);
  f.by_slip = s.has_slip();
  if (f.by_slip) {
    const double speed = FirstOr(s.slip().speed_m_per_s(), model.message.domain().speed_m_per_s());
    e->set_slip(s.slip().slip(0));
    e->set_attack_angle_rad(s.slip().attack_angle_rad(0));
    e->set_speed_m_per_s(speed);
    f.motion = AskedMotion(e->slip(), e->attack_angle_rad(), speed);
  } else {
    const v1alpha1::VelocityForm& v = s.velocity();
    f.motion = {v.v_x_m_per_s(0), v.v_y_m_per_s(0), v.rim_speed_m_per_s(0)};
  }
  const VelocityState& v = f.motion;
  e->set_v_x_m_per_s(v.v_x);
  e->set_v_y_m_per_s(v.v_y);
  e->set_rim_speed_m_per_s(v.rim_speed);
  e->set_load_n(f.load);
  const double hub = std::hypot(v.v_x, v.v_y), rim = std::fabs(v.rim_speed);
  if (std::isfinite(hub) && std::isfinite(rim)) {
    const SlipState slip = ToSlip(v.v_x, v.v_y, v.rim_speed);
    e->set_slip(slip.slip);
    e->set_attack_angle_rad(slip.attack_angle_rad);
    e->set_speed_m_per_s(std::fmax(hub, rim));
  } else if (!f.by_slip) {
    for (const auto set : {&Explanation::set_slip, &Explanation::set_attack_angle_rad,
                           &Explanation::set_speed_m_per_s}) {
      (e->*set)(kNaN);
    }
  }
  return f;
}

/// Outputs with their intervals, and the flags.
void Evaluate(const v1alpha1::WheelStates& s, StateFacts* f, Explanation* e) {
  StateBatch batch(1, {kValue, kSdFit, kSdPatch, kLow, kHigh});
  batch.Set(0, f->motion, f->load);
  batch.slope_pitch.assign(s.slope_pitch_rad().begin(), s.slope_pitch_rad().end());
  batch.slope_roll.assign(s.slope_roll_rad().begin(), s.slope_roll_rad().end());
  batch.yaw_rate.assign(s.yaw_rate_rad_per_s().begin(), s.yaw_rate_rad_per_s().end());
  batch.pass_number.assign(s.pass_number().begin(), s.pass_number().end());
  double form[3][kOutputs];
  FormView to;
  for (int o = 0; o < kOutputs; ++o) {
    to.output[o] = {{&form[0][o], 1}, {&form[1][o], 1}, {&form[2][o], 1}};
  }
  EvaluateWithForm(*f->evaluator, f->form, batch.In(), batch.Out(), to);
  f->flags = batch.flags[0];
  e->set_flags(f->flags);
  for (int o = 0; o < kOutputs; ++o) {
    f->value[o] = batch.part[o][kValue][0];
    v1alpha1::OutputExplanation* out = e->add_outputs();
    out->set_output(kOutputFields[o].name);
    out->set_unit(kOutputFields[o].unit);
    out->set_value(f->value[o]);
    out->set_low(batch.part[o][kLow][0]);
    out->set_high(batch.part[o][kHigh][0]);
    out->set_measured_low(form[1][o]);
    out->set_measured_high(form[2][o]);
    out->set_sd_fit(batch.part[o][kSdFit][0]);
    out->set_sd_patch(batch.part[o][kSdPatch][0]);
    out->set_sd_form(form[0][o]);
  }
}

/// Where the state lies in what the runs covered.
void Place(StateFacts* f, Explanation* e) {
  const std::uint32_t no_answer = kInvalid | kAirborne;
  if ((f->flags & no_answer) != 0) return;
  const VelocityState& v = f->motion;
  const bool rests = v.v_x == 0 && v.v_y == 0 && v.rim_speed == 0;
  if (!rests) f->canonical = ToCanonical(v.v_x, v.v_y, v.rim_speed);
  if (!rests && (f->flags & kNotAnswered) == 0) {
    f->region = MeasuredRegionAt(v.v_x, v.v_y, v.rim_speed);
    e->set_measured_region(ToMessage(*f->region));
  }
  if (IsHard(*f->model)) return;
  f->hull = TrainedHull(*f->model);
  const double radius = f->model->wheel().radius_m();
  const double fastest = f->hull->Fastest(radius);
  if (rests) {
    f->table_distance = 1;
    // A lookup at rest answers by its end of the load axis, other kinds by the law of rest.
    if (f->model->kind() == v1alpha1::MODEL_KIND_LOOKUP) {
      f->excess.load = ExcessOf(f->hull->box(), ToCanonical(1, 0, 1), f->load,
                                std::numeric_limits<double>::infinity())
                           .load;
    }
  } else {
    f->table_distance = std::fmax(TrainedDistance(*f->model, *f->canonical, f->load), 0);
    if (HasPhysics(*f->model)) f->share = TrainedShare(*f->model, *f->canonical, f->load);
    f->excess = ExcessOf(f->hull->box(), *f->canonical, f->load, fastest);
  }
  f->distance = f->table_distance + f->excess.Sum();
}

void SetAxes(const StateFacts& f, Explanation* e) {
  if (!f.hull) return;
  const TrainingDomain& box = f.hull->box();
  const auto add = [&](const char* quantity, double value, double low, double high, double adds) {
    v1alpha1::TrainingAxis* axis = e->add_axes();
    axis->set_quantity(quantity);
    axis->set_value(value);
    axis->set_low(low);
    axis->set_high(high);
    axis->set_beyond(value < low ? value - low : value > high ? value - high : 0);
    axis->set_hull_distance(adds);
  };
  const bool moves = f.canonical.has_value();
  const Canonical s = moves ? *f.canonical : Canonical{};
  add("slip", moves ? s.rim - s.forward : kNaN, box.slip_min, box.slip_max, f.excess.slip);
  add("attack_angle_rad", moves ? std::atan2(s.lateral, s.forward) : kNaN, 0,
      box.attack_angle_max_rad, f.excess.lateral);
  add("load_n", f.load, box.load_min_n, box.load_max_n, f.excess.load);
  add("speed_m_per_s", moves ? s.speed : 0, 0, f.hull->Fastest(f.model->wheel().radius_m()),
      f.excess.speed);
}

/// The parts of the intervals, by the laws of Hull and FormErrors.
void SetParts(const StateFacts& f, Explanation* e) {
  const double bulldozing = f.canonical ? Hull::Bulldozing(*f.canonical) : f.hull ? 0 : kNaN;
  e->set_bulldozing(bulldozing);
  e->set_hull_distance(f.hull ? f.distance : kNaN);
  e->set_table_distance(f.hull ? f.table_distance : kNaN);
  for (int o = 0; o < kOutputs; ++o) {
    v1alpha1::OutputExplanation* out = e->mutable_outputs(o);
    const bool answered = !std::isnan(out->value());
    double inside = kNaN, beyond = kNaN, growth = kNaN;
    double factor = answered && IsHard(*f.model) ? kTwoSided90 : kNaN;
    if (f.hull && answered) {
      const Uncertainty& u = f.hull->uncertainty();
      growth = 1 + u.bulldozing[o] * bulldozing;
      const double scale = growth * (o == kSinkage ? 1 : f.load / f.hull->middle_load());
      inside = scale * u.fit_inside[o];
      // By what was answered: a hybrid's fine table interpolates the hull distance once more.
      const double near = out->sd_fit() > 0 ? inside / out->sd_fit() : 1;
      const double rest = (1 - near) * (1 + near);
      beyond = rest > kSingle ? out->sd_fit() * std::sqrt(rest) : 0;
      factor = u.interval_factor[o];
    } else if ((f.flags & kAirborne) != 0) {
      inside = beyond = 0;
    }
    out->set_sd_fit_inside(inside);
    out->set_sd_fit_beyond(beyond);
    out->set_interval_factor(factor);
    out->set_bulldozing_growth(growth);
    out->set_form_factor(f.region ? f.form.region[static_cast<std::size_t>(*f.region)].factor[o]
                                  : kNaN);
  }
}

/// The law's stress at the middles of bins, on the state's own side.
void SetPhysicsStress(const StateFacts& f, Explanation* e) {
  const bool answered = f.canonical && (f.flags & kNotAnswered) == 0;
  if (!answered || !HasPhysics(*f.model)) return;
  const BekkerModel physics = TrainedPhysics(*f.model);
  const double sinkage = physics.SolveCanonical(*f.canonical, f.load).value[kSinkage];
  if (!(sinkage > 0)) return;
  std::array<double, kPhysicsBins> angle;
  std::array<RimStress, kPhysicsBins> stress;
  for (int i = 0; i < kPhysicsBins; ++i) {
    angle[i] = (i + 0.5) * kPhysicsStep - std::numbers::pi;
  }
  physics.StressesAt(*f.canonical, sinkage, angle, stress);
  v1alpha1::StressSummary* to = e->mutable_physics_stress();
  to->set_first_angle_rad(-std::numbers::pi);
  to->set_angle_step_rad(kPhysicsStep);
  for (const RimStress& s : stress) {
    to->add_normal_pa(s.normal);
    to->add_shear_tangential_pa(s.tangential);
  }
  if (f.canonical->sign_x < 0) MirrorStress(to);
}

void SetNotes(const StateFacts& f, bool some_have_stress, Explanation* e) {
  const v1alpha1::Model& m = *f.model;
  const int runs = m.provenance().runs_size();
  if (IsHard(m)) {
    e->add_notes(
        "a law of hard ground: no DEM run stands behind it; sd_fit is the spread of its "
        "parameters");
  } else if (runs == 0) {
    e->add_notes(m.untuned() ? "no run stands behind this model: its intervals are what such "
                               "models of other wheels were off by"
                             : "no runs recorded in this model file");
  } else if (!some_have_stress) {
    e->add_notes(
        "no stresses on the rim recorded in this model file: it was fitted before they "
        "were kept, or its runs had none");
  }
  if (runs > 0 && !f.canonical) {
    e->add_notes("runs are not compared with a state that is invalid, at rest or off the ground");
  }
  if (!IsHard(m) && m.residual().coefficients().empty()) {
    e->add_notes(
        "no table of hull distances in this model file: the hull distance is that beyond "
        "the domain alone");
  }
}

void SetHead(const ExplainedModel& model, Explanation* e) {
  const v1alpha1::Model& m = model.message;
  e->set_model(model.reference);
  e->set_kind(m.kind() == v1alpha1::MODEL_KIND_UNSPECIFIED ? v1alpha1::MODEL_KIND_HYBRID
                                                           : m.kind());
  e->set_wheel(Bounded(m.wheel().name()));
  e->set_soil(Bounded(m.soil().name()));
  e->set_radius_m(m.wheel().radius_m());
  e->set_reason(Bounded(m.provenance().reason()));
  e->set_command(Bounded(m.provenance().command()));
  e->set_grouser_version(Bounded(m.provenance().grouser_version()));
  e->set_base_digest(Bounded(m.provenance().base_digest()));
  if (m.has_create_time()) *e->mutable_create_time() = m.create_time();
  e->set_interval_level(m.interval_level());
  e->set_averaging_length_m(m.averaging_length_m());
}

}  // namespace

Explanation Explain(const ExplainedModel& model, const v1alpha1::WheelStates& state, int runs) {
  CheckOne(state);
  if (runs < 0 || runs > kMostRuns) {
    throw std::invalid_argument("max_runs: " + std::to_string(runs) + ", expected 0 to " +
                                std::to_string(kMostRuns));
  }
  Explanation e;
  SetHead(model, &e);
  StateFacts facts = FactsOf(model, state, &e);
  Evaluate(state, &facts, &e);
  Place(&facts, &e);
  SetAxes(facts, &e);
  SetParts(facts, &e);
  AddReasons(facts, &e);
  const bool some_have_stress = std::ranges::any_of(model.message.provenance().runs(), HasStress);
  AddRuns(facts, runs, some_have_stress, &e);
  SetPhysicsStress(facts, &e);
  SetNotes(facts, some_have_stress, &e);
  return e;
}

}  // namespace grouser::surrogate

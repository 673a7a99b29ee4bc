#include "server/core/evaluator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "server/core/accuracy_request.h"
#include "surrogate/model_io/asked_motion.h"

namespace grouser::server {
namespace {

using google::protobuf::RepeatedField;
using surrogate::kOutputs;

// The wire's flags are the models'; a new one of the wire changes StateFlag_MAX.
constexpr bool SameBit(v1alpha1::StateFlag wire, surrogate::Flag ours) {
  return static_cast<std::uint32_t>(wire) == static_cast<std::uint32_t>(ours);
}
static_assert(SameBit(v1alpha1::STATE_FLAG_INVALID, surrogate::kInvalid) &&
              SameBit(v1alpha1::STATE_FLAG_CLAMPED, surrogate::kClamped) &&
              SameBit(v1alpha1::STATE_FLAG_EXTRAPOLATED, surrogate::kExtrapolated) &&
              SameBit(v1alpha1::STATE_FLAG_STATIC, surrogate::kStatic) &&
              SameBit(v1alpha1::STATE_FLAG_NO_EQUILIBRIUM, surrogate::kNoEquilibrium) &&
              SameBit(v1alpha1::STATE_FLAG_RATE, surrogate::kRate) &&
              SameBit(v1alpha1::STATE_FLAG_SLOPE, surrogate::kSlope) &&
              SameBit(v1alpha1::STATE_FLAG_VIRGIN_ASSUMED, surrogate::kVirginAssumed) &&
              SameBit(v1alpha1::STATE_FLAG_FORM_UNKNOWN, surrogate::kFormUnknown) &&
              SameBit(v1alpha1::STATE_FLAG_TOLERANCE_UNMET, surrogate::kToleranceUnmet) &&
              SameBit(v1alpha1::STATE_FLAG_AIRBORNE, surrogate::kAirborne) &&
              SameBit(v1alpha1::STATE_FLAG_UNTUNED, surrogate::kUntuned) &&
              SameBit(v1alpha1::StateFlag_MAX, std::end(surrogate::kFlagFields)[-1].flag));

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class T>
std::span<const T> View(const RepeatedField<T>& field) {
  return {field.data(), static_cast<std::size_t>(field.size())};
}

/// n entries that the caller writes; the memory is reused, not cleared.
template <class T>
std::span<T> Fill(RepeatedField<T>* field, int n) {
  field->Clear();
  field->Reserve(n);
  return {field->AddNAlreadyReserved(n), static_cast<std::size_t>(n)};
}

/// Velocity form of a slip-form message, into the echo arrays.
void FromSlipForm(const v1alpha1::SlipForm& form, double training_speed,
                  v1alpha1::VelocityForm* velocity) {
  const int n = form.slip_size();
  const auto v_x = Fill(velocity->mutable_v_x_m_per_s(), n);
  const auto v_y = Fill(velocity->mutable_v_y_m_per_s(), n);
  const auto rim = Fill(velocity->mutable_rim_speed_m_per_s(), n);
  for (int i = 0; i < n; ++i) {
    const double speed = form.speed_m_per_s().empty() ? training_speed : form.speed_m_per_s(i);
    const auto state = surrogate::AskedMotion(form.slip(i), form.attack_angle_rad(i), speed);
    v_x[i] = state.v_x;
    v_y[i] = state.v_y;
    rim[i] = state.rim_speed;
  }
}

/// Where a slip form made no sense, its own numbers tell more than NaN.
void EchoInvalidSlips(const v1alpha1::SlipForm& form, std::span<const std::uint32_t> flags,
                      v1alpha1::SlipForm* echo) {
  for (int i = 0; i < form.slip_size(); ++i) {
    if ((flags[i] & surrogate::kInvalid) == 0) continue;
    echo->set_slip(i, form.slip(i));
    echo->set_attack_angle_rad(i, form.attack_angle_rad(i));
    if (!form.speed_m_per_s().empty()) echo->set_speed_m_per_s(i, form.speed_m_per_s(i));
  }
}

void EchoSpeed(const v1alpha1::VelocityForm& velocity, v1alpha1::SlipForm* slip) {
  const int n = velocity.v_x_m_per_s_size();
  const auto speed = Fill(slip->mutable_speed_m_per_s(), n);
  for (int i = 0; i < n; ++i) {
    const double hub = std::hypot(velocity.v_x_m_per_s(i), velocity.v_y_m_per_s(i));
    const double rim = std::abs(velocity.rim_speed_m_per_s(i));
    // std::max would drop a NaN on its right.
    speed[i] = std::isnan(hub) || std::isnan(rim) ? kNan : std::max(hub, rim);
  }
}

/// Room for the derivatives of one output: NaN where a model leaves it.
void FillGradients(int n, bool wanted, v1alpha1::OutputArray* array, surrogate::OutputView* view) {
  const struct {
    RepeatedField<double>* field;
    std::span<double>* view;
  } gradients[] = {{array->mutable_d_v_x(), &view->d_v_x},
                   {array->mutable_d_v_y(), &view->d_v_y},
                   {array->mutable_d_rim_speed(), &view->d_rim_speed},
                   {array->mutable_d_load(), &view->d_load}};
  for (const auto& d : gradients) {
    d.field->Clear();
    if (!wanted) continue;
    *d.view = Fill(d.field, n);
    std::ranges::fill(*d.view, kNan);
  }
}

/// Room for one output; for its interval for a measurement where `with_interval`.
void FillOutput(int n, AnswerParts parts, bool with_interval, v1alpha1::OutputArray* array,
                surrogate::OutputView* view, surrogate::FormView::OfOutput* form) {
  view->value = Fill(array->mutable_value(), n);
  FillGradients(n, parts.gradients, array, view);
  array->clear_measured_low();
  array->clear_measured_high();
  if (!parts.uncertainty) {
    for (auto* unused : {array->mutable_sd_fit(), array->mutable_sd_patch(), array->mutable_low(),
                         array->mutable_high(), array->mutable_sd_form()}) {
      unused->Clear();
    }
    return;
  }
  view->sd_fit = Fill(array->mutable_sd_fit(), n);
  view->sd_patch = Fill(array->mutable_sd_patch(), n);
  view->low = Fill(array->mutable_low(), n);
  view->high = Fill(array->mutable_high(), n);
  form->sd = Fill(array->mutable_sd_form(), n);
  if (!with_interval) return;
  form->low = Fill(array->mutable_measured_low(), n);
  form->high = Fill(array->mutable_measured_high(), n);
}

/// Whether some model that may answer knows an interval for measurements of this output.
bool KnowsInterval(const ServedModel& named, const Selection* selection, int output) {
  if (!selection || !selection->selectable) return named.choice.form.KnowsInterval(output);
  return std::ranges::any_of(selection->selectable->models, [output](const ServedModel* model) {
    return model->choice.form.KnowsInterval(output);
  });
}

/// The selectable models answer; what is said by model is said by the one that answered.
void EvaluateSelected(const surrogate::WheelStatesView& in, const surrogate::ResponsesView& out,
                      const surrogate::FormView& form, Selection* selection) {
  const SelectableModels& selectable = *selection->selectable;
  const auto answered_by = Fill(&selection->answered_by, static_cast<int>(in.load.size()));
  selectable.selector.Evaluate(in, selection->accuracy, out, answered_by, &selection->worst, form);
}

}  // namespace

Status ValidateStates(const v1alpha1::WheelStates& states, int max_states) {
  const int n = states.load_n_size();
  if (n > max_states) {
    return Status::ResourceExhausted(
        fmt::format("states.load_n: {} entries, at most {} in one message", n, max_states));
  }
  if (states.kinematics_case() == v1alpha1::WheelStates::KINEMATICS_NOT_SET) {
    return Status::InvalidArgument("states.kinematics: missing, expected velocity or slip");
  }
  if (n == 0) {
    return Status::InvalidArgument(
        fmt::format("states.load_n: empty, expected 1 to {} entries", max_states));
  }
  const v1alpha1::VelocityForm& velocity = states.velocity();
  const v1alpha1::SlipForm& slip = states.slip();
  const struct {
    const char* field;
    int size;
    bool optional;  // may be empty, as all of the form that was not given are
  } arrays[] = {
      {"velocity.v_x_m_per_s", velocity.v_x_m_per_s_size(), states.has_slip()},
      {"velocity.v_y_m_per_s", velocity.v_y_m_per_s_size(), states.has_slip()},
      {"velocity.rim_speed_m_per_s", velocity.rim_speed_m_per_s_size(), states.has_slip()},
      {"slip.slip", slip.slip_size(), states.has_velocity()},
      {"slip.attack_angle_rad", slip.attack_angle_rad_size(), states.has_velocity()},
      {"slip.speed_m_per_s", slip.speed_m_per_s_size(), true},
      {"pass_number", states.pass_number_size(), true},
      {"slope_pitch_rad", states.slope_pitch_rad_size(), true},
      {"slope_roll_rad", states.slope_roll_rad_size(), true},
      {"yaw_rate_rad_per_s", states.yaw_rate_rad_per_s_size(), true},
  };
  for (const auto& array : arrays) {
    if (array.size == n || (array.optional && array.size == 0)) continue;
    return Status::InvalidArgument(fmt::format(
        "states.{}: {} entries, expected {} as in states.load_n", array.field, array.size, n));
  }
  return Status::Ok();
}

void EvaluateViews(const ServedModel& model, const surrogate::WheelStatesView& in,
                   const surrogate::ResponsesView& out, const surrogate::FormView& form) {
  model.evaluator->Evaluate(in, out);
  const surrogate::FormErrors& known = model.choice.form;
  if (known.ClearsFlags() || form.WantsAny()) return AddForm(known, in, out, form);
  for (std::uint32_t& flags : out.flags) {
    if ((flags & (surrogate::kInvalid | surrogate::kAirborne)) == 0)
      flags |= surrogate::kFormUnknown;
  }
}

void EvaluateStates(const ServedModel& model, const v1alpha1::WheelStates& states,
                    AnswerParts parts, v1alpha1::WheelResponses* responses, Selection* selection) {
  const int n = states.load_n_size();
  if (states.has_velocity()) {
    *responses->mutable_velocity() = states.velocity();
  } else {
    FromSlipForm(states.slip(), model.message.domain().speed_m_per_s(),
                 responses->mutable_velocity());
  }
  const v1alpha1::VelocityForm& velocity = responses->velocity();
  surrogate::WheelStatesView in;
  in.v_x = View(velocity.v_x_m_per_s());
  in.v_y = View(velocity.v_y_m_per_s());
  in.rim_speed = View(velocity.rim_speed_m_per_s());
  in.load = View(states.load_n());
  in.slope_pitch = View(states.slope_pitch_rad());
  in.slope_roll = View(states.slope_roll_rad());
  in.yaw_rate = View(states.yaw_rate_rad_per_s());
  in.pass_number = View(states.pass_number());

  const bool selects = selection && selection->selectable;
  const AnswerFields fields = selects ? AnswerFields() : parts.fields;
  parts.uncertainty = parts.uncertainty && fields.uncertainty();
  surrogate::ResponsesView out;
  surrogate::FormView form;
  const auto arrays = OutputArrays(responses);
  for (int k = 0; k < kOutputs; ++k) {
    if (!fields.output(k)) {
      arrays[k]->Clear();  // keeps the arrays' memory
      continue;
    }
    FillOutput(n, parts, KnowsInterval(model, selection, k), arrays[k], &out.output[k],
               &form.output[k]);
  }
  out.flags = Fill(responses->mutable_flags(), n);
  v1alpha1::SlipForm* slip = responses->mutable_slip();
  slip->Clear();
  if (fields.slip()) {
    out.slip = Fill(slip->mutable_slip(), n);
    out.attack_angle = Fill(slip->mutable_attack_angle_rad(), n);
    EchoSpeed(velocity, slip);
  }
  if (selects) {
    EvaluateSelected(in, out, form, selection);
  } else {
    EvaluateViews(model, in, out, form);
  }
  if (states.has_slip() && fields.slip()) EchoInvalidSlips(states.slip(), out.flags, slip);
  responses->set_interval_level(model.message.interval_level());
  responses->set_interval_target(v1alpha1::INTERVAL_TARGET_DEM);
  responses->set_averaging_length_m(model.message.averaging_length_m());
}

Status Evaluate(const Snapshot& snapshot, std::string_view model_reference,
                const v1alpha1::WheelStates& states, AnswerParts parts,
                const ServedModel** answered_by, v1alpha1::WheelResponses* responses,
                const v1alpha1::AccuracyRequest& accuracy, Selection* selection) {
  *answered_by = nullptr;
  const ServedModel* model = nullptr;
  surrogate::AccuracyRequest wanted;
  Status status = ValidateStates(states, parts.gradients ? kMaxStatesWithGradients : kMaxStates);
  if (status.ok()) status = ReadAccuracyRequest(accuracy, &wanted);
  if (status.ok()) status = snapshot.Find(model_reference, &model);
  if (selection) selection->selectable = nullptr;
  if (!status.ok()) {
    responses->Clear();
    return status;
  }
  if (selection && !wanted.IsEmpty()) {
    selection->accuracy = wanted;
    selection->selectable = &snapshot.SelectableOf(model_reference, *model);
  }
  EvaluateStates(*model, states, parts, responses, selection);
  *answered_by = model;
  return status;
}

}  // namespace grouser::server

#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "clients/in_process/grouser/model.h"
#include "surrogate/models/accuracy_request.h"
#include "surrogate/models/wheel_model.h"

// What model.cc and model_selector.cc share; not installed.

namespace grouser {

namespace v1alpha1 {
class Model;
}

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// kOutputSpanFields: in the order of surrogate::Part; then what FormView has; then sd_soil.
static_assert(kOutputSpanFields.size() == surrogate::kParts + 4 &&
              kOutputSpanFields[surrogate::kDvX].member == &OutputSpans::d_v_x &&
              kOutputSpanFields[surrogate::kDLoad].member == &OutputSpans::d_load &&
              kOutputSpanFields[surrogate::kParts].member == &OutputSpans::sd_form);
inline constexpr std::size_t kFirstGradient = surrogate::kDvX;
inline constexpr std::size_t kGradientsEnd = surrogate::kParts;

inline bool Fits(std::span<const double> span, std::size_t n) noexcept {
  return span.empty() || span.size() == n;
}

/// Whether Model::SizeProblem would be empty.
inline bool SizesFit(const States& in, const Answers& out) noexcept {
  const std::size_t n = in.load.size();
  bool fit = in.v_x.size() == n && in.v_y.size() == n && in.rim_speed.size() == n &&
             out.flags.size() == n && Fits(out.slip, n) && Fits(out.attack_angle, n);
  for (const OutputSpans& o : out.output) {
    for (const OutputSpanField& field : kOutputSpanFields) fit &= Fits(o.*field.member, n);
  }
  return fit;
}

inline surrogate::WheelStatesView ToView(const States& in) noexcept {
  return {in.v_x, in.v_y, in.rim_speed, in.load, {}, {}, {}, {}};
}

inline surrogate::ResponsesView ToView(const Answers& out) noexcept {
  surrogate::ResponsesView view;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    for (std::size_t p = 0; p < surrogate::kParts; ++p) {
      view.output[o].*surrogate::kPartMembers[p] = out.output[o].*kOutputSpanFields[p].member;
    }
    view.output[o].sd_soil = out.output[o].sd_soil;
  }
  view.flags = out.flags;
  view.slip = out.slip;
  view.attack_angle = out.attack_angle;
  return view;
}

inline surrogate::FormView FormViewOf(const Answers& out) noexcept {
  surrogate::FormView view;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    const OutputSpans& from = out.output[o];
    view.output[o] = {from.sd_form, from.measured_low, from.measured_high};
  }
  return view;
}

inline void FillGradients(const Answers& out, double with) noexcept {
  for (const OutputSpans& o : out.output) {
    for (std::size_t f = kFirstGradient; f < kGradientsEnd; ++f) {
      const std::span<double> span = o.*kOutputSpanFields[f].member;
      std::fill(span.begin(), span.end(), with);
    }
  }
}

/// That of answers to one soil that is known.
inline void FillSdSoil(const Answers& out) noexcept {
  for (const OutputSpans& o : out.output) {
    for (std::size_t i = 0; i < o.sd_soil.size(); ++i) {
      o.sd_soil[i] = (out.flags[i] & kInvalid) != 0 ? kNaN : 0;
    }
  }
}

struct Model::Parts {
  std::shared_ptr<const surrogate::WheelModel> evaluator;
  std::string name, soil, wheel, kind, digest;
  double radius_m = 0, width_m = 0, gravity_m_per_s2 = 0, interval_level = 0;
  bool has_gradients = false;
  Domain domain{};
  surrogate::SelectableModel as_selectable;  ///< of a ModelSelector
  std::string pair;                          ///< equal for models of one wheel on one soil
  bool mixture = false;
  std::shared_ptr<const v1alpha1::Model> head;  ///< of the file, without tables and runs
  std::shared_ptr<const Parts> file;            ///< of a similar wheel's model: what was opened

  void Evaluate(const States& in, const Answers& out) const noexcept {
    // Never leave what the caller's memory held before where a derivative belongs.
    if (!has_gradients) FillGradients(out, kNaN);
    EvaluateWithForm(*evaluator, as_selectable.form, ToView(in), ToView(out), FormViewOf(out));
    if (!mixture) FillSdSoil(out);
  }
  bool FillsGradients() const noexcept;
};

}  // namespace grouser

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "surrogate/models/form_error.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// A model of one of the soils that it may be, and how likely that soil is.
struct MixturePart {
  std::shared_ptr<const WheelModel> model;
  double weight = 0;  ///< >= 0
  double radius_m = 0, width_m = 0, gravity_m_per_s2 = 0;
};

/// Of parts whose weights have the sum 1, laid out one after the other from 0 to 1, that where
/// `which` lies. Precondition: one part or more.
template <class Part>
const Part& PartAt(std::span<const Part> parts, double which) noexcept {
  std::size_t i = 0;
  for (double end = parts[0].weight; which >= end && i + 1 < parts.size(); end += parts[i].weight) {
    ++i;
  }
  return parts[i];
}

/// One soil of several, and it is not known which: a wheel on soil i with weight w_i (sum 1). With
/// the soils' answers m_i, sd_i, half widths h_i:
///
///   value    = sum w_i m_i                      (derivatives likewise)
///   sd_soil  = sqrt(sum w_i (m_i - value)^2)    which soil it is
///   sd_fit   = sqrt(sum w_i sd_fit_i^2), sd_patch likewise
///   interval = value +- sqrt(sum w_i h_i^2 + 1.645^2 sd_soil^2)
///
/// The variance of a mixture; its interval is that of a normal distribution of this variance, which
/// a mixture of soils far apart is not. Flags: those of every soil with a weight above 0.
///
/// A draw (draw_field.h) is that draw of one of the soils, at all states: which soil it is, is an
/// error that all have in common. Over the draws mean and standard deviation are those above.
class MixtureModel final : public WheelModel {
 public:
  static constexpr std::size_t kMost = 255;

  /// Weights are divided by their sum, parts of weight 0 left out. Throws std::invalid_argument
  /// "mixture: ..." for no part, more than kMost, a part without a model or that is a mixture,
  /// weights that are negative, not finite or all 0, and another radius, width or gravity than the
  /// first's (by over 1 %).
  explicit MixtureModel(std::vector<MixturePart> parts);

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;
  double Tolerance() const noexcept override;
  /// Of any part; the others flag it.
  bool UsesYawRate() const noexcept override;
  bool HoldsOnSlopes() const noexcept override;
  /// Of the part with the slowest runs, as flags are those of every part.
  double FastestOfRuns() const noexcept override;
  const WheelModel& OfDraw(double which) const noexcept override {
    return *PartAt(parts(), which).model;
  }

  /// Without those of weight 0, normalised.
  std::span<const MixturePart> parts() const { return parts_; }

 private:
  std::vector<MixturePart> parts_;
};

/// DEM minus measurement of a mixture: sd = sqrt(sum w_i sd_i^2), half widths likewise; NaN where
/// some soil's is unknown. As many weights, of sum 1, as forms; middle loads are brought to the
/// first's, and a form that holds at every load beside one that does not makes all unknown.
FormErrors Mixed(std::span<const FormErrors> forms, std::span<const double> weights);

}  // namespace grouser::surrogate

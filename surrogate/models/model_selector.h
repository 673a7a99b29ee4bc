#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surrogate/models/accuracy_request.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// The state of a call that misses its tolerance by most.
struct Shortfall {
  std::size_t index = 0;
  double excess = 0;  ///< claimed error over tolerance; 0: nothing that a DEM run could mend
  int output = 0;
  double load = 0;  ///< [N]
};

/// Several models (models) of one wheel on one soil, the cheapest first, and the
/// choice between them. Immutable and thread-safe; does not own the models.
///
/// With a tolerance every state is answered by the cheapest model that suffices:
/// whose claimed error (ClaimedError: own interval and own error table) is within
/// the tolerance on every output. Where none does, the model with the smallest
/// claim over tolerance (of its worst output) answers, with kToleranceUnmet. So
/// the promise is: per output, an answer without that flag lies within the
/// tolerance of a fresh DEM run's mean as often as the interval's level says. Against a measurement
/// (AccuracyRequest::target) the claim is hypot(ClaimedError, factor sd_form) (f_z, which is the
/// load: ClaimedError), infinite where that is unknown, and no DEM run is proposed: none would
/// narrow it. Of answers with infinite claims the one of the smaller claim against DEM is kept.
///
/// An answer that leaves part of the question out (kSlope, kVirginAssumed, kRate,
/// a yaw rate that the model does not use), or that DEM could not give (kNoEquilibrium),
/// promises nothing: it never suffices. Nor does hard ground's at rest, and no DEM run is
/// proposed for hard ground. Invalid states stay invalid and airborne ones (load 0) are
/// answered exactly by the first model, both without the flag.
///
/// A budget is spent on models' costs, in proportion along the call: after each
/// block of states at most its share, plus what earlier ones left, is gone. The
/// cheapest model always answers; a dearer one is tried on as many of the states
/// still unmet as its cost allows, in order. Without a tolerance the model of the
/// smallest MeanClaim whose cost for all states fits answers everything; without
/// a budget either, the one of the smallest MeanClaim.
///
/// Without a budget, a state's answer does not depend on what it is asked with.
class ModelSelector {
 public:
  /// Models whose costs differ by less than this factor count as equally dear,
  /// and the one that claims less comes first: timing tells no more apart.
  static constexpr double kSameCost = 1.5;
  static constexpr std::size_t kBlock = 128;  // states

  /// Throws std::invalid_argument "model selector: ..." for no model, one without a
  /// model, a cost or a radius, or models of several radii.
  explicit ModelSelector(std::vector<SelectableModel> models);

  /// The cheapest first.
  const std::vector<SelectableModel>& models() const { return models_; }
  /// Place of the model with the smallest MeanClaim.
  std::size_t most_accurate() const { return most_accurate_; }

  /// Answers all states as above. No allocation, lock or system call.
  /// answered_by: place in models() of who answered; n entries or empty. worst: may be
  /// null. form: sd_form and the intervals for a measurement, of who answered (AddForm).
  /// Precondition: sizes as WheelModel::Evaluate's.
  void Evaluate(const WheelStatesView& in, const AccuracyRequest& accuracy,
                const ResponsesView& out, std::span<std::uint32_t> answered_by, Shortfall* worst,
                const FormView& form = {}) const noexcept;

 private:
  std::size_t ByBudget(const AccuracyRequest& accuracy, std::size_t n) const noexcept;

  std::vector<SelectableModel> models_;
  std::vector<double> mean_claim_;
  std::size_t most_accurate_ = 0;
};

}  // namespace grouser::surrogate

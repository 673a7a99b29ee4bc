#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "surrogate/models/bekker.h"
#include "surrogate/models/residual_table.h"
#include "surrogate/models/tabulated_model.h"

namespace grouser::surrogate {

/// Grid of the whole answer, in intervals; see HybridModel::Tabulate.
struct Resolution {
  /// At least; multiples of the residual table's. Of a table with a share as many directions as
  /// it has itself: what it holds is smooth, and physics answer far from runs alone.
  int direction = 90, lateral = 36;
  double log_load = 0.25;  ///< at most, a fraction of the residual table's step
};

/// Physics trend + table; with a table of hull distances alone it is the bekker model.
///
///   value = (1 - q(state)) bekker(state) + s T(state), s = load, load r or r
///
/// q is T's channel of f_z (ResidualTable::kShare). Where it is none T is what physics leave
/// of the runs. Where it is 1, about the runs, T is the answer; where it is 0, at motions and loads
/// that no run has, the answer is that of physics. NO_EQUILIBRIUM, f_z: (1 - q) m + 8 S(2 q - 1),
/// m = ln(largest load that has an equilibrium/load) of physics within -8 to 8, S(x) = 3 x^2 - 2
/// x^3 within 0 to 1, is ln of what the soil carries/load: runs say so where q is above 1/2.
///
/// Uncertainty and intervals: see Hull. EvaluateOne is this law. Evaluate is as well,
/// one state at a time, until Prepare: from then on a table of it (Tabulate) answers, or
/// where T has no outputs the physics themselves, in batches (AnswerByLaw).
///
/// Flags: kInvalid non-finite input, load < 0 (NaN out); kAirborne load 0 (zeros);
/// kStatic V = r w = 0
/// (static sinkage, no force but f_z); kExtrapolated outside the hull box, or a
/// sinkage beyond 0.7 r, where no steady run exists; kNoEquilibrium with
/// kClamped where 1.2 r of sinkage does not carry the load; kClamped also for a
/// negative sinkage and for a yaw rate, which is taken as 0; kSlope and
/// kVirginAssumed (NaN out); kRate, kFormUnknown.
class HybridModel final : public TabulatedModel {
 public:
  using Answer = WheelAnswer;

  HybridModel(const BekkerModel& physics, ResidualTable table, const TrainingDomain& hull,
              const Uncertainty& uncertainty);
  /// With a speed axis: s (T + u T_rate) instead of s T, u by SpeedAxis::At. T_rate
  /// has T's axes; throws std::invalid_argument "speed axis: ..." if not.
  HybridModel(const BekkerModel& physics, ResidualTable table, ResidualTable rate,
              const SpeedAxis& speed, const TrainingDomain& hull, const Uncertainty& uncertainty);

  /// Takes the way of answering many states that suits the model: AnswerByLaw where
  /// T has no outputs, else Tabulate.
  void Prepare();

  /// Lets Evaluate solve the physics of every state (BekkerModel::SolveBatch), with
  /// gradients by the implicit function theorem, and interpolate the hull distance
  /// alone. A table would be some ten times faster in a batch, and off by what Tabulate
  /// states; this is the law itself for any load, and made at once.
  /// Precondition: T has no outputs and no speed axis.
  void AnswerByLaw();

  /// Solves the physics at the nodes of a grid, adds the residual (which the
  /// grid's splines hold exactly, its knots being among theirs) and lets
  /// Evaluate interpolate the sum. The load axis reaches from load_min/4 to
  /// 3 load_max; beyond it the exact law answers. Where no sinkage carries the load
  /// the law answers as at 1.2 r, and the table rounds off that corner: its error in
  /// the CMU pair's hull, 99 of 100 states, over load, load r or r (f_y is the worst):
  ///   sinkage up to 0.5 r 0.003, to 0.7 r 0.02; where every answer is flagged: to 1 r
  ///   0.03, beyond 0.13 (half of the states: 0.02).
  /// f_z and kNoEquilibrium come from an interpolated ln(largest load/load) there.
  void Tabulate(const Resolution& resolution = {});

  /// Of what Tabulate makes. To be raised with any change that changes a bit of it: tables are kept
  /// between processes (kept_table_test.cc knows what one was).
  static constexpr int kTableVersion = 2;
  /// The table that answers, to be kept; empty: none that Tabulate made.
  std::string TableBytes() const;
  /// How many bytes those are of the table that Prepare makes; 0: it makes none that is worth
  /// keeping.
  std::size_t TableSize() const noexcept;
  /// Instead of Prepare: the table whose bytes an equal model gave. Throws as ResponseTable.
  void TakeTable(std::string_view bytes);

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;
  ErrorForm Errors() const noexcept override {
    return {.of_physics = !table_.has_outputs(), .friction_radius_m = 0};
  }
  double Tolerance() const noexcept override { return by_law_ ? 0 : TabulatedModel::Tolerance(); }

  /// One state, exactly; for the fitter and for tests. Same preconditions as
  /// BekkerModel::Solve.
  Answer EvaluateOne(double v_x, double v_y, double rim_speed, double load) const noexcept override;

  const BekkerModel& physics() const { return physics_; }
  const TrainingDomain& hull() const { return domain().box(); }

 protected:
  Answer OffTable(double v_x, double v_y, double rim_speed, double load) const noexcept override;

 private:
  bool WantsTable() const { return table_.has_outputs() || speed_.present(); }
  TableAxes AxesFor(const Resolution& wanted) const noexcept;
  /// The answer with `trend` for what the physics say in the canonical half-space.
  Answer Complete(const BekkerModel::Answer& trend, double v_x, double v_y, double rim_speed,
                  double load) const noexcept;
  /// Adds what the physics say to answers without them.
  void AddLaw(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
              std::size_t count) const noexcept;
  /// T + u T_rate.
  std::array<double, ResidualTable::kChannels> Residual(const Canonical& state,
                                                        double log_load) const noexcept;
  BekkerModel physics_;
  ResidualTable table_, rate_;  // rate_: empty without a speed axis
  SpeedAxis speed_;
  bool by_law_ = false;
};

}  // namespace grouser::surrogate

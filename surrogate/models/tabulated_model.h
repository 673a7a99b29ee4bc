#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "surrogate/models/hull.h"
#include "surrogate/models/isa.h"
#include "surrogate/models/response_table.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Evaluates blocks of states with a ResponseTable, and what the table does not
/// answer with a scalar law of the derived model: the state at rest, loads
/// beyond the table, magnitudes that single precision does not hold. Without a
/// table the scalar law answers everything.
///
/// Gradients are analytic in the table. They are central differences of what
/// Evaluate answers (steps M/1000 and load/1000) where the scalar law has a
/// share, and where both v_x and the rim speed are below |v_y|/1000 or so: the
/// chart's pole. At rest no answer is differentiable in the velocities: those
/// are 0, that by load is a difference. A sinkage clamped to 0 has gradient 0.
/// With a speed axis they are one-sided where |r w| = V.
/// Off the ground (load 0) all are 0, that by load as well: it is one-sided there.
/// At v_y = 0 the mirrors make the derivatives of odd outputs by v_x, of even
/// ones by v_y, 0.
class TabulatedModel : public WheelModel {
 public:
  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;

  /// One state, by the law that the table stands for where there is one, else by
  /// Evaluate; for fitters and tests. Precondition: finite, load > 0.
  virtual WheelAnswer EvaluateOne(double v_x, double v_y, double rim_speed,
                                  double load) const noexcept;

  /// Takes the kernel of "avx512", "avx2" or "baseline" instead of the best;
  /// false, and no change, where this machine lacks it. For tests and benches.
  bool SelectIsa(const char* isa) noexcept;

  double FastestOfRuns() const noexcept override { return hull_.Fastest(constants_.radius); }

  /// A table made of a law lies within 1 % of it at the golden vectors (0.15 %
  /// in the shipped model, whose farthest stand well outside the hull); a table that is the law
  /// itself has but single precision.
  double Tolerance() const noexcept override { return !table_ ? 0 : blended_ ? 0.01 : 2e-6; }

  bool tabulated() const { return table_ != nullptr; }

 protected:
  TabulatedModel(const Hull& hull, double radius_m);

  /// From now on the table answers; with `blended` between its load ends
  /// alone, beyond which OffTable does, fading in over the last interval.
  void SetTable(ResponseTable table, bool blended);

  /// Precondition: finite, load > 0.
  virtual WheelAnswer OffTable(double v_x, double v_y, double rim_speed,
                               double load) const noexcept = 0;

  const ResponseTable* table() const { return table_.get(); }
  const Hull& domain() const { return hull_; }
  /// Of the same instruction set as the kernel.
  BlockSolver solver() const { return solver_; }

 private:
  void EvaluateSome(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
                    int count) const noexcept;
  void EvaluateRest(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
                    std::size_t count) const noexcept;
  void Complete(const WheelStatesView& in, const ResponsesView& out, std::size_t i,
                std::uint32_t special) const noexcept;
  void AnswerOff(const WheelStatesView& in, const ResponsesView& out, std::size_t i,
                 double share) const noexcept;
  void Difference(const WheelStatesView& in, const ResponsesView& out,
                  std::size_t i) const noexcept;
  double ShareBeyond(double load) const noexcept;

  Hull hull_;
  std::shared_ptr<const ResponseTable> table_;  // immutable: copies share it
  bool blended_ = false;
  response::Constants constants_{};
  response::BlockFn kernel_;
  BlockSolver solver_;
};

}  // namespace grouser::surrogate

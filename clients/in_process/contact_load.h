#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/in_process/grouser/contact.h"

// Load by sinkage for many wheels of one model at once; not installed.

namespace grouser {

/// A wheel that is at rest by 1 - moving, and moves with (v_x, v_y, rim_speed) by `moving`.
struct RelaxedMotion {
  double v_x = 0, v_y = 0, rim_speed = 0;
  double moving = 1;  ///< m of WheelContact
};

/// Inverts S(N) = m sinkage(N, motion) + (1 - m) sinkage(N, at rest) + N/k as LoadAtSinkage says.
class LoadSearch {
 public:
  /// Allocates, and asks the model for its sinkages at rest.
  LoadSearch(const Model& model, double tyre_stiffness);

  /// sinkage > 0 and all finite, as many of each. Allocates only for more than ever before.
  void Solve(std::span<const RelaxedMotion> motions, std::span<const double> sinkage,
             std::span<double> load);

 private:
  static constexpr int kNodes = 8;
  static constexpr int kRest = 257;  // loads at which the sinkage at rest is known

  // S of asked_ into depth_.
  void Ask();
  void Add(const RelaxedMotion& motion, double load) {
    asked_.push_back(motion);
    at_load_.push_back(load);
  }
  // Sinkages of v_x_, v_y_, rim_, load_.
  void Evaluate(std::span<double> out);
  double AtRest(double load) const;

  struct Bracket {
    std::size_t wheel = 0;
    double target = 0, scale = 1;    // sinkage that is sought; load over that of the target
    int lower = -1, upper = kNodes;  // nodes; -1: below the first, kNodes: beyond the last
    double low = 0, high = 0;        // loads
    double below = 0, above = 0;     // S - target there: < 0, >= 0
    double below_weight = 1, above_weight = 1;
    double guess = 0, off = 1;  // the last load that was asked, S - target there [m]
    int asked = kNodes;         // its node; kNodes: none
    double width = 0;           // three rounds ago
    int rounds = 0;
    bool last_from_below = false;
  };
  // The next load to ask; false: that of the last guess is it.
  bool Next(Bracket* bracket) const;
  bool NextNode(Bracket* bracket) const;
  void Narrow(double depth, Bracket* bracket) const;

  const Model& model_;
  double compliance_, tolerance_;
  double node_[kNodes];
  double rest_per_log_ = 0;   // intervals of rest_ by the logarithm of the load
  std::vector<double> rest_;  // sinkage at rest, at loads that rise geometrically
  std::vector<RelaxedMotion> asked_;
  std::vector<double> at_load_, depth_, v_x_, v_y_, rim_, load_, sinkage_;
  std::vector<std::uint32_t> flags_;
  std::vector<std::size_t> which_;
  std::vector<Bracket> open_;
};

}  // namespace grouser

#pragma once

#include <vector>

#include "dem_offline/engine/rig/bed.h"
#include "dem_offline/engine/rig/materials.h"

namespace grouser::dem {

inline constexpr double kFractionTolerance = 0.004;                  ///< of a solid fraction
inline constexpr double kLeastFriction = 0.02, kMostFriction = 4.0;  ///< that are tried
/// More rolling friction packs denser again: 0.510, 0.545 for 1 and 4 beside the largest friction,
/// where 0.3 gives 0.543 (grains of 10 to 12 mm, EPSD).
inline constexpr double kMostRollingFriction = 1.0;

/// Which friction of preparation to try next, until a packing has the solid fraction it is aimed
/// at. More friction packs looser: about -0.012 in solid fraction per unit of its logarithm, then
/// by the secant through the last two tries. Where the largest friction still packs too densely,
/// the rolling friction goes on in the same way.
class PackingSearch {
 public:
  static constexpr int kTries = 6;  ///< of each friction
  static constexpr int kMostAttempts = 2 * kTries;

  /// own: of the grains, not of their preparation; rolls: their laws know rolling friction.
  PackingSearch(const BedPreparation& given, const GrainFriction& own, bool rolls,
                double first_friction);

  PackingSearch(const PackingSearch&) = delete;  // it points into itself
  PackingSearch& operator=(const PackingSearch&) = delete;

  const GrainFriction& next() const { return next_; }
  /// What `next` gave, less the aim. False: met, or nothing is left to try.
  bool Tried(double error);
  /// Goes on for an aim that is so much lower, from what was tried before.
  void AimLower(double by);

 private:
  struct Try {
    double log_friction, error;
  };
  double Most() const;
  double NextLog() const;

  GrainFriction next_;
  double* searched_ = nullptr;  ///< of next_; null: both are given
  bool may_roll_;
  std::vector<Try> tried_;
};

/// Whether the chosen laws use a rolling friction.
bool Rolls(const LawChoice& laws);

}  // namespace grouser::dem

#pragma once

#include <array>
#include <memory>
#include <vector>

#include "surrogate/accuracy_benchmark/timing.h"
#include "surrogate/fit/training_set.h"

namespace grouser::surrogate {

/// Universal kriging of every output by OpenTURNS, the yardstick of the other
/// kinds: x = (canonical direction of (v_x, |v_y|, r w) on the unit sphere, ln
/// load; ln speed, where the runs' speeds differ), y = mean over OutputScale; constant
/// trend, Matern 5/2 covariance with a length an axis found by maximum likelihood, and
/// the known noise of every run (block error and patch noise). Runs and their mirrors stand side by
/// side, so that the answers have the mirror symmetries to rounding. f_z is the load. Half
/// width: 1.645 sqrt(kriging variance + patch^2), of a fresh run's mean.
class Kriging {
 public:
  /// Throws std::runtime_error with OpenTURNS' words where no fit is found.
  Kriging(const std::vector<Sample>& rows, const std::array<double, kOutputs>& patch,
          double radius_m);
  ~Kriging();

  Answer At(const Sample& state) const;

 private:
  struct Fits;
  std::unique_ptr<Fits> fits_;
  std::array<double, kOutputs> patch_;
  double radius_;
};

}  // namespace grouser::surrogate

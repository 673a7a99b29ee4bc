#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// Probes of joints and springs. Coordinates, rates and lengths are those of the moment, reactions
/// and forces means over the sample.
class JointProbes {
 public:
  /// mechanism: null where there are no joints.
  JointProbes(const Experiment& e, const Mechanism* mechanism);

  static std::vector<std::string> ColumnsOf(const Experiment& e, const Probe& probe);
  /// After a step: adds to the means.
  void AfterStep();
  /// turn: of the child's body coordinates, for reactions in its axes.
  void AddRow(const Probe& probe, const Quatd& turn, std::vector<double>* row) const;
  void Forget();  ///< the sample is written

  const Joint& JointOf(const Probe& probe) const;

 private:
  const Experiment& e_;
  const Mechanism* mechanism_;
  std::vector<char> joint_wanted_, spring_wanted_;
  std::vector<Wrench> reactions_;  ///< sums, by joint
  std::vector<double> forces_;     ///< sums, by spring
  double steps_ = 0;
};

/// Throws SpecError for a probe of a joint or spring that is not there.
void CheckJointProbe(const Experiment& e, const std::string& at, const Probe& probe);

}  // namespace grouser::dem::experiment

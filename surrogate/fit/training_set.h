#pragma once

#include <array>
#include <string>
#include <tuple>
#include <vector>

#include "grouser/v1alpha1/campaign.pb.h"
#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/kinematics.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What a fit is made of: the runs of one wheel on one soil.
struct TrainingSet {
  std::string name;
  v1alpha1::Scene scene;                   ///< soil, wheel, rig
  std::vector<v1alpha1::RunSummary> runs;  ///< every status and role
  std::vector<std::string> notes;          ///< planned runs without a file, ...
};

/// One run, ready to compare with a model. A run that still drifted when its time
/// was up counts with the mean over its window, the last 55 % of its travel: what
/// another run over the same ground gives again (repeats show it), not what a
/// longer one would come to.
struct Sample {
  VelocityState motion;
  double slip, attack_angle_rad, load_n;
  std::array<double, kOutputs> mean, standard_error;
  bool steady;
  const v1alpha1::RunSummary* source;  ///< not owned

  Canonical state() const { return ToCanonical(motion.v_x, motion.v_y, motion.rim_speed); }
};

/// Reads DIR/campaign.json and the run files it names. Throws
/// std::invalid_argument with path and cause; a planned run without a file
/// becomes a note.
TrainingSet ReadCampaign(const std::string& directory);

/// A campaign folder, or the summary file of one. Throws as ReadCampaign.
TrainingSet ReadRuns(const std::string& path);

/// Writes a summary file (JSON of CampaignSummary, numbers to 7 digits), aside and
/// renamed.
void WriteSummary(const std::string& path, const TrainingSet& set);

/// Adds another campaign of the same wheel, soil and rig; throws
/// std::invalid_argument naming what differs.
void Merge(const TrainingSet& more, TrainingSet* set);

/// Where some runs count sinkage from the cut plane (engine 5 and before), all do afterwards, with
/// a note: sinkage from the cut plane = that from the plane of equal mass less surface_m.
void CountFromOnePlane(TrainingSet* set);

/// The summary of one run file, its hash included.
v1alpha1::RunSummary SummariseRun(const std::string& path, v1alpha1::RunRole role);

/// A state in either form; throws std::invalid_argument "run ID: ..." for a
/// summary without six outputs, with an impossible motion or with a stress profile
/// that is none (HasProfile).
Sample MakeSample(const v1alpha1::RunSummary& summary);

/// The runs of a role (UNSPECIFIED counts as TRAIN) that are steady or drifted to
/// their end.
std::vector<Sample> SamplesOf(const std::vector<v1alpha1::RunSummary>& runs,
                              v1alpha1::RunRole role);
/// Those of a model's provenance, which has to outlive them.
std::vector<Sample> SamplesOf(const v1alpha1::Model& model, v1alpha1::RunRole role);

/// The PATCH runs, and the training runs of their states: repeats of one state on
/// several tiles.
std::vector<Sample> ReplicateSamples(const std::vector<v1alpha1::RunSummary>& runs);

/// Equal for all seeds of one state.
using StateKey = std::tuple<long, long, long, long>;
StateKey KeyOf(const Sample& row);

}  // namespace grouser::surrogate

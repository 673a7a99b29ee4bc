#pragma once

#include <array>
#include <string>
#include <vector>

#include "grouser/v1alpha1/campaign.pb.h"
#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What a fit is made of: the runs of one wheel on one soil.
struct TrainingSet {
  v1alpha1::Scene scene;                       ///< soil, wheel, rig
  std::vector<v1alpha1::RunSummary> runs;      ///< every status and role
  std::vector<std::string> notes;              ///< planned runs without a file, ...
};

/// One steady run, ready to compare with a model.
struct Row {
  VelocityState motion;
  double slip, attack_angle_rad, load_n;
  std::array<double, kOutputs> mean, standard_error;
  const v1alpha1::RunSummary* source;  ///< not owned
};

/// Reads DIR/campaign.json and the run files it names. Throws
/// std::invalid_argument with path and cause; a planned run without a file
/// becomes a note.
TrainingSet ReadCampaign(const std::string& directory);

/// Adds another campaign of the same wheel, soil and rig; throws
/// std::invalid_argument naming what differs.
void Merge(const TrainingSet& more, TrainingSet* set);

/// The summary of one run file, its hash included.
v1alpha1::RunSummary SummariseRun(const std::string& path, v1alpha1::RunRole role);

/// A state in either form; throws std::invalid_argument "run ID: ..." for a
/// summary without six outputs or with an impossible motion.
Row MakeRow(const v1alpha1::RunSummary& summary);

/// The steady runs of a role (UNSPECIFIED counts as TRAIN).
std::vector<Row> SteadyRows(const std::vector<v1alpha1::RunSummary>& runs,
                            v1alpha1::RunRole role);

/// Unit of a deviation: load, load r or r; by which outputs become comparable.
double OutputScale(int output, double load_n, double radius_m);

}  // namespace grouser::surrogate

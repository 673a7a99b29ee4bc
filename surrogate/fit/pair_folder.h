#pragma once

#include <optional>
#include <string>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

/// A wheel on a soil, as a folder:
///   runs.json      what was learned from, and the test states (grouser-fit summarise)
///   hybrid.model, lookup.model, bekker.model   (grouser-ladder fit)
///   coarse.json    the test states with coarser grains; may be missing
///   measured.csv   the same wheel measured; may be missing
///   measured_dem*.json   rows.json of `grouser validate` on it, one a grain size; may be missing
///   untuned.soil   name of a soil of the table, for the untuned Bekker model; may
///                  be missing
struct PairFolder {
  std::string path, name;
  std::string soils;            ///< table of published soils
  bool accept_unusual = false;  ///< ReadSoils, ReadMeasured
};

/// Folders below `root` that hold a runs.json, by name. Throws
/// std::invalid_argument where there is none.
std::vector<PairFolder> FindPairs(const std::string& root, const std::string& soils = {},
                                  bool accept_unusual = false);

/// Nothing fitted: the pair's wheel on the published soil that untuned.soil names; none without
/// that file. Throws std::invalid_argument for a soil that the table does not have.
std::optional<BekkerModel> UntunedModel(const PairFolder& pair, const v1alpha1::Scene& scene);

}  // namespace grouser::surrogate

#pragma once

#include <map>
#include <string>
#include <vector>

#include "grouser/v1alpha1/run.pb.h"
#include "proto/records/sha256.h"  // of run and tile files

namespace grouser::records {

/// Named one-dimensional arrays that stand beside a record.
using DoubleArrays = std::map<std::string, std::vector<double>>;

/// Version of run files. Schema 1 had created_unix_s and soil.bekker.
inline constexpr int kRunFileSchema = 2;

/// A run file: the record, and time series by name (see RunRecord).
struct RunFile {
  v1alpha1::RunRecord record;
  DoubleArrays series;          ///< "time_s", "f_x_n", ...; equal lengths
  int schema = kRunFileSchema;  ///< of the file that it was read from
  std::string note;             ///< what reading changed in the record, in words; empty: nothing
};

/// Writes `path` as HDF5: aside, synced, renamed, folder synced. Throws
/// std::runtime_error naming path and cause (full disk included); then no
/// partial file remains.
void WriteRunFile(const std::string& path, const RunFile& run);

/// A run file of any schema, its record in today's form. A record of an engine before
/// version 5 that names the law hertz_oden_martins comes back with hertz_dashpot, as that
/// law is called since, and a note that says so. Throws std::runtime_error
/// "PATH: what is wrong, what was expected" for a missing, truncated or foreign file, and for an
/// experiment that is no wheel test.
RunFile ReadRunFile(const std::string& path);
/// The same of any experiment.
RunFile ReadAnyRunFile(const std::string& path);

/// A settled tile, as written by the campaign (arrays by name with their
/// types; `meta_json` says what it is of).
struct TileFile {
  std::string meta_json;
  std::map<std::string, std::vector<double>> doubles;
  std::map<std::string, std::vector<float>> floats;
  std::map<std::string, std::vector<std::int32_t>> ints;
};
void WriteTileFile(const std::string& path, const TileFile& tile);
TileFile ReadTileFile(const std::string& path);

}  // namespace grouser::records

#pragma once

#include <limits>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// Heights of the surface along x behind a wheel, in fields of equal width.
struct Trace {
  double from_m = 0, step_m = 0;  ///< middle of the first field; width of one
  std::vector<double> height_m;   ///< NaN: no grain
};

/// The transverse ruts that the treads of a wheel leave in its trace.
struct Ruts {
  std::vector<std::size_t> bottoms;  ///< fields of the trace
  /// Of each below the mean of the crests beside it (the first and the last: of one), both from the
  /// straight line through the trace [m].
  std::vector<double> depth_m;
  double mean_depth_m = std::numeric_limits<double>::quiet_NaN();
  double spacing_m = std::numeric_limits<double>::quiet_NaN();        ///< NaN: less than two
  double spacing_error_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN: less than three
};

/// The period of the trace is the largest peak of its autocorrelation between 0.5 and 1.5 times
/// `unslipped_m`, the spacing that a wheel without slip leaves, or the first that is 0.8 times as
/// high (twice the period is a peak as well); a rut's bottom is the lowest field within half a
/// period of it. Mean spacing s and its standard error are those of the line of least squares
/// x_k = x_0 + s k through the bottoms and their numbers k, in which a rut that is missing counts.
/// No rut where there is no peak between these, or less than two such spacings of trace.
/// (reproduce/ono/system.py takes the largest peak itself, from its table of the surface.)
Ruts FindRuts(const Trace& trace, double unslipped_m);

/// Spacing that a wheel's first ring of treads leaves without slip: 2 pi r/count, r of their tips.
double UnslippedSpacing(const Shape& shape);

/// The fields of a surface (MeasureSurface) between two places along x; heights of the fields
/// beside one another across y are averaged.
Trace TraceOf(const std::vector<double>& surface, const Probe& probe, double from_m, double to_m);

/// Throws SpecError for a body without treads, and for fields too wide for their ruts.
void CheckRuts(const Experiment& e, const std::string& at, const Probe& probe);

}  // namespace grouser::dem::experiment

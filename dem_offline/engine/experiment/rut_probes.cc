// The trace behind a wheel as a probe sees it.
#include <cmath>
#include <limits>

#include "dem_offline/engine/experiment/probes.h"

namespace grouser::dem::experiment {

void Probes::BeginTraces(double time_s) {
  for (std::size_t k = 0; k < trace_from_m_.size(); ++k) {
    const Probe& p = e_.probes[k];
    if (p.kind != Probe::Kind::kRuts || !std::isnan(trace_from_m_[k]) ||
        time_s * (1 + 1e-9) < p.from_s)
      continue;
    trace_from_m_[k] = ground_.world().body(ground_.BodyOf(IndexOf(p.body))).position_m[0];
  }
}

/// From where the trace begins up to 0.8 radii behind the axle: the treads still move what lies
/// nearer.
Trace Probes::TraceBehind(const Probe& p) const {
  constexpr double kBehind = 0.8;
  const Body& body = ground_.world().body(ground_.BodyOf(IndexOf(p.body)));
  const Probe here = Shifted(p);
  return TraceOf(MeasureSurface(States(), here), here, trace_from_m_[&p - e_.probes.data()],
                 body.position_m[0] - kBehind * body.shape.rings.front().outer_radius);
}

Ruts Probes::RutsIn(const Probe& p, const Trace& trace) const {
  const Body& body = ground_.world().body(ground_.BodyOf(IndexOf(p.body)));
  return FindRuts(trace, UnslippedSpacing(body.shape));
}

void Probes::WriteRuts(const Probe& p, double time_s) const {
  const Trace trace = TraceBehind(p);
  const Ruts ruts = RutsIn(p, trace);
  std::vector<double> depth(trace.height_m.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < ruts.bottoms.size(); ++k) depth[ruts.bottoms[k]] = ruts.depth_m[k];
  for (std::size_t k = 0; k < depth.size(); ++k) {
    sink_(tables_[&p - e_.probes.data()],
          {time_s, trace.from_m + static_cast<double>(k) * trace.step_m, trace.height_m[k],
           depth[k]});
  }
}

}  // namespace grouser::dem::experiment

#include "dem_offline/engine/rig/recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grouser::dem {

StressRecorder::StressRecorder(const WheelShape& wheel, const RigSettings& rig, double yaw_rad)
    : wheel_(wheel) {
  grid_.angles = static_cast<int>(std::lround(2 * M_PI / rig.stress_bin_rad));
  grid_.widths = rig.width_bins;
  grid_.step_rad = 2 * M_PI / grid_.angles;
  grid_.width_m = wheel.width_m;
  grid_.cos_yaw = static_cast<float>(std::cos(yaw_rad));
  grid_.sin_yaw = static_cast<float>(std::sin(yaw_rad));
  NextChunk(0);
}

void StressRecorder::NextChunk(double time_s) {
  chunks_.push_back({time_s, 0, std::vector<double>(3 * grid_.bins(), 0.0)});
}

void StressRecorder::Add(const BodyContact& contact) {
  if (contact.rim) AddTo(chunks_.back().sums.data(), StressOf(grid_, contact.point, contact.force));
}

void StressRecorder::AddSums(long steps, const std::vector<double>& sums) {
  Chunk& c = chunks_.back();
  c.steps += steps;
  for (std::size_t i = 0; i < c.sums.size(); ++i) c.sums[i] += sums[i];
}

StressProfile StressRecorder::Average(double from_s, double to_s) const {
  StressProfile out;
  out.first_angle_rad = -M_PI;
  out.angle_step_rad = grid_.step_rad;
  out.width_bins = grid_.widths;
  std::vector<double> sums(3 * grid_.bins(), 0.0);
  long steps = 0;
  for (const Chunk& c : chunks_) {
    if (c.time_s < from_s || c.time_s >= to_s) continue;
    steps += c.steps;
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += c.sums[i];
  }
  const double area = wheel_.radius_m * grid_.step_rad * wheel_.width_m / grid_.widths;
  const double scale = steps > 0 ? 1.0 / (static_cast<double>(steps) * area) : 0.0;
  std::vector<double> mean(grid_.angles, 0.0);
  for (int i = 0; i < grid_.bins(); ++i) {
    out.normal_pa.push_back(sums[3 * i] * scale);
    out.shear_tangential_pa.push_back(sums[3 * i + 1] * scale);
    out.shear_axial_pa.push_back(sums[3 * i + 2] * scale);
    mean[i / grid_.widths] += out.normal_pa[i] / grid_.widths;
  }
  const int peak = static_cast<int>(std::max_element(mean.begin(), mean.end()) - mean.begin());
  int low = peak, high = peak;
  while (low > 0 && mean[low - 1] > 0.05 * mean[peak]) --low;
  while (high + 1 < grid_.angles && mean[high + 1] > 0.05 * mean[peak]) ++high;
  if (mean[peak] > 0) {
    out.exit_angle_rad = -M_PI + low * grid_.step_rad;
    out.entry_angle_rad = -M_PI + (high + 1) * grid_.step_rad;
  }
  return out;
}

SurfaceProfile MeasureSurface(const World& world, const Vec3d& centre_m, double yaw_rad,
                              double step_m) {
  const Frame& frame = world.config().frame;
  SurfaceProfile p;
  p.step_m = step_m;
  p.nx = std::max(1, static_cast<int>(frame.length_m / step_m));
  p.ny = std::max(1, static_cast<int>(frame.width_m / step_m));
  p.x_first_m = -0.5 * (p.nx - 1) * step_m;
  p.y_first_m = -0.5 * (p.ny - 1) * step_m;
  p.height_m.assign(p.nx * p.ny, std::numeric_limits<double>::quiet_NaN());
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    const double dx = std::remainder(g.x_m - centre_m[0], frame.length_m);
    const double dy = std::remainder(g.y_m - centre_m[1], frame.width_m);
    const double x = c * dx + s * dy, y = -s * dx + c * dy;
    const int ix = static_cast<int>(std::lround((x - p.x_first_m) / step_m));
    const int iy = static_cast<int>(std::lround((y - p.y_first_m) / step_m));
    if (ix < 0 || ix >= p.nx || iy < 0 || iy >= p.ny) continue;
    double& h = p.height_m[ix * p.ny + iy];
    const double top = g.z_m + g.radius_m;
    if (!(h >= top)) h = top;
  }
  return p;
}

}  // namespace grouser::dem

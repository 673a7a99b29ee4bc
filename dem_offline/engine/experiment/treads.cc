#include "dem_offline/engine/experiment/treads.h"

#include <algorithm>
#include <cmath>

#include "dem_offline/engine/experiment/shapes.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kSlowest = 0.2;  // of the tips' speed: what flows

/// Angle of a tread from straight down, positive towards +x.
double AngleOf(const Part& tread, const Mat3d& turn) {
  const float* z = &tread.axes[6];
  const Vec3d out = turn * Vec3d{z[0], z[1], z[2]};
  return std::atan2(out[0], -out[2]);
}

}  // namespace

TreadState MeasureTreads(const std::vector<GrainState>& grains, const Body& body, double period_m) {
  const Shape::Ring& ring = body.shape.rings.front();
  const Mat3d turn = MatrixOf(body.orientation);
  std::vector<double> angle;
  for (int k = 0; k < ring.count; ++k) {
    angle.push_back(AngleOf(body.shape.parts[ring.first + k], turn));
  }
  TreadState out;
  out.tread_rad = *std::min_element(angle.begin(), angle.end(),
                                    [](double a, double b) { return std::abs(a) < std::abs(b); });
  const double tip = Norm(body.spin_rad_per_s) * ring.outer_radius;
  for (const GrainState& g : grains) {
    const double speed = std::sqrt(g.v_x * g.v_x + g.v_y * g.v_y + g.v_z * g.v_z);
    if (speed >= kSlowest * tip && speed <= tip && tip > 0) {
      out.flow_m_per_s += speed;
      out.flow_area_m2 += M_PI * g.radius_m * g.radius_m;
      ++out.flow_grains;
    }
    Vec3d to = Sub({g.x_m, g.y_m, g.z_m}, body.position_m);
    to[0] = std::remainder(to[0], period_m);
    if (Norm(to) > body.shape.reach + g.radius_m) continue;
    const Vec3d local = turn.Back(to);
    SurfacePoint points[kMostSurfacePoints];
    const auto f = [](double v) { return static_cast<float>(v); };
    const int n =
        SurfacePoints(body.shape, {f(local[0]), f(local[1]), f(local[2])}, f(g.radius_m), points);
    for (int k = 0; k < n; ++k) {
      const int tread = points[k].key - ring.first;
      if (tread < 0 || tread >= ring.count) continue;
      out.entry_rad = std::fmax(out.entry_rad, angle[tread]);  // a NaN counts for nothing
      out.exit_rad = std::fmin(out.exit_rad, angle[tread]);
    }
  }
  if (out.flow_grains > 0) out.flow_m_per_s /= out.flow_grains;
  return out;
}

void CheckTreads(const Experiment& e, const std::string& at, const Probe& probe) {
  for (const BodySpec& b : e.bodies) {
    if (b.name == probe.body && ShapeOf(b.parts, at).rings.empty()) {
      throw SpecError(at + ".body", "'" + b.name + "', which has no treads",
                      "a body whose first part is a wheel with treads, not moved or turned");
    }
  }
}

}  // namespace grouser::dem::experiment

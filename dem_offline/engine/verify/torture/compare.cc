#include "dem_offline/engine/verify/torture/compare.h"

#include <algorithm>
#include <cmath>

namespace grouser::dem::verify {

double Transform::Determinant() const {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

Vec3d Transform::operator()(const Vec3d& a) const {
  return {m[0] * a[0] + m[1] * a[1] + m[2] * a[2], m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
          m[6] * a[0] + m[7] * a[1] + m[8] * a[2]};
}

double ForceDistance(const World& a, const World& b, const Transform& t) {
  const double axial = t.Determinant();
  double largest = 0, worst = 0;
  for (std::int32_t id = 0; id < a.count(); ++id) {
    const GrainLoad &f = a.LoadOf(id), &g = b.LoadOf(id);
    const double r = a.StateOf(id).radius_m;
    const Vec3d force = t({f.fx, f.fy, f.fz}), moment = t({f.tx, f.ty, f.tz});
    largest = std::max<double>(largest, std::hypot(f.fx, f.fy, f.fz));
    worst = std::max(worst, std::hypot(force[0] - g.fx, force[1] - g.fy, force[2] - g.fz));
    worst = std::max(worst, std::hypot(axial * moment[0] - g.tx, axial * moment[1] - g.ty,
                                       axial * moment[2] - g.tz) /
                                r);
  }
  return worst / largest;
}

}  // namespace grouser::dem::verify

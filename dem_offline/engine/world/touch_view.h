#pragma once

#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/touch_body.h"

namespace grouser::dem {

/// The surface of a shape, with its mesh: for the host.
struct SurfaceOf {
  const Shape& shape;
  int operator()(const ShapeView&, Vec3f p, float reach, SurfacePoint* out) const {
    return SurfacePoints(shape, p, reach, out);
  }
};

/// A body of a World in its present pose. Throws std::out_of_range where it has
/// left the frame.
inline BodyView BodyViewOf(const WorldConfig& c, const Body& b) {
  c.frame.FixZ(b.position_m[2] - c.origin_m[2]);
  const auto& parts = b.shape.parts;
  return BodyView(b, PlaneOf(parts.data(), static_cast<int>(parts.size())), c.frame, c.origin_m);
}

inline TouchView TouchViewOf(const WorldConfig& c, const std::vector<PairParams>& params,
                             float range, int words, const BodyEntry& b) {
  const Body& body = b.body;
  const bool free = body.motion == BodyMotion::kFree;
  // Round bodies move no surface by turning about their axle.
  const double stride = TravelOf(body, body.shape.reach, c.dt_s, !body.shape.round);
  return {BodyViewOf(c, body),
          ViewOf(body.shape),
          ToFloat(body.velocity_m_per_s),
          ToFloat(body.spin_rad_per_s),
          free ? static_cast<float>(body.mass_kg) : 0.0f,
          static_cast<float>(stride),
          range,
          static_cast<float>(c.dt_s),
          b.slots.per_grain,
          words,
          body.shape.mesh != nullptr,
          body.material,
          params.data(),
          c.contacts.materials()};
}

}  // namespace grouser::dem

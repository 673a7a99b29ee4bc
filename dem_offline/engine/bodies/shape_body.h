#pragma once

#include "dem_offline/engine/bodies/part_distance.h"

// Where a grain may touch a body, and how near the body may come: the bodies
// that the host's functions (shape.h) and the device share. A mesh is the
// host's alone: its points are handed in.

namespace grouser::dem {

/// A shape without its mesh, as plain arrays.
struct ShapeView {
  const Part* parts;
  const Shape::Ring* rings;
  std::int32_t part_count, ring_count;
};
ShapeView ViewOf(const Shape& shape);

namespace shape_body {

inline constexpr int kMostCandidates = 16;
inline constexpr float kFar = 1e30f;
inline constexpr float kSlack = 1 - 1e-5f;  // bounds stay bounds after rounding

using part_distance::Abs;
GROUSER_HD float Rho(Vec3f p) { return Sqrt(p.x * p.x + p.z * p.z); }

struct Candidates {
  SurfacePoint at[kMostCandidates];
  const Part* part[kMostCandidates];  ///< null: of the mesh
  bool alive[kMostCandidates];
  int count = 0;

  /// In rising order of key; when full the furthest gives way.
  GROUSER_HD void Add(const SurfacePoint& point, const Part* of) {
    if (count == kMostCandidates) {
      int furthest = 0;
      for (int i = 1; i < count; ++i) {
        if (at[i].distance > at[furthest].distance) furthest = i;
      }
      if (!(point.distance < at[furthest].distance)) return;
      for (int i = furthest; i + 1 < count; ++i) {
        at[i] = at[i + 1];
        part[i] = part[i + 1];
      }
      --count;
    }
    at[count] = point;
    part[count] = of;
    alive[count] = true;
    ++count;
  }
};

GROUSER_HD void Try(const ShapeView& shape, int index, Vec3f p, float reach, Candidates* found) {
  const Part& part = shape.parts[index];
  const SignedDistance s = part_distance::ToPart(part, p);
  if (!(s.distance < reach)) return;
  const bool rim = part.kind == PartKind::kCylinder && s.normal.y == 0.0f;
  found->Add({index, s.distance, s.normal, rim}, &part);
}

/// Cheap look at a bar: beyond its flanks or its foot by more than reach? Or at a sphere.
GROUSER_HD bool BarAway(const Part& bar, Vec3f p, float reach) {
  const float* m = bar.axes;
  const Vec3f r = {p.x - bar.centre[0], p.y - bar.centre[1], p.z - bar.centre[2]};
  if (bar.kind == PartKind::kSphere) return Dot(r, r) > (bar.a + reach) * (bar.a + reach);
  if (m[6] * r.x + m[7] * r.y + m[8] * r.z < -reach) return true;
  return Abs(m[0] * r.x + m[1] * r.y + m[2] * r.z) > Max(bar.a, bar.d) + reach;
}

GROUSER_HD void TryRing(const ShapeView& shape, const Shape::Ring& ring, Vec3f p, float reach,
                        Candidates* found) {
  if (Abs(p.y) > ring.half_width + reach || Rho(p) > ring.outer_radius + reach) return;
  for (int i = ring.first; i < ring.first + ring.count; ++i) {
    if (!BarAway(shape.parts[i], p, reach)) {
      Try(shape, i, p, reach, found);
    }
  }
}

/// Does `b` hide the nearest point of `a`? For parts: that point lies on or in
/// part b. For surfaces of a mesh (which sorted this out among themselves):
/// the two points are one.
GROUSER_HD bool Covers(const SurfacePoint& b, const Part* part_b, const SurfacePoint& a, Vec3f p,
                       float near) {
  const Vec3f foot = p - a.distance * a.normal;
  if (part_b != nullptr) return part_distance::ToPart(*part_b, foot).distance <= near;
  const Vec3f apart = foot - (p - b.distance * b.normal);
  return Dot(apart, apart) <= near * near && Dot(a.normal, b.normal) > 0.99f;
}

/// One point for one place on the union. Of two that are equally near the one
/// with the lower key stays, so that its history goes on.
GROUSER_HD void DropCovered(Candidates* c, Vec3f p, float near) {
  for (int j = 1; j < c->count; ++j) {
    for (int i = 0; i < j && c->alive[j]; ++i) {
      if (!c->alive[i]) continue;
      const SurfacePoint &a = c->at[i], &b = c->at[j];
      if (c->part[i] == nullptr && c->part[j] == nullptr) continue;
      if (a.distance <= b.distance + near) {
        if (Covers(a, c->part[i], b, p, near)) c->alive[j] = false;
      } else if (Covers(b, c->part[j], a, p, near)) {
        c->alive[i] = false;
      }
    }
  }
}

GROUSER_HD int Deliver(Candidates* c, SurfacePoint* out) {
  int alive = 0;
  for (int i = 0; i < c->count; ++i) alive += c->alive[i];
  for (; alive > kMostSurfacePoints; --alive) {
    int furthest = -1;
    for (int i = 0; i < c->count; ++i) {
      if (c->alive[i] && (furthest < 0 || c->at[i].distance > c->at[furthest].distance)) {
        furthest = i;
      }
    }
    c->alive[furthest] = false;
  }
  int n = 0;
  for (int i = 0; i < c->count; ++i) {
    if (c->alive[i]) out[n++] = c->at[i];
  }
  return n;
}

/// Signed distance to the solid of revolution rho <= radius, low <= y <= high.
GROUSER_HD float ToHull(Vec3f p, float radius, float low, float high) {
  const float dr = Rho(p) - radius, dy = Max(p.y - high, low - p.y);
  if (dr > 0.0f && dy > 0.0f) return Sqrt(dr * dr + dy * dy);
  return Max(dr, dy);
}

GROUSER_HD bool OnAxle(const Part& part) {
  return part.centre[0] == 0.0f && part.centre[2] == 0.0f && part.axes[3] == 0.0f &&
         part.axes[5] == 0.0f;
}

/// Half sizes of a box around the part, in its axes, about (0, 0, middle).
GROUSER_HD Vec3f HalfSizes(const Part& part, float* middle) {
  *middle = 0.0f;
  switch (part.kind) {
    case PartKind::kCylinder:
      return {part.a, part.b, part.a};
    case PartKind::kHollowCylinder:
      return {part.a + part.c, part.b, part.a + part.c};
    case PartKind::kDisc:
      return {part.a, part.a, 0.0f};
    case PartKind::kAnnulus:
      return {part.b, part.b, 0.0f};
    case PartKind::kPrism:
      *middle = 0.5f * part.c;
      return {Max(part.a, part.d), part.b, 0.5f * part.c};
    default:
      return {part.a, part.b, part.c};
  }
}

/// Distance to what a part sweeps when it turns about the body's y.
GROUSER_HD float SweptPart(const Part& part, Vec3f p) {
  const float* m = part.axes;
  if (part.kind == PartKind::kHalfSpace) {
    const float away = m[6] * part.centre[0] + m[7] * part.centre[1] + m[8] * part.centre[2];
    return m[7] * p.y - Sqrt(m[6] * m[6] + m[8] * m[8]) * Rho(p) - away;
  }
  const bool hollow = part.kind == PartKind::kHollowCylinder;
  if ((hollow || part.kind == PartKind::kCylinder) && OnAxle(part)) {
    return part_distance::ToPart(part, p).distance;
  }
  if (hollow && !(part.c > 0.0f)) return -kFar;
  float middle;
  const Vec3f h = HalfSizes(part, &middle);
  const Vec3f c = {part.centre[0] + middle * m[6], part.centre[1] + middle * m[7],
                   part.centre[2] + middle * m[8]};
  float radius2 = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const float sx = corner & 1 ? h.x : -h.x, sy = corner & 2 ? h.y : -h.y,
                sz = corner & 4 ? h.z : -h.z;
    const float x = c.x + sx * m[0] + sy * m[3] + sz * m[6];
    const float z = c.z + sx * m[2] + sy * m[5] + sz * m[8];
    radius2 = Max(radius2, x * x + z * z);
  }
  const float half = h.x * Abs(m[1]) + h.y * Abs(m[4]) + h.z * Abs(m[7]);
  return ToHull(p, Sqrt(radius2), c.y - half, c.y + half);
}

GROUSER_HD float Slacken(float bound) { return bound > 0.0f ? bound * kSlack : bound / kSlack; }

/// As SurfacePoints of shape.h; more: points of a mesh, in rising order of key.
GROUSER_HD int Points(const ShapeView& shape, Vec3f p, float reach, const SurfacePoint* more,
                      int more_count, SurfacePoint* out) {
  Candidates found;
  int ring = 0;  // rings follow one another in the list of parts
  for (int i = 0; i < shape.part_count;) {
    if (ring < shape.ring_count && i == shape.rings[ring].first && shape.rings[ring].count > 0) {
      TryRing(shape, shape.rings[ring], p, reach, &found);
      i += shape.rings[ring++].count;
    } else {
      Try(shape, i++, p, reach, &found);
    }
  }
  for (int i = 0; i < more_count; ++i) found.Add(more[i], nullptr);
  if (found.count > 1) DropCovered(&found, p, 1e-4f * reach);
  return Deliver(&found, out);
}

/// As SweptDistance, before Slacken; kFar for no part.
GROUSER_HD float Swept(const ShapeView& shape, Vec3f p) {
  float nearest = kFar;
  int ring = 0;
  for (int i = 0; i < shape.part_count;) {
    if (ring < shape.ring_count && i == shape.rings[ring].first && shape.rings[ring].count > 0) {
      const Shape::Ring& r = shape.rings[ring++];
      nearest = Min(nearest, ToHull(p, r.outer_radius, -r.half_width, r.half_width));
      i += r.count;
    } else {
      nearest = Min(nearest, SweptPart(shape.parts[i++], p));
    }
  }
  return nearest;
}

/// As StillDistance, before Slacken.
GROUSER_HD float Still(const ShapeView& shape, Vec3f p) {
  float nearest = kFar;
  for (int i = 0; i < shape.part_count; ++i) {
    nearest = Min(nearest, part_distance::ToPart(shape.parts[i], p).distance);
  }
  return nearest;
}

}  // namespace shape_body
}  // namespace grouser::dem

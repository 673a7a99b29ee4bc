#pragma once

#include "dem_offline/engine/bodies/shape.h"

// Distance to one part: + - x / sqrt only, so the same bits everywhere.

namespace grouser::dem::part_distance {

GROUSER_HD float Abs(float a) { return a < 0.0f ? -a : a; }
GROUSER_HD float SignOf(float a) { return a >= 0.0f ? 1.0f : -1.0f; }

/// Two faces that meet at a right angle, with distances d and e along the unit
/// normals n and m: the edge, the nearer face, or (inside) the less deep one.
GROUSER_HD SignedDistance Corner(float d, Vec3f n, float e, Vec3f m) {
  if (d > 0.0f && e > 0.0f) {
    const float r = Sqrt(d * d + e * e);
    return {r, (d / r) * n + (e / r) * m};
  }
  return d > e ? SignedDistance{d, n} : SignedDistance{e, m};
}

/// Away from the axis of the plane (u, v); any direction on the axis itself.
struct Polar {
  float rho, u, v;
};
GROUSER_HD Polar ToPolar(float u, float v) {
  const float rho = Sqrt(u * u + v * v);
  if (!(rho > 1e-12f)) return {rho, 1.0f, 0.0f};
  const float inv = 1.0f / rho;
  return {rho, u * inv, v * inv};
}

GROUSER_HD SignedDistance Cylinder(const Part& part, Vec3f q) {
  const Polar p = ToPolar(q.x, q.z);
  const float side = SignOf(q.y);
  return Corner(p.rho - part.a, {p.u, 0.0f, p.v}, side * q.y - part.b, {0.0f, side, 0.0f});
}

/// Without a wall thickness everything beyond the radius is solid (a bore).
GROUSER_HD SignedDistance HollowCylinderAt(const Part& part, Vec3f q) {
  const Polar p = ToPolar(q.x, q.z);
  const float side = SignOf(q.y);
  const float half = 0.5f * part.c;
  const float middle = part.a + half;  // of the wall
  const float out = part.c > 0.0f && p.rho > middle ? 1.0f : -1.0f;
  const float d = out > 0.0f ? p.rho - middle - half : part.a - p.rho;
  return Corner(d, {out * p.u, 0.0f, out * p.v}, side * q.y - part.b, {0.0f, side, 0.0f});
}

/// A disc is an annulus without a hole. Thin: never negative.
GROUSER_HD SignedDistance Ring(float inner, float outer, Vec3f q) {
  const Polar p = ToPolar(q.x, q.y);
  const float side = SignOf(q.z), h = side * q.z;
  const float beyond = p.rho - outer, hole = inner - p.rho;
  if (beyond <= 0.0f && hole <= 0.0f) return {h, {0.0f, 0.0f, side}};
  const float out = beyond > hole ? 1.0f : -1.0f;
  const float dr = Max(beyond, hole);
  const float d = Sqrt(dr * dr + h * h);
  return {d, {out * p.u * (dr / d), out * p.v * (dr / d), side * (h / d)}};
}

GROUSER_HD SignedDistance BoxAt(const Part& part, Vec3f q) {
  const Vec3f s = {SignOf(q.x), SignOf(q.y), SignOf(q.z)};
  const Vec3f e = {Abs(q.x) - part.a, Abs(q.y) - part.b, Abs(q.z) - part.c};
  const int outside = (e.x > 0.0f) + (e.y > 0.0f) + (e.z > 0.0f);
  if (outside <= 1) {  // one face, exactly; inside the least deep one
    if (e.x >= e.y && e.x >= e.z) return {e.x, {s.x, 0.0f, 0.0f}};
    if (e.y >= e.z) return {e.y, {0.0f, s.y, 0.0f}};
    return {e.z, {0.0f, 0.0f, s.z}};
  }
  const Vec3f o = {Max(e.x, 0.0f), Max(e.y, 0.0f), Max(e.z, 0.0f)};
  const float d = Sqrt(Dot(o, o));
  return {d, {s.x * (o.x / d), s.y * (o.y / d), s.z * (o.z / d)}};
}

/// Trapezoid in the plane x >= 0 (mirrored): the zones of bottom, top and
/// flank, and the wedges of the two corners, fill the outside.
GROUSER_HD SignedDistance Trapezoid(const Part& part, float x, float z) {
  const float run = part.d - part.a, length = Sqrt(run * run + part.c * part.c);
  const Vec3f along = {run / length, 0.0f, part.c / length};  // flank, upwards
  const Vec3f out = {along.z, 0.0f, -along.x};
  const float flank = (x - part.a) * out.x + z * out.z;
  const float u = (x - part.a) * along.x + z * along.z;
  const float top = z - part.c;
  const Vec3f up = {0.0f, 0.0f, 1.0f}, down = {0.0f, 0.0f, -1.0f};
  if (flank <= 0.0f && top <= 0.0f && z >= 0.0f) {
    if (flank >= top && flank >= -z) return {flank, out};
    return top >= -z ? SignedDistance{top, up} : SignedDistance{-z, down};
  }
  if (top > 0.0f && x <= part.d) return {top, up};
  if (z < 0.0f && x <= part.a) return {-z, down};
  if (flank > 0.0f && u >= 0.0f && u <= length) return {flank, out};
  const bool tip = u > 0.5f * length;
  const float dx = x - (tip ? part.d : part.a), dz = z - (tip ? part.c : 0.0f);
  const float d = Sqrt(dx * dx + dz * dz);
  if (!(d > 0.0f)) return {0.0f, out};
  return {d, {dx / d, 0.0f, dz / d}};
}

GROUSER_HD SignedDistance Prism(const Part& part, Vec3f q) {
  const float side = SignOf(q.y), mirror = SignOf(q.x);
  SignedDistance flat = Trapezoid(part, Abs(q.x), q.z);
  flat.normal.x *= mirror;
  return Corner(flat.distance, flat.normal, side * q.y - part.b, {0.0f, side, 0.0f});
}

GROUSER_HD SignedDistance SphereAt(const Part& part, Vec3f q) {
  const float r = Sqrt(Dot(q, q));
  if (!(r > 1e-12f)) return {-part.a, {0.0f, 0.0f, 1.0f}};
  return {r - part.a, (1.0f / r) * q};
}

GROUSER_HD SignedDistance InPartFrame(const Part& part, Vec3f q) {
  switch (part.kind) {
    case PartKind::kHalfSpace:
      return {q.z, {0.0f, 0.0f, 1.0f}};
    case PartKind::kCylinder:
      return Cylinder(part, q);
    case PartKind::kHollowCylinder:
      return HollowCylinderAt(part, q);
    case PartKind::kDisc:
      return Ring(0.0f, part.a, q);
    case PartKind::kAnnulus:
      return Ring(part.a, part.b, q);
    case PartKind::kBox:
      return BoxAt(part, q);
    case PartKind::kPrism:
      return Prism(part, q);
    case PartKind::kSphere:
      return SphereAt(part, q);
  }
  return {1e30f, {0.0f, 0.0f, 1.0f}};
}

/// Distance to one part.
GROUSER_HD SignedDistance ToPart(const Part& part, Vec3f p) {
  const float* m = part.axes;
  const Vec3f r = {p.x - part.centre[0], p.y - part.centre[1], p.z - part.centre[2]};
  const Vec3f q = {m[0] * r.x + m[1] * r.y + m[2] * r.z, m[3] * r.x + m[4] * r.y + m[5] * r.z,
                   m[6] * r.x + m[7] * r.y + m[8] * r.z};
  const SignedDistance s = InPartFrame(part, q);
  const Vec3f n = s.normal;
  return {s.distance,
          {m[0] * n.x + m[3] * n.y + m[6] * n.z, m[1] * n.x + m[4] * n.y + m[7] * n.z,
           m[2] * n.x + m[5] * n.y + m[8] * n.z}};
}

}  // namespace grouser::dem::part_distance

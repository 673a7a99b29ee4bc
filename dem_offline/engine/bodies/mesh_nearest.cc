// Nearest points of a mesh: no allocation, + - x / sqrt in double.
#include <cmath>

#include "dem_offline/engine/bodies/mesh.h"

namespace grouser::dem {
namespace {

constexpr int kDeepest = 64;  // halving 1e8 faces goes 26 deep

double SquareTo(const Vec3d& low, const Vec3d& high, const Vec3d& p) {
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    const double d = p[a] < low[a] ? low[a] - p[a] : (p[a] > high[a] ? p[a] - high[a] : 0.0);
    sum += d * d;
  }
  return sum;
}

}  // namespace

/// Zones of a triangle (corners, edges, face), by the signs of p's projections
/// on its sides.
int Mesh::ClosestFeature(std::int32_t face, const Vec3d& p, Vec3d* foot) const {
  const Vec3d &a = Corner(face, 0), &b = Corner(face, 1), &c = Corner(face, 2);
  const Vec3d ab = Sub(b, a), ac = Sub(c, a), bc = Sub(c, b);
  const Vec3d ap = Sub(p, a), bp = Sub(p, b), cp = Sub(p, c);
  const double ab_a = DotD(ab, ap), ac_a = DotD(ac, ap);
  const double ab_b = DotD(ab, bp), bc_b = DotD(bc, bp);
  const double ac_c = DotD(ac, cp), bc_c = DotD(bc, cp);
  const auto at = [&](const Vec3d& corner, int feature) {
    *foot = corner;
    return feature;
  };
  if (ab_a <= 0 && ac_a <= 0) return at(a, 0);
  if (ab_b >= 0 && bc_b <= 0) return at(b, 1);
  if (ac_c >= 0 && bc_c >= 0) return at(c, 2);
  const Vec3d& n = normal_[face];
  // Outside an edge: on the other side of it than the face.
  if (ab_a > 0 && ab_b < 0 && DotD(CrossD(n, ab), ap) <= 0) {
    return at(Add(a, Scale(ab_a / DotD(ab, ab), ab)), 3);
  }
  if (bc_b > 0 && bc_c < 0 && DotD(CrossD(n, bc), bp) <= 0) {
    return at(Add(b, Scale(bc_b / DotD(bc, bc), bc)), 4);
  }
  if (ac_a > 0 && ac_c < 0 && DotD(CrossD(n, ac), ap) >= 0) {
    return at(Add(a, Scale(ac_a / DotD(ac, ac), ac)), 5);
  }
  return at(Add(p, Scale(-DotD(ap, n), n)), kFace);
}

/// Which side of the surface p is on at the nearest point.
double Mesh::Side(const Best& best, const Vec3d& p) const {
  const Vec3d away = Sub(p, best.foot);
  const Vec3d& n = normal_[best.face];
  if (best.feature == kFace) return DotD(Sub(p, Corner(best.face, 0)), n);
  if (best.feature < 3) {
    const std::int32_t v = soup_.triangles[best.face][best.feature];
    return DotD(away, corner_normal_[v]);
  }
  const std::int32_t beyond = other_[best.face][best.feature - 3];
  return DotD(away, beyond < 0 ? n : Add(n, Scale(1.0, normal_[beyond])));
}

void Mesh::Look(std::int32_t face, const Vec3d& p, double reach2, Found* found) const {
  Best best;
  best.feature = ClosestFeature(face, p, &best.foot);
  const Vec3d away = Sub(p, best.foot);
  best.square = DotD(away, away);
  if (!(best.square < reach2)) return;
  best.surface = surface_of_[face];
  best.face = face;
  best.kept = true;
  int place = -1, furthest = 0;
  for (int i = 0; i < found->count; ++i) {
    if (found->at[i].surface == best.surface) place = i;
    if (found->at[i].square > found->at[furthest].square) furthest = i;
  }
  if (place < 0 && found->count < Found::kMost) {
    found->at[found->count++] = best;
    return;
  }
  if (place < 0) place = furthest;
  const Best& old = found->at[place];
  if (best.square < old.square || (best.square == old.square && face < old.face)) {
    found->at[place] = best;
  }
}

/// Does no face at the nearest point, of whichever surface, lead nearer to p?
bool Mesh::IsLowest(const Best& best, const Vec3d& p, double tolerance) const {
  const Vec3d away = Sub(p, best.foot);
  const auto nearer = [&](const Vec3d& direction) {
    const double gain = DotD(away, direction);
    return gain > 0 && gain * gain > tolerance * tolerance * DotD(direction, direction);
  };
  if (best.feature == kFace) return true;
  if (best.feature < 3) {
    const std::int32_t v = soup_.triangles[best.face][best.feature];
    for (std::int32_t s = spoke_first_[v]; s < spoke_first_[v + 1]; ++s) {
      if (nearer(Sub(soup_.vertices[spokes_[s]], best.foot))) return false;
    }
    return true;
  }
  const int e = best.feature - 3;
  const std::int32_t beyond = other_[best.face][e];
  if (beyond < 0) return true;
  const Vec3d back = Sub(Corner(best.face, e), Corner(best.face, (e + 1) % 3));
  return !nearer(CrossD(normal_[beyond], back));  // into the face beyond
}

/// Of each piece: from inside its one nearest point; from outside the lowest
/// points of what p can see. Then no place twice.
void Mesh::KeepVisible(const Vec3d& p, double tolerance, Found* found) const {
  for (int i = 0; i < found->count; ++i) found->at[i].side = Side(found->at[i], p);
  for (int i = 0; i < found->count; ++i) {
    Best& b = found->at[i];
    const std::int32_t piece = piece_of_surface_[b.surface];
    const bool solid = piece_closed_[piece] != 0;
    int nearest = i;
    bool inside = solid;
    for (int j = 0; j < found->count; ++j) {
      if (piece_of_surface_[found->at[j].surface] != piece) continue;
      if (found->at[j].square < found->at[nearest].square) nearest = j;
    }
    for (int j = 0; j < found->count; ++j) {
      const Best& o = found->at[j];
      if (piece_of_surface_[o.surface] != piece) continue;
      // Back to back faces are equally near: the one in front decides.
      if (o.square <= found->at[nearest].square * (1 + 1e-9) && !(o.side < 0)) inside = false;
    }
    if (inside) {
      b.kept = i == nearest;
    } else {
      b.kept = !(solid && b.side < 0) && IsLowest(b, p, 0.5 * tolerance);
    }
  }
  for (int j = 1; j < found->count; ++j) {
    for (int i = 0; i < j && found->at[j].kept; ++i) {
      Best &a = found->at[i], &b = found->at[j];
      if (!a.kept) continue;
      const Vec3d apart = Sub(a.foot, b.foot);
      if (DotD(apart, apart) > tolerance * tolerance) continue;
      const double da = std::sqrt(a.square), db = std::sqrt(b.square);
      (da <= db + tolerance ? b : a).kept = false;
    }
  }
}

SurfacePoint Mesh::ToPoint(const Best& best, const Vec3d& p) const {
  const bool solid = piece_closed_[piece_of_surface_[best.surface]] != 0;
  const bool behind = best.side < 0;
  const double inward = solid && behind ? -1.0 : 1.0;  // the normal looks away from p
  double distance = std::sqrt(best.square);
  Vec3d n = normal_[best.face];
  if (best.feature == kFace) {
    distance = behind ? -best.side : best.side;
    if (behind && !solid) n = {-n[0], -n[1], -n[2]};
  } else if (best.square > 1e-60) {
    const Vec3d away = Sub(p, best.foot);
    n = {inward * away[0] / distance, inward * away[1] / distance, inward * away[2] / distance};
  }
  return {kMeshKey + best.surface,
          static_cast<float>(inward * distance),
          {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])},
          false};
}

/// Out of reach, or of one surface that has a nearer point already?
bool Mesh::Hopeless(const Node& node, const Vec3d& p, double reach2, const Found& found) const {
  const double square = SquareTo(node.box.low, node.box.high, p);
  if (!(square < reach2)) return true;
  for (int i = 0; i < found.count && node.surface >= 0; ++i) {
    if (found.at[i].surface == node.surface) return square > found.at[i].square;
  }
  return false;
}

int Mesh::Nearest(Vec3f at, float reach, SurfacePoint* out, int capacity) const {
  const Vec3d p = {at.x, at.y, at.z};
  const double reach2 = static_cast<double>(reach) * reach;
  Found found;
  std::int32_t stack[kDeepest];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (Hopeless(node, p, reach2, found)) continue;
    if (node.count > 0) {
      for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
        Look(ordered_[i], p, reach2, &found);
      }
    } else {
      const Box &l = nodes_[node.left].box, &r = nodes_[node.left + 1].box;
      const int first = SquareTo(r.low, r.high, p) < SquareTo(l.low, l.high, p) ? 1 : 0;
      stack[depth++] = node.left + 1 - first;  // the nearer one comes off first
      stack[depth++] = node.left + first;
    }
  }
  for (int i = 1; i < found.count; ++i) {  // into the order of surfaces
    const Best b = found.at[i];
    int j = i;
    for (; j > 0 && found.at[j - 1].surface > b.surface; --j) found.at[j] = found.at[j - 1];
    found.at[j] = b;
  }
  KeepVisible(p, 1e-4 * reach, &found);
  int kept = 0;
  for (int i = 0; i < found.count; ++i) kept += found.at[i].kept;
  for (; kept > capacity; --kept) {  // the furthest give way
    int furthest = -1;
    for (int i = 0; i < found.count; ++i) {
      if (found.at[i].kept && (furthest < 0 || found.at[i].square > found.at[furthest].square)) {
        furthest = i;
      }
    }
    found.at[furthest].kept = false;
  }
  int n = 0;
  for (int i = 0; i < found.count; ++i) {
    if (found.at[i].kept) out[n++] = ToPoint(found.at[i], p);
  }
  return n;
}

float Mesh::LowerBound(Vec3f p) const {
  const Box& box = nodes_[0].box;
  return static_cast<float>(std::sqrt(SquareTo(box.low, box.high, {p.x, p.y, p.z})));
}

}  // namespace grouser::dem

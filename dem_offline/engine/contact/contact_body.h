#pragma once

#include <cstdint>

#include "dem_offline/engine/core/energy_sums.h"
#include "dem_offline/engine/core/frame.h"
#include "dem_offline/engine/core/grain.h"
#include "dem_offline/engine/laws/generic.h"

// What one contact does to its two grains: the body that SIMD loops, a CUDA
// thread and the one-thread emulation share. Plain functions of plain numbers.

namespace grouser::dem {

/// One of the two grains.
struct Side {
  float radius, mass;  ///< [m], [kg]
  Vec3f v, w;          ///< [m/s], [rad/s]
  std::int32_t kind;
};
GROUSER_HD Side SideOf(const Grain& g) {
  return {g.radius, g.mass, {g.vx, g.vy, g.vz}, {g.wx, g.wy, g.wz}, g.kind};
}

/// The first grain's centre from the second's.
struct Separation {
  float dx, dy, dz;  ///< [m] minimum image
  float d2, reach;   ///< square of the distance; sum of the radii
  bool touch;        ///< do the laws act?
};

/// kRange: laws act up to a gap of `range`. dx, dy, dz: in quanta q.
template <bool kRange>
GROUSER_HD Separation Separate(std::int32_t dx, std::int32_t dy, std::int32_t dz, float reach,
                               const float* q, float range) {
  Separation s;
  s.dx = static_cast<float>(dx) * q[0];
  s.dy = static_cast<float>(dy) * q[1];
  s.dz = static_cast<float>(dz) * q[2];
  s.d2 = s.dx * s.dx + s.dy * s.dy + s.dz * s.dz;
  s.reach = reach;
  const float limit = kRange ? reach + range : reach;
  s.touch =
      s.d2 > 0.0f ? s.d2 < limit * limit : false;  // 0: padding, a pair of a grain with itself
  return s;
}

/// a b/(a + b); the same bits for (b, a), and no product to underflow.
GROUSER_HD float Harmonic(float a, float b) {
  const float most = Max(a, b), least = Min(a, b);
  return most * (least / (least + most));
}

/// One contact as its first side sees it; a pair that does not touch gets a
/// harmless geometry and is masked afterwards.
template <bool kRange>
GROUSER_HD ContactGeometry GeometryOf(const Side& i, const Side& j, const Separation& s,
                                      float range) {
  const float dist = Sqrt(s.touch ? s.d2 : 1.0f);
  const float inv = 1.0f / dist;
  ContactGeometry g;
  g.n = {s.dx * inv, s.dy * inv, s.dz * inv};
  g.overlap = s.touch ? s.reach - dist : 1e-9f;
  if (!kRange || range == 0.0f) g.overlap = Max(g.overlap, 1e-12f);
  g.r_own = i.radius;
  g.r_other = j.radius;
  const float li = g.r_own - 0.5f * g.overlap, lj = g.r_other - 0.5f * g.overlap;
  g.v_rel = (i.v - j.v) - Cross(li * i.w + lj * j.w, g.n);
  g.w_rel = i.w - j.w;
  g.w_own = i.w;
  g.r_eff = Harmonic(g.r_own, g.r_other);
  g.m_own = i.mass;
  g.m_eff = Harmonic(i.mass, j.mass);
  g.roll_inertia =
      Harmonic(1.4f * i.mass * g.r_own * g.r_own, 1.4f * j.mass * g.r_other * g.r_other);
  g.k_old = 0.0f;
  return g;
}

/// The same contact as its second side sees it.
GROUSER_HD ContactGeometry OtherSide(const ContactGeometry& g, Vec3f w_other, float m_other) {
  ContactGeometry o = g;
  o.n = -1.0f * g.n;
  o.v_rel = -1.0f * g.v_rel;
  o.w_rel = -1.0f * g.w_rel;
  o.w_own = w_other;
  o.r_own = g.r_other;
  o.r_other = g.r_own;
  o.m_own = m_other;
  return o;
}

GROUSER_HD float Keep(bool keep, float value) { return keep ? value : 0.0f; }
GROUSER_HD Vec3f Keep(bool keep, Vec3f a) { return Select(keep, a, {0.0f, 0.0f, 0.0f}); }

/// What a contact does in one step; all zero where it is none.
struct ContactLoads {
  Vec3f force, on_first, on_second;  ///< force on the first [N]; moments on both [N m]
  float deepest, touching;           ///< overlap [m]; 1 or 0
};
/// words: the history as the first side sees it; cleared where there is no
/// contact.
template <class Law>
GROUSER_HD ContactLoads EvaluateContact(const Law& law, const Side& i, const Side& j,
                                        const Separation& s, float range, float dt, float* words,
                                        ContactEnergy* energy) {
  const ContactGeometry g = GeometryOf<Law::kRange>(i, j, s, range);
  const int count = law.Words();
  float other[Law::kMostWords];
  for (int w = 0; w < count; ++w) other[w] = words[w];
  const ContactResult r = law.Evaluate(i.kind, j.kind, g, words, dt);
  Vec3f moment = -1.0f * r.moment;
  float rolling = r.rolling;
  if (law.OwnSides(i.kind, j.kind)) {
    const ContactResult o = law.Evaluate(j.kind, i.kind, OtherSide(g, j.w, j.mass), other, dt);
    moment = o.moment;
    rolling += o.rolling;
  }
  const bool touch = s.touch && (!Law::kRange || r.active);
  for (int w = 0; w < count; ++w) words[w] = Keep(touch, words[w]);
  const Vec3f turn = Cross(g.n, r.force);
  *energy = {Keep(touch, r.stored),          Keep(touch, r.normal_damping),
             Keep(touch, r.tangent_damping), Keep(touch, r.slip),
             Keep(touch, rolling),           Keep(touch, r.plastic),
             Keep(s.touch, r.cohesion)};
  return {Keep(touch, r.force), Keep(touch, r.moment - (g.r_own - 0.5f * g.overlap) * turn),
          Keep(touch, moment - (g.r_other - 0.5f * g.overlap) * turn), Keep(touch, g.overlap),
          Keep(touch, 1.0f)};
}

/// A compiled law combination, one material.
template <class R>
struct OneCombination {
  static constexpr bool kRange = R::kHasRange;
  static constexpr int kMostWords = R::kWords;
  typename R::Params params;
  GROUSER_HD static constexpr int Words() { return R::kWords; }
  GROUSER_HD static constexpr bool OwnSides(std::int32_t, std::int32_t) { return R::kOwnSides; }
  GROUSER_HD ContactResult Evaluate(std::int32_t, std::int32_t, const ContactGeometry& g,
                                    float* words, float dt) const {
    return R::Evaluate(params, g, words, dt);
  }
  /// At a body: with the parameters of that pair of materials.
  GROUSER_HD ContactResult With(const PairParams& p, const ContactGeometry& g, float* words,
                                float dt) const {
    return R::Evaluate(R::From(p), g, words, dt);
  }
};

/// Any laws, any materials.
struct AnyLaws {
  static constexpr bool kRange = true;
  static constexpr int kMostWords = kMaxHistoryWords;
  WordLayout layout;
  const PairParams* params;  ///< [materials x materials]
  int materials;
  GROUSER_HD const PairParams& Of(std::int32_t kind_i, std::int32_t kind_j) const {
    return params[(kind_i & 0xffff) * materials + (kind_j & 0xffff)];
  }
  GROUSER_HD int Words() const { return layout.words; }
  GROUSER_HD bool OwnSides(std::int32_t kind_i, std::int32_t kind_j) const {
    return OwnSidesOf(Of(kind_i, kind_j).laws);
  }
  GROUSER_HD ContactResult Evaluate(std::int32_t kind_i, std::int32_t kind_j,
                                    const ContactGeometry& g, float* words, float dt) const {
    return EvaluateGeneric(layout, Of(kind_i, kind_j), g, words, dt);
  }
  GROUSER_HD ContactResult With(const PairParams& p, const ContactGeometry& g, float* words,
                                float dt) const {
    return EvaluateGeneric(layout, p, g, words, dt);
  }
};

}  // namespace grouser::dem

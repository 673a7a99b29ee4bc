#pragma once

#include "dem_offline/engine/bodies/shape_body.h"
#include "dem_offline/engine/contact/contact_body.h"
#include "dem_offline/engine/core/energy_sums.h"
#include "dem_offline/engine/world/body_view.h"

// The contacts of one grain with one body: the index body that all back ends
// share.

namespace grouser::dem {

inline constexpr float kLookAhead = 0.5f;    ///< radii of a grain, for its distance from a body
inline constexpr float kLeastClear = 0.02f;  ///< radii; nearer than this is looked at every step
inline constexpr float kSafeClear = 0.99f;   ///< of a distance: rounding

/// A body as its contacts see it in one step, in plain numbers.
struct TouchView {
  BodyView body;
  ShapeView shape;
  Vec3f hub, spin;  ///< velocity of the origin, angular velocity
  float free_mass;  ///< [kg] of a free body; 0: another
  float stride;     ///< no surface point goes further in this step [m]
  float range, dt;
  std::int32_t per_grain, words;
  bool pass_history;  ///< a mesh passes histories on from surface to surface
  std::int32_t material;
  const PairParams* params;  ///< [materials x materials]
  std::int32_t materials;
};

/// What one contact point did.
struct TouchRecord {
  Vec3f point;          ///< from the body's origin [m]
  Vec3f force, moment;  ///< on the body, about its origin
  std::int32_t key;
  bool rim, active;
  ContactEnergy energy;
};

/// Moves the words of keys that are still there into their new slots. A mesh
/// passes the history of the one surface left on to the one entered.
GROUSER_HD void MatchSlots(const SurfacePoint* at, int n, int per_grain, int words,
                           bool pass_history, std::int32_t* key, float* word) {
  float kept[kMostSurfacePoints * kMaxHistoryWords];
  std::int32_t old[kMostSurfacePoints];
  for (int s = 0; s < per_grain; ++s) {
    old[s] = key[s];
    key[s] = -1;
  }
  for (int w = 0; w < per_grain * words; ++w) {
    kept[w] = word[w];
    word[w] = 0.0f;
  }
  int fresh = -1, news = 0, gone = -1, lost = 0;
  for (int s = 0; s < n; ++s) {
    key[s] = at[s].key;
    int from = 0;
    while (from < per_grain && old[from] != at[s].key) ++from;
    if (from < per_grain) {
      for (int w = 0; w < words; ++w) word[s * words + w] = kept[from * words + w];
    } else {
      fresh = s;
      ++news;
    }
  }
  for (int o = 0; o < per_grain; ++o) {
    int to = 0;
    while (to < per_grain && key[to] != old[o]) ++to;
    if (old[o] >= 0 && to == per_grain) {
      gone = o;
      ++lost;
    }
  }
  if (pass_history && news == 1 && lost == 1) {
    for (int w = 0; w < words; ++w) word[fresh * words + w] = kept[gone * words + w];
  }
}

/// Where the surface of a body touches, or nearly touches, one grain.
struct Touching {
  Vec3f rel;  ///< grain from the body's origin, world axes
  SurfacePoint at[kMostSurfacePoints];
  int n;
  float clear;  ///< the rest of the way to the surface, where it is known; not negative

  /// Surface: points of the body nearer than a reach to a point in its frame.
  template <class Surface>
  GROUSER_HD Touching(const TouchView& v, const Grain& g, const Surface& surface)
      : rel(v.body.Relative(g)), n(0), clear(0.0f) {
    const float reach = g.radius + v.range;
    if (v.body.plane) {
      const float d = v.body.PlaneDistance(g);
      if (d < reach) at[n++] = {0, d, v.body.PlaneNormal(), false};
      clear = Max(d - reach, 0.0f);
      return;
    }
    const Vec3f p = v.body.ToBody(rel);
    n = surface(v.shape, p, reach, at);
    if (n == 0) {
      const float far = reach + kLookAhead * g.radius;
      const int next = surface(v.shape, p, far, at);
      float nearest = far;
      for (int s = 0; s < next; ++s) nearest = Min(nearest, at[s].distance);
      clear = Max(nearest - reach, 0.0f);
    }
    for (int s = 0; s < n; ++s) at[s].normal = v.body.ToWorld(at[s].normal);
    n = n < v.per_grain ? n : v.per_grain;
  }

  /// point: of the contact, from the body's origin.
  GROUSER_HD ContactGeometry Geometry(const TouchView& v, const Grain& g, int s, Vec3f* point,
                                      float* lever) const {
    ContactGeometry c;
    c.n = at[s].normal;
    c.overlap = g.radius - at[s].distance;
    *lever = g.radius - 0.5f * c.overlap;  // the middle of the overlap, as for pairs
    *point = rel - *lever * c.n;
    const Vec3f spin_i = {g.wx, g.wy, g.wz};
    c.v_rel =
        (Vec3f{g.vx, g.vy, g.vz} - *lever * Cross(spin_i, c.n)) - (v.hub + Cross(v.spin, *point));
    c.w_rel = spin_i - v.spin;
    c.w_own = spin_i;
    c.r_own = c.r_other = c.r_eff = g.radius;
    c.m_own = c.m_eff = g.mass;
    if (v.free_mass > 0.0f) c.m_eff = g.mass * (v.free_mass / (g.mass + v.free_mass));
    c.roll_inertia = 1.4f * c.m_eff * g.radius * g.radius;
    c.k_old = 0.0f;
    return c;
  }
};

/// Index body: the contacts of grain g. evaluate(params, geometry, words, dt):
/// the laws. key, word: the grain's slots, in and out; clear: way that grain and
/// body may go before they can touch [m], in and out. Adds to *load; returns the
/// number of records written [per_grain]; *tunnelled is set where the grain is
/// nearly through.
template <class Evaluate, class Surface>
GROUSER_HD int TouchGrain(const TouchView& v, const Grain& g, const Evaluate& evaluate,
                          const Surface& surface, std::int32_t* key, float* word, float* clear,
                          GrainLoad* load, TouchRecord* out, bool* tunnelled) {
  if (g.kind & kFrozen) return 0;
  if (*clear > 0.0f) {
    const auto size = [](float a) { return a < 0.0f ? -a : a; };
    *clear -= v.stride + v.dt * (size(g.vx) + size(g.vy) + size(g.vz));
    if (*clear > 0.0f) return 0;
  }
  const Touching t(v, g, surface);
  *clear = t.clear > kLeastClear * g.radius ? kSafeClear * t.clear : 0.0f;
  const bool same = t.n == 1 && key[0] == t.at[0].key && (v.per_grain == 1 || key[1] < 0);
  if (!same && (t.n > 0 || key[0] >= 0)) {
    MatchSlots(t.at, t.n, v.per_grain, v.words, v.pass_history, key, word);
  }
  const PairParams& p = v.params[(g.kind & 0xffff) * v.materials + v.material];
  for (int s = 0; s < t.n; ++s, word += v.words) {
    TouchRecord& record = out[s];
    float lever;
    const ContactGeometry c = t.Geometry(v, g, s, &record.point, &lever);
    if (c.overlap > 1.9f * g.radius) *tunnelled = true;
    const ContactResult r = evaluate(p, c, word, v.dt);
    record.energy = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, r.cohesion};
    record.active = r.active;
    record.key = t.at[s].key;
    record.rim = t.at[s].rim;
    if (!r.active) {
      for (int w = 0; w < v.words; ++w) word[w] = 0.0f;
      continue;
    }
    const Vec3f torque = r.moment - lever * Cross(c.n, r.force);
    load->Add(r.force, torque);
    load->touching += 1.0f;
    record.force = -1.0f * r.force;
    record.moment = -1.0f * (Cross(record.point, r.force) + r.moment);
    record.energy = {r.stored,  r.normal_damping, r.tangent_damping, r.slip,
                     r.rolling, r.plastic,        r.cohesion};
  }
  return t.n;
}

}  // namespace grouser::dem

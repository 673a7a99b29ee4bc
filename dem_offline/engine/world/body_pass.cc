// Bodies of a World: search, contact forces, motion.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {
namespace {

/// A body as the contact loop needs it: fixed point and float.
struct BodyView {
  std::int32_t x, y, z;
  float q[3];
  double qd[3];
  float m[9];  ///< world = M body
  bool plane;  ///< one half space through the origin: done in double
  Vec3d normal;

  BodyView(const Body& b, const WorldConfig& c) {
    const Frame& f = c.frame;
    x = f.FixX(b.position_m[0] - c.origin_m[0]);
    y = f.FixY(b.position_m[1] - c.origin_m[1]);
    z = f.FixZ(b.position_m[2] - c.origin_m[2]);
    const auto quantum = f.Quantum();
    for (int a = 0; a < 3; ++a) q[a] = quantum[a];
    qd[0] = f.length_m / 4294967296.0;
    qd[1] = f.width_m / 4294967296.0;
    qd[2] = f.z_span_m / 4294967296.0;
    const Mat3d r = MatrixOf(b.orientation);
    for (int k = 0; k < 9; ++k) m[k] = static_cast<float>(r.m[k]);
    plane = b.shape.parts.size() == 1 && b.shape.parts[0].kind == PartKind::kHalfSpace;
    if (plane) {
      const float* n = &b.shape.parts[0].axes[6];
      normal = r * Vec3d{n[0], n[1], n[2]};
      normal = Scale(1 / Norm(normal), normal);
    }
  }
  Vec3f Relative(const Grain& g) const {  // world axes [m]
    return {static_cast<float>(WrapDiff(g.x, x)) * q[0], static_cast<float>(WrapDiff(g.y, y)) * q[1],
            static_cast<float>(WrapDiff(g.z, z)) * q[2]};
  }
  Vec3f ToBody(Vec3f a) const {
    return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
            m[2] * a.x + m[5] * a.y + m[8] * a.z};
  }
  Vec3f ToWorld(Vec3f a) const {
    return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
            m[6] * a.x + m[7] * a.y + m[8] * a.z};
  }
  float PlaneDistance(const Grain& g) const {
    return static_cast<float>(WrapDiff(g.x, x) * (qd[0] * normal[0]) +
                              WrapDiff(g.y, y) * (qd[1] * normal[1]) +
                              WrapDiff(g.z, z) * (qd[2] * normal[2]));
  }
  Vec3f PlaneNormal() const {
    return {static_cast<float>(normal[0]), static_cast<float>(normal[1]),
            static_cast<float>(normal[2])};
  }
};

Vec3f ToFloat(const Vec3d& a) {
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}

int SlotsPerGrain(const Shape& s) {
  if (s.mesh) return kMostSurfacePoints;
  int parts = static_cast<int>(s.parts.size());
  for (const auto& ring : s.rings) parts += 2 - ring.count;  // two of a ring at most
  return std::clamp(parts, 1, kMostSurfacePoints);
}

template <class R>
ContactResult EvaluateRecipe(const World& w, const PairParams& p, const ContactGeometry& g,
                             float* words) {
  return R::Evaluate(R::From(p), g, words, static_cast<float>(w.config().dt_s));
}
ContactResult EvaluateAny(const World& w, const PairParams& p, const ContactGeometry& g,
                          float* words) {
  const auto& model = w.config().contacts;
  return EvaluateGeneric(model.laws(), model.layout(), p, g, words,
                         static_cast<float>(w.config().dt_s));
}
template <class... R>
ContactFn Choose(int recipe, RecipeList<R...>) {
  static constexpr ContactFn all[] = {EvaluateRecipe<R>...};
  return recipe < 0 ? EvaluateAny : all[recipe];
}

/// Moves the words of keys that are still there into their new slots. A mesh
/// hands the history of the one surface left to the one entered.
void MatchSlots(const SurfacePoint* at, int n, int per_grain, int words, bool hand_over,
                std::int32_t* key, float* word) {
  float kept[kMostSurfacePoints * kMaxHistoryWords];
  std::int32_t old[kMostSurfacePoints];
  std::copy(key, key + per_grain, old);
  std::copy(word, word + per_grain * words, kept);
  std::fill(key, key + per_grain, -1);
  std::fill(word, word + per_grain * words, 0.0f);
  int fresh = -1, news = 0, gone = -1, lost = 0;
  for (int s = 0; s < n; ++s) {
    key[s] = at[s].key;
    const std::int32_t* from = std::find(old, old + per_grain, at[s].key);
    if (from != old + per_grain) {
      std::copy_n(kept + (from - old) * words, words, word + s * words);
    } else {
      fresh = s;
      ++news;
    }
  }
  for (int o = 0; o < per_grain; ++o) {
    if (old[o] >= 0 && std::find(key, key + per_grain, old[o]) == key + per_grain) {
      gone = o;
      ++lost;
    }
  }
  if (hand_over && news == 1 && lost == 1) {
    std::copy_n(kept + gone * words, words, word + fresh * words);
  }
}

}  // namespace

ContactFn BodyPass::ContactOf(int recipe) { return Choose(recipe, Recipes{}); }

void BodyPass::Find(World& w, BodyEntry& b) {
  const BodyView view(b.body, w.config_);
  BodySlots old = std::move(b.slots);
  BodySlots& now = b.slots;
  now = BodySlots{};
  now.per_grain = SlotsPerGrain(b.body.shape);
  const int words = w.list_.words();
  b.moved_m = 0;
  const Vec3d& spin = b.body.spin_rad_per_s;
  b.turning = b.body.motion == BodyMotion::kFree || DotD(spin, spin) > 0;
  const auto distance = b.turning ? SweptDistance : StillDistance;
  const float margin = static_cast<float>(b.margin_m) + w.range_;
  std::size_t before = 0;
  for (std::int64_t i = 0; i < w.count_; ++i) {
    const Grain& g = w.grains_[i];
    const float gap = (view.plane ? view.PlaneDistance(g)
                                  : distance(b.body.shape, view.ToBody(view.Relative(g)))) -
                      g.radius;
    if (!(gap < margin)) continue;
    const auto id = static_cast<std::int32_t>(i);
    now.near.push_back(id);
    while (before < old.near.size() && old.near[before] < id) ++before;
    if (before < old.near.size() && old.near[before] == id && old.per_grain == now.per_grain) {
      const auto k = static_cast<std::ptrdiff_t>(before) * old.per_grain;
      now.key.insert(now.key.end(), old.key.begin() + k, old.key.begin() + k + old.per_grain);
      now.words.insert(now.words.end(), old.words.begin() + k * words,
                       old.words.begin() + (k + old.per_grain) * words);
    } else {
      now.key.insert(now.key.end(), now.per_grain, -1);
      now.words.insert(now.words.end(), static_cast<std::size_t>(now.per_grain) * words, 0.0f);
    }
  }
}

void BodyPass::FindAll(World& w) {
  for (BodyEntry& b : w.parts_->bodies) Find(w, b);
}

void BodyPass::Forces(World& w) {
  World::Parts& parts = *w.parts_;
  const int words = w.list_.words(), materials = w.config_.contacts.materials();
  const double dt = w.config_.dt_s;
  for (std::size_t number = 0; number < parts.bodies.size(); ++number) {
    BodyEntry& b = parts.bodies[number];
    const BodyView view(b.body, w.config_);
    const Vec3f hub = ToFloat(b.body.velocity_m_per_s), spin = ToFloat(b.body.spin_rad_per_s);
    const float body_mass = static_cast<float>(b.body.mass_kg);
    Wrench& sum = b.wrench = Wrench{};
    BodySlots& slots = b.slots;
    for (std::size_t k = 0; k < slots.near.size(); ++k) {
      const std::int32_t i = slots.near[k];
      const Grain& g = w.grains_[i];
      std::int32_t* key = &slots.key[k * slots.per_grain];
      float* word = &slots.words[k * slots.per_grain * words];
      const float reach = g.radius + w.range_;
      const Vec3f rel = view.Relative(g);
      SurfacePoint at[kMostSurfacePoints];
      int n = 0;
      if (view.plane) {
        const float d = view.PlaneDistance(g);
        if (d < reach) at[n++] = {0, d, view.PlaneNormal(), false};
      } else {
        n = SurfacePoints(b.body.shape, view.ToBody(rel), reach, at);
        for (int s = 0; s < n; ++s) at[s].normal = view.ToWorld(at[s].normal);
      }
      n = std::min(n, slots.per_grain);
      const bool same = n == 1 && key[0] == at[0].key && (slots.per_grain == 1 || key[1] < 0);
      if (!same && (n > 0 || key[0] >= 0)) {
        MatchSlots(at, n, slots.per_grain, words, b.body.shape.mesh != nullptr, key, word);
      }
      for (int s = 0; s < n; ++s, word += words) {
        ContactGeometry c;
        c.n = at[s].normal;
        c.overlap = g.radius - at[s].distance;
        if (c.overlap > 1.9f * g.radius) w.fault_ = StepFault::kTunnelled;
        const float lever = g.radius - 0.5f * c.overlap;  // the middle of the overlap, as for pairs
        const Vec3f point = rel - lever * c.n;            // from the body's origin
        const Vec3f spin_i = {g.wx, g.wy, g.wz};
        c.v_rel = (Vec3f{g.vx, g.vy, g.vz} - lever * Cross(spin_i, c.n)) - (hub + Cross(spin, point));
        c.w_rel = spin_i - spin;
        c.w_own = spin_i;
        c.r_own = c.r_other = c.r_eff = g.radius;
        c.m_own = c.m_eff = g.mass;
        if (b.body.motion == BodyMotion::kFree) c.m_eff = g.mass * (body_mass / (g.mass + body_mass));
        c.roll_inertia = 1.4f * c.m_eff * g.radius * g.radius;
        const PairParams& p = w.params_[MaterialOf(g) * materials + b.body.material];
        const ContactResult r = parts.contact(w, p, c, word);
        if (w.config_.energy) w.step_energy_.cohesion += r.cohesion;
        if (!r.active) {
          std::fill_n(word, words, 0.0f);
          continue;
        }
        GrainLoad& f = w.loads_[i];
        const Vec3f torque = r.moment - lever * Cross(c.n, r.force);
        f.fx += r.force.x;
        f.fy += r.force.y;
        f.fz += r.force.z;
        f.tx += torque.x;
        f.ty += torque.y;
        f.tz += torque.z;
        f.touching += 1.0f;
        if (w.config_.energy) {
          w.step_energy_.Add({r.stored, r.normal_damping, r.tangent_damping, r.slip, r.rolling,
                              r.plastic, 0.0});
        }
        sum.fx -= r.force.x;
        sum.fy -= r.force.y;
        sum.fz -= r.force.z;
        const Vec3f moment = Cross(point, r.force);
        sum.tx -= moment.x + r.moment.x;
        sum.ty -= moment.y + r.moment.y;
        sum.tz -= moment.z + r.moment.z;
        if (parts.sink) {
          parts.sink({static_cast<int>(number), point, -1.0f * r.force, at[s].key, at[s].rim});
        }
      }
    }
    if (b.body.motion == BodyMotion::kPrescribed) {
      const Vec3d &v = b.body.velocity_m_per_s, &o = b.body.spin_rad_per_s;
      b.work_j -= dt * (sum.fx * v[0] + sum.fy * v[1] + sum.fz * v[2] + sum.tx * o[0] +
                        sum.ty * o[1] + sum.tz * o[2]);
    } else if (b.body.motion == BodyMotion::kFree) {
      b.work_j += dt * (DotD(b.body.outer_force_n, b.body.velocity_m_per_s) +
                        DotD(b.body.outer_moment_n_m, b.body.spin_rad_per_s));
    }
  }
}

}  // namespace grouser::dem

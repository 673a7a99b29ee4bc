// Bodies of a World: contact forces.
#include <algorithm>
#include <cmath>

#include "dem_offline/engine/world/body_view.h"

namespace grouser::dem {
namespace {

constexpr std::size_t kRun = 64;      // grains
constexpr float kLookAhead = 0.5f;    // radii of a grain, for its distance from a body
constexpr float kLeastClear = 0.02f;  // radii; nearer than this is looked at every step
constexpr float kSafe = 0.99f;        // of a distance: rounding

void AddTo(GrainLoad& f, Vec3f force, Vec3f torque) {
  f.fx += force.x;
  f.fy += force.y;
  f.fz += force.z;
  f.tx += torque.x;
  f.ty += torque.y;
  f.tz += torque.z;
  f.touching += 1.0f;
}
void AddTo(Wrench& sum, Vec3f force, Vec3f moment) {
  sum.fx += force.x;
  sum.fy += force.y;
  sum.fz += force.z;
  sum.tx += moment.x;
  sum.ty += moment.y;
  sum.tz += moment.z;
}

void BookWork(BodyEntry& b, double dt) {
  const Vec3d &v = b.body.velocity_m_per_s, &o = b.body.spin_rad_per_s;
  if (b.body.motion == BodyMotion::kPrescribed) {
    const Wrench& f = b.wrench;
    b.work_j -=
        dt * (f.fx * v[0] + f.fy * v[1] + f.fz * v[2] + f.tx * o[0] + f.ty * o[1] + f.tz * o[2]);
  } else if (b.body.motion == BodyMotion::kFree) {
    b.work_j += dt * (DotD(b.body.outer_force_n, v) + DotD(b.body.outer_moment_n_m, o));
  }
}

Vec3f ToFloat(const Vec3d& a) {
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}

template <class R>
ContactResult EvaluateRecipe(const WorldConfig&, const PairParams& p, const ContactGeometry& g,
                             float* words, float dt) {
  return R::Evaluate(R::From(p), g, words, dt);
}
ContactResult EvaluateAny(const WorldConfig& c, const PairParams& p, const ContactGeometry& g,
                          float* words, float dt) {
  return EvaluateGeneric(c.contacts.laws(), c.contacts.layout(), p, g, words, dt);
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

/// Where the surface of a body touches, or nearly touches, one grain.
struct BodyPass::Touching {
  Vec3f rel;  ///< grain from the body's origin, world axes
  SurfacePoint at[kMostSurfacePoints];
  int n = 0;
  float clear = 0;  ///< the rest of the way to the surface, where it is known; not negative

  Touching(const World& w, const BodyEntry& b, const BodyView& view, const Grain& g)
      : rel(view.Relative(g)) {
    const float reach = g.radius + w.range_;
    if (view.plane) {
      const float d = view.PlaneDistance(g);
      if (d < reach) at[n++] = {0, d, view.PlaneNormal(), false};
      clear = Max(d - reach, 0.0f);
      return;
    }
    n = SurfacePoints(b.body.shape, view.ToBody(rel), reach, at);
    if (n == 0) clear = Clear(b.body.shape, view.ToBody(rel), reach, kLookAhead * g.radius);
    for (int s = 0; s < n; ++s) at[s].normal = view.ToWorld(at[s].normal);
    n = std::min(n, b.slots.per_grain);
  }

  static float Clear(const Shape& shape, Vec3f p, float reach, float ahead) {
    SurfacePoint next[kMostSurfacePoints];
    const int n = SurfacePoints(shape, p, reach + ahead, next);
    float nearest = reach + ahead;
    for (int s = 0; s < n; ++s) nearest = Min(nearest, next[s].distance);
    return Max(nearest - reach, 0.0f);
  }

  /// point: of the contact, from the body's origin.
  ContactGeometry Geometry(const BodyEntry& b, const Grain& g, int s, Vec3f* point,
                           float* lever) const {
    const Vec3f hub = ToFloat(b.body.velocity_m_per_s), spin = ToFloat(b.body.spin_rad_per_s);
    ContactGeometry c;
    c.n = at[s].normal;
    c.overlap = g.radius - at[s].distance;
    *lever = g.radius - 0.5f * c.overlap;  // the middle of the overlap, as for pairs
    *point = rel - *lever * c.n;
    const Vec3f spin_i = {g.wx, g.wy, g.wz};
    c.v_rel = (Vec3f{g.vx, g.vy, g.vz} - *lever * Cross(spin_i, c.n)) - (hub + Cross(spin, *point));
    c.w_rel = spin_i - spin;
    c.w_own = spin_i;
    c.r_own = c.r_other = c.r_eff = g.radius;
    c.m_own = c.m_eff = g.mass;
    if (b.body.motion == BodyMotion::kFree) {
      const float body_mass = static_cast<float>(b.body.mass_kg);
      c.m_eff = g.mass * (body_mass / (g.mass + body_mass));
    }
    c.roll_inertia = 1.4f * c.m_eff * g.radius * g.radius;
    c.k_old = 0.0f;
    return c;
  }
};

/// What a run of grains did to a body.
struct BodyPass::Sums {
  float stride = 0;  ///< of the body in this step [m]
  Wrench wrench;
  EnergySums energy;
  bool tunnelled = false;
};

void BodyPass::TouchGrain(World& w, BodyEntry& b, int number, const BodyView& view, std::size_t k,
                          Sums& sums) {
  BodySlots& slots = b.slots;
  const int words = w.list_.words();
  const std::int32_t i = slots.near[k];
  const Grain& g = w.grains_[i];
  if (g.kind & kFrozen) return;
  float& clear = slots.clear[k];
  if (clear > 0.0f) {
    const float dt = static_cast<float>(w.config_.dt_s);
    clear -= sums.stride + dt * (std::abs(g.vx) + std::abs(g.vy) + std::abs(g.vz));
    if (clear > 0.0f) return;
  }
  std::int32_t* key = &slots.key[k * slots.per_grain];
  float* word = &slots.words[k * slots.per_grain * words];
  const Touching t(w, b, view, g);
  clear = t.clear > kLeastClear * g.radius ? kSafe * t.clear : 0.0f;
  const bool same = t.n == 1 && key[0] == t.at[0].key && (slots.per_grain == 1 || key[1] < 0);
  if (!same && (t.n > 0 || key[0] >= 0)) {
    MatchSlots(t.at, t.n, slots.per_grain, words, b.body.shape.mesh != nullptr, key, word);
  }
  const PairParams& p = w.params_[MaterialOf(g) * w.config_.contacts.materials() + b.body.material];
  for (int s = 0; s < t.n; ++s, word += words) {
    Vec3f point;
    float lever;
    const ContactGeometry c = t.Geometry(b, g, s, &point, &lever);
    if (c.overlap > 1.9f * g.radius) sums.tunnelled = true;
    const ContactResult r =
        w.parts_->contact(w.config_, p, c, word, static_cast<float>(w.config_.dt_s));
    sums.energy.cohesion += r.cohesion;
    if (!r.active) {
      std::fill_n(word, words, 0.0f);
      continue;
    }
    const Vec3f torque = r.moment - lever * Cross(c.n, r.force);
    AddTo(w.loads_[i], r.force, torque);
    sums.energy.Add(
        {r.stored, r.normal_damping, r.tangent_damping, r.slip, r.rolling, r.plastic, 0.0});
    AddTo(sums.wrench, -1.0f * r.force, -1.0f * (Cross(point, r.force) + r.moment));
    if (w.parts_->sink) w.parts_->sink({number, point, -1.0f * r.force, t.at[s].key, t.at[s].rim});
  }
}

void BodyPass::Forces(World& w) {
  World::Parts& parts = *w.parts_;
  std::vector<Sums> sums;
  for (std::size_t number = 0; number < parts.bodies.size(); ++number) {
    BodyEntry& b = parts.bodies[number];
    const BodyView view(b.body, w.config_);
    // Summed run by run, whatever the threads; a recorder is called by one.
    const std::size_t near = b.slots.near.size(), runs = (near + kRun - 1) / kRun;
    Sums none;
    // Round bodies move no surface by turning about their axle.
    none.stride = static_cast<float>(Travel(b.body, w.config_.dt_s, !b.body.shape.round));
    sums.assign(runs, none);
    const auto touch = [&](std::size_t from, std::size_t to) {
      for (std::size_t r = from; r < to; ++r) {
        for (std::size_t k = r * kRun; k < std::min(near, (r + 1) * kRun); ++k) {
          TouchGrain(w, b, static_cast<int>(number), view, k, sums[r]);
        }
      }
    };
    const std::size_t size = parts.sink ? 1 : static_cast<std::size_t>(parts.team.size());
    if (size == 1 || runs < 2 * size) {
      touch(0, runs);
    } else {
      parts.team.Run([&](int part) { touch(runs * part / size, runs * (part + 1) / size); });
    }
    b.wrench = Wrench{};
    for (const Sums& s : sums) {
      b.wrench.Add(s.wrench);
      if (w.config_.energy) w.step_energy_.Add(s.energy);
      if (s.tunnelled) w.fault_ = StepFault::kTunnelled;
    }
    BookWork(b, w.config_.dt_s);
  }
}

double BodyPass::Stored(const World& w) {
  double sum = 0;
  const int words = w.list_.words();
  float word[kMaxHistoryWords];
  for (const BodyEntry& b : w.parts_->bodies) {
    const BodyView view(b.body, w.config_);
    for (std::size_t k = 0; k < b.slots.near.size(); ++k) {
      const Grain& g = w.grains_[b.slots.near[k]];
      if (g.kind & kFrozen) continue;
      const Touching t(w, b, view, g);
      for (int s = 0; s < t.n; ++s) {
        // The words of this point's key, wherever they lie.
        for (int n = 0; n < b.slots.per_grain; ++n) {
          const std::size_t slot = k * b.slots.per_grain + n;
          if (b.slots.key[slot] != t.at[s].key) continue;
          std::copy_n(&b.slots.words[slot * words], words, word);
          Vec3f point;
          float lever;
          const PairParams& p =
              w.params_[MaterialOf(g) * w.config_.contacts.materials() + b.body.material];
          const ContactGeometry c = t.Geometry(b, g, s, &point, &lever);
          const ContactResult r = w.parts_->contact(w.config_, p, c, word, 0.0f);
          if (r.active) sum += r.stored;
        }
      }
    }
  }
  return sum;
}

}  // namespace grouser::dem

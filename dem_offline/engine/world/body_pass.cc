// Bodies of a World: contact forces.
#include <algorithm>
#include <cmath>

#include "dem_offline/engine/world/touch_view.h"

namespace grouser::dem {
namespace {

constexpr std::size_t kRun = 64;  // grains

template <class R>
ContactResult EvaluateCombination(const WorldConfig&, const PairParams& p, const ContactGeometry& g,
                                  float* words, float dt) {
  return R::Evaluate(R::From(p), g, words, dt);
}
ContactResult EvaluateAny(const WorldConfig& c, const PairParams& p, const ContactGeometry& g,
                          float* words, float dt) {
  return EvaluateGeneric(c.contacts.layout(), p, g, words, dt);
}
template <class... R>
ContactFn Choose(int combination, CombinationList<R...>) {
  static constexpr ContactFn all[] = {EvaluateCombination<R>...};
  return combination < 0 ? EvaluateAny : all[combination];
}

}  // namespace

ContactFn BodyPass::ContactOf(int combination) {
  return Choose(combination, CompiledCombinations{});
}

/// What a run of grains did to a body.
struct BodyPass::Sums {
  Wrench wrench;
  EnergySums energy;
  bool tunnelled = false;
};

void BodyPass::TouchEntry(SimulationState& w, BodyEntry& b, int number, const TouchView& view,
                          std::size_t k, Sums& sums) {
  BodySlots& slots = b.slots;
  const std::int32_t i = slots.near[k];
  TouchRecord record[kMostSurfacePoints];
  const auto evaluate = [&w](const PairParams& p, const ContactGeometry& g, float* words,
                             float dt) { return w.contact(w.config, p, g, words, dt); };
  const int n =
      TouchGrain(view, w.grains[i], evaluate, SurfaceOf{b.body.shape},
                 &slots.key[k * slots.per_grain], &slots.words[k * slots.per_grain * view.words],
                 &slots.clear[k], &w.loads[i], record, &sums.tunnelled);
  for (int s = 0; s < n; ++s) {
    const TouchRecord& r = record[s];
    sums.energy.Add(r.energy);
    if (!r.active) continue;
    sums.wrench.Add(r.force, r.moment);
    if (!w.sink) continue;
    const Vec3f arm = view.body.Relative(w.grains[i]) - r.point;
    const float lever = std::sqrt(Dot(arm, arm));
    w.sink({number, r.point, (1 / lever) * arm, r.force, r.key, r.rim, i, lever});
  }
}

void BodyPass::Forces(SimulationState& w) {
  std::vector<Sums> sums;
  for (std::size_t number = 0; number < w.bodies.size(); ++number) {
    BodyEntry& b = w.bodies[number];
    const TouchView view = TouchViewOf(w.config, w.params, w.range, w.list.words(), b);
    // Summed run by run, whatever the threads; a recorder is called by one.
    const std::size_t near = b.slots.near.size(), runs = (near + kRun - 1) / kRun;
    sums.assign(runs, Sums{});
    const auto touch = [&](std::size_t from, std::size_t to) {
      for (std::size_t r = from; r < to; ++r) {
        for (std::size_t k = r * kRun; k < std::min(near, (r + 1) * kRun); ++k) {
          TouchEntry(w, b, static_cast<int>(number), view, k, sums[r]);
        }
      }
    };
    const std::size_t size = w.sink ? 1 : static_cast<std::size_t>(w.team.size());
    if (size == 1 || runs < 2 * size) {
      touch(0, runs);
    } else {
      w.team.Run([&](int part) { touch(runs * part / size, runs * (part + 1) / size); });
    }
    const Wrench before = b.wrench;
    b.wrench = Wrench{};
    for (const Sums& s : sums) {
      b.wrench.Add(s.wrench);
      if (w.config.energy) w.step_energy.Add(s.energy);
      if (s.tunnelled) w.fault = StepFault::kTunnelled;
    }
    BookWork(b.body, w.config.dt_s, before, &b);
  }
}

namespace {

/// fn(grain, surface point, contact point from the body's origin, lever, result) for each active
/// contact of a body, at the present positions and histories.
template <class Fn>
void VisitTouches(const SimulationState& w, const BodyEntry& b, const Fn& fn) {
  const int words = w.list.words();
  float word[kMaxHistoryWords];
  const TouchView view = TouchViewOf(w.config, w.params, w.range, words, b);
  for (std::size_t k = 0; k < b.slots.near.size(); ++k) {
    const Grain& g = w.grains[b.slots.near[k]];
    if (g.kind & kFrozen) continue;
    const Touching t(view, g, SurfaceOf{b.body.shape});
    for (int s = 0; s < t.n; ++s) {
      // The words of this point's key, wherever they lie.
      for (int n = 0; n < b.slots.per_grain; ++n) {
        const std::size_t slot = k * b.slots.per_grain + n;
        if (b.slots.key[slot] != t.at[s].key) continue;
        std::copy_n(&b.slots.words[slot * words], words, word);
        Vec3f point;
        float lever;
        const PairParams& p =
            w.params[MaterialOf(g) * w.config.contacts.materials() + b.body.material];
        const ContactGeometry c = t.Geometry(view, g, s, &point, &lever);
        const ContactResult r = w.contact(w.config, p, c, word, 0.0f);
        if (r.active) fn(b.slots.near[k], t.at[s], point, lever, r);
      }
    }
  }
}

}  // namespace

double BodyPass::Stored(const SimulationState& w) {
  double sum = 0;
  for (const BodyEntry& b : w.bodies) {
    VisitTouches(w, b,
                 [&](std::int32_t, const SurfacePoint&, Vec3f, float, const ContactResult& r) {
                   sum += r.stored;
                 });
  }
  return sum;
}

std::vector<BodyContact> BodyPass::ContactsOf(const SimulationState& w, int number) {
  std::vector<BodyContact> out;
  VisitTouches(
      w, w.bodies.at(number),
      [&](std::int32_t grain, const SurfacePoint& at, Vec3f point, float lever,
          const ContactResult& r) {
        out.push_back({number, point, at.normal, -1.0f * r.force, at.key, at.rim, grain, lever});
      });
  return out;
}

}  // namespace grouser::dem

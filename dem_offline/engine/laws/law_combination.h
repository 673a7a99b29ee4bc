#pragma once

#include "dem_offline/engine/laws/law.h"
#include "dem_offline/engine/laws/law_list.h"

namespace grouser::dem {

/// One step of one contact. History words of a contact: k_old, then those of
/// the normal, tangential, rolling and cohesion law.
struct ContactResult {
  bool active;           ///< false: nothing there; forces and history are zero
  Vec3f force;           ///< on i, at the contact [N]
  Vec3f moment;          ///< rolling moment on i [N m]
  float stored;          ///< recoverable energy [J]
  float normal_damping;  ///< dissipated in this step [J]
  float tangent_damping;
  float slip;
  float rolling;
  float plastic;
  float cohesion;
};

/// What the four laws of a contact said, put together.
GROUSER_HD ContactResult Together(const NormalTerms& normal, const CohesionTerms& bond,
                                  const TangentialTerms& tangent, const RollingTerms& roll, Vec3f n,
                                  float dt) {
  ContactResult out;
  out.active = bond.active;
  out.force = normal.force * n + tangent.force;
  out.moment = roll.moment;
  out.stored = normal.stored + tangent.stored + roll.stored;
  out.normal_damping = normal.damping_power * dt;
  out.tangent_damping = tangent.damping_power * dt;
  out.slip = tangent.slip_work;
  out.rolling = roll.loss;
  out.plastic = normal.plastic;
  out.cohesion = bond.loss;
  return out;
}

/// One legal combination of laws, evaluated as one function.
template <class N, class T, class R, class C>
struct LawCombination {
  using Normal = N;
  using Tangential = T;
  using Rolling = R;
  using Cohesion = C;
  static constexpr int kN = 1, kT = kN + kWordsOf<N>, kR = kT + kWordsOf<T>, kC = kR + kWordsOf<R>,
                       kWords = kC + kWordsOf<C>;
  static constexpr bool kHasRange = C::kHasRange;
  static constexpr bool kOwnSides = R::kOwnSides;

  struct Params {
    typename N::Params normal;
    typename T::Params tangential;
    typename R::Params rolling;
    typename C::Params cohesion;
  };
  template <class All>
  static GROUSER_HD Params From(const All& all) {
    return {ParamsOf<N>(all), ParamsOf<T>(all), ParamsOf<R>(all), ParamsOf<C>(all)};
  }

  /// words: in and out; zero for a new contact. g.k_old is set here.
  static GROUSER_HD ContactResult Evaluate(const Params& p, ContactGeometry g, float* words,
                                           float dt) {
    g.k_old = words[0];
    typename N::History hn = FromWords<typename N::History, kWordsOf<N>>(words + kN);
    typename T::History ht = FromWords<typename T::History, kWordsOf<T>>(words + kT);
    typename R::History hr = FromWords<typename R::History, kWordsOf<R>>(words + kR);
    typename C::History hc = FromWords<typename C::History, kWordsOf<C>>(words + kC);
    const float v_n = Dot(g.v_rel, g.n);
    const bool pressed = !kHasRange || g.overlap > 0.0f;
    ContactGeometry pressed_g = g;
    if (kHasRange) pressed_g.overlap = pressed ? g.overlap : 1e-12f;
    NormalTerms normal = N::Evaluate(p.normal, pressed_g, -v_n, hn, dt);
    if (kHasRange && !pressed) {
      normal = NormalTerms{0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
      hn = typename N::History{};
    }
    const CohesionTerms bond = C::Evaluate(p.cohesion, g, normal, hc, dt);
    const TangentialTerms tangent =
        T::Evaluate(p.tangential, g, g.v_rel - v_n * g.n, normal, ht, dt);
    const Vec3f w_t = g.w_rel - Dot(g.w_rel, g.n) * g.n;
    const RollingTerms roll = R::Evaluate(p.rolling, g, w_t, normal, hr, dt);
    words[0] = normal.stiffness;
    ToWords<kWordsOf<N>>(hn, words + kN);
    ToWords<kWordsOf<T>>(ht, words + kT);
    ToWords<kWordsOf<R>>(hr, words + kR);
    ToWords<kWordsOf<C>>(hc, words + kC);
    return Together(normal, bond, tangent, roll, g.n, dt);
  }
};

}  // namespace grouser::dem

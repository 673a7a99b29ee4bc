#pragma once

#include "dem_offline/engine/laws/law_registry.h"

namespace grouser::dem {

/// History words of a choice: the same layout as the combination of these laws. Of a world whose
/// pairs of materials have different laws: each slot as wide as the widest of them.
struct WordLayout {
  int n = 1, t = 1, r = 1, c = 1, words = 1;
  unsigned vector_words = 0;  ///< bit w: word w changes its sign where the two sides swap
};
GROUSER_HD WordLayout LayoutOf(const LawChoice& laws) {
  WordLayout out;
  int size = 0;
  unsigned odd = 0;
  NormalLaws::Visit(laws.normal, [&](auto law) {
    size = kWordsOf<decltype(law)>;
    odd = VectorWordsOf<decltype(law)>();
  });
  out.vector_words |= odd << out.n;
  out.t = out.n + size;
  TangentialLaws::Visit(laws.tangential, [&](auto law) {
    size = kWordsOf<decltype(law)>;
    odd = VectorWordsOf<decltype(law)>();
  });
  out.vector_words |= odd << out.t;
  out.r = out.t + size;
  RollingLaws::Visit(laws.rolling, [&](auto law) {
    size = kWordsOf<decltype(law)>;
    odd = VectorWordsOf<decltype(law)>();
  });
  out.vector_words |= odd << out.r;
  out.c = out.r + size;
  CohesionLaws::Visit(laws.cohesion, [&](auto law) {
    size = kWordsOf<decltype(law)>;
    odd = VectorWordsOf<decltype(law)>();
  });
  out.vector_words |= odd << out.c;
  out.words = out.c + size;
  return out;
}

/// Does the rolling law want each side evaluated by itself?
GROUSER_HD bool OwnSidesOf(const LawChoice& laws) {
  bool out = false;
  RollingLaws::Visit(laws.rolling, [&](auto law) { out = decltype(law)::kOwnSides; });
  return out;
}

/// Any legal combination, chosen at run time by the pair: the same steps in the same order
/// as LawCombination::Evaluate (a test holds the two equal to the bit).
GROUSER_HD ContactResult EvaluateGeneric(const WordLayout& at, const PairParams& p,
                                         ContactGeometry g, float* words, float dt) {
  const LawChoice& laws = p.laws;
  g.k_old = words[0];
  const float v_n = Dot(g.v_rel, g.n);
  const bool pressed = g.overlap > 0.0f;
  ContactGeometry pressed_g = g;
  if (!pressed) pressed_g.overlap = 1e-12f;
  NormalTerms normal = {};
  NormalLaws::Visit(laws.normal, [&](auto law) {
    using Law = decltype(law);
    auto h = FromWords<typename Law::History, kWordsOf<Law>>(words + at.n);
    normal = Law::Evaluate(ParamsOf<Law>(p), pressed_g, -v_n, h, dt);
    if (!pressed) h = typename Law::History{};
    ToWords<kWordsOf<Law>>(h, words + at.n);
  });
  if (!pressed) normal = NormalTerms{0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
  CohesionTerms bond = {};
  CohesionLaws::Visit(laws.cohesion, [&](auto law) {
    using Law = decltype(law);
    auto h = FromWords<typename Law::History, kWordsOf<Law>>(words + at.c);
    bond = Law::Evaluate(ParamsOf<Law>(p), g, normal, h, dt);
    ToWords<kWordsOf<Law>>(h, words + at.c);
  });
  TangentialTerms tangent = {};
  TangentialLaws::Visit(laws.tangential, [&](auto law) {
    using Law = decltype(law);
    auto h = FromWords<typename Law::History, kWordsOf<Law>>(words + at.t);
    tangent = Law::Evaluate(ParamsOf<Law>(p), g, g.v_rel - v_n * g.n, normal, h, dt);
    ToWords<kWordsOf<Law>>(h, words + at.t);
  });
  RollingTerms roll = {};
  RollingLaws::Visit(laws.rolling, [&](auto law) {
    using Law = decltype(law);
    auto h = FromWords<typename Law::History, kWordsOf<Law>>(words + at.r);
    const Vec3f w_t = g.w_rel - Dot(g.w_rel, g.n) * g.n;
    roll = Law::Evaluate(ParamsOf<Law>(p), g, w_t, normal, h, dt);
    ToWords<kWordsOf<Law>>(h, words + at.r);
  });
  words[0] = normal.stiffness;
  return Together(normal, bond, tangent, roll, g.n, dt);
}

}  // namespace grouser::dem

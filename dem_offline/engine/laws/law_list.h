#pragma once

#include <type_traits>

#include "dem_offline/engine/core/vec3.h"

// Lists of types and what they need at compile time. No law is named here.

namespace grouser::dem {

template <class Law>
struct ParamsSlot {
  typename Law::Params value;
};
template <class Law>
struct SettingsSlot {
  typename Law::Settings value;
};

/// Words of a law's history: 0 for an empty struct.
template <class Law>
inline constexpr int kWordsOf = std::is_empty<typename Law::History>::value
                                    ? 0
                                    : static_cast<int>(sizeof(typename Law::History) / 4);

/// Bits of the words that change their sign where the two sides swap.
template <class Law>
GROUSER_HD constexpr unsigned VectorWordsOf() {
  if constexpr (kWordsOf < Law >> 0) {
    return Law::kVectorWords;
  } else {
    return 0u;
  }
}

/// Bits of the words that keep theirs.
template <class Law>
constexpr unsigned ScalarWordsOf() {
  return ((1u << kWordsOf<Law>)-1) & ~VectorWordsOf<Law>();
}

GROUSER_HD constexpr int Largest(int a) { return a; }
template <class... More>
GROUSER_HD constexpr int Largest(int a, int b, More... more) {
  return Largest(a > b ? a : b, more...);
}

template <class... Laws>
struct LawList {
  static constexpr int kSize = sizeof...(Laws);
  static constexpr int kMostWords = Largest(kWordsOf<Laws>...);
  /// Is no word a vector's in one law and a scalar in another? Then one list of pairs may hold
  /// histories of all of them.
  static constexpr bool kWordsAgree =
      ((VectorWordsOf<Laws>() | ...) & (ScalarWordsOf<Laws>() | ...)) == 0;

  struct Params : ParamsSlot<Laws>... {};
  struct Settings : SettingsSlot<Laws>... {};

  /// f(Law{}) for the law of this number.
  template <class F>
  static GROUSER_HD void Visit(int index, F&& f) {
    int at = 0;
    ((at++ == index ? f(Laws{}) : void()), ...);
  }
  template <class F>
  static void ForEach(F&& f) {
    (f(Laws{}), ...);
  }
  /// Number of a law in the list; -1: not in it.
  template <class Law>
  static constexpr int IndexOf() {
    int at = 0, found = -1;
    ((std::is_same<Law, Laws>::value ? void(found = at++) : void(at++)), ...);
    return found;
  }
};

template <class Law, class P>
GROUSER_HD const typename Law::Params& ParamsOf(const P& all) {
  return static_cast<const ParamsSlot<Law>&>(all).value;
}
template <class Law, class P>
GROUSER_HD typename Law::Params& ParamsOf(P& all) {
  return static_cast<ParamsSlot<Law>&>(all).value;
}

/// A law's history out of, and into, its words. k: first word.
template <class History, int kWords>
GROUSER_HD History FromWords(const float* words) {
  History h{};
  if constexpr (kWords > 0) __builtin_memcpy(&h, words, sizeof(float) * kWords);
  return h;
}
template <int kWords, class History>
GROUSER_HD void ToWords(const History& h, float* words) {
  if constexpr (kWords > 0) __builtin_memcpy(words, &h, sizeof(float) * kWords);
}

}  // namespace grouser::dem

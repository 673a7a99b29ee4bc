#pragma once

#include "dem_offline/engine/laws/cohesion_capillary.h"
#include "dem_offline/engine/laws/cohesion_jkr.h"
#include "dem_offline/engine/laws/cohesion_jkr_added.h"
#include "dem_offline/engine/laws/law_combination.h"
#include "dem_offline/engine/laws/none.h"
#include "dem_offline/engine/laws/normal_elasto_plastic.h"
#include "dem_offline/engine/laws/normal_hertz.h"
#include "dem_offline/engine/laws/normal_hertz_dashpot.h"
#include "dem_offline/engine/laws/normal_linear.h"
#include "dem_offline/engine/laws/normal_oden_martins.h"
#include "dem_offline/engine/laws/normal_walton_braun.h"
#include "dem_offline/engine/laws/rolling_constant.h"
#include "dem_offline/engine/laws/rolling_epsd.h"
#include "dem_offline/engine/laws/rolling_own_spin.h"
#include "dem_offline/engine/laws/tangential_deresiewicz.h"
#include "dem_offline/engine/laws/tangential_displacement.h"
#include "dem_offline/engine/laws/tangential_kelvin.h"
#include "dem_offline/engine/laws/tangential_linear.h"
#include "dem_offline/engine/laws/tangential_mindlin.h"

// The law registry: every law, and the combinations that are compiled. A new law is
// a header, its name in one list here (and in a combination if it is to be fast),
// and a test: docs/engine.md, "A new law".

namespace grouser::dem {

using NormalLaws = LawList<HertzRestitution, LinearSpring, HertzOdenMartins, ElastoPlastic,
                           WaltonBraun, HertzDashpot>;
using TangentialLaws = LawList<MindlinRescaled, LinearHistory, MindlinDisplacement,
                               MindlinDeresiewicz, KelvinRegularised>;
using RollingLaws = LawList<RollingNone, RollingEpsd, RollingConstant, RollingOwnSpin>;
using CohesionLaws = LawList<CohesionNone, Jkr, JkrAdded, Capillary>;

/// The default: sand.
using HertzMindlinEpsd =
    LawCombination<HertzRestitution, MindlinRescaled, RollingEpsd, CohesionNone>;
using HertzMindlin = LawCombination<HertzRestitution, MindlinRescaled, RollingNone, CohesionNone>;
/// As most codes ship it: with a directional constant torque.
using HertzMindlinTorque =
    LawCombination<HertzRestitution, MindlinRescaled, RollingConstant, CohesionNone>;
/// The default as LIGGGHTS computes its tangential spring: what is compared with it.
using HertzMindlinPeer =
    LawCombination<HertzRestitution, MindlinDisplacement, RollingEpsd, CohesionNone>;
// Those of dem_offline/reproduce (five times faster than the generic path): Shin et al. 2020 with
// adhesion; ATV wheel in LS-DYNA; annular shear cell of McCarthy et al. 2010 with its plastic law,
// its damper, its linear friction; 2-D grouser wheel.
using WheelTestbed = LawCombination<HertzRestitution, MindlinRescaled, RollingEpsd, JkrAdded>;
using WheelTestbedJkr = LawCombination<HertzRestitution, MindlinRescaled, RollingEpsd, Jkr>;
using AtvWheel = LawCombination<LinearSpring, LinearHistory, RollingConstant, CohesionNone>;
using ShearCell = LawCombination<ElastoPlastic, MindlinDeresiewicz, RollingOwnSpin, CohesionNone>;
using ShearCellDamper =
    LawCombination<HertzOdenMartins, MindlinDeresiewicz, RollingOwnSpin, CohesionNone>;
using ShearCellLinear = LawCombination<ElastoPlastic, LinearHistory, RollingOwnSpin, CohesionNone>;
using GrouserWheel = LawCombination<HertzRestitution, KelvinRegularised, RollingEpsd, CohesionNone>;

template <class... R>
struct CombinationList {
  static constexpr int kSize = sizeof...(R);
};
/// Compiled and vectorised for each instruction set; named in
/// CombinationName. The first is the default.
using CompiledCombinations =
    CombinationList<HertzMindlinEpsd, HertzMindlin, HertzMindlinTorque, WheelTestbed,
                    WheelTestbedJkr, AtvWheel, ShearCell, ShearCellDamper, ShearCellLinear,
                    GrouserWheel, HertzMindlinPeer>;

static_assert(NormalLaws::kWordsAgree && TangentialLaws::kWordsAgree && RollingLaws::kWordsAgree &&
                  CohesionLaws::kWordsAgree,
              "pairs of materials have laws of their own and one layout of history words");

/// Numbers of the chosen laws in their lists.
struct LawChoice {
  int normal = 0, tangential = 0, rolling = 0, cohesion = 0;
  bool operator==(const LawChoice& o) const {
    return normal == o.normal && tangential == o.tangential && rolling == o.rolling &&
           cohesion == o.cohesion;
  }
};

/// Laws of one pair of materials and their parameters (those of all other laws stay zero).
struct PairParams : NormalLaws::Params,
                    TangentialLaws::Params,
                    RollingLaws::Params,
                    CohesionLaws::Params {
  LawChoice laws;
};
/// Settings that belong to single laws; defaults where not touched.
struct LawSettings : NormalLaws::Settings,
                     TangentialLaws::Settings,
                     RollingLaws::Settings,
                     CohesionLaws::Settings {};

template <class Law>
typename Law::Settings& SettingsOf(LawSettings& all) {
  return static_cast<SettingsSlot<Law>&>(all).value;
}
template <class Law>
const typename Law::Settings& SettingsOf(const LawSettings& all) {
  return static_cast<const SettingsSlot<Law>&>(all).value;
}

template <class R>
constexpr LawChoice ChoiceOf() {
  return {
      NormalLaws::IndexOf<typename R::Normal>(), TangentialLaws::IndexOf<typename R::Tangential>(),
      RollingLaws::IndexOf<typename R::Rolling>(), CohesionLaws::IndexOf<typename R::Cohesion>()};
}
template <class N, class T, class R, class C>
constexpr LawChoice ChoiceOfLaws() {
  return ChoiceOf<LawCombination<N, T, R, C>>();
}

inline constexpr int kMaxHistoryWords = 1 + NormalLaws::kMostWords + TangentialLaws::kMostWords +
                                        RollingLaws::kMostWords + CohesionLaws::kMostWords;

}  // namespace grouser::dem

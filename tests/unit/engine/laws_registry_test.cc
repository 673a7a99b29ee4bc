// The registry as a whole: combinations against the generic path, the two sides of a
// contact, refusals, extremes.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>

#include "dem_offline/engine/laws/settings.h"
#include "tests/unit/engine/laws_driver.h"

namespace grouser::dem {
namespace {

constexpr float kDt = 1e-6f;

/// Two materials whose laws all do something.
ContactModel Model(const LawChoice& laws) {
  ContactModel model(laws);
  model.AddMaterial({1e8, 0.3});
  model.AddMaterial({5e8, 0.2});
  ContactProperties f;
  f.rolling_friction = 0.2;
  f.surface_energy_j_per_m2 = 0.2;
  LawSettings s;
  SettingsOf<ElastoPlastic>(s).yield_force_n = 0.5;
  SettingsOf<HertzOdenMartins>(s).damping_kg_per_m_s = 1e4;
  SettingsOf<LinearHistory>(s).critical_damping_share = 0.3;
  SettingsOf<KelvinRegularised>(s).stick_friction = 0.6;
  for (int i = 0; i < 2; ++i) model.SetContactProperties(i, 1, f, s);
  model.SetContactProperties(0, 0, f, s);
  return model;
}

/// A contact that is pressed, sheared, turned and let go at random.
class Walk {
 public:
  explicit Walk(int seed) : random_(seed) {
    g = {};
    g.n = Unit();
    g.overlap = 2e-5f * (1 + U());
    g.r_own = 2e-3f * (1.5f + U());
    g.r_other = 2e-3f * (1.5f + U());
    g.r_eff = g.r_own * g.r_other / (g.r_own + g.r_other);
    g.m_own = 1e-4f * (1.5f + U());
    g.m_eff = 0.4f * g.m_own;
    g.roll_inertia = 1e-9f;
  }
  void Next() {
    g.overlap += 3e-6f * U();
    if (g.overlap > 5e-5f || g.overlap < -5e-6f) g.overlap = 1e-6f;
    const Vec3f n = g.n + 0.01f * Unit();
    g.n = (1 / std::sqrt(Dot(n, n))) * n;
    g.v_rel = {0.3f * U(), 0.3f * U(), 0.3f * U()};
    g.w_rel = {30 * U(), 30 * U(), 30 * U()};
    g.w_own = {30 * U(), 30 * U(), 30 * U()};
  }
  ContactGeometry OtherSide() const {
    ContactGeometry o = g;
    o.n = -1.0f * g.n;
    o.v_rel = -1.0f * g.v_rel;
    o.w_rel = -1.0f * g.w_rel;
    o.r_own = g.r_other;
    o.r_other = g.r_own;
    o.m_own = 2 * g.m_own;
    return o;
  }
  ContactGeometry g;

 private:
  float U() { return std::uniform_real_distribution<float>(-1, 1)(random_); }
  Vec3f Unit() {
    const Vec3f a = {U(), U(), U() + 1.5f};
    return (1 / std::sqrt(Dot(a, a))) * a;
  }
  std::mt19937 random_;
};

bool SameBits(const ContactResult& a, const ContactResult& b) {
  const auto same = [](float x, float y) { return std::memcmp(&x, &y, 4) == 0; };
  return a.active == b.active && same(a.force.x, b.force.x) && same(a.force.y, b.force.y) &&
         same(a.force.z, b.force.z) && same(a.moment.x, b.moment.x) &&
         same(a.moment.y, b.moment.y) && same(a.moment.z, b.moment.z) && same(a.stored, b.stored) &&
         same(a.normal_damping, b.normal_damping) && same(a.tangent_damping, b.tangent_damping) &&
         same(a.slip, b.slip) && same(a.rolling, b.rolling) && same(a.plastic, b.plastic) &&
         same(a.cohesion, b.cohesion);
}

template <class R>
void CombinationEqualsGeneric(int number) {
  const LawChoice laws = ChoiceOf<R>();
  const ContactModel model = Model(laws);
  EXPECT_EQ(model.combination(), number);
  const WordLayout at = LayoutOf(laws);
  ASSERT_EQ(at.words, R::kWords);
  const PairParams params = model.Table()[1];
  const typename R::Params own = R::From(params);
  int active = 0;
  for (int seed = 0; seed < 100; ++seed) {
    Walk walk(seed);
    float a[kMaxHistoryWords] = {}, b[kMaxHistoryWords] = {};
    for (int step = 0; step < 200; ++step) {
      walk.Next();
      if (!R::kHasRange) walk.g.overlap = std::max(walk.g.overlap, 1e-9f);
      const ContactResult x = R::Evaluate(own, walk.g, a, kDt);
      const ContactResult y = EvaluateGeneric(at, params, walk.g, b, kDt);
      ASSERT_TRUE(SameBits(x, y)) << CombinationName(number) << " seed " << seed << " step "
                                  << step;
      ASSERT_EQ(std::memcmp(a, b, sizeof(a)), 0) << CombinationName(number);
      active += x.active;
    }
  }
  EXPECT_GT(active, 10000);
}

template <class... R>
void AllCombinationsEqualGeneric(CombinationList<R...>) {
  int number = 0;
  (CombinationEqualsGeneric<R>(number++), ...);
}

TEST(LawRegistry, EveryCombinationEqualsTheGenericPathToTheBit) {
  AllCombinationsEqualGeneric(CompiledCombinations{});
}

/// Combinations beyond those compiled, with range, hold to the same.
TEST(LawRegistry, CombinationsWithRangeEqualTheGenericPathToTheBit) {
  CombinationEqualsGeneric<LawCombination<HertzRestitution, MindlinRescaled, RollingNone, Jkr>>(-1);
  CombinationEqualsGeneric<LawCombination<WaltonBraun, LinearHistory, RollingConstant, Capillary>>(
      -1);
  CombinationEqualsGeneric<
      LawCombination<ElastoPlastic, MindlinDeresiewicz, RollingEpsd, Capillary>>(-1);
}

/// f(laws) for each combination of the registry.
template <class F>
void ForEachChoice(F&& f) {
  for (int n = 0; n < NormalLaws::kSize; ++n) {
    for (int t = 0; t < TangentialLaws::kSize; ++t) {
      for (int r = 0; r < RollingLaws::kSize; ++r) {
        for (int c = 0; c < CohesionLaws::kSize; ++c) f(LawChoice{n, t, r, c});
      }
    }
  }
}

bool Mirrored(Vec3f a, Vec3f b) { return a.x == -b.x && a.y == -b.y && a.z == -b.z; }

TEST(LawRegistry, BothSidesOfAContactAgreeToTheBit) {
  const int own_spin = RollingLaws::IndexOf<RollingOwnSpin>();
  int legal = 0;
  ForEachChoice([&](const LawChoice& laws) {
    if (!WhyIllegal(laws).empty()) return;
    ++legal;
    const auto table = Model(laws).Table();
    const WordLayout at = LayoutOf(laws);
    for (int seed = 0; seed < 3; ++seed) {
      Walk walk(seed);
      float mine[kMaxHistoryWords] = {}, theirs[kMaxHistoryWords] = {};
      for (int step = 0; step < 100; ++step) {
        walk.Next();
        const ContactResult i = EvaluateGeneric(at, table[1], walk.g, mine, kDt);
        const ContactResult j = EvaluateGeneric(at, table[2], walk.OtherSide(), theirs, kDt);
        ASSERT_EQ(i.active, j.active);
        ASSERT_TRUE(Mirrored(i.force, j.force)) << Describe(laws);
        ASSERT_EQ(i.stored, j.stored) << Describe(laws);
        ASSERT_EQ(i.slip, j.slip) << Describe(laws);
        ASSERT_EQ(i.normal_damping + i.tangent_damping + i.plastic + i.cohesion,
                  j.normal_damping + j.tangent_damping + j.plastic + j.cohesion);
        if (laws.rolling != own_spin) {
          ASSERT_TRUE(Mirrored(i.moment, j.moment)) << Describe(laws);
          ASSERT_EQ(i.rolling, j.rolling) << Describe(laws);
        }
      }
    }
  });
  EXPECT_GT(legal, 150);
}

TEST(LawRegistry, FiniteFromAPicometreToNearTheRadius) {
  ForEachChoice([&](const LawChoice& laws) {
    if (!WhyIllegal(laws).empty()) return;
    const auto params = Model(laws).Table()[1];
    const WordLayout at = LayoutOf(laws);
    for (const float start : {1e-12f, 1e-6f, 0.9f * 2e-3f}) {
      for (const float speed : {0.0f, 1e-6f, 50.0f}) {
        Walk walk(1);
        walk.g.v_rel = {speed, -speed, -speed};
        walk.g.w_rel = walk.g.w_own = {speed, 0.0f, 0.0f};
        float words[kMaxHistoryWords] = {};
        for (const float share : {1.0f, 0.5f, 1e-3f, 1.0f, -1e-6f, 1.0f}) {
          walk.g.overlap = share > 0 ? std::max(share * start, 1e-12f) : share * 1e-3f;
          const ContactResult r = EvaluateGeneric(at, params, walk.g, words, kDt);
          const float sum = r.force.x + r.force.y + r.force.z + r.moment.x + r.moment.y +
                            r.moment.z + r.stored + r.normal_damping + r.tangent_damping + r.slip +
                            r.rolling + r.plastic + r.cohesion;
          ASSERT_TRUE(std::isfinite(sum)) << Describe(laws) << " overlap " << walk.g.overlap;
          for (int w = 0; w < at.words; ++w) ASSERT_TRUE(std::isfinite(words[w])) << Describe(laws);
        }
      }
    }
  });
}

TEST(LawRegistry, IllegalCombinationsAreRefusedByName) {
  const struct {
    const char *normal, *tangential, *cohesion, *named, *why;
  } rows[] = {
      {"linear_spring", "mindlin", "none", "'mindlin'", "Hertzian contact radius"},
      {"walton_braun", "mindlin_deresiewicz", "none", "'mindlin_deresiewicz'", "contact radius"},
      {"walton_braun", "mindlin_displacement", "none", "'mindlin_displacement'", "radius"},
      {"elasto_plastic", "linear_history", "jkr", "'jkr'", "exactly Hertz"},
      {"linear_spring", "linear_history", "jkr_added", "'jkr_added'", "exactly Hertz"},
  };
  for (const auto& row : rows) {
    const LawChoice laws = LawsByName(row.normal, row.tangential, "none", row.cohesion);
    try {
      ContactModel model(laws);
      ADD_FAILURE() << Describe(laws) << " was accepted";
    } catch (const std::invalid_argument& e) {
      const std::string what = e.what();
      EXPECT_NE(what.find(row.named), std::string::npos) << what;
      EXPECT_NE(what.find(row.why), std::string::npos) << what;
      EXPECT_NE(what.find(row.normal), std::string::npos) << what;
    }
  }
  EXPECT_EQ(
      WhyIllegal(LawsByName("elasto_plastic", "mindlin_deresiewicz", "own_spin", "capillary")), "");
  EXPECT_THROW(LawsByName("hertz", "mindlin", "none", "none"), std::invalid_argument);
}

/// What the model says when one setting or number is wrong.
std::string Refusal(const Pairing& s) {
  try {
    Contact c(s);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "accepted";
}

TEST(LawRegistry, BadSettingsAreRefusedByName) {
  const auto refuses = [](const char* field, const Pairing& s) {
    EXPECT_NE(Refusal(s).find(field), std::string::npos) << field << ": " << Refusal(s);
  };
  Pairing s;
  s.normal = "elasto_plastic";
  SettingsOf<ElastoPlastic>(s.settings).yield_force_n = 0;
  refuses("yield_force_n", s);
  s = Pairing{};
  s.normal = "walton_braun";
  s.tangential = "linear_history";
  SettingsOf<WaltonBraun>(s.settings).unloading_stiffness_n_per_m = 1;
  refuses("unloading_stiffness_n_per_m", s);
  s.normal = "linear_spring";
  SettingsOf<LinearSpring>(s.settings).normk = 0;
  refuses("normk", s);
  s.settings = {};
  s.a.poisson_ratio = s.b.poisson_ratio = 0.5;
  refuses("poisson_ratio", s);
  s = Pairing{};
  s.tangential = "kelvin_regularised";
  SettingsOf<KelvinRegularised>(s.settings).slide_friction = 0.9;
  refuses("slide_friction", s);
  s = Pairing{};
  s.cohesion = "capillary";
  SettingsOf<Capillary>(s.settings).contact_angle_rad = 2;
  refuses("contact_angle_rad", s);
  s = Pairing{};
  s.normal = "hertz_oden_martins";  // without its beta: a file of before engine 5
  refuses("since engine version 5", s);
  refuses("hertz_dashpot", s);
  SettingsOf<HertzOdenMartins>(s.settings).damping_kg_per_m_s = -1;
  refuses("damping_kg_per_m_s", s);
  s.normal = "hertz_dashpot";
  SettingsOf<HertzDashpot>(s.settings).damping_n_s_per_m = -1;
  refuses("damping_n_s_per_m", s);
}

// Two settings that say the same thing twice: neither wins, both are named.
TEST(LawRegistry, SettingsThatContradictAreRefused) {
  struct Both {
    const char *law, *a, *b;
  };
  for (const Both& both : {Both{"hertz_dashpot", "damping_n_s_per_m", "critical_damping_share"},
                           Both{"hertz_dashpot", "damping_n_s_per_m", "reference_overlap_share"},
                           Both{"linear_spring", "stiffness_n_per_m", "normk"}}) {
    const auto with = [&](double a, double b) {
      Pairing s;
      s.normal = both.law;
      s.tangential = "linear_history";
      Put(s.settings, {both.law, both.a, a});
      Put(s.settings, {both.law, both.b, b});
      return Refusal(s);
    };
    const std::string law = both.law;
    EXPECT_EQ(with(2, 0.1), law + "." + both.a + " and " + law + "." + both.b +
                                ": got both, expected one of them");
    EXPECT_EQ(with(2, -1), "accepted") << both.a;  // as where b is not given
    EXPECT_EQ(with(0, 0.1), "accepted") << both.b;
  }
}

TEST(LawRegistry, NamesAreUniqueAndTheDefaultIsFirst) {
  std::set<std::string> names;
  for (int r = 0; r < CompiledCombinations::kSize; ++r) names.insert(CombinationName(r));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(CompiledCombinations::kSize));
  EXPECT_STREQ(CombinationName(0), "hertz_mindlin_epsd");
  EXPECT_STREQ(CombinationName(-1), "generic");
  EXPECT_EQ(ContactModel().combination(), 0);
  names.clear();
  NormalLaws::ForEach([&](auto law) { names.insert(decltype(law)::kName); });
  TangentialLaws::ForEach([&](auto law) { names.insert(decltype(law)::kName); });
  EXPECT_EQ(names.size(), 11u);
}

}  // namespace
}  // namespace grouser::dem

#include "dem_offline/engine/laws/contact_model.h"

#include <algorithm>
#include <stdexcept>

namespace grouser::dem {
namespace {

template <class List>
int ByName(const char* slot, const std::string& name) {
  int at = 0, found = -1;
  std::string known;
  List::ForEach([&](auto law) {
    if (name == decltype(law)::kName) found = at;
    known += (at++ ? ", " : "") + std::string(decltype(law)::kName);
  });
  if (found < 0) {
    throw std::invalid_argument(std::string(slot) + " law: '" + name + "', expected one of " +
                                known);
  }
  return found;
}

template <class List>
std::string NameOf(int index) {
  std::string out = "?";
  List::Visit(index, [&](auto law) { out = decltype(law)::kName; });
  return out;
}

template <class List>
void MakeInto(int index, const Elastic& a, const Elastic& b, const ContactProperties& f,
              const LawSettings& settings, PairParams& out) {
  List::Visit(index, [&](auto law) {
    using Law = decltype(law);
    ParamsOf<Law>(static_cast<typename List::Params&>(out)) =
        Law::Make(a, b, f, SettingsOf<Law>(settings));
  });
}

/// Room for the histories of either.
WordLayout Join(const WordLayout& a, const WordLayout& b) {
  WordLayout out;
  const auto slot = [&](int WordLayout::*at, int WordLayout::*next) {
    for (const WordLayout* one : {&a, &b}) {
      const int width = one->*next - one->*at;
      out.vector_words |= (one->vector_words >> one->*at & ((1u << width) - 1)) << out.*at;
      out.*next = std::max(out.*next, out.*at + width);
    }
  };
  slot(&WordLayout::n, &WordLayout::t);
  slot(&WordLayout::t, &WordLayout::r);
  slot(&WordLayout::r, &WordLayout::c);
  slot(&WordLayout::c, &WordLayout::words);
  return out;
}

template <class... R>
int CombinationOf(const LawChoice& laws, CombinationList<R...>) {
  int at = 0, found = -1;
  ((ChoiceOf<R>() == laws ? void(found = at++) : void(at++)), ...);
  return found;
}

}  // namespace

LawChoice LawsByName(const std::string& normal, const std::string& tangential,
                     const std::string& rolling, const std::string& cohesion) {
  return {ByName<NormalLaws>("normal", normal), ByName<TangentialLaws>("tangential", tangential),
          ByName<RollingLaws>("rolling", rolling), ByName<CohesionLaws>("cohesion", cohesion)};
}

std::string Describe(const LawChoice& laws) {
  return "normal=" + NameOf<NormalLaws>(laws.normal) +
         ", tangential=" + NameOf<TangentialLaws>(laws.tangential) +
         ", rolling=" + NameOf<RollingLaws>(laws.rolling) +
         ", cohesion=" + NameOf<CohesionLaws>(laws.cohesion);
}

const char* CombinationName(int combination) {
  static constexpr const char* kNames[] = {
      "hertz_mindlin_epsd", "hertz_mindlin", "hertz_mindlin_torque", "wheel_testbed",
      "wheel_testbed_jkr",  "atv_wheel",     "shear_cell",           "shear_cell_damper",
      "shear_cell_linear",  "grouser_wheel", "hertz_mindlin_peer"};
  static_assert(sizeof(kNames) / sizeof(kNames[0]) == CompiledCombinations::kSize,
                "a name for each combination");
  return combination >= 0 && combination < CompiledCombinations::kSize ? kNames[combination]
                                                                       : "generic";
}

std::string WhyIllegal(const LawChoice& laws) {
  unsigned provides = 0;
  std::string normal = NameOf<NormalLaws>(laws.normal), why;
  NormalLaws::Visit(laws.normal, [&](auto law) { provides = decltype(law)::kProvides; });
  const auto check = [&](const char* slot, const char* name, unsigned needs) {
    const unsigned missing = needs & ~provides;
    if (!missing) return;
    why += (why.empty() ? "" : "; ") + std::string(slot) + " law '" + name + "' needs " +
           (missing & kHertzElastic ? "an elastic part that is exactly Hertz"
                                    : "a Hertzian contact radius") +
           ", which normal law '" + normal + "' does not have";
  };
  TangentialLaws::Visit(laws.tangential, [&](auto law) {
    check("tangential", decltype(law)::kName, decltype(law)::kNeeds);
  });
  RollingLaws::Visit(laws.rolling, [&](auto law) {
    check("rolling", decltype(law)::kName, decltype(law)::kNeeds);
  });
  CohesionLaws::Visit(laws.cohesion, [&](auto law) {
    check("cohesion", decltype(law)::kName, decltype(law)::kNeeds);
  });
  return why;
}

const LawChoice& Legal(const LawChoice& laws) {
  const std::string why = WhyIllegal(laws);
  if (!why.empty()) throw std::invalid_argument("laws: " + why);
  return laws;
}

ContactModel::ContactModel(LawChoice laws) : laws_(Legal(laws)) {
  table_.resize(kMostMaterials * kMostMaterials);
  Arrange();
}

template <class F>
void ContactModel::ForEachPair(F&& f) const {
  for (const Entry& e : table_) {
    if (e.set) f(e.params);
  }
}

/// Words and path of the laws of all interfaces.
void ContactModel::Arrange() {
  std::optional<LawChoice> first;
  ForEachPair([&](const PairParams& p) {
    layout_ = first ? Join(layout_, LayoutOf(p.laws)) : LayoutOf(p.laws);
    if (!first) first = p.laws;
  });
  if (!first) layout_ = LayoutOf(first.emplace(laws_));
  combination_ = All(*first) ? CombinationOf(*first, CompiledCombinations{}) : -1;
}

bool ContactModel::All(const LawChoice& laws) const {
  bool all = true;
  ForEachPair([&](const PairParams& p) { all &= p.laws == laws; });
  return all;
}

bool ContactModel::SameLaws(const ContactModel& other) const {
  bool same = materials() == other.materials();
  for (std::size_t k = 0; k < table_.size(); ++k) {
    same &= table_[k].params.laws == other.table_[k].params.laws;
  }
  return same;
}

int ContactModel::AddMaterial(const Elastic& material) {
  Check(material);
  if (materials() >= kMostMaterials) {
    throw std::invalid_argument("materials: more than 16, expected at most 16");
  }
  materials_.push_back(material);
  return materials() - 1;
}

void ContactModel::SetContactProperties(int a, int b, const ContactProperties& f,
                                        const LawSettings& settings,
                                        const std::optional<LawChoice>& own) {
  Check(f);
  const LawChoice laws = Legal(own.value_or(laws_));
  for (const auto& [i, j] : {std::pair{a, b}, std::pair{b, a}}) {
    Entry& e = table_[i * kMostMaterials + j];
    const Elastic &mi = materials_.at(i), &mj = materials_.at(j);
    // Two rigid bodies never touch; bodies feel grains only.
    if (mi.youngs_modulus_pa == kRigid && mj.youngs_modulus_pa == kRigid) {
      throw std::invalid_argument("interface: both materials are rigid, expected one elastic");
    }
    e.params = {};
    e.params.laws = laws;
    MakeInto<NormalLaws>(laws.normal, mi, mj, f, settings, e.params);
    MakeInto<TangentialLaws>(laws.tangential, mi, mj, f, settings, e.params);
    MakeInto<RollingLaws>(laws.rolling, mi, mj, f, settings, e.params);
    MakeInto<CohesionLaws>(laws.cohesion, mi, mj, f, settings, e.params);
    e.set = true;
  }
  Arrange();
}

std::vector<PairParams> ContactModel::Table() const {
  std::vector<PairParams> out;
  for (int i = 0; i < materials(); ++i) {
    for (int j = 0; j < materials(); ++j) {
      const Entry& e = table_[i * kMostMaterials + j];
      const bool rigid =
          material(i).youngs_modulus_pa == kRigid && material(j).youngs_modulus_pa == kRigid;
      if (!e.set && !rigid) {
        throw std::invalid_argument("interface of materials " + std::to_string(i) + " and " +
                                    std::to_string(j) + ": not set");
      }
      out.push_back(e.params);
    }
  }
  return out;
}

double ContactModel::Range(double smallest, double largest) const {
  double range = 0;
  ForEachPair([&](const PairParams& p) {
    CohesionLaws::Visit(p.laws.cohesion, [&](auto law) {
      using Law = decltype(law);
      range = std::max(range, Law::Range(ParamsOf<Law>(p), smallest, largest));
    });
  });
  return range;
}

ContactSize PairOf(double overlap, double radius, double mass) {
  return {overlap, radius / 2, mass / 2, 0.7 * mass * radius * radius};
}
ContactSize AtBody(double overlap, double radius, double mass) {
  return {overlap, radius, mass, 1.4 * mass * radius * radius};
}

ContactBounds ContactModel::Bounds(int a, int b, const ContactSize& size) const {
  const PairParams& params = table_.at(a * kMostMaterials + b).params;
  const LawChoice& laws = params.laws;
  ContactBounds out;
  double secant = 0;
  NormalLaws::Visit(laws.normal, [&](auto law) {
    using Law = decltype(law);
    const auto& p = ParamsOf<Law>(params);
    out.normal = {Law::Stiffness(p, size.overlap_m, size.r_eff_m, size.m_eff_kg),
                  Law::Damping(p, size.overlap_m, size.r_eff_m, size.m_eff_kg)};
    secant = Law::kSecantShare;
  });
  CohesionLaws::Visit(laws.cohesion, [&](auto law) {
    using Law = decltype(law);
    out.normal.stiffness += Law::Stiffness(ParamsOf<Law>(params), size.overlap_m, size.r_eff_m);
  });
  secant *= out.normal.stiffness;
  TangentialLaws::Visit(laws.tangential, [&](auto law) {
    using Law = decltype(law);
    out.tangential = Law::Bounds(ParamsOf<Law>(params), secant, size.m_eff_kg);
  });
  RollingLaws::Visit(laws.rolling, [&](auto law) {
    using Law = decltype(law);
    out.rolling = Law::Bounds(ParamsOf<Law>(params), secant, size.r_eff_m, size.roll_inertia_kg_m2);
  });
  return out;
}

double ContactModel::StepShare() const {
  double share = 1;
  ForEachPair([&](const PairParams& p) {
    RollingLaws::Visit(p.laws.rolling,
                       [&](auto law) { share = std::min(share, decltype(law)::kStepShare); });
  });
  return share;
}

ContactBounds ContactModel::Bounds(const ContactSize& size) const {
  ContactBounds most;
  const auto raise = [](SpringBound& to, const SpringBound& by) {
    to = {std::max(to.stiffness, by.stiffness), std::max(to.damping, by.damping)};
  };
  for (int a = 0; a < materials(); ++a) {
    for (int b = a; b < materials(); ++b) {
      if (!has_contact_properties(a, b)) continue;
      const ContactBounds here = Bounds(a, b, size);
      raise(most.normal, here.normal);
      raise(most.tangential, here.tangential);
      raise(most.rolling, here.rolling);
    }
  }
  return most;
}

ContactModel OneMaterial(const Elastic& grains, const ContactProperties& f, LawChoice laws,
                         const LawSettings& settings) {
  ContactModel model(laws);
  const int grain = model.AddMaterial(grains);
  const int rigid = model.AddMaterial({kRigid, 0.0});
  model.SetContactProperties(grain, grain, f, settings);
  model.SetContactProperties(grain, rigid, f, settings);
  return model;
}

}  // namespace grouser::dem

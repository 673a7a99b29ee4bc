#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dem_offline/engine/laws/generic.h"

namespace grouser::dem {

/// Name of a law of a list, and back. Throws std::invalid_argument with the
/// slot, the name and the names there are.
LawChoice LawsByName(const std::string& normal, const std::string& tangential,
                     const std::string& rolling, const std::string& cohesion);
/// "normal=..., tangential=..., rolling=..., cohesion=..."
std::string Describe(const LawChoice& laws);
/// Empty if the laws may stand beside one another, else why not.
std::string WhyIllegal(const LawChoice& laws);
/// The same laws. Throws std::invalid_argument saying why they are illegal.
const LawChoice& Legal(const LawChoice& laws);

/// Name of a compiled law combination; "generic" for -1.
const char* CombinationName(int combination);

inline constexpr int kMostMaterials = 16;

/// A contact whose bounds are asked for: overlap and R* [m], m* [kg], reduced
/// 7/5 m R^2 [kg m^2].
struct ContactSize {
  double overlap_m, r_eff_m, m_eff_kg, roll_inertia_kg_m2;
};
/// Of two equal grains, and of a grain at a body.
ContactSize PairOf(double overlap_m, double radius_m, double mass_kg);
ContactSize AtBody(double overlap_m, double radius_m, double mass_kg);

/// Most that the laws of a contact put against motion, up to an overlap.
struct ContactBounds {
  SpringBound normal, tangential, rolling;
};

/// Materials, interfaces and laws of a world.
class ContactModel {
 public:
  /// laws: of the interfaces that have none of their own. Throws std::invalid_argument for an
  /// illegal choice, by name.
  explicit ContactModel(LawChoice laws = ChoiceOf<HertzMindlinEpsd>());

  /// Number of the new material (0, 1, ...). Throws as Check(Elastic) does.
  int AddMaterial(const Elastic& material);
  /// Interface of two materials, both ways round; own: its laws. Throws as the constructor and
  /// as the laws' Make do.
  void SetContactProperties(int a, int b, const ContactProperties& f,
                            const LawSettings& settings = {},
                            const std::optional<LawChoice>& own = {});

  /// Of a pair of materials whose interface is set.
  const LawChoice& laws(int a, int b) const { return table_[a * kMostMaterials + b].params.laws; }
  /// Have all interfaces these laws?
  bool All(const LawChoice& laws) const;
  /// Has the other as many materials, and each pair the same laws?
  bool SameLaws(const ContactModel& other) const;
  const WordLayout& layout() const { return layout_; }
  int materials() const { return static_cast<int>(materials_.size()); }
  const Elastic& material(int m) const { return materials_.at(m); }
  /// [materials x materials], row: grain i. Throws std::invalid_argument naming
  /// the pair whose interface is missing.
  std::vector<PairParams> Table() const;
  /// Furthest gap at which any pair acts [m].
  double Range(double smallest_radius_m, double largest_radius_m) const;
  /// What the laws of this pair of materials state.
  ContactBounds Bounds(int a, int b, const ContactSize& size) const;
  /// The largest of any pair of materials, bound by bound.
  ContactBounds Bounds(const ContactSize& size) const;
  /// kStepShare of the rolling laws, the least of them.
  double StepShare() const;
  bool has_contact_properties(int a, int b) const { return table_[a * kMostMaterials + b].set; }
  /// Number of the compiled combination of these laws; -1: the generic path, as wherever two
  /// pairs have different laws.
  int combination() const { return combination_; }

 private:
  template <class F>
  void ForEachPair(F&& f) const;  ///< f(params) of every interface that is set
  void Arrange();

  LawChoice laws_;
  WordLayout layout_;
  int combination_ = -1;
  std::vector<Elastic> materials_;
  struct Entry {
    bool set = false;
    PairParams params = {};
  };
  std::vector<Entry> table_;  ///< [kMost x kMost]
};

/// One material against itself and against a rigid one (number 1), both with
/// the same interface: the commonest world.
ContactModel OneMaterial(const Elastic& grains, const ContactProperties& f,
                         LawChoice laws = ChoiceOf<HertzMindlinEpsd>(),
                         const LawSettings& settings = {});

}  // namespace grouser::dem

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dem_offline/engine/laws/contact_model.h"

namespace grouser::dem {

/// A number that belongs to one law, as files name it.
struct NamedSetting {
  std::string law;   ///< e.g. "capillary"
  std::string name;  ///< e.g. "surface_tension_n_per_m"
  double value = 0;
};

/// Puts it where the law reads it. Throws std::invalid_argument naming the
/// laws, or the settings of the law, that there are.
void Put(LawSettings& settings, const NamedSetting& named);

/// Every law of the registry with its slot and its settings' defaults.
struct LawEntry {
  std::string slot, name;
  std::vector<NamedSetting> settings;
};
std::vector<LawEntry> LawRegistry();

/// Numbers of one interface of the grains where they differ from those of the
/// grains among themselves.
struct InterfaceChoice {
  std::optional<double> rolling_damping, surface_energy_j_per_m2;
  std::vector<NamedSetting> settings;
};

/// Laws of a soil by name, and the numbers they need beyond restitution,
/// friction and rolling friction: of the grains among themselves, and what
/// differs at the wheel and at the floor. The laws are the same at all of them.
struct ContactChoice {
  std::string normal = "hertz_restitution", tangential = "mindlin", rolling = "epsd",
              cohesion = "none";
  double rolling_damping = 0.3;        ///< eta of EPSD
  double surface_energy_j_per_m2 = 0;  ///< work of adhesion
  std::vector<NamedSetting> settings;
  InterfaceChoice wheel, floor;
};
/// Throw std::invalid_argument as LawsByName and Put do.
LawChoice LawsOf(const ContactChoice& choice);
/// Among the grains, or at an interface whose numbers differ as `here` says.
LawSettings SettingsOf(const ContactChoice& choice, const InterfaceChoice& here = {});
/// The same for the numbers that stand in the interface.
void PutInto(ContactProperties& f, const ContactChoice& choice, const InterfaceChoice& here = {});

}  // namespace grouser::dem

#include "dem_offline/engine/laws/settings.h"

#include <stdexcept>

namespace grouser::dem {
namespace {

/// f(slot, law) for every law of the registry.
template <class F>
void ForEachLaw(F&& f) {
  NormalLaws::ForEach([&](auto law) { f("normal", law); });
  TangentialLaws::ForEach([&](auto law) { f("tangential", law); });
  RollingLaws::ForEach([&](auto law) { f("rolling", law); });
  CohesionLaws::ForEach([&](auto law) { f("cohesion", law); });
}

}  // namespace

void Put(LawSettings& settings, const NamedSetting& named) {
  bool law_known = false, put = false;
  std::string laws, names;
  ForEachLaw([&](const char*, auto law) {
    using Law = decltype(law);
    const std::string name = Law::kName;
    if (name != "none") laws += (laws.empty() ? "" : ", ") + name;
    if (name != named.law) return;
    law_known = true;
    Law::Fields(SettingsOf<Law>(settings), [&](const char* field, auto& value) {
      names += (names.empty() ? "" : ", ") + std::string(field);
      if (named.name != field) return;
      value = static_cast<std::remove_reference_t<decltype(value)>>(named.value);
      put = true;
    });
  });
  if (!law_known) {
    throw std::invalid_argument("law '" + named.law + "': no such law, expected one of " + laws);
  }
  if (!put) {
    throw std::invalid_argument("setting '" + named.law + "." + named.name + "': not known, " +
                                (names.empty() ? "the law has none" : "expected one of " + names));
  }
}

std::vector<LawEntry> LawRegistry() {
  std::vector<LawEntry> out;
  LawSettings defaults;
  ForEachLaw([&](const char* slot, auto law) {
    using Law = decltype(law);
    LawEntry entry = {slot, Law::kName, {}};
    Law::Fields(SettingsOf<Law>(defaults), [&](const char* field, auto& value) {
      entry.settings.push_back({Law::kName, field, static_cast<double>(value)});
    });
    out.push_back(entry);
  });
  return out;
}

LawChoice LawsOf(const ContactChoice& c) {
  return Legal(LawsByName(c.normal, c.tangential, c.rolling, c.cohesion));
}

LawSettings SettingsOf(const ContactChoice& choice, const InterfaceChoice& here) {
  LawSettings out;
  for (const NamedSetting& s : choice.settings) Put(out, s);
  for (const NamedSetting& s : here.settings) Put(out, s);
  return out;
}

void PutInto(ContactProperties& f, const ContactChoice& choice, const InterfaceChoice& here) {
  f.rolling_damping = here.rolling_damping.value_or(choice.rolling_damping);
  f.surface_energy_j_per_m2 = here.surface_energy_j_per_m2.value_or(choice.surface_energy_j_per_m2);
}

}  // namespace grouser::dem

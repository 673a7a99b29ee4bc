// A mapping of an experiment file, read by the table of keys.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/scenes/experiment_keys.h"

namespace grouser::campaign {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

bool Contains(const std::vector<std::string>& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

/// Whether a key belongs to a section under its choice; names of laws belong to kLaws.
bool Knows(const Key& key, const std::string& section, const std::string& choice) {
  return section == key.section &&
         (*key.of == '\0' || choice.empty() || Contains(SplitChoices(key.of), choice));
}

std::vector<std::string> LawNames() {
  std::vector<std::string> out;
  for (const dem::LawEntry& law : dem::LawRegistry()) {
    if (!law.settings.empty()) out.push_back(law.name);
  }
  return out;
}

}  // namespace

KeyedSection::KeyedSection(YamlSection section, const std::string& name)
    : section_(std::move(section)), name_(name) {
  CheckKeys();
}

void KeyedSection::CheckKeys() {
  const std::string selector = SelectorOf(name_);
  std::string choice;
  if (!selector.empty()) {
    const Key& key = Find(selector);
    choice = section_.Text(selector);
    const auto choices = SplitChoices(key.more);
    if (!Contains(choices, choice)) {
      section_.Fail(selector, "'" + choice + "'",
                    fmt::format("one of: {}; the nearest is '{}'", fmt::join(choices, ", "),
                                NearestOf(choice.substr(0, 100), choices)));
    }
  }
  std::vector<std::string> known;
  for (const Key& k : ExperimentKeys()) {
    if (!Knows(k, name_, choice)) continue;
    if (k.kind == KeyKind::kLaws) {
      const auto names = LawNames();
      known.insert(known.end(), names.begin(), names.end());
    } else {
      known.push_back(k.name);
    }
  }
  for (const std::string& key : section_.Keys()) {
    if (Contains(known, key)) continue;
    const auto found =
        std::find_if(ExperimentKeys().begin(), ExperimentKeys().end(),
                     [&](const Key& k) { return name_ == k.section && key == k.name; });
    if (found == ExperimentKeys().end()) {
      section_.Fail(key, "an unknown key",
                    fmt::format("one of: {}; the nearest is '{}'", fmt::join(known, ", "),
                                NearestOf(key.substr(0, 100), known)));
    }
    section_.Fail(key, fmt::format("it with {}: {}", selector, choice),
                  fmt::format("{}: one of {}, or not this key", selector,
                              fmt::join(SplitChoices(found->of), ", ")));
  }
}

const Key& KeyedSection::Find(const std::string& key) const {
  for (const Key& k : ExperimentKeys()) {
    if (name_ == k.section && key == k.name) return k;
  }
  throw std::logic_error("key '" + key + "' is not in the table of section '" + name_ + "'");
}

bool KeyedSection::Has(const char* key) {
  Find(key);
  return section_.Has(key);
}
double KeyedSection::Number(const char* key) {
  return section_.Number(key) * (Find(key).kind == KeyKind::kDegrees ? kDegree : 1.0);
}
double KeyedSection::NumberOr(const char* key, double otherwise) {
  return Has(key) ? Number(key) : otherwise;
}
std::uint64_t KeyedSection::Count(const char* key, std::uint64_t most) {
  Find(key);
  return section_.Count(key, 0, most);
}
std::uint64_t KeyedSection::CountOr(const char* key, std::uint64_t otherwise, std::uint64_t most) {
  return Has(key) ? Count(key, most) : otherwise;
}
std::string KeyedSection::Text(const char* key) {
  Find(key);
  return section_.Text(key);
}
std::string KeyedSection::TextOr(const char* key, const std::string& otherwise) {
  return Has(key) ? Text(key) : otherwise;
}

int KeyedSection::Choice(const char* key) {
  const auto choices = SplitChoices(Find(key).more);
  const std::string text = section_.Text(key);
  const auto at = std::find(choices.begin(), choices.end(), text);
  if (at == choices.end()) {
    section_.Fail(key, "'" + text + "'", fmt::format("one of: {}", fmt::join(choices, ", ")));
  }
  return static_cast<int>(at - choices.begin());
}
int KeyedSection::ChoiceOr(const char* key, int otherwise) {
  return Has(key) ? Choice(key) : otherwise;
}

std::vector<int> KeyedSection::Choices(const char* key) {
  const auto choices = SplitChoices(Find(key).more);
  const std::string what = fmt::format("some of: {}", fmt::join(choices, ", "));
  std::vector<int> out;
  for (const std::string& text : section_.Words(key, what)) {
    const auto at = std::find(choices.begin(), choices.end(), text);
    if (at == choices.end()) section_.Fail(key, "'" + text + "'", what);
    out.push_back(static_cast<int>(at - choices.begin()));
  }
  return out;
}

bool KeyedSection::Switch(const char* key, bool otherwise) {
  const std::string word = TextOr(key, otherwise ? "on" : "off");
  std::string low = word;
  for (char& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const bool on = Contains({"on", "true", "yes"}, low);
  if (!on && !Contains({"off", "false", "no"}, low)) {
    section_.Fail(key, "'" + word + "'", "on or off, true or false, yes or no");
  }
  return on;
}

std::vector<double> KeyedSection::Vector(const char* key) {
  auto out = section_.Tuple(key, 3);
  if (Find(key).kind == KeyKind::kAngles) {
    for (double& v : out) v *= kDegree;
  }
  return out;
}

std::vector<std::uint64_t> KeyedSection::Counts(const char* key, std::uint64_t most) {
  std::vector<std::uint64_t> out;
  for (const double v : Vector(key)) {
    if (!(v >= 1 && v <= static_cast<double>(most) && v == std::floor(v))) {
      section_.Fail(key, fmt::format("{}", v), fmt::format("whole numbers in [1, {}]", most));
    }
    out.push_back(static_cast<std::uint64_t>(v));
  }
  return out;
}

std::vector<std::string> KeyedSection::Texts(const char* key) {
  Find(key);
  return section_.Texts(key, 2);
}

std::vector<double> KeyedSection::Numbers(const char* key) {
  Find(key);
  return section_.Numbers(key);
}

std::vector<std::string> KeyedSection::Values(const char* key) {
  Find(key);
  return section_.Values(key);
}

KeyedSection KeyedSection::Section(const char* key) {
  return KeyedSection(section_.Section(key), Find(key).more);
}

std::vector<KeyedSection> KeyedSection::Sections(const char* key) {
  std::vector<KeyedSection> out;
  for (YamlSection& s : section_.Sections(key)) out.emplace_back(std::move(s), Find(key).more);
  return out;
}

}  // namespace grouser::campaign

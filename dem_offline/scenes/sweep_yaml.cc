// Sweeps of experiment files: what their members are.
#include "dem_offline/scenes/sweep_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "dem_offline/scenes/experiment_keys.h"
#include "proto/records/durable_file.h"

namespace grouser::campaign {
namespace {

constexpr std::size_t kMostAxes = 64;
constexpr double kMostCharacters = 64 << 20;  // of the values of all members

/// Axes that take their values together.
struct Group {
  std::vector<std::string> keys;
  std::vector<std::vector<std::string>> values;  ///< [keys][n]
  std::size_t size() const { return values[0].size(); }
};

struct Design {
  std::vector<Group> groups;
  std::uint64_t replicates = 1;
};

Group& GroupFor(bool zipped, KeyedSection& axis, Design* design) {
  if (!zipped) return design->groups.emplace_back();
  if (design->groups.empty()) {
    axis.yaml().Fail("zipped", "it at the first axis", "an axis above");
  }
  return design->groups.back();
}

Design ReadDesign(KeyedSection& s) {
  Design out;
  out.replicates = s.CountOr("replicates", 1, kMostMembers);
  if (out.replicates == 0) s.yaml().Fail("replicates", "0", "1 or more");
  double members = static_cast<double>(out.replicates);
  std::vector<std::string> seen;
  if (s.Has("axes")) {
    for (KeyedSection& axis : s.Sections("axes")) {
      const std::string key = axis.Text("key");
      if (key == "sweep" || key.starts_with("sweep.")) {
        axis.yaml().Fail("key", "'" + key + "'", "a key of the experiment itself");
      }
      if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
        axis.yaml().Fail("key", "'" + key + "' twice", "each key once");
      }
      seen.push_back(key);
      if (seen.size() > kMostAxes) {
        axis.yaml().Fail("key", fmt::format("axis {}", seen.size()),
                         fmt::format("at most {}", kMostAxes));
      }
      const bool zipped = axis.Switch("zipped", false);
      Group& group = GroupFor(zipped, axis, &out);
      group.keys.push_back(key);
      group.values.push_back(axis.Values("values"));
      if (group.values.back().size() != group.size()) {
        axis.yaml().Fail("values", fmt::format("{} of them", group.values.back().size()),
                         fmt::format("{}, as many as the axis above has", group.size()));
      }
      axis.Finish();
      if (!zipped) members *= static_cast<double>(group.size());
    }
  }
  if (members > static_cast<double>(kMostMembers)) {
    s.yaml().Fail("axes", fmt::format("{:.6g} members", members),
                  fmt::format("at most {}", kMostMembers));
  }
  return out;
}

SweepResult ReadResult(KeyedSection& s) {
  SweepResult r;
  r.column = s.Text("column");
  r.of = static_cast<SweepResult::Of>(s.ChoiceOr("of", 0));
  r.name = s.TextOr("name", r.column + "." + s.TextOr("of", "mean"));
  if (r.name.find_first_of(",\"\n\r") != std::string::npos) {
    s.yaml().Fail("name", "'" + r.name + "'", "no comma, quote or end of line");
  }
  r.from_s = s.NumberOr("from_s", r.from_s);
  r.to_s = s.NumberOr("to_s", r.to_s);
  s.Finish();
  return r;
}

/// Every member holds its values.
void CheckCharacters(const Design& design, const SweepMember& base, const std::string& file) {
  double members = static_cast<double>(design.replicates), characters = 0;
  for (const std::string& value : base.values) characters += static_cast<double>(value.size());
  for (const Group& group : design.groups) {
    members *= static_cast<double>(group.size());
    for (const auto& values : group.values) {
      std::size_t most = 0;
      for (const std::string& value : values) most = std::max(most, value.size());
      characters += static_cast<double>(most);
    }
  }
  if (members * characters <= kMostCharacters) return;
  throw InputError(
      fmt::format("{}: sweep.axes: {:.6g} members with values of {:.6g} characters, "
                  "expected at most {:.6g} in all",
                  file, members, characters, kMostCharacters));
}

/// Members of a design; what an axis does not name has its value in the file.
void AddMembers(const Design& design, bool held_out, std::uint64_t seed, const YamlSection& root,
                Sweep* sweep) {
  SweepMember base;
  base.held_out = held_out;
  for (const std::string& key : sweep->keys) base.values.push_back(root.ValueAt(key));
  CheckCharacters(design, base, sweep->file);
  std::vector<SweepMember> members = {base};
  for (const Group& group : design.groups) {
    std::vector<SweepMember> next;
    for (const SweepMember& member : members) {
      for (std::size_t n = 0; n < group.size(); ++n) {
        SweepMember m = member;
        for (std::size_t k = 0; k < group.keys.size(); ++k) {
          const auto at = std::find(sweep->keys.begin(), sweep->keys.end(), group.keys[k]);
          m.values[static_cast<std::size_t>(at - sweep->keys.begin())] = group.values[k][n];
          m.sets.push_back(group.keys[k] + "=" + group.values[k][n]);
        }
        next.push_back(std::move(m));
      }
    }
    members = std::move(next);
  }
  for (const SweepMember& member : members) {
    for (std::uint64_t r = 0; r < design.replicates; ++r) {
      SweepMember m = member;
      m.seed = seed + r;
      m.sets.push_back(fmt::format("seed={}", m.seed));
      sweep->members.push_back(std::move(m));
    }
  }
}

YamlSection RootOf(const Sweep& sweep, const std::vector<std::string>& sets) {
  YamlSection root = YamlSection::OfText(sweep.text, sweep.file);
  PutSets(sweep.user_sets, &root);
  PutSets(sets, &root);
  return root;
}

/// An axis over a key that --set names too would hide it.
void CheckSets(const Sweep& sweep, bool replicates) {
  for (const std::string& set : sweep.user_sets) {
    const std::string key = set.substr(0, set.find('='));
    for (const std::string& swept : sweep.keys) {
      if (key == swept || key.starts_with(swept + ".")) {
        throw InputError(fmt::format("--set {}: an axis of the sweep varies {}", set, swept));
      }
    }
  }
  const bool seeds = std::find(sweep.keys.begin(), sweep.keys.end(), "seed") != sweep.keys.end();
  if (seeds && replicates) {
    throw InputError(
        fmt::format("{}: sweep: an axis over seed beside replicates, expected one", sweep.file));
  }
}

void AddKeys(const Design& design, std::vector<std::string>* keys) {
  for (const Group& group : design.groups) {
    for (const std::string& key : group.keys) {
      if (std::find(keys->begin(), keys->end(), key) == keys->end()) keys->push_back(key);
    }
  }
}

/// Of a member whose seed is an axis: that one.
void TakeSeeds(Sweep* sweep) {
  const auto at = std::find(sweep->keys.begin(), sweep->keys.end(), "seed");
  if (at == sweep->keys.end()) return;
  const auto column = at - sweep->keys.begin();
  for (SweepMember& m : sweep->members) {
    m.sets.pop_back();
    m.seed = std::strtoull(m.values[static_cast<std::size_t>(column)].c_str(), nullptr, 10);
    m.values.erase(m.values.begin() + column);
  }
  sweep->keys.erase(at);
}

}  // namespace

std::optional<Sweep> ReadSweep(const std::string& text, const std::string& file,
                               const std::string& folder, const std::vector<std::string>& sets) {
  Sweep sweep;
  sweep.text = text;
  sweep.file = file;
  sweep.folder = folder;
  sweep.user_sets = sets;
  const YamlSection plain = RootOf(sweep, {});
  KeyedSection root(plain, "");
  if (!root.Has("sweep")) return std::nullopt;
  sweep.name = root.Text("name");
  const std::uint64_t seed = root.CountOr("seed", 1, std::numeric_limits<std::uint64_t>::max() / 2);
  KeyedSection s = root.Section("sweep");
  const Design design = ReadDesign(s);
  Design held_out;
  AddKeys(design, &sweep.keys);
  if (s.Has("held_out")) {
    KeyedSection h = s.Section("held_out");
    if (!h.Has("axes")) h.yaml().Fail("axes", "none", "values that the others do not have");
    held_out = ReadDesign(h);
    h.Finish();
    AddKeys(held_out, &sweep.keys);
  }
  if (s.Has("results")) {
    for (KeyedSection& r : s.Sections("results")) sweep.results.push_back(ReadResult(r));
  }
  s.Finish();
  CheckSets(sweep, design.replicates > 1 || held_out.replicates > 1);
  AddMembers(design, false, seed, plain, &sweep);
  if (!held_out.groups.empty()) AddMembers(held_out, true, seed, plain, &sweep);
  TakeSeeds(&sweep);
  return sweep;
}

std::optional<Sweep> LoadSweep(const std::string& file, const std::vector<std::string>& sets) {
  return ReadSweep(ReadYamlText(file), file, std::filesystem::path(file).parent_path().string(),
                   sets);
}

ExperimentFile ReadMember(const Sweep& sweep, const SweepMember& member,
                          const dem::WorkLimits& limits) {
  try {
    YamlSection root = RootOf(sweep, member.sets);
    root.Remove("sweep");
    ExperimentFile out = ReadExperiment(root, sweep.folder, limits);
    out.text = out.resolved;
    out.sets = member.sets;
    return out;
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} (member {})", error.what(), Describe(sweep, member)));
  }
}

std::string Describe(const Sweep& sweep, const SweepMember& member) {
  std::string out;
  for (std::size_t k = 0; k < sweep.keys.size(); ++k) {
    out += fmt::format("{}={}, ", sweep.keys[k], member.values[k]);
  }
  return out + fmt::format("seed={}", member.seed);
}

void CheckResults(const Sweep& sweep, const std::vector<std::string>& columns) {
  for (const SweepResult& r : sweep.results) {
    if (std::find(columns.begin(), columns.end(), r.column) != columns.end()) continue;
    throw InputError(
        fmt::format("{}: sweep.results: no column '{}', expected one of the series; "
                    "the nearest is '{}'",
                    sweep.file, r.column, NearestOf(r.column.substr(0, 100), columns)));
  }
}

double ValueOf(const SweepResult& result,
               const std::map<std::string, std::vector<double>>& series) {
  const auto times = series.find("time_s"), values = series.find(result.column);
  if (values == series.end() || times == series.end() || times->second.empty()) {
    return std::nan("");
  }
  const double end = times->second.back();
  const auto time = [&](double t) { return t < 0 ? end + t : t; };
  double n = 0, sum = 0, square = 0, least = HUGE_VAL, most = -HUGE_VAL, last = std::nan("");
  for (std::size_t k = 0; k < times->second.size(); ++k) {
    const double t = times->second[k], v = values->second[k];
    if (t < time(result.from_s) * (1 - 1e-12) || t > time(result.to_s) * (1 + 1e-12)) continue;
    n += 1, sum += v, square += v * v;
    least = std::min(least, v), most = std::max(most, v), last = v;
  }
  if (n == 0) return std::nan("");
  switch (result.of) {
    case SweepResult::Of::kMean:
      return sum / n;
    case SweepResult::Of::kLast:
      return last;
    case SweepResult::Of::kLeast:
      return least;
    case SweepResult::Of::kMost:
      return most;
    case SweepResult::Of::kDeviation:
      break;
  }
  return n > 1 ? std::sqrt(std::max(0.0, (square - sum * sum / n) / (n - 1))) : std::nan("");
}

}  // namespace grouser::campaign

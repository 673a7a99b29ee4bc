// docs/scene-files.md beside what the readers accept: its examples, and its tables of keys.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "dem_offline/campaign/design.h"
#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/scene_yaml.h"
#include "proto/records/durable_file.h"
#include "proto/records/yaml/message_yaml.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;

struct Row {
  std::string key;  ///< empty: every law that has settings
  std::string left_out;
};

struct Table {
  std::vector<std::string> sections;  ///< paths of keys that it is of; none: the file itself
  std::vector<Row> rows;
};

/// A chapter ("## ...") that begins with an example.
struct Chapter {
  std::string file, example;
  std::vector<Table> tables;
};

/// Texts between backticks.
std::vector<std::string> Quoted(const std::string& line) {
  static const std::regex quoted("`([^`]*)`");
  std::vector<std::string> out;
  for (std::sregex_iterator at(line.begin(), line.end(), quoted), end; at != end; ++at) {
    out.push_back((*at)[1]);
  }
  return out;
}

Row RowOf(const std::string& line) {
  static const std::regex cells(R"(\| (.*?) \| (.*?) \| (.*?) \| .*)");
  std::smatch found;
  if (!std::regex_match(line, found, cells)) throw std::runtime_error("no row of four: " + line);
  const auto key = Quoted(found[1]);
  if (key.empty() && found[1] != "name of a law") throw std::runtime_error("no key: " + line);
  return {key.empty() ? "" : key[0], found[3]};
}

/// Chapters whose example is `my.*.yaml`, by the name of the file.
std::map<std::string, Chapter> ReadPage() {
  std::istringstream page(records::ReadFileBytes(GROUSER_SCENE_FILES));
  std::map<std::string, Chapter> out;
  Chapter* chapter = nullptr;
  bool in_example = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) chapter = nullptr;
    if (line.starts_with("# my.")) {
      chapter = &out[line.substr(2)];
      in_example = true;
    } else if (line == "```") {
      in_example = false;
    } else if (in_example) {
      chapter->example += line + "\n";
    } else if (chapter != nullptr && line.starts_with("### ")) {
      chapter->tables.push_back({Quoted(line), {}});
    } else if (chapter != nullptr && !chapter->tables.empty() && line.starts_with("| ") &&
               !line.starts_with("| key ") && !line.starts_with("| --- ")) {
      chapter->tables.back().rows.push_back(RowOf(line));
    }
  }
  return out;
}

/// Every place in a file that has a section: "a", or "b[0].c", "b[1].c" of lists.
std::vector<std::string> PlacesOf(const YamlSection& file, const std::string& section) {
  std::vector<std::string> places = {""};
  std::istringstream keys(section);
  for (std::string key; std::getline(keys, key, '.');) {
    std::vector<std::string> next;
    for (const std::string& place : places) {
      for (int i = 0;; ++i) {
        const std::string at = fmt::format("{}{}{}[{}]", place, place.empty() ? "" : ".", key, i);
        if (file.ValueAt(at).empty()) break;
        next.push_back(at);
      }
    }
    places = next;
  }
  return places;
}

std::string Join(const std::string& place, const std::string& key) {
  return place.empty() ? key : place + "." + key;
}

/// Takes a key out of the section at a place.
void Remove(YamlSection section, const std::string& place, const std::string& key) {
  if (place.empty()) return section.Remove(key);
  const std::size_t end = place.find('.'), bracket = place.find('[');
  Remove(section.Sections(place.substr(0, bracket)).at(std::stoul(place.substr(bracket + 1))),
         end == std::string::npos ? "" : place.substr(end + 1), key);
}

std::string Without(const YamlSection& file, const std::string& place, const std::string& key) {
  const YamlSection copy = YamlSection::OfText(file.Dump(), "copy");
  Remove(copy, place, key);
  return copy.Dump();
}

std::string With(const YamlSection& file, const std::string& path, const std::string& value) {
  YamlSection copy = YamlSection::OfText(file.Dump(), "copy");
  copy.Set(path, value);
  return copy.Dump();
}

std::set<std::string> KeysOf(const Table& table) {
  std::set<std::string> keys;
  for (const Row& row : table.rows) {
    if (!row.key.empty()) {
      EXPECT_TRUE(keys.insert(row.key).second) << row.key << " twice";
      continue;
    }
    for (const dem::LawEntry& law : dem::LawRegistry()) {
      if (!law.settings.empty()) keys.insert(law.name);
    }
  }
  return keys;
}

/// The keys that a refusal names: "... expected one of: a, b; the nearest is 'a'".
std::set<std::string> KeysIn(const std::string& refusal) {
  static const std::regex list(
      "key '[^']*no_such_key': got an unknown key, expected one of: (.*);");
  std::smatch found;
  EXPECT_TRUE(std::regex_search(refusal, found, list)) << refusal;
  std::set<std::string> keys;
  std::istringstream names(found[1]);
  for (std::string name; std::getline(names >> std::ws, name, ',');) keys.insert(name);
  return keys;
}

class SceneFiles : public testing::Test {
 protected:
  using Read = std::function<std::string()>;

  SceneFiles() {
    for (const auto& [name, chapter] : page_) Write(name, chapter.example);
  }

  void Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
  }

  /// One of the files, and what is read with it: the message as bytes.
  struct File {
    std::string name;
    Read read;
    bool of_scene;  ///< "required in a scene" holds
  };

  /// Refused with `what` (empty: accepted), where the file holds this.
  std::string Refusal(const File& file, const std::string& text, std::string* read = nullptr) {
    Write(file.name, text);
    return MessageOf([&] {
      const std::string bytes = file.read();
      if (read != nullptr) *read = bytes;
    });
  }

  void Check(const File& file, const Table& table, const std::string& root) {
    const YamlSection example = YamlSection::OfText(page_.at(file.name).example, file.name);
    std::vector<std::string> places;
    for (std::string section : table.sections) {
      if (section.starts_with(root)) section.erase(0, root.size());
      if (section.starts_with(".")) section.erase(0, 1);
      const auto more = PlacesOf(example, section);
      EXPECT_FALSE(more.empty()) << file.name << " has no " << section;
      places.insert(places.end(), more.begin(), more.end());
    }
    if (table.sections.empty()) places = {""};
    CheckKeys(file, table, example, places);
    for (const Row& row : table.rows) {
      if (!row.key.empty()) CheckLeftOut(file, row, example, places);
    }
    Write(file.name, page_.at(file.name).example);
  }

  void CheckKeys(const File& file, const Table& table, const YamlSection& example,
                 const std::vector<std::string>& places) {
    std::set<std::string> known;
    for (const std::string& place : places) {
      known.merge(KeysIn(Refusal(file, With(example, Join(place, "no_such_key"), "1"))));
    }
    if (file.name == "my.wheel.yaml" && places[0].empty()) known.erase("wheel");  // of a scene
    EXPECT_EQ(known, KeysOf(table)) << file.name << " " << places[0];
  }

  void CheckLeftOut(const File& file, const Row& row, const YamlSection& example,
                    const std::vector<std::string>& places) {
    const bool required = row.left_out == "required" ||
                          (file.of_scene && row.left_out.starts_with("required in a scene"));
    const auto value = Quoted(row.left_out);
    const bool literal = !value.empty() && row.left_out == "`" + value[0] + "`";
    int stands = 0, accepted = 0;
    for (const std::string& place : places) {
      std::string without, with;
      const std::string refusal = Refusal(file, Without(example, place, row.key), &without);
      const bool there = !example.ValueAt(Join(place, row.key)).empty();
      stands += there;
      accepted += there && refusal.empty();
      if (required && there) {
        EXPECT_THAT(refusal, HasSubstr(row.key + "': got no such key"));
      }
      if (!literal) continue;
      EXPECT_EQ(refusal, "");
      EXPECT_EQ(Refusal(file, With(example, Join(place, row.key), value[0]), &with), "");
      EXPECT_TRUE(with == without) << file.name << " " << Join(place, row.key);
    }
    if (required) {
      EXPECT_GT(stands, 0) << file.name << ": no example of " << row.key;
    } else if (stands > 0) {
      EXPECT_GT(accepted, 0) << file.name << ": " << row.key;
    }
  }

  std::string ReadScene() { return LoadScene(folder_ / "my.scene.yaml").SerializeAsString(); }

  const records::TempFolder folder_;
  std::map<std::string, Chapter> page_ = ReadPage();
  const File wheel_ = {"my.wheel.yaml",
                       [this] {
                         return records::LoadWheel(folder_ / "my.wheel.yaml").SerializeAsString();
                       },
                       false},
             soil_ = {"my.soil.yaml", [this] { return ReadScene(); }, false},
             scene_ = {"my.scene.yaml", [this] { return ReadScene(); }, true},
             campaign_ = {
                 "my.campaign.yaml",
                 [this] {
                   return LoadCampaign(folder_ / "my.campaign.yaml", "e").SerializeAsString();
                 },
                 false};
};

TEST_F(SceneFiles, ExamplesCanBeRun) {
  EXPECT_EQ(MessageOf([&] { wheel_.read(); }), "");
  const auto campaign = LoadCampaign(folder_ / "my.campaign.yaml", "e");
  EXPECT_EQ(campaign.runs_size(), 12 + 2 + 2 + 2 + 1 + 2);
  for (const auto& run : campaign.runs()) {
    EXPECT_EQ(MessageOf([&] { dem::ValidateSpec(ToEngine(SpecOf(campaign, run))); }), "")
        << Describe(run.state(), run.seed());
  }
}

TEST_F(SceneFiles, TablesHaveTheKeysOfTheReaders) {
  const auto check = [&](const File& file, const std::string& root) {
    const std::vector<Table>& tables = page_.at(file.name).tables;
    EXPECT_GE(tables.size(), 2u) << file.name;
    for (const Table& table : tables) Check(file, table, root);
  };
  check(wheel_, "wheel");
  check(soil_, "soil");
  check(scene_, "");
  check(campaign_, "");
  for (const Table& table : page_.at(wheel_.name).tables) Check(scene_, table, "");
}

}  // namespace
}  // namespace grouser::campaign

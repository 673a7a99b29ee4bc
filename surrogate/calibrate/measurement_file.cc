#include "surrogate/calibrate/measurement_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/sha256.h"
#include "proto/records/yaml/neighbour.h"

namespace grouser::surrogate {
namespace {

namespace fs = std::filesystem;
using records::YamlSection;

// Names a quantity of the kind, or fails at `key` with the nearest.
void CheckQuantity(TestKind kind, const std::string& key, const YamlSection& section) {
  try {
    FindQuantity(kind, key, "");
  } catch (const std::invalid_argument& error) {
    section.Fail(key, "it", std::string(error.what()).substr(2));
  }
}

LineChoice ChoiceOf(YamlSection& test, const std::string& key) {
  LineChoice choice;
  if (test.IsText(key)) {
    const std::string word = test.Text(key);
    if (word != "true" && word != "false") {
      test.Fail(key, "'" + word + "'", "true, false, lines: [...] or COLUMN: [...]");
    }
    choice.all = word == "true";
    return choice;
  }
  YamlSection section = test.Section(key);
  for (const std::string& column : section.Keys()) {
    if (column == "lines") {
      for (const auto line : section.Counts(column, 1, 1u << 30)) {
        choice.lines.insert(static_cast<int>(line));
      }
    } else {
      choice.texts[column] = section.Words(column, "texts of that column");
    }
  }
  section.Finish();
  return choice;
}

SdSpec SdOf(const std::string& text, Dimension dimension) {
  if (text.ends_with('%')) return {ParseQuantity(text, Dimension::kNone), true};
  return {ParseQuantity(text, dimension), false};
}

void ReadColumns(YamlSection columns, TestSpec* spec) {
  for (const std::string& quantity : columns.Keys()) {
    CheckQuantity(spec->kind, quantity, columns);
    ColumnSpec& column = spec->columns[quantity];
    if (columns.IsText(quantity)) {
      column.column = columns.Text(quantity);
      continue;
    }
    YamlSection own = columns.Section(quantity);
    column.column = own.Text("column");
    column.unit = own.TextOr("unit", "");
    column.sign = own.NumberOr("sign", 1, {-1, 1});
    if (column.sign != 1 && column.sign != -1) own.Fail("sign", "another number", "1 or -1");
    own.Finish();
  }
}

template <class Take>
void ReadQuantities(YamlSection& test, const char* key, TestKind kind, const Take& take) {
  if (!test.Has(key)) return;
  YamlSection section = test.Section(key);
  for (const std::string& quantity : section.Keys()) {
    CheckQuantity(kind, quantity, section);
    const std::string text = section.Text(quantity);
    try {
      take(quantity, text, FindQuantity(kind, quantity, "").dimension);
    } catch (const std::invalid_argument& error) {
      section.Fail(quantity, "'" + text + "'", error.what());
    }
  }
}

TestSpec SpecOf(YamlSection& test, const std::string& within, std::size_t index) {
  TestSpec spec;
  spec.place = fmt::format("{}: tests[{}]", test.file(), index);
  spec.kind = ParseKind(test.Text("kind"), spec.place);
  spec.file = records::NeighbourOf(test, "file", within);
  spec.name = test.TextOr("name", fmt::format("{} {}", NameOf(spec.kind), index + 1));
  ReadColumns(test.Section("columns"), &spec);
  ReadQuantities(test, "constants", spec.kind, [&](const auto& q, const auto& text, Dimension d) {
    spec.constants[q] = ParseQuantity(text, d);
  });
  ReadQuantities(test, "sd", spec.kind, [&](const auto& q, const auto& text, Dimension d) {
    spec.sd[q] = SdOf(text, d);
    if (!(spec.sd[q].value > 0)) throw std::invalid_argument("a positive standard deviation");
  });
  if (test.Has("where")) {
    YamlSection where = test.Section("where");
    for (const std::string& column : where.Keys()) spec.where[column] = where.Text(column);
  }
  if (test.Has("held_out")) spec.held_out = ChoiceOf(test, "held_out");
  if (test.Has("fitted")) {
    if (test.Has("held_out")) test.Fail("fitted", "it beside held_out", "one of both");
    spec.fitted = ChoiceOf(test, "fitted");
  }
  if (test.Has("counts_as")) spec.counts_as = test.Number("counts_as", records::kPositive);
  test.Finish();
  return spec;
}

void ReadYaml(const std::string& file, const std::string& within, MeasuredSoil* soil) {
  YamlSection top = YamlSection::Load(file);
  soil->name = top.TextOr("soil", soil->name);
  soil->source = top.TextOr("source", soil->source);
  if (top.Has("kind")) {
    const std::string word = top.Text("kind");
    soil->kind = FindSoilKind(word);
    if (!soil->kind) top.Fail("kind", "'" + word + "'", "sand, loam, clay or snow");
  }
  if (top.Has("density_kg_per_m3")) {
    soil->density_kg_per_m3 = top.Number("density_kg_per_m3", {30, 4000});
  }
  soil->gravity = top.NumberOr("gravity_m_per_s2", soil->gravity, {0.1, 100});
  soil->files.push_back(
      {fs::path(file).filename().string(), records::Sha256OfString(records::ReadFileBytes(file))});
  std::size_t index = 0;
  for (YamlSection& test : top.Sections("tests")) {
    ReadTest(SpecOf(test, within, index++), soil);
  }
  top.Finish();
}

std::pair<std::string, std::string> Halves(const std::string& text, const std::string& option,
                                           const std::string& expected) {
  const auto equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw std::invalid_argument(fmt::format("{}: got '{}', expected {}", option, text, expected));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

TestSpec SpecOf(const std::string& file, const CommandLineTest& csv) {
  TestSpec spec;
  spec.place = file;
  spec.file = file;
  spec.name = fs::path(file).stem().string();
  if (csv.kind.empty()) {
    throw std::invalid_argument(file +
                                ": a CSV needs --kind, expected plate, shear, press or "
                                "wheel (a .yaml says it itself)");
  }
  spec.kind = ParseKind(csv.kind, "--kind");
  spec.by_name = true;
  for (const std::string& text : csv.columns) {
    auto [source, quantity] = Halves(text, "--columns", "COLUMN=QUANTITY or COLUMN=QUANTITY:UNIT");
    const auto colon = quantity.find(':');
    const std::string unit = colon == std::string::npos ? "" : quantity.substr(colon + 1);
    quantity = quantity.substr(0, colon);
    FindQuantity(spec.kind, quantity, "--columns");
    if (!spec.columns.emplace(quantity, ColumnSpec{source, unit}).second) {
      throw std::invalid_argument("--columns: " + quantity + " twice, expected it once");
    }
  }
  for (const std::string& text : csv.constants) {
    const auto [quantity, value] = Halves(text, "--constant", "QUANTITY=VALUE UNIT");
    const Dimension dimension = FindQuantity(spec.kind, quantity, "--constant").dimension;
    try {
      spec.constants[quantity] = ParseQuantity(value, dimension);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("--constant " + quantity + ": " + error.what());
    }
  }
  return spec;
}

// Two plates that are told apart by name and not by width.
void NoteEqualPlates(MeasuredSoil* soil) {
  std::map<double, std::string> by_width;
  for (const Observation& at : soil->observations) {
    const MeasuredTest& test = soil->tests[at.test];
    if (test.kind != TestKind::kPlate || at.held_out) continue;
    const auto [first, added] = by_width.emplace(at.width, test.name);
    if (added || first->second == test.name || first->second.empty()) continue;
    soil->notes.push_back(
        fmt::format("{} and {} have the same width b = {:g} mm: together they count as one plate",
                    first->second, test.name, 1e3 * at.width));
    first->second.clear();
  }
}

}  // namespace

MeasuredSoil ReadMeasuredSoil(const std::vector<std::string>& files, const CommandLineTest& csv,
                              const std::string& within) {
  MeasuredSoil soil;
  for (const std::string& file : files) {
    const std::string ending = fs::path(file).extension().string();
    if (ending == ".yaml" || ending == ".yml") {
      ReadYaml(file, within, &soil);
    } else {
      ReadTest(SpecOf(file, csv), &soil);
    }
  }
  if (std::ranges::all_of(soil.observations, &Observation::held_out)) {
    throw std::invalid_argument(fmt::format("{}: every row is held out, expected some to fit",
                                            files.empty() ? "no file" : files[0]));
  }
  NoteEqualPlates(&soil);
  return soil;
}

}  // namespace grouser::surrogate

#include "proto/records/yaml/yaml_section.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <utility>

#include "proto/records/durable_file.h"

namespace grouser::records {
namespace {

std::string Describe(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return fmt::format("'{}'", node.Scalar());
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node.size());
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "nothing";
  }
}

std::string Describe(const Range& range) {
  const double huge = std::numeric_limits<double>::max();
  if (range.min == -huge && range.max == huge) return "a finite number";
  if (range.max == huge) {
    return fmt::format("a number {} {}", range.open_min ? ">" : ">=", range.min);
  }
  return fmt::format("a number in {}{}, {}]", range.open_min ? "(" : "[", range.min, range.max);
}

// The whole text must be one number; YAML's own ".nan", hex and octal are not.
template <typename T>
bool Parse(const std::string& text, T* value) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, *value);
  return error == std::errc() && stop == end && begin != end;
}

/// What stands at "key" or "key[2]" of a mapping; not valid: nothing.
YAML::Node Step(const YAML::Node& map, const std::string& key) {
  const std::size_t bracket = key.find('[');
  const YAML::Node none(YAML::NodeType::Undefined);
  if (!map.IsMap()) return none;
  const YAML::Node at = map[key.substr(0, bracket)];
  if (bracket == std::string::npos || !at) return at;
  std::size_t index = 0;
  const char* end = key.data() + key.size();
  const auto [stop, error] = std::from_chars(key.data() + bracket + 1, end, index);
  if (error != std::errc() || stop + 1 != end || *stop != ']') return none;
  if (at.IsMap() && index == 0) return at;  // a list of one may be written as its mapping
  if (!at.IsSequence() || index >= at.size()) return none;
  return at[index];
}

void MakeFlow(YAML::Node node) {
  if (!node.IsMap() && !node.IsSequence()) return;
  node.SetStyle(YAML::EmitterStyle::Flow);
  for (auto entry : node) MakeFlow(node.IsMap() ? entry.second : static_cast<YAML::Node>(entry));
}

constexpr std::size_t kMostText = std::size_t{1} << 20;  // [bytes]; nodes take 300 times as much
constexpr std::size_t kMostExtent = 2 * kMostText;       // a text without aliases has at most 1.5
constexpr int kMostDepth = 100;

/// Where the last document begins.
struct LastDocument : YAML::EventHandler {
  int line = 0;
  void OnDocumentStart(const YAML::Mark& mark) override { line = mark.line; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// What is wrong with a document for those who copy or write it, which writes out its aliases:
/// nodes and characters, counted as often as they are named, and depth. Empty: nothing.
std::string FaultOf(const YAML::Node& node, int depth, std::size_t* left) {
  if (depth > kMostDepth) {
    return fmt::format("more than {} levels, expected fewer, and no alias inside its own anchor",
                       kMostDepth);
  }
  const std::size_t own = 1 + (node.IsScalar() ? node.Scalar().size() : 0);
  if (own > *left) {
    return fmt::format("more than {} nodes and characters with its aliases written out",
                       kMostExtent);
  }
  *left -= own;
  std::string fault;
  if (!node.IsMap() && !node.IsSequence()) return fault;
  for (const auto& entry : node) {
    if (node.IsMap()) fault = FaultOf(entry.first, depth + 1, left);
    if (fault.empty()) fault = FaultOf(node.IsMap() ? entry.second : entry, depth + 1, left);
    if (!fault.empty()) break;
  }
  return fault;
}

/// Throws InputError, and YAML::Exception for what is malformed.
void CheckExtent(const YAML::Node& node, const std::string& file) {
  std::size_t left = kMostExtent;
  const std::string fault = FaultOf(node, 0, &left);
  if (!fault.empty()) throw InputError(fmt::format("{}: got {}", file, fault));
}

void CheckTextSize(std::uintmax_t bytes, const std::string& file) {
  if (bytes <= kMostText) return;
  throw InputError(
      fmt::format("{}: got {} bytes, expected at most {}: YAML takes 300 times as much memory",
                  file, bytes, kMostText));
}

/// Throws InputError for more than one, of which YAML::Load takes the first.
void CheckOneDocument(const std::string& text, const std::string& file) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  LastDocument last;
  if (!parser.HandleNextDocument(last) || !parser.HandleNextDocument(last)) return;
  throw InputError(
      fmt::format("{}:{}: got a second YAML document, expected one", file, last.line + 1));
}

/// The first document of a text. Throws as CheckExtent.
YAML::Node DocumentOf(const std::string& text, const std::string& file) {
  CheckTextSize(text.size(), file);
  const YAML::Node node = YAML::Load(text);
  CheckExtent(node, file);
  return node;
}

std::string OnOneLine(const YAML::Node& node) {
  const YAML::Node copy = YAML::Clone(node);
  MakeFlow(copy);
  return YAML::Dump(copy);
}

}  // namespace

YamlSection::YamlSection(std::string file, std::string path, YAML::Node node)
    : file_(std::move(file)), path_(std::move(path)), node_(std::move(node)) {
  if (!node_.IsMap()) {
    FailAt(node_.Mark(), "", Describe(node_), "a mapping of keys to values");
  }
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (!seen.insert(key).second) FailAt(entry.first.Mark(), key, "it twice", "it once");
  }
}

std::string ReadInput(const std::string& file, std::uint64_t most_bytes) {
  try {
    return ReadFileBytes(file, most_bytes);
  } catch (const std::exception& error) {
    throw InputError(error.what());
  }
}

std::string ReadYamlText(const std::string& file) {
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
  if (!unknown) CheckTextSize(bytes, file);
  return ReadInput(file, kMostText);
}

YamlSection YamlSection::Load(const std::string& file) { return OfText(ReadYamlText(file), file); }

YamlSection YamlSection::OfText(const std::string& text, const std::string& file) {
  try {
    YamlSection section(file, "", DocumentOf(text, file));
    CheckOneDocument(text, file);
    return section;
  } catch (const YAML::Exception& error) {
    throw InputError(
        fmt::format("{}:{}: malformed YAML: {}", file, error.mark.line + 1, error.msg));
  }
}

std::string YamlSection::PathOf(const std::string& key) const {
  if (path_.empty()) return key;
  return key.empty() ? path_ : path_ + "." + key;
}

void YamlSection::FailAt(const YAML::Mark& mark, const std::string& key, const std::string& got,
                         const std::string& expected) const {
  throw InputError(fmt::format("{}:{}: key '{}': got {}, expected {}", file_,
                               mark.is_null() ? 1 : mark.line + 1, PathOf(key), got, expected));
}

void YamlSection::Fail(const std::string& key, const std::string& got,
                       const std::string& expected) const {
  const YAML::Node node = node_[key];
  FailAt(node ? node.Mark() : node_.Mark(), key, got, expected);
}

void YamlSection::FailAtPath(const std::string& path, const std::string& got,
                             const std::string& expected) const {
  YAML::Node node = node_;
  std::string found;
  std::string unit;
  const std::string wanted = path.substr(0, path.find(','));
  std::istringstream keys(wanted);
  for (std::string key; std::getline(keys, key, '.');) {
    const std::size_t bracket = key.find('[');
    const std::string name = key.substr(0, bracket);
    if (!node.IsMap()) break;
    std::string shown = key;
    if (!std::as_const(node)[name] && name.ends_with("_rad")) {
      shown = name.substr(0, name.size() - 3) + "deg";
      unit = "in radians, ";
    }
    YAML::Node next = std::as_const(node)[shown.substr(0, bracket)];
    // sizes[0].diameter_m may stand there as diameter_m alone
    if (!next && std::as_const(node)[wanted.substr(wanted.rfind('.') + 1)]) continue;
    if (!next) break;
    found += (found.empty() ? "" : ".") + shown;
    if (bracket != std::string::npos && next.IsSequence()) {
      next.reset(next[std::stoul(key.substr(bracket + 1))]);
    }
    node.reset(next);
  }
  double number = 0;
  const bool plain = node.IsScalar() && Parse(got, &number);
  FailAt(node.Mark(), found.empty() ? path : found, plain ? Describe(node) : got, unit + expected);
}

void YamlSection::Set(const std::string& path, const std::string& value) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("{}: {}={}: {}", file_, path, value, what));
  };
  YAML::Node node = node_;
  std::string last;
  std::istringstream keys(path);
  for (std::string key; std::getline(keys, key, '.'); last = key) {
    if (last.empty()) continue;
    YAML::Node next = Step(node, last);
    if (!next) refuse(fmt::format("no such key as '{}', expected one of the file's", last));
    node.reset(next);
  }
  try {
    const YAML::Node put = DocumentOf(value, file_ + ": " + path);
    CheckOneDocument(value, file_ + ": " + path);
    const std::size_t bracket = last.find('[');
    if (bracket != std::string::npos) {
      YAML::Node item = Step(node, last);
      if (!item) refuse("no such entry of a list");
      item = put;
    } else {
      if (last.empty() || !node.IsMap()) refuse("expected KEY.KEY=VALUE");
      node[last] = put;
    }
    CheckExtent(node_, file_ + ": " + path);  // aliases may name the place more than once
  } catch (const YAML::Exception& error) {
    refuse("malformed YAML: " + error.msg);
  }
}

std::string YamlSection::ValueAt(const std::string& path) const {
  YAML::Node node = node_;
  std::istringstream keys(path);
  for (std::string key; std::getline(keys, key, '.');) {
    const YAML::Node next = Step(node, key);
    if (!next) return "";
    node.reset(next);
  }
  return OnOneLine(node);
}

void YamlSection::Remove(const std::string& key) { node_.remove(key); }

std::string YamlSection::Dump() const { return YAML::Dump(node_) + "\n"; }

bool YamlSection::Has(const std::string& key) {
  known_.insert(key);
  return static_cast<bool>(std::as_const(node_)[key]);
}

bool YamlSection::IsText(const std::string& key) {
  return Has(key) && std::as_const(node_)[key].IsScalar();
}

YAML::Node YamlSection::Find(const std::string& key, const std::string& expected) {
  known_.insert(key);
  const YAML::Node node = std::as_const(node_)[key];
  if (!node) FailAt(node_.Mark(), key, "no such key", expected);
  return node;
}

double YamlSection::ToNumber(const YAML::Node& node, const std::string& key,
                             const Range& range) const {
  double value = 0;
  if (!node.IsScalar() || !Parse(node.Scalar(), &value) || !std::isfinite(value) ||
      value < range.min || value > range.max || (range.open_min && value == range.min)) {
    FailAt(node.Mark(), key, Describe(node), Describe(range));
  }
  return value;
}

std::uint64_t YamlSection::ToCount(const YAML::Node& node, const std::string& key,
                                   std::uint64_t min, std::uint64_t max) const {
  std::uint64_t value = 0;
  if (!node.IsScalar() || !Parse(node.Scalar(), &value) || value < min || value > max) {
    FailAt(node.Mark(), key, Describe(node), fmt::format("a whole number in [{}, {}]", min, max));
  }
  return value;
}

double YamlSection::Number(const std::string& key, const Range& range) {
  return ToNumber(Find(key, Describe(range)), key, range);
}

double YamlSection::NumberOr(const std::string& key, double otherwise, const Range& range) {
  return Has(key) ? Number(key, range) : otherwise;
}

std::uint64_t YamlSection::Count(const std::string& key, std::uint64_t min, std::uint64_t max) {
  return ToCount(Find(key, "a whole number"), key, min, max);
}

std::uint64_t YamlSection::CountOr(const std::string& key, std::uint64_t otherwise,
                                   std::uint64_t min, std::uint64_t max) {
  return Has(key) ? Count(key, min, max) : otherwise;
}

std::string YamlSection::Text(const std::string& key) {
  const YAML::Node node = Find(key, "a text");
  if (!node.IsScalar() || node.Scalar().empty()) {
    FailAt(node.Mark(), key, Describe(node), "a non-empty text");
  }
  return node.Scalar();
}

std::string YamlSection::TextOr(const std::string& key, const std::string& otherwise) {
  return Has(key) ? Text(key) : otherwise;
}

template <class T, class Read>
std::vector<T> YamlSection::List(const std::string& key, const std::string& what, Read&& read) {
  const YAML::Node list = Find(key, "a list of " + what);
  if (!list.IsSequence() || list.size() == 0) {
    FailAt(list.Mark(), key, Describe(list), "a non-empty list of " + what);
  }
  std::vector<T> values;
  for (const auto& node : list) {
    const T value = read(node);
    if (std::find(values.begin(), values.end(), value) != values.end()) {
      FailAt(node.Mark(), key, Describe(node) + " twice", "each value once");
    }
    values.push_back(value);
  }
  return values;
}

std::vector<double> YamlSection::Numbers(const std::string& key, const Range& range) {
  return List<double>(key, "numbers",
                      [&](const YAML::Node& node) { return ToNumber(node, key, range); });
}

std::vector<std::uint64_t> YamlSection::Counts(const std::string& key, std::uint64_t min,
                                               std::uint64_t max) {
  return List<std::uint64_t>(key, "whole numbers",
                             [&](const YAML::Node& node) { return ToCount(node, key, min, max); });
}

std::vector<std::string> YamlSection::Words(const std::string& key, const std::string& what) {
  return List<std::string>(key, what, [&](const YAML::Node& node) {
    if (!node.IsScalar()) FailAt(node.Mark(), key, Describe(node), what);
    return node.Scalar();
  });
}

YAML::Node YamlSection::ListOf(const std::string& key, std::size_t n, const char* expected) {
  const std::string what = fmt::format("a list of {} {}", n, expected);
  const YAML::Node list = Find(key, what);
  if (!list.IsSequence() || list.size() != n) FailAt(list.Mark(), key, Describe(list), what);
  return list;
}

std::vector<double> YamlSection::Tuple(const std::string& key, std::size_t n) {
  std::vector<double> values;
  for (const auto& node : ListOf(key, n, "numbers")) values.push_back(ToNumber(node, key, {}));
  return values;
}

std::vector<std::string> YamlSection::Texts(const std::string& key, std::size_t n) {
  std::vector<std::string> values;
  for (const auto& node : ListOf(key, n, "texts")) {
    if (!node.IsScalar()) FailAt(node.Mark(), key, Describe(node), "a text");
    values.push_back(node.Scalar());
  }
  return values;
}

std::vector<std::string> YamlSection::Values(const std::string& key) {
  const YAML::Node list = Find(key, "a list of values");
  if (!list.IsSequence() || list.size() == 0) {
    FailAt(list.Mark(), key, Describe(list), "a non-empty list of values");
  }
  std::vector<std::string> values;
  for (const auto& node : list) values.push_back(OnOneLine(node));
  return values;
}

std::vector<std::string> YamlSection::Keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_) {
    keys.push_back(entry.first.IsScalar() ? entry.first.Scalar() : "?");
  }
  return keys;
}

YamlSection YamlSection::Section(const std::string& key) {
  return YamlSection(file_, PathOf(key), Find(key, "a mapping"));
}

std::vector<YamlSection> YamlSection::Sections(const std::string& key) {
  const YAML::Node list = Find(key, "a list of mappings");
  std::vector<YamlSection> sections;
  if (list.IsMap()) {
    sections.push_back(YamlSection(file_, PathOf(key), list));
    return sections;
  }
  if (!list.IsSequence() || list.size() == 0) {
    FailAt(list.Mark(), key, Describe(list), "a non-empty list of mappings");
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    sections.push_back(YamlSection(file_, fmt::format("{}[{}]", PathOf(key), i), list[i]));
  }
  return sections;
}

void YamlSection::Finish() const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (known_.count(key)) continue;
    FailAt(entry.first.Mark(), key, "an unknown key",
           fmt::format("one of: {}; the nearest is '{}'", fmt::join(known_, ", "),
                       NearestOf(key.substr(0, 100), {known_.begin(), known_.end()})));
  }
}

}  // namespace grouser::records

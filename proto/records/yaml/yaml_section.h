#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/records/yaml/nearest.h"

namespace grouser::records {

/// Bad input of a person: the program's exit code is 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Closed range of a number; the defaults allow every finite one. `open_min`
/// leaves the lower end itself out.
struct Range {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  bool open_min = false;
};
inline constexpr Range kPositive{0.0, std::numeric_limits<double>::max(), true};
inline constexpr Range kNonNegative{0.0, std::numeric_limits<double>::max(), false};

/// All of a text that people write. Throws InputError, also beyond `most_bytes`.
std::string ReadInput(const std::string& file, std::uint64_t most_bytes);
/// All of a file of YAML, of at most 1 MiB. Throws InputError.
std::string ReadYamlText(const std::string& file);

/// One mapping of a YAML file, read strictly. Every error is an InputError
/// "FILE:LINE: key 'a.b': got X, expected Y". Keys that nobody asked for are
/// refused by Finish().
class YamlSection {
 public:
  /// The whole file, which must be one mapping of at most 1 MiB, at most 100 levels deep, and
  /// with its aliases written out no larger than twice that.
  static YamlSection Load(const std::string& file);
  /// The same of text that stands nowhere; `file` is for the messages.
  static YamlSection OfText(const std::string& text, const std::string& file);

  /// Puts a value, as YAML, at a path of keys ("a.b[1].c"); the last one may be new. Throws
  /// InputError for a path that is not there.
  void Set(const std::string& path, const std::string& value);

  /// What stands at such a path, as YAML on one line; empty: nothing.
  std::string ValueAt(const std::string& path) const;
  /// Takes a key out, if it stands there.
  void Remove(const std::string& key);
  /// All of it as YAML.
  std::string Dump() const;

  /// Whether an optional key stands there; makes it a known one.
  bool Has(const std::string& key);
  double Number(const std::string& key, const Range& range = {});
  double NumberOr(const std::string& key, double otherwise, const Range& range = {});
  std::uint64_t Count(const std::string& key, std::uint64_t min, std::uint64_t max);
  std::uint64_t CountOr(const std::string& key, std::uint64_t otherwise, std::uint64_t min,
                        std::uint64_t max);
  std::string Text(const std::string& key);
  std::string TextOr(const std::string& key, const std::string& otherwise);
  /// Non-empty lists without repeated values.
  std::vector<double> Numbers(const std::string& key, const Range& range = {});
  std::vector<std::uint64_t> Counts(const std::string& key, std::uint64_t min, std::uint64_t max);
  std::vector<std::string> Words(const std::string& key, const std::string& what);
  /// A list of exactly n numbers or texts, which may repeat.
  std::vector<double> Tuple(const std::string& key, std::size_t n);
  std::vector<std::string> Texts(const std::string& key, std::size_t n);
  /// A non-empty list of anything, each entry as YAML on one line.
  std::vector<std::string> Values(const std::string& key);
  YamlSection Section(const std::string& key);
  /// A list of mappings; a single mapping counts as a list of one.
  std::vector<YamlSection> Sections(const std::string& key);
  /// True when `key` is plain text (a file name, say) rather than a mapping.
  bool IsText(const std::string& key);

  /// All keys that stand there.
  std::vector<std::string> Keys() const;
  /// Refuses unknown keys, and lists the known ones with the nearest at the end.
  void Finish() const;

  /// For checks across keys: the same error form, at `key`.
  [[noreturn]] void Fail(const std::string& key, const std::string& got,
                         const std::string& expected) const;
  /// The same at a path of keys from here on ("a.b[1].c"), or as far down as there are
  /// such keys. A number in radians may stand there in degrees (_rad, _deg). What
  /// follows a comma in the path is left out; a plain number that was got is shown
  /// as it is written there.
  [[noreturn]] void FailAtPath(const std::string& path, const std::string& got,
                               const std::string& expected) const;
  const std::string& file() const { return file_; }

 private:
  YamlSection(std::string file, std::string path, YAML::Node node);
  YAML::Node ListOf(const std::string& key, std::size_t n, const char* expected);
  YAML::Node Find(const std::string& key, const std::string& expected);
  double ToNumber(const YAML::Node& node, const std::string& key, const Range& range) const;
  template <class T, class Read>
  std::vector<T> List(const std::string& key, const std::string& what, Read&& read);
  std::uint64_t ToCount(const YAML::Node& node, const std::string& key, std::uint64_t min,
                        std::uint64_t max) const;
  [[noreturn]] void FailAt(const YAML::Mark& mark, const std::string& key, const std::string& got,
                           const std::string& expected) const;
  std::string PathOf(const std::string& key) const;

  std::string file_;
  std::string path_;  // "a.b", empty at the top
  YAML::Node node_;
  std::set<std::string> known_;
};

}  // namespace grouser::records

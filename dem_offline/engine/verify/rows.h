#pragma once

#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace grouser::dem::verify {

/// A number or a word; what a row expects or got.
struct Value {
  Value() = default;
  Value(double n) : number(n) {}                // NOLINT: rows are written by hand
  Value(const char* t) : text(t) {}             // NOLINT
  Value(std::string t) : text(std::move(t)) {}  // NOLINT
  double number = std::numeric_limits<double>::quiet_NaN();
  std::string text;  ///< empty: the number speaks
  std::string Words() const;
};

/// One line of the table. Verify: what was measured and what a source says.
/// Torture: `quantity` is the criterion, in words; expected, source and
/// tolerance stay empty.
struct Row {
  std::string name;  ///< of the case
  std::string quantity;
  Value expected;
  std::string source;
  Value got;
  std::string tolerance;
  bool pass = false;
  double seconds = 0;
};

/// Rows of one case. The seconds of a row are those since the row before.
class Rows {
 public:
  explicit Rows(std::string name);

  /// |got - expected| <= share |expected|. Unit in brackets in `quantity`.
  void Relative(const std::string& quantity, double expected, double got, double share,
                const std::string& source);
  /// |got - expected| <= tolerance.
  void Absolute(const std::string& quantity, double expected, double got, double tolerance,
                const std::string& source);
  /// got <= limit.
  void AtMost(const std::string& quantity, double limit, double got, const std::string& source);
  /// got >= limit.
  void AtLeast(const std::string& quantity, double limit, double got, const std::string& source);
  /// A criterion in words, whether it holds, and what was seen.
  void Holds(const std::string& criterion, bool pass, Value got);
  /// A criterion in words that says: got < limit.
  void Below(const std::string& criterion, double limit, double got) {
    Holds(criterion, got < limit, got);
  }
  /// A sentence below the table (convergence studies, causes of a miss).
  void Note(const std::string& text) { notes_.push_back(name_ + ": " + text); }

  const std::string& name() const { return name_; }
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void Add(Row row);

  std::string name_;
  std::vector<Row> rows_;
  std::vector<std::string> notes_;
  std::chrono::steady_clock::time_point last_;
};

/// Mean of some runs [n >= 2] that differ in their draw alone, and its standard error.
struct Mean {
  double value = 0, error = 0;
};
Mean MeanOf(const std::vector<double>& runs);

/// printf into a string.
std::string Format(const char* format, ...) __attribute__((format(printf, 1, 2)));

}  // namespace grouser::dem::verify
